# A frame of ours cut into CAN frames: ids and layout are in docs/protocol.md, section CAN.
#
# An id is priority (2 bits) node (3) direction (1) channel (5). What is no telemetry travels in pieces
# of 7 bytes (63 on CAN FD) and a tail byte; telemetry as frames of whole fields, which tvslam.dbc
# describes, and one with header and CRC behind them. Sans-I/O; nothing allocates after __init__.

from protocol.tables import CAN_FIRST, CAN_MESSAGES, CAN_OFFSETS, CAN_SIZES, HEAD_BYTES, LINK, PLACE, SCHEMA_HI, SCHEMA_LO, VERSION

try:
    from micropython import const
except ImportError:
    def const(value):
        return value

NODE = const(1)
STEP_PRIORITY = const(0x200)
OTHER_PRIORITY = const(0x400)
TELEMETRY = const(0x600)    # single frames: channel = place in CAN_MESSAGES
FD_CHANNEL = const(16)      # of OTHER_PRIORITY: telemetry on CAN FD, plus the id's low four bits
SCHEMA_CHANNEL = const(30)  # of TELEMETRY: schema hash, version
END_CHANNEL = const(31)     # of TELEMETRY: header and CRC of the fields before

START = const(128)          # the tail byte, as Cyphal has it: start, end, toggle, transfer (5 bits)
END = const(64)
TOGGLE = const(32)

FD_HEAD = const(8)          # of telemetry on CAN FD: CTL SEQ ACK ID CRC-32, then the body
FD_SIZES = b"\x00\x01\x02\x03\x04\x05\x06\x07\x08\x0c\x10\x14\x18\x20\x30\x40"  # by DLC

_HEADER = const(5)
_CRC = const(4)
_RAW_MIN = const(9)
_RAW_MAX = const(105)
_NONE = const(255)


class CanCutter:
    # begin(wire, size): a whole frame as link.py and host_link.py make it, delimiters included. Then each
    # next() that is True leaves a CAN frame: can_id, data[0 .. size), dlc. `direction`: of what we send.
    # Frames must leave in this order, and no other frame of ours between them: who takes them forgets one that is begun.

    def __init__(self, direction, fd, node=NODE):
        self.fd = fd
        self.data = bytearray(64 if fd else 8)
        self.size = 0
        self.dlc = 0
        self.can_id = 0
        self._address = node << 6 | direction << 5
        self._raw = bytearray(_RAW_MAX)
        self._at = 0
        self._end = 0
        self._tail = START | TOGGLE
        self._channel = _NONE   # the next one of telemetry; _NONE: pieces
        self._links = 0         # LINKs so far, modulo 2

    def begin(self, wire, size):
        self._at = 0
        self._end = size - 3
        if self._end < _RAW_MIN or self._end > _RAW_MAX:
            self._end = 0       # our own bug: nothing goes out
            return
        raw = self._raw
        code = 1 + wire[1]
        i = 2
        while i < size - 1:
            byte = wire[i]
            if i == code:
                code += byte
                byte = 0
            raw[i - 2] = byte
            i += 1
        self._tail = (self._tail + 1 & 31) | START | TOGGLE
        message = raw[3]
        self._channel = _NONE
        if message >> 4 == 2 and CAN_FIRST[message & 15] != _NONE:
            body = HEAD_BYTES[PLACE[message]]
            if self._end == body + _HEADER + _CRC and (not self.fd or body + FD_HEAD <= 64):
                self._channel = CAN_FIRST[message & 15]

    def next(self):
        if self._at >= self._end:
            return False
        if self._channel == _NONE:
            self._piece()
        elif self._channel == SCHEMA_CHANNEL:
            self._schema()
        elif self.fd:
            self._fd_telemetry()
        else:
            self._telemetry()
        return True

    def _piece(self):
        # The kind of message, the upper half of its id, is the channel.
        kind = self._raw[3] >> 4 & 15
        self.can_id = (STEP_PRIORITY if kind == 1 else OTHER_PRIORITY) | self._address | kind
        size = min(self._end - self._at, len(self.data) - 1)
        self._copy(0, self._at, size)
        self._at += size
        self._pad(size, size + 1)
        self.data[self.size - 1] = self._tail if self._at < self._end else self._tail | END
        self._tail = (self._tail ^ TOGGLE) & 63

    def _telemetry(self):
        channel = self._channel
        message = self._raw[3]
        if CAN_MESSAGES[channel] != message:
            self.can_id = TELEMETRY | self._address | END_CHANNEL
            self._head()
            self._pad(FD_HEAD, FD_HEAD)
            return
        self.can_id = TELEMETRY | self._address | channel
        size = CAN_SIZES[channel]
        self._copy(0, _HEADER + CAN_OFFSETS[channel], size)
        self._pad(size, size)
        self._channel = channel + 1

    def _fd_telemetry(self):
        self.can_id = OTHER_PRIORITY | self._address | FD_CHANNEL | self._raw[3] & 15
        body = self._end - _HEADER - _CRC
        self._copy(FD_HEAD, _HEADER, body)
        self._head()
        self._pad(FD_HEAD + body, FD_HEAD + body)

    def _head(self):
        # What the fields alone do not say. Behind every second LINK, so once a second, goes what tells a viewer whether
        # its DBC is of this core.
        self._copy(0, 0, 4)
        self._copy(4, self._end - _CRC, _CRC)
        self._at = self._end
        if self._raw[3] == LINK:
            self._links ^= 1
            if self._links:
                self._at = 0
                self._channel = SCHEMA_CHANNEL

    def _schema(self):
        data = self.data
        self.can_id = TELEMETRY | self._address | SCHEMA_CHANNEL
        data[0] = SCHEMA_LO & 255
        data[1] = SCHEMA_LO >> 8
        data[2] = SCHEMA_HI & 255
        data[3] = SCHEMA_HI >> 8
        data[4] = VERSION
        self._pad(5, 5)
        self._at = self._end

    def _copy(self, to, start, size):
        data = self.data
        raw = self._raw
        while size > 0:
            data[to] = raw[start]
            to += 1
            start += 1
            size -= 1

    def _pad(self, used, size):
        # To the next length that CAN has; up to 8 each length is one.
        dlc = 0
        while FD_SIZES[dlc] < size:
            dlc += 1
        size = FD_SIZES[dlc]
        for i in range(used, size):
            self.data[i] = 0
        self.dlc = dlc
        self.size = size
