# The core's end of the link: frames, epochs, handshake, the retained answer.
#
#   at = 0
#   while at < size:                                  size bytes were read into rx
#       at = link.feed(rx, at, size)                  takes one frame at most
#       if link.message_id:                           a message: link.values[0 .. link.count)
#           link.out[0] = ...
#           link.send(STEP_RSP)                       -> link.tx[0 .. link.tx_len)
#       if link.tx_len: port.write(link.tx, link.tx_len)
#
# Left for the reliable layer: SEQ counts what we send and ACK repeats the last SEQ
# that came; nobody looks at either yet, a lost frame is asked for again by its sender.

from array import array

from protocol import cobs
from protocol.codec import decode_into, encode_into
from protocol.crc32 import crc32_into
from protocol.frame_reader import BAD_ID, BAD_VALUE, COUNTERS, DOWN, STALE, WIRE_MAX, FrameReader
from protocol.tables import (
    BODY_MAX, ERROR, FLAGS, HELLO, IDENTITY, PLACE, SCHEMA_HI, SCHEMA_LO, VALUES_MAX, VERSION, WELCOME,
)

try:
    from micropython import const
except ImportError:
    def const(value):
        return value

_BODY = const(7)            # in tx: delimiter, COBS byte, five bytes of header
_ERROR_UNKNOWN_ID = const(1)
_ERROR_RANGE = const(3)
_WINDOW_DOWN = const(4)
_WINDOW_UP = const(2)
_KEPT_MAX = const(32)


class Link:
    # Everything is allocated in __init__: values (VALUES_MAX ints; `out` is the same array, as no answer needs
    # its question once it is begun), tx (108 bytes), held (106), the retained copy (32: the answer to a step;
    # a longer frame is not retained), counters (14 ints). Nothing allocates or raises afterwards.
    #
    # Handshake: until WELCOME names our boot id, only the ids 1 to 4 pass. From then on every other
    # frame must carry the epoch that WELCOME gave; frames of another epoch are dropped and counted.
    # HELLO, WELCOME, IDENTIFY and IDENTITY always travel in epoch 0.
    #
    # A sound frame with an unknown id, or with a body that its id does not allow, is answered with ERROR
    # by the link itself: message_id is 0 and tx_len is not.

    def __init__(self, boot_id):
        self.tx = bytearray(WIRE_MAX)
        self.tx_len = 0
        self.values = array("i", bytes(4 * VALUES_MAX))
        self.out = self.values
        self.counters = array("i", bytes(4 * COUNTERS))  # named in frame_reader.py, in the order of LINK
        self.reader = FrameReader(DOWN, self.counters)
        self.message_id = 0     # of the message that feed() found; 0: none
        self.count = 0          # its ints in values
        self.boot_id = boot_id & 65535
        self.epoch = 0          # 0: not welcomed yet
        self._seq = 0
        self._ack = 0
        self.kept = bytearray(_KEPT_MAX)
        self._kept_len = 0
        self._crc = array("H", bytes(4))

    def feed(self, buf, start, end):
        # -> the index up to which buf (a bytearray, scratch: frames are decoded in it) is used up
        self.message_id = 0
        self.tx_len = 0
        reader = self.reader
        at = reader.feed_from(buf, start, end)
        if reader.ready:
            self._receive()
        return at

    def feed_byte(self, byte):
        # For a port that gets single bytes. -> True if there is a message, or an answer in tx
        self.message_id = 0
        self.tx_len = 0
        if self.reader.feed(byte):
            self._receive()
        return self.message_id != 0 or self.tx_len != 0

    def send(self, message_id, items=0):
        # Encodes `out` (and `items` of its group) as a whole frame in tx[0 .. tx_len).
        # -> tx_len, 0 if the message does not fit its schema (our own bug; nothing is sent)
        tx = self.tx
        end = encode_into(message_id, self.out, tx, _BODY, items)
        if end < 0:
            self.tx_len = 0
            return 0
        tx[0] = 0
        tx[2] = VERSION | 4  # up
        if message_id > IDENTITY:
            tx[2] |= self.epoch << 5
        tx[3] = self._seq
        tx[4] = self._ack
        tx[5] = message_id
        tx[6] = end + 2  # less the delimiter and the COBS byte, plus the CRC
        crc = self._crc
        crc32_into(tx, 2, end, crc)
        tx[end] = crc[0] & 255
        tx[end + 1] = crc[0] >> 8
        tx[end + 2] = crc[1] & 255
        tx[end + 3] = crc[1] >> 8
        end += 4
        cobs.encode(tx, 1, end)
        tx[end] = 0
        self._seq = self._seq + 1 & 255
        self.tx_len = end + 1
        self.reader.count_out(end + 1)
        return end + 1

    def keep(self):
        # Retains the frame in tx: the answer to the step just done.
        # Byte by byte: a slice would be an object on the heap of MicroPython 1.25.
        self._kept_len = 0
        if self.tx_len <= _KEPT_MAX:
            kept = self.kept
            tx = self.tx
            for i in range(self.tx_len):
                kept[i] = tx[i]
            self._kept_len = self.tx_len

    def resend_kept(self):
        # The retained frame once more, byte for byte. -> tx_len, 0 if there is none in this epoch
        for i in range(self._kept_len):
            self.tx[i] = self.kept[i]
        self.tx_len = self._kept_len
        if self.tx_len:
            self.reader.count_out(self.tx_len)
        return self.tx_len

    def send_hello(self, firmware_lo, firmware_hi, reset_cause, stores, parameters,
                   heap_bytes, heap_used_bytes, heap_code_bytes):
        out = self.out
        out[0] = VERSION
        out[1] = VERSION
        out[2] = SCHEMA_LO
        out[3] = SCHEMA_HI
        out[4] = firmware_lo
        out[5] = firmware_hi
        out[6] = self.boot_id
        out[7] = reset_cause
        out[8] = BODY_MAX
        out[9] = _WINDOW_DOWN
        out[10] = _WINDOW_UP
        out[11] = 0
        out[12] = stores
        out[13] = parameters
        out[14] = heap_bytes
        out[15] = heap_used_bytes
        out[16] = heap_code_bytes
        return self.send(HELLO)

    def send_error(self, code, message_id, detail):
        out = self.out
        out[0] = code
        out[1] = message_id
        out[2] = detail
        return self.send(ERROR)

    def _receive(self):
        # The reader has a sound frame: is it of this epoch, known, and in its bounds?
        reader = self.reader
        message_id = reader.message_id
        epoch = reader.ctl >> 5 & 3
        if 0 < message_id <= IDENTITY:
            if epoch != 0:
                return reader.count(STALE)
        elif epoch == 0 or epoch != self.epoch:
            return reader.count(STALE)
        self._ack = reader.seq
        row = PLACE[message_id]
        if row == 255 or FLAGS[row] & 1 != DOWN:
            reader.count(BAD_ID)
            return self.send_error(_ERROR_UNKNOWN_ID, message_id, 0)
        count = decode_into(message_id, reader.body, reader.body_start, reader.body_end, self.values)
        if count < 0:
            reader.count(BAD_VALUE)
            return self.send_error(_ERROR_RANGE, message_id, 0)
        if message_id == WELCOME and not self._welcome():
            return reader.count(STALE)
        self.count = count
        self.message_id = message_id

    def _welcome(self):
        # -> whether it is meant for this boot
        epoch = self.values[0]
        if self.values[1] != self.boot_id or epoch < 1 or epoch > 3:
            return False
        if epoch != self.epoch:
            self.epoch = epoch
            self._kept_len = 0  # an answer of the last epoch answers nothing now
        return True
