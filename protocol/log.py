# The log of a link: every raw frame of both directions, as sim_device writes it
# and host_tools reads it. Sans-I/O: bytes come and go, files are the callers'.
# For the host only; the core never imports it.
#
#   head      "TVSLAM1\n", u32 length, JSON in UTF-8, u32 CRC-32 of all before
#             JSON: {"messages": ..., "parameters": ..., "states": ... (a schema: dialect.py), "version": ..., plus what the writer adds}
#   record    u8 direction (0 DOWN, 1 UP), u8 length, u32 dt_us since the record before, the raw frame
#             (CTL ... CRC-32), u32 CRC-32 of the record so far
#   marker    MARK (16 bytes), u64 records so far, u64 t_us, u32 CRC-32 of the marker; at least one in 64 KB
#
# All little-endian. A reader that meets damage goes on at the next marker: a flipped bit costs what lies before
# that marker. A file that breaks off, at whatever byte, has every whole record before it.

import json
import zlib
from dataclasses import dataclass
from struct import Struct

from protocol import schema
from protocol.dialect import OURS

MAGIC = b"TVSLAM1\n"
MARK = b"\xf5TVSLAM-SYNC\r\n\x1a\n"
MARK_EVERY_BYTES = 65536
FRAME_MAX = 255
_U32 = Struct("<I")
_RECORD = Struct("<BBI")
_MARKER = Struct("<16sQQ")
_RECORD_EXTRA = _RECORD.size + _U32.size
_MARKER_SIZE = _MARKER.size + _U32.size
_DT_MAX = 0xFFFFFFFF
_HEADER = 5             # of a frame: CTL SEQ ACK ID LEN
_ID = 3
_CRC = 4


class LogError(Exception):
    """One sentence: these bytes are not the beginning of such a log."""


@dataclass(frozen=True, slots=True)
class Record:
    t_us: int
    direction: int
    frame: bytes

    def message(self, kinds):
        """What it says, by {id: what unpacks it}; None where that has no such id. May raise MessageError."""
        kind = kinds.get(self.frame[_ID]) if len(self.frame) >= _HEADER + _CRC else None
        return kind and kind.unpack(self.frame[_HEADER:-_CRC])


# Makes the bytes of a log. Holds a few integers only; the caller stores what
# head() and record() return, in that order; since_mark is 0 behind a marker. t_us never runs backwards here:
# an earlier time than the last is written as the last.
class LogWriter:
    def __init__(self):
        self.records = 0
        self.since_mark = 0     # bytes
        self._t_us = 0

    def head(self, dialect=OURS, **notes):
        """`dialect` is the schema of the core whose frames are to follow."""
        told = {**dialect.told(), "version": schema.VERSION, **notes}
        text = json.dumps(told, separators=(",", ":")).encode()
        head = MAGIC + _U32.pack(len(text)) + text
        return head + _U32.pack(zlib.crc32(head)) + self.marker()

    def record(self, t_us, direction, frame):
        dt_us = min(max(t_us - self._t_us, 0), _DT_MAX)
        self._t_us += dt_us
        body = _RECORD.pack(direction, len(frame), dt_us) + frame
        self.records += 1
        self.since_mark += len(body) + 4
        if self.since_mark + FRAME_MAX + _RECORD_EXTRA + _MARKER_SIZE < MARK_EVERY_BYTES:
            return body + _U32.pack(zlib.crc32(body))
        return body + _U32.pack(zlib.crc32(body)) + self.marker()

    def marker(self):
        """A marker outside the usual distance, as before a pause."""
        self.since_mark = 0
        marker = _MARKER.pack(MARK, self.records, self._t_us)
        return marker + _U32.pack(zlib.crc32(marker))


