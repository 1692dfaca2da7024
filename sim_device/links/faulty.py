# A link on which frames are lost, hit, doubled, overtaken and late, cables are pulled and cores reset: any link, made worse.

import heapq
import itertools
import random

from protocol import cobs
from protocol.describe import field_size
from protocol.dialect import OURS
from protocol.messages import BY_NAME
from sim_device.faults import BUS_EVENTS, plain

OVERTAKEN_S = 0.02      # so long a frame waits for the next one to go first
TORN_MAX = 256          # bytes without a delimiter: no frame, they pass as they are

_HELLO = BY_NAME["HELLO"].ID
_ID, _BODY = 4, 6       # in a frame as on the wire, after decoding: COBS byte, CTL SEQ ACK ID LEN, body
_BOOT_ID = slice(_BODY + 10, _BODY + 12)


# One direction. send() takes a frame, due() gives what has come through by then, in order. What is done to which frame
# follows from seed, plan and the frame's number alone: each frame draws the same numbers whatever happens to it.
class _Way:
    def __init__(self, name, plan, seed, note):
        self.name = name
        self.frames = 0
        self._plan = plan
        self._random = random.Random("%d %s" % (seed, name))
        self._note = note
        self._queue = []
        self._order = 0
        self._held = None

    def send(self, wire, now_s):
        done = self._fate(len(wire) * 8)
        for kind, detail in done:
            self._note(kind, self.name, self.frames, detail)
        fate = dict(done)
        overtaken, self._held = self._held, None
        if "drop" not in fate:
            if "flip" in fate and fate["flip"] < len(wire) * 8:
                wire = bytearray(wire)
                wire[fate["flip"] >> 3] ^= 1 << (fate["flip"] & 7)
            due_s = now_s + fate.get("delay", 0)
            for _ in range(2 if "dup" in fate else 1):
                if "reorder" in fate and overtaken is None:
                    self._held = (due_s, bytes(wire), now_s + OVERTAKEN_S)
                    fate.pop("reorder")  # its double is not held
                else:
                    self._push(due_s, wire)
        if overtaken is not None:
            self._push(max(overtaken[0], now_s), overtaken[1])

    def due(self, now_s):
        if self._held is not None and now_s >= self._held[2]:
            self._push(max(self._held[0], now_s), self._held[1])
            self._held = None
        came = []
        while self._queue and self._queue[0][0] <= now_s:
            came.append(heapq.heappop(self._queue)[2])
        return came

    def next_s(self):
        times = [self._queue[0][0]] if self._queue else []
        return min(times + ([self._held[2]] if self._held is not None else []), default=float("inf"))

    def clear(self):
        self._queue.clear()
        self._held = None

    def _push(self, due_s, wire):
        self._order += 1
        heapq.heappush(self._queue, (due_s, self._order, bytes(wire)))

    def _fate(self, bits):
        """[(kind, detail)] of this frame."""
        self.frames += 1
        draw = self._random.random
        chances, done = self._plan.chances, []
        for kind in ("drop", "flip", "dup", "reorder", "delay"):
            hit, which = draw() < chances.get(kind, 0), draw()
            if hit:
                done.append((kind, int(which * bits) if kind == "flip" else self._plan.delay_s if kind == "delay" else None))
        return done + self._plan.frames.get((self.name, self.frames), [])


