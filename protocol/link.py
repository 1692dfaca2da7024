# The core's end of the link: frames, epochs, handshake, questions in order, the retained answers.
#
#   at = 0
#   while at < size:                                  size bytes were read into rx
#       at = link.feed(rx, at, size)                  takes one frame at most
#       if link.message_id:                           a message: link.values[0 .. link.count)
#           link.out[0] = ...
#           link.send(STEP_RSP)                       -> link.tx[0 .. link.tx_len)
#       if link.tx_len: port.write(link.tx, link.tx_len)
#
# The reliable layer: a question with the reliable bit is taken once and in order, and its answer, of the same
# SEQ, is retained until the host's ACK says that it has it. Who asks keeps the time and repeats: the core has no timer,
# as over semihosting its clock stands still, and as each of its reliable frames is an answer.

from array import array

from protocol import cobs
from protocol.codec import decode_into, encode_into
from protocol.crc32 import crc32_into
from protocol.frame_reader import BAD_ID, BAD_VALUE, COUNTERS, DOWN, DUPLICATES, STALE, WIRE_MAX, FrameReader
from protocol.tables import (
    ACK, BODY_MAX, ERROR, FLAGS, HELLO, IDENTITY, PLACE, SCHEMA_HI, SCHEMA_LO, VALUES_MAX, VERSION, WELCOME,
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
_WINDOW_UP = const(2)       # answers retained: so many questions may wait for theirs
_RELIABLE = const(8)
_NAK = const(16)


class Link:
    # Everything is allocated in __init__: values (VALUES_MAX ints; `out` is the same array, as no answer needs
    # its question once it is begun), three buffers to send from (108 bytes each: two of them hold the answers that
    # the host may have missed, `tx` is the one at hand), held (106), counters (14 ints). Nothing allocates or raises afterwards.
    #
    # A reliable question that came before is not a message: its retained answer is in tx again. One that comes too
    # early is answered with ACK, once a gap; one whose answer could not be retained is left to be repeated.
    #
    # Handshake: until WELCOME names our boot id, only the ids 1 to 4 pass. From then on every other
    # frame must carry the epoch that WELCOME gave; frames of another epoch are dropped and counted.
    # HELLO, WELCOME, IDENTIFY and IDENTITY always travel in epoch 0.
    #
    # A sound frame with an unknown id, or with a body that its id does not allow, is answered with ERROR
    # by the link itself: message_id is 0 and tx_len is not.

    def __init__(self, boot_id):
        self._told = bytearray(WIRE_MAX)
        self.tx = self._told
        self.kept = [bytearray(WIRE_MAX), bytearray(WIRE_MAX)]
        self._kept_len = bytearray(_WINDOW_UP)
        self.tx_len = 0
        self.values = array("i", bytes(4 * VALUES_MAX))
        self.out = self.values
        self.counters = array("i", bytes(4 * COUNTERS))  # named in frame_reader.py, in the order of LINK
        self.reader = FrameReader(DOWN, self.counters)
        self.message_id = 0     # of the message that feed() found; 0: none
        self.count = 0          # its ints in values
        self.boot_id = boot_id & 65535
        self.epoch = 0          # 0: not welcomed yet
        self._seq = 0           # of what is told without being repeated
        self._ack = 0           # the last question that was taken, and SEQ of its answer
        self._acked = 0         # the last answer that the host has
        self._owed = False      # the question at hand is to be answered reliably
        self._gap = False       # told already
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
        answers = self._owed and FLAGS[PLACE[message_id]] & 2
        place = self._ack & 1
        tx = self.kept[place] if answers else self._told
        self.tx = tx
        end = encode_into(message_id, self.out, tx, _BODY, items)
        if end < 0:
            self.tx_len = 0
            return 0
        tx[0] = 0
        tx[2] = VERSION | 4  # up
        if message_id > IDENTITY:
            tx[2] |= self.epoch << 5
        if answers:
            tx[2] |= _RELIABLE
            tx[3] = self._ack
            self._owed = False
            self._kept_len[place] = end + 5
        else:
            if message_id == ACK:
                tx[2] |= _NAK
            if message_id > IDENTITY:
                self._seq = self._seq + 1 & 255
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
        self.tx_len = end + 1
        self.reader.count_out(end + 1)
        return end + 1

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
        out[11] = self.epoch    # in force: a host that comes later opens another one
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
        self._owed = False
        message_id = reader.message_id
        epoch = reader.ctl >> 5 & 3
        if 0 < message_id <= IDENTITY:
            if epoch != 0:
                return reader.count(STALE)
        elif epoch == 0 or epoch != self.epoch:
            return reader.count(STALE)
        elif not self._in_turn():
            return
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

    def _in_turn(self):
        # What the header of a frame of our epoch says. -> whether the frame is to be taken.
        reader = self.reader
        kept = self._ack - self._acked & 255
        acked = reader.ack - self._acked & 255
        if acked <= kept:  # else it is older than what we know
            self._acked = reader.ack
            kept -= acked
        if not reader.ctl & _RELIABLE:
            return True
        behind = self._ack - reader.seq & 255
        if behind == 255:
            if kept == _WINDOW_UP:
                return False
            self._ack = reader.seq
            self._owed = True
            self._gap = False
            return True
        if behind < 128:
            if behind >= kept:
                reader.count(STALE)  # the host has its answer
            else:
                reader.count(DUPLICATES)
                place = reader.seq & 1
                self.tx = self.kept[place]
                self.tx_len = self._kept_len[place]
                reader.count_out(self.tx_len)
        elif not self._gap:
            self._gap = True
            self.out[0] = self._ack + 1 & 255
            self.send(ACK)
        return False

    def _welcome(self):
        # -> whether it is meant for this boot
        epoch = self.values[0]
        if self.values[1] != self.boot_id or epoch < 1 or epoch > 3:
            return False
        if epoch != self.epoch:
            self.epoch = epoch
            self._seq = 0
            self._ack = 0
            self._acked = 0     # an answer of the last epoch answers nothing now
            self._gap = False
        return True