# Takes the bytes of a log in pieces of any size. `told` is the head's JSON, None
# until it is there. `damaged` counts the stretches of bytes that were skipped,
# `lost` the records that are known to be missing in them. `damaged_at` is the byte of
# the first that is not as it was written, None so far; `sound` the records before it. `damage` says it in words.
# Keeps at most one incomplete record, or the bytes since the damage up to a marker.
class LogReader:
    def __init__(self):
        self.told = None
        self.records = 0
        self.damaged = 0
        self.lost = 0
        self.damaged_at = None
        self.sound = 0
        self._passed = 0    # bytes before those held
        self._marked = 0    # records before the last marker
        self._bytes = bytearray()
        self._t_us = 0
        self._lost_track = False

    @property
    def left_over(self):
        """Bytes that make no whole record yet: at the end of a file, what its writer did not finish."""
        return len(self._bytes)

    @property
    def damage(self):
        """When all is fed: where it is not whole, to be put behind "the log"; "" if it is."""
        if self.damaged_at is not None:
            known = "no sync marker follows" if self._lost_track else "%d of them lost" % self.lost
            return "is damaged from byte %d on, behind record %d of %d; %s" % (self.damaged_at, self.sound, self.records, known)
        if self.told is None:
            return "ends within its head"
        if self._bytes:
            return "breaks off at byte %d, in the middle of record %d" % (self._passed, self.sound + 1)
        return ""

    def feed(self, chunk):
        """The records that these bytes complete, in order."""
        self._bytes += chunk
        found = []
        at = 0 if self.told is not None else self._head()
        if at is None:
            return found
        while True:
            if self._lost_track:
                at = self._resume(at)
                if self._lost_track:
                    break
            size = self._one(at, found)
            if size == 0:
                break
            if size < 0:
                self.damaged += 1
                self._lost_track = True
                self._not_sound(at)
                at += 1
            else:
                at += size
        del self._bytes[:at]
        self._passed += at
        return found

    def _not_sound(self, at):
        if self.damaged_at is None:
            self.damaged_at = self._passed + at

    def _head(self):
        data = self._bytes
        if not MAGIC.startswith(bytes(data[:len(MAGIC)])):
            raise LogError("this is no log of a TVSLAM link: it does not begin with %r" % MAGIC.decode())
        start = len(MAGIC) + 4
        if len(data) < start:
            return None
        end = start + _U32.unpack_from(data, len(MAGIC))[0]
        if end > (1 << 24):
            raise LogError("the head of this log is damaged: it claims a length of %d bytes" % end)
        if len(data) < end + 4:
            return None
        if zlib.crc32(data[:end]) != _U32.unpack_from(data, end)[0]:
            raise LogError("the head of this log is damaged: its check sum is wrong")
        try:
            self.told = json.loads(data[start:end])
            kinds = [[type(row) for row in self.told[key]] for key in ("messages", "parameters")]
        except (ValueError, TypeError, KeyError, RecursionError):
            kinds = None
        if not kinds or any(kind is not list for row in kinds for kind in row):
            self.told = None
            raise LogError("the head of this log is not understood: it was written by another program")
        return end + 4

    def _one(self, at, found):
        """Size of the record or marker at this place, 0 if it is not all there yet, -1 if it is damaged."""
        data, have = self._bytes, len(self._bytes) - at
        if have < 2:
            return 0
        if data[at] == MARK[0]:
            if have < _MARKER_SIZE:
                return 0
            if zlib.crc32(data[at:at + _MARKER.size]) != _U32.unpack_from(data, at + _MARKER.size)[0]:
                return -1
            _, records, t_us = _MARKER.unpack_from(data, at)
            if records != self.records:     # whole records are gone, or there twice: the bytes that are left say nothing
                self._not_sound(at)
            if records >= self._marked:     # else it is a copy of an earlier one
                self.lost += max(records - self.records, 0)
                self.records = self._marked = records
                self._t_us = t_us
            return _MARKER_SIZE
        if data[at] > schema.UP:
            return -1
        size = data[at + 1] + _RECORD_EXTRA
        if have < size:
            return 0
        end = at + size - 4
        if zlib.crc32(data[at:end]) != _U32.unpack_from(data, end)[0]:
            return -1
        direction, _, dt_us = _RECORD.unpack_from(data, at)
        self._t_us += dt_us
        self.records += 1
        self.sound += self.damaged_at is None
        found.append(Record(self._t_us, direction, bytes(data[at + _RECORD.size:end])))
        return size

    def _resume(self, at):
        """The next place with an intact marker; without one, all but what may be a marker's beginning is skipped."""
        data = self._bytes
        while True:
            place = data.find(MARK, at)
            if place < 0:
                return max(at, len(data) - len(MARK) + 1)
            if len(data) - place < _MARKER_SIZE:
                return place
            end = place + _MARKER.size
            if zlib.crc32(data[place:end]) == _U32.unpack_from(data, end)[0]:
                self._lost_track = False
                return place
            at = place + 1
