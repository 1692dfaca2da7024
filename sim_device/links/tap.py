# The tap: further ptys on which viewers see what passes between robot and core.

from array import array

from protocol import cobs
from protocol.describe import field_size
from protocol.dialect import OURS
from protocol.frame_reader import COUNTERS, DOWN, FrameReader
from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from protocol.schema_pull import PIECE_BYTES, SECTION, piece
from sim_device.links.pty import Pty

FLUSH_S = 0.02
HELLO_S = 1.0
BACKLOG_BYTES = 65536
DRAIN_S = 1.5
ASKED_BYTES = 3     # of IDENTIFY: section, offset
NUMBER_BYTES = 2    # of an item: so many are kept, whatever a core of another schema counts

_ID = 3         # in a raw frame: CTL SEQ ACK ID LEN body CRC
_BODY = 5
_BOOT_ID = slice(_BODY + 10, _BODY + 12)  # HELLO keeps its layout for ever
_SCHEMA = slice(_BODY + 2, _BODY + 6)
_HELLO, _IDENTITY, _IDENTIFY, _WELCOME = (BY_NAME[name].ID for name in ("HELLO", "IDENTITY", "IDENTIFY", "WELCOME"))
_NUMBERS = ("index", "order")   # fields of telemetry of which each item counts for itself: a vector, a store


def wire(raw):
    """The bytes on the line of a raw frame."""
    frame = bytearray(len(raw) + 3)
    frame[2:-1] = raw
    cobs.encode(frame, 1, len(frame) - 1)
    return frame


# All taps of one link. frame() takes every raw frame that passes, in order, and
# costs next to nothing; service() is called now and then and moves what has
# gathered, at most every 20 ms. A viewer that comes late is told the last HELLO,
# then the newest of every kind of telemetry and of every numbered item (the map
# so far). A viewer that reads too slowly loses whole frames: steps first,
# everything beyond 64 KB of backlog, counted in `dropped`. It never slows the link.
# What a viewer sends is answered here, and never reaches the core.
class Taps:
    def __init__(self, paths):
        self._taps = []
        self._hello = None
        self._identity = {}
        self._newest = {}
        self._link = HostLink()
        self.speaks(OURS)
        self._passing = []
        self._next_s = 0.0
        try:
            for path in paths:
                self._taps.append(_Tap(path))
        except BaseException:
            self.close()
            raise

    @property
    def dropped(self):
        return sum(tap.dropped for tap in self._taps)

    def speaks(self, dialect):
        """What passes from here on is of this schema, and whoever asks is told it."""
        self._dialect = dialect
        telemetry = {number: kind for number, kind in dialect.by_id.items() if 0x20 <= number < 0x30}
        self._kept = {number: _number_of(kind) for number, kind in telemetry.items()}
        self._kept |= {dialect.by_name[name].ID: slice(0) for name in ("STATUS_RSP",) if name in dialect.by_name}
        self._steps = [dialect.by_name[name].ID for name in ("STEP", "STEP_RSP") if name in dialect.by_name]

    def frame(self, raw):
        if not self._taps:
            return
        self._passing.append(raw)
        message_id = raw[_ID]
        if message_id in self._kept:
            self._newest[message_id, raw[self._kept[message_id]]] = raw
        elif message_id == _HELLO:
            if self._hello is not None and self._hello[_BOOT_ID] != raw[_BOOT_ID]:
                self._newest.clear()  # another core: what the last one said is no longer so
                self._identity.clear()
            self._hello = raw
        elif message_id == _IDENTITY:
            self._identity[raw[_BODY:_BODY + 3]] = raw

    def service(self, now_s):
        if now_s < self._next_s or not self._taps:
            return
        self._next_s = now_s + FLUSH_S
        passing, self._passing = self._passing, []
        wires = None
        for tap in self._taps:
            if not tap.arrived():
                continue
            if tap.is_new:
                tap.is_new = False
                tap.write([wire(raw) for raw in self._introduction()])
                tap.hello_s = now_s + HELLO_S
                continue  # what was passing is in the introduction, but for steps
            if wires is None:
                wires = [(raw[_ID], wire(raw)) for raw in passing]
            if self._hello is not None and now_s >= tap.hello_s:
                # Again, once a second: opening a port may throw away what came before.
                tap.hello_s = now_s + HELLO_S
                tap.write([wire(self._hello)])
            tap.pass_on(wires, self._steps)
            for request in tap.requests():
                answer = self._answer(request)
                if answer is not None:
                    tap.write([answer])
                    tap.is_new = tap.is_new or self._is_last(request)

    def _answer(self, request):
        """The frame that answers IDENTIFY with these three bytes, None if nobody has said it."""
        if request[:1] == bytes((SECTION,)):
            known = self._hello is not None and self._hello[_SCHEMA] == self._dialect.hash.to_bytes(4, "little")
            return self._link.encode(piece(self._dialect.data, int.from_bytes(request[1:], "little"))) if known else None
        raw = self._identity.get(request, self._hello)
        return None if raw is None else wire(raw)

    def _is_last(self, request):
        """Whoever has the last piece of the schema understands only now what was said at first: it is told that again."""
        offset = int.from_bytes(request[1:], "little")
        return request[:1] == bytes((SECTION,)) and offset < len(self._dialect.data) <= offset + PIECE_BYTES

    def _introduction(self):
        return ([] if self._hello is None else [self._hello]) + list(self._newest.values())

    def close(self):
        """Sends what is left to those who read, and removes the names."""
        self._next_s = 0.0
        self.service(0.0)
        for tap in self._taps:
            tap.close()
        self._taps = []


def _number_of(kind):
    """Which bytes of a raw frame number this item of telemetry."""
    at = _BODY
    for name, type_, _ in kind.FIELDS:
        if type_ == "*":
            break
        if name in _NUMBERS:
            return slice(at, at + min(field_size(type_), NUMBER_BYTES))
        at += field_size(type_)
    return slice(0)


# One viewer's port.
class _Tap:
    def __init__(self, path):
        self.dropped = 0
        self.is_new = True
        self.hello_s = 0.0
        self._pty = Pty(path, BACKLOG_BYTES * 2)
        self._reader = FrameReader(DOWN, array("i", bytes(4 * COUNTERS)))

    def arrived(self):
        if self._pty.present:
            return True
        if not self.is_new:
            self._pty.forget()
            self._reader.reset()
            self.is_new = True
        return False

    def write(self, wires):
        if not self._pty.write(b"".join(wires)):
            self.dropped += len(wires)

    def pass_on(self, wires, steps):
        self._pty.flush()
        waiting = self._pty.waiting
        if waiting > BACKLOG_BYTES:
            self.dropped += len(wires)
            return
        if waiting:
            kept = [frame for message_id, frame in wires if message_id not in steps]
        else:
            kept = [frame for _, frame in wires]
        self.dropped += len(wires) - len(kept)
        if kept:
            self.write(kept)

    def requests(self):
        """For each question of the viewer the three bytes (section, offset) that it asks for, or b"" for HELLO."""
        data = bytearray(self._pty.read() or b"")
        asked, at = [], 0
        while at < len(data):
            at = self._reader.feed_from(data, at, len(data))
            if self._reader.ready and self._reader.message_id in (_IDENTIFY, _WELCOME):
                body = bytes(self._reader.body[self._reader.body_start:self._reader.body_end])
                if self._reader.message_id == _WELCOME:
                    asked.append(b"")
                elif len(body) == ASKED_BYTES:
                    asked.append(body)
        return asked

    def close(self):
        self._pty.drain(DRAIN_S)
        self._pty.close()