# Stands in for the link that it wraps towards Peer: write() takes one whole frame, read() gives what came. Times are
# the link's own. `note(text)` gets each fault as an item of --faults that repeats it. `reset(byte)` starts the core anew, or
# asks for it to be done, `byte` is that at which the power was lost, if it was; what was sent to the old core, or comes from it, is lost.
class FaultyLink:
    def __init__(self, link, plan, seed, reset, note=lambda text: None):
        self._link = link
        self._plan = plan
        self._reset = reset
        self._note = note
        self._down, self._up = (_Way(name, plan, seed, self._noted) for name in ("down", "up"))
        self._torn = bytearray()
        self._cut_s = None      # the cable is out until then
        self._boot_id = None
        self._seen = set()      # events happen once, though a step may be sent twice
        self.clock = link.clock
        self.resetting = False
        self.speaks(OURS)

    def speaks(self, dialect):
        """The core's schema: where in a frame the number of a step stands."""
        kind = dialect.by_name["STEP"]
        sizes = {field[0]: field_size(field[1]) for field in kind.FIELDS if field[1] != "*"}
        at = _BODY + sum(sizes[name] for name in itertools.takewhile(lambda name: name != "step", sizes))
        self._step_id, self._step = kind.ID, slice(at, at + sizes["step"])
        self._link.speaks(dialect)

    def __getattr__(self, name):
        return getattr(self._link, name)

    def write(self, data):
        now_s = self.clock()
        self._happens("down", self._down.frames + 1, now_s)
        if self._plan.events:
            raw = _decoded(data)
            if raw is not None and raw[_ID] == self._step_id:
                self._happens("step", int.from_bytes(raw[self._step], "little"), now_s)
        if not self.resetting:
            self._down.send(data, now_s)
            self._deliver(now_s)
        return True

    def read(self, timeout_ms=0):
        end_s = self.clock() + timeout_ms / 1000
        while True:
            now_s = self.clock()
            self._deliver(now_s)
            came = self._through(self._up.due(now_s), now_s)
            if came:
                return b"".join(came)
            wait_s = min(end_s, self._down.next_s(), self._up.next_s()) - now_s
            data = self._link.read(max(0, int(wait_s * 1000) + 1) if end_s > now_s else 0)
            if data is None:
                self._torn.clear()
                return None
            self._take(data)
            if not data and self.clock() >= end_s:
                return b""

    def _take(self, data):
        """Frames as they come off the line; a torn one waits for its rest."""
        *whole, self._torn = (self._torn + data).split(b"\0")
        if len(self._torn) > TORN_MAX:
            whole.append(self._torn)
            self._torn = bytearray()
        now_s = self.clock()
        for part in whole:
            if part:
                self._happens("up", self._up.frames + 1, now_s)
                wire = b"\0" + part + b"\0"
                if not (self._plan.events or self._plan.power) or self._lives(wire):
                    self._up.send(wire, now_s)

    def _deliver(self, now_s):
        for wire in self._through(self._down.due(now_s), now_s):
            self._link.write(wire)

    def _through(self, wires, now_s):
        """What the cable lets through now."""
        if self._cut_s is not None and now_s < self._cut_s:
            return []
        return wires

    def _lives(self, wire):
        """Whether the core that said this is still there: one that is reset says nothing until a new one's HELLO."""
        raw = _decoded(wire)
        if raw is not None and raw[_ID] == _HELLO:
            boot_id = bytes(raw[_BOOT_ID])
            self.resetting = self.resetting and boot_id == self._boot_id
            self._boot_id = boot_id
        return not self.resetting

    def _happens(self, where, number, now_s):
        for kind, seconds in self._plan.events.get((where, number), ()):
            if (where, number, kind) in self._seen:
                continue
            self._seen.add((where, number, kind))
            self._noted(kind, where, number, seconds)
            if kind == "cut":
                self._cut_s = now_s + seconds
            elif kind in BUS_EVENTS:
                self._link.happens(kind, seconds)
            else:
                self._start_anew()

    def lose_power(self, number):
        """What the non-volatile memory says when the power was lost at that byte (sim_device/nvm.py)."""
        self._noted("power", "byte", number, None)
        self._start_anew(number)

    def missed(self):
        """Items of the plan whose step or frame never came."""
        sent = {"down": self._down.frames, "up": self._up.frames}
        items = [(kind, place) for place, events in self._plan.events.items() for kind, _ in events if (*place, kind) not in self._seen]
        items += [(kind, place) for place, faults in self._plan.frames.items() for kind, _ in faults if place[1] > sent[place[0]]]
        return ["%s@%s=%d" % (kind, *place) for kind, place in items]

    def _start_anew(self, byte=None):
        self.resetting = True
        self._down.clear()
        self._up.clear()
        self._reset(byte)

    def _noted(self, kind, where, number, detail):
        text = "%s@%s=%d" % (kind, where, number)
        self._note(text if detail is None else "%s:%d" % (text, detail) if kind == "flip" else "%s:%ss" % (text, plain(detail)))


def _decoded(wire):
    """The frame between its delimiters, COBS undone; None if it is none."""
    raw = bytearray(wire.strip(b"\0"))
    return raw if len(raw) > _BODY and cobs.decode(raw, 0, len(raw)) else None
