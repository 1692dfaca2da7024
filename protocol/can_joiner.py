# CAN frames joined to a frame of ours again, the way back from can_cutter.py.
#
# A CAN frame that is lost, repeated or out of order costs the frame that it belongs to: what is joined
# nevertheless goes through the CRC-32 of frame_reader.py like everything else.
# Sans-I/O, fixed memory, never raises on what comes off the bus.

from protocol import cobs
from protocol.can_cutter import (
    END, END_CHANNEL, FD_CHANNEL, FD_HEAD, NODE, OTHER_PRIORITY, START, STEP_PRIORITY, TELEMETRY, TOGGLE,
)
from protocol.tables import CAN_BODIES, CAN_FIRST, CAN_MESSAGES, CAN_OFFSETS, CAN_SIZES

try:
    from micropython import const
except ImportError:
    def const(value):
        return value

_RAW = const(2)         # in `frame`, behind delimiter and COBS byte
_BODY = const(7)
_HEADER = const(5)
_LEN = const(6)
_CRC = const(4)
_RAW_MIN = const(9)
_RAW_MAX = const(105)
_COLLECTED_MAX = const(110)  # two pieces of CAN FD, the last one padded
FRAME_MAX = const(113)


class CanJoiner:
    # join(can_id, data, size) -> how many bytes of `frame`, the caller's, are a whole frame as on a byte stream; else 0.
    # They are the caller's until the next join(). `direction`: of what we listen to. `broken` counts what was begun
    # and did not become a frame; it stays at 65535. speaks(): tables (dbc.py) of a sender with another schema.

    def __init__(self, frame, direction, node=NODE):
        assert len(frame) >= FRAME_MAX
        self.frame = frame
        self.broken = 0
        self._address = node << 1 | direction
        self._id = 0            # of the pieces being collected; 0: none
        self._tail = 0          # that the next one must have, less START and END
        self._collected = 0
        self._message = 0       # of the telemetry being collected; 0: none
        self._channel = 0       # of its next part
        self._messages = CAN_MESSAGES
        self._offsets = CAN_OFFSETS
        self._sizes = CAN_SIZES
        self._first = CAN_FIRST
        self._bodies = CAN_BODIES

    def speaks(self, messages, offsets, sizes, first, bodies):
        self._messages = messages
        self._offsets = offsets
        self._sizes = sizes
        self._first = first
        self._bodies = bodies

    def join(self, can_id, data, size):
        if can_id >> 5 & 15 != self._address:
            return 0
        priority = can_id & ~511
        channel = can_id & 31
        if priority == TELEMETRY:
            if channel == END_CHANNEL:
                return self._end(data, size)
            if self._messages[channel]:
                self._part(channel, data, size)
            return 0
        if priority == OTHER_PRIORITY and channel >= FD_CHANNEL:
            return self._fd_telemetry(channel, data, size)
        if channel < FD_CHANNEL and (priority == STEP_PRIORITY or priority == OTHER_PRIORITY):
            return self._piece(can_id, data, size)
        return 0

    def _piece(self, can_id, data, size):
        if size < 2:
            return 0
        size -= 1
        tail = data[size]
        if tail & START:
            self._forget()
            self._id = can_id
            self._tail = tail & 31 | TOGGLE
            self._collected = 0
        if self._id == 0:
            return 0
        if can_id != self._id or tail & 63 != self._tail or self._collected + size > _COLLECTED_MAX:
            self._forget()
            return 0
        self._put(_RAW + self._collected, data, 0, size)
        self._collected += size
        self._tail ^= TOGGLE
        if not tail & END:
            return 0
        self._id = 0
        size = self.frame[_LEN]
        if size < _RAW_MIN or size > _RAW_MAX or size > self._collected:
            self._count()
            return 0
        return self._whole(size)

    def _part(self, channel, data, size):
        message = self._messages[channel]
        if channel == self._first[message & 15]:
            self._forget()
            self._message = message
            self._channel = channel
        if self._message == 0:
            return
        if message != self._message or channel != self._channel or size != self._sizes[channel]:
            self._forget()
            return
        self._put(_BODY + self._offsets[channel], data, 0, size)
        self._channel = channel + 1

    def _end(self, data, size):
        message = self._message
        if message == 0:
            return 0
        if size != 8 or data[3] != message or self._messages[self._channel] == message:
            self._forget()
            return 0
        self._message = 0
        return self._headed(message, data)

    def _fd_telemetry(self, channel, data, size):
        self._forget()
        message = 32 | channel & 15
        body = self._bodies[channel & 15]
        if body == 0 or size < FD_HEAD + body or data[3] != message:
            self._count()
            return 0
        self._put(_BODY, data, FD_HEAD, body)
        return self._headed(message, data)

    def _headed(self, message, data):
        # CTL SEQ ACK ID and the CRC stand in data; LEN follows from the message.
        size = self._bodies[message & 15] + _HEADER + _CRC
        self._put(_RAW, data, 0, 4)
        self.frame[_LEN] = size
        self._put(_RAW + size - _CRC, data, 4, _CRC)
        return self._whole(size)

    def _whole(self, size):
        frame = self.frame
        frame[0] = 0
        cobs.encode(frame, 1, _RAW + size)
        frame[_RAW + size] = 0
        return size + 3

    def _put(self, to, data, start, size):
        frame = self.frame
        while size > 0:
            frame[to] = data[start]
            to += 1
            start += 1
            size -= 1

    def _forget(self):
        # What was begun, of either sort: they share the frame.
        if self._id or self._message:
            self._id = 0
            self._message = 0
            self._count()

    def _count(self):
        if self.broken < 65535:
            self.broken += 1
