"""Bytes of a link, of both directions, to decoded messages; and messages to frames.

Contract: `feed(data, take)` never raises on what a wire may carry; `take(name,
fields)` is called once a message, in order. Of a run of STEP and STEP_RSP in one
piece of data only the newest is decoded: at a hundred times real time 10,000 of
them pass a second, and only the last can be seen.
"""

from array import array

from host_tools.message_fields import IDS, flat, named
from protocol import cobs, frame_reader, tables
from protocol.codec import decode_into, encode_into
from protocol.crc32 import crc32_into
from protocol.frame_reader import FrameReader

_NEWEST_ONLY = (tables.STEP, tables.STEP_RSP)
_CAUSES = {"cobs": frame_reader.BAD_COBS, "crc": frame_reader.BAD_CRC, "length": frame_reader.BAD_LENGTH,
           "header": frame_reader.BAD_HEADER, "overrun": frame_reader.OVERRUN}


class TapFrames:
    def __init__(self):
        self.epoch = 0
        self.bad_bodies = 0
        self._counters = array("i", bytes(4 * frame_reader.COUNTERS))
        self._reader = FrameReader(frame_reader.BOTH, self._counters)
        self._values = array("i", bytes(4 * tables.VALUES_MAX))
        self._seq = 0

    @property
    def good(self):
        return self._counters[frame_reader.FRAMES_IN]

    @property
    def bytes(self):
        return self._counters[frame_reader.BYTES_IN]

    def counts(self):
        """Frames, bytes and bad frames by cause, for people."""
        counts = {"frames": self.good, "bytes": self.bytes, "body": self.bad_bodies}
        counts.update((name, self._counters[index]) for name, index in _CAUSES.items())
        return counts

    def feed(self, data, take):
        scratch = bytearray(data)
        reader, end, at = self._reader, len(data), 0
        newest = {}
        while at < end:
            at = reader.feed_from(scratch, at, end)
            if not reader.ready:
                continue
            message_id = reader.message_id
            if message_id in _NEWEST_ONLY:
                newest[message_id] = bytes(reader.body[reader.body_start:reader.body_end])
            else:
                self._decode(message_id, reader.body, reader.body_start, reader.body_end, take)
        for message_id, body in newest.items():
            self._decode(message_id, body, 0, len(body), take)

    def _decode(self, message_id, body, start, end, take):
        if decode_into(message_id, body, start, end, self._values) < 0:
            self.bad_bodies += 1
        else:
            take(*named(message_id, self._values))

    def encode(self, name, fields, up=False):
        """One frame on the wire; `up` as the core would send it, for tests and drivers."""
        message_id = IDS[name]
        values, items = flat(message_id, fields)
        frame = bytearray(frame_reader.WIRE_MAX)
        end = encode_into(message_id, values, frame, 7, items)
        if end < 0:
            raise ValueError("%s does not fit its schema: %r" % (name, fields))
        epoch = self.epoch if message_id > tables.IDENTITY else 0   # the handshake travels in epoch 0
        frame[2:7] = bytes((tables.VERSION | up << 2 | epoch << 5, self._seq, 0, message_id, end + 2))
        self._seq = self._seq + 1 & 255
        crc = array("H", bytes(4))
        crc32_into(frame, 2, end, crc)
        frame[end:end + 4] = crc[0].to_bytes(2, "little") + crc[1].to_bytes(2, "little")
        cobs.encode(frame, 1, end + 4)
        frame[end + 4] = 0
        return bytes(frame[:end + 5])

    def identify(self):
        """The question for HELLO: all that a viewer ever says."""
        return self.encode("IDENTIFY", {"section": 0, "offset": 0})
