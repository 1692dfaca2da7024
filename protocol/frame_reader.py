# Bytes in, checked frames out. Sans-I/O, fixed memory, never raises on wire input.
#
# A frame on the wire:  00 | COBS(CTL SEQ ACK ID LEN | body 0-96 | CRC-32 little-endian) | 00
#   CTL  bits 0-1 protocol version, 2 direction (1 up), 3 reliable, 4 nak, 5-6 epoch, 7 zero
#   LEN  the decoded length: header, body and CRC together, 9 to 105
# The delimiter stands on both sides, so that a hit frame never takes the next one along.

from array import array

from protocol import cobs
from protocol.crc32 import crc32_into
from protocol.tables import BODY_MAX, VERSION

try:
    from micropython import const
except ImportError:
    def const(value):
        return value

# Counters, in the order of the fields of message LINK.
FRAMES_IN = const(0)
BYTES_IN = const(1)
FRAMES_OUT = const(2)
BYTES_OUT = const(3)
DUPLICATES = const(4)
TELEMETRY_DROPPED = const(5)
BAD_COBS = const(6)
BAD_CRC = const(7)
BAD_LENGTH = const(8)
BAD_HEADER = const(9)   # another version, the reserved bit, or our own direction: an echo
BAD_ID = const(10)
BAD_VALUE = const(11)
OVERRUN = const(12)     # more bytes without a delimiter than a frame can have
STALE = const(13)       # a sound frame of another epoch (not in LINK)
COUNTERS = const(14)

DOWN = const(0)
UP = const(1)
BOTH = const(2)

_HEADER = const(5)
_CRC = const(4)
_RAW_MIN = const(9)
_RAW_MAX = const(105)
_STUFFED_MAX = const(106)   # raw and the one byte of COBS
WIRE_MAX = const(108)
_SUM_MAX = const(0x20000000)  # sums of frames and bytes stay there once reached: no int over 30 bits
_CAUSE_MAX = const(65535)     # counts of causes travel as u16
_ZERO = b"\0"

assert BODY_MAX + _HEADER + _CRC == _RAW_MAX


class FrameReader:
    # feed_from(buf, start, end) takes bytes up to the end of the next good frame; feed(byte) takes one.
    # After either, `ready` tells whether a frame is there, and until the next call
    #   ctl, seq, ack, message_id       its header
    #   body, body_start, body_end      its body, inside `body`
    #
    # A frame that lies whole in the caller's bytearray is decoded there, in place: `buf` is scratch, and
    # the body points into it. A frame that comes in pieces is collected in `held` (106 bytes).
    # `listen` is the direction accepted: DOWN in the core, UP in the host, BOTH at a tap.
    # `counters` is an array "i" of COUNTERS, written here and by the owner. Nothing allocates after __init__.

    def __init__(self, listen, counters):
        self.held = bytearray(_STUFFED_MAX)
        self.counters = counters
        self.ready = False
        self.ctl = 0
        self.seq = 0
        self.ack = 0
        self.message_id = 0
        self.body = self.held
        self.body_start = 0
        self.body_end = 0
        self._listen = listen
        self._held_size = 0     # _STUFFED_MAX + 1: overrun, waiting for the delimiter
        self._crc = array("H", bytes(4))

    def feed_from(self, buf, start, end):
        # -> the index after the frame that is ready, else `end`
        self.ready = False
        at = start
        while at < end:
            if buf[at] == 0 and self._held_size == 0:
                at += 1  # between two frames stand two delimiters
                continue
            zero = buf.find(_ZERO, at, end)
            if zero < 0:
                self._hold(buf, at, end)
                at = end
            elif self._held_size == 0:
                self._check(buf, at, zero)
                at = zero + 1
            else:
                self._hold(buf, at, zero)
                self._check_held()
                at = zero + 1
            if self.ready:
                break
        if self.counters[BYTES_IN] < _SUM_MAX:
            self.counters[BYTES_IN] += at - start
        return at

    def feed(self, byte):
        # -> True when this byte completes a good frame
        self.ready = False
        if self.counters[BYTES_IN] < _SUM_MAX:
            self.counters[BYTES_IN] += 1
        if byte == 0:
            if self._held_size:
                self._check_held()
        elif self._held_size < _STUFFED_MAX:
            self.held[self._held_size] = byte
            self._held_size += 1
        else:
            self._held_size = _STUFFED_MAX + 1
        return self.ready

    def count(self, cause):
        if self.counters[cause] < _CAUSE_MAX:
            self.counters[cause] += 1

    def count_out(self, size):
        # Another frame of `size` bytes went out.
        counters = self.counters
        if counters[BYTES_OUT] < _SUM_MAX:
            counters[BYTES_OUT] += size
            counters[FRAMES_OUT] += 1

    def reset(self):
        # Forgets a frame begun: the line was opened anew.
        self._held_size = 0
        self.ready = False

    def _hold(self, buf, start, end):
        size = self._held_size
        if size + end - start > _STUFFED_MAX:
            self._held_size = _STUFFED_MAX + 1
            return
        held = self.held
        while start < end:
            held[size] = buf[start]
            size += 1
            start += 1
        self._held_size = size

    def _check_held(self):
        size = self._held_size
        self._held_size = 0
        self._check(self.held, 0, size)

    def _check(self, buf, start, end):
        # [start .. end) is what stood between two delimiters. The first check that fails names the cause.
        size = end - start - 1
        if size < _RAW_MIN:
            return self.count(BAD_LENGTH)
        if size > _RAW_MAX:
            return self.count(OVERRUN)
        if not cobs.decode(buf, start, end):
            return self.count(BAD_COBS)
        start += 1
        if buf[start + 4] != size:
            return self.count(BAD_LENGTH)
        end -= _CRC
        crc = self._crc
        crc32_into(buf, start, end, crc)
        if crc[0] != buf[end] | buf[end + 1] << 8 or crc[1] != buf[end + 2] | buf[end + 3] << 8:
            return self.count(BAD_CRC)
        ctl = buf[start]
        if ctl & 131 != VERSION or (self._listen != BOTH and ctl >> 2 & 1 != self._listen):
            return self.count(BAD_HEADER)
        self.ctl = ctl
        self.seq = buf[start + 1]
        self.ack = buf[start + 2]
        self.message_id = buf[start + 3]
        self.body = buf
        self.body_start = start + _HEADER
        self.body_end = end
        self.ready = True
        if self.counters[FRAMES_IN] < _SUM_MAX:
            self.counters[FRAMES_IN] += 1
