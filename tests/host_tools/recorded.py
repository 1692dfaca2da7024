"""Recorded missions for the tests: a device in this process answers a stream of STEPs, and all that passes is kept.

No assertion lives here.
"""

import zlib
from functools import lru_cache

from host_tools.asked import Tick
from host_tools.recording import TELEMETRY
from protocol.log import LogWriter
from protocol.messages import BY_ID, BY_NAME
from tests.firmware_py.device_story import Story
from tests.strategies import Segment, ticks_of

MARK_EVERY = 300    # frames
STEPS, ASKED_AT = 660, 250
HEAD, CRC = 5, 4
WANDER = (Segment("wander", 400, 4), Segment("along_a_wall", 200, 5), Segment("noise", 60, 6))
STEP = BY_NAME["STEP"]


# The device's answers to a stream, as a Recording gives them. `frames` are the raw frames of both directions.
class Recorded:
    def __init__(self, parameters, segments):
        self.parameters = [triple for triple in parameters]
        self.before = [Tick(BY_NAME["PARAM_SET"](*triple), None, []) for triple in parameters]
        self.share = 1.0
        self.frames = []
        self._story = Story(joined=False)
        self._story.host._sink = lambda direction, raw: self.frames.append((direction, raw))
        self._story.join()
        for triple in parameters:
            self._story.one("PARAM_SET", *triple)
        self._ticks = [self._tick(values) for values in ticks_of(segments)]
        self.status = self._story.one("STATUS", 0)
        self.map_bytes = self._story.map()[1]

    def ticks(self):
        return iter(self._ticks)

    def _tick(self, values):
        story = self._story
        story.telemetry = []
        question = STEP.from_values(values)
        if question.step == ASKED_AT:
            story.one("STATUS", 0)  # what a core says of itself on the way is not what it says at the end
        (answer,) = story.ask("STEP", *question)
        return Tick(question, answer, [message for message in story.telemetry if message.NAME in TELEMETRY])

    def log(self, change=lambda number, direction, raw: raw):
        """The bytes of the log; change(number of the frame, direction, raw) may put another frame in the place of one."""
        writer = LogWriter()
        data = writer.head()
        for number, (direction, raw) in enumerate(self.frames):
            raw = change(number, direction, raw)
            if number % MARK_EVERY == 0:
                data += writer.marker()
            if raw is not None:
                data += writer.record(number * 100, direction, raw)
        return data + writer.marker()


@lru_cache(maxsize=1)
def wander():
    return Recorded([(0, 0, 1)], WANDER)


def changed(name, nth, cut=lambda _number, _direction, raw: raw, **fields):
    """A log in which the nth message of that name says something else, soundly framed."""
    seen = 0

    def change(number, direction, raw):
        nonlocal seen
        if cut(number, direction, raw) is None:
            return None
        if BY_ID[raw[3]].NAME != name:
            return raw
        seen += 1
        if seen != nth:
            return raw
        message = BY_ID[raw[3]].unpack(raw[HEAD:-CRC])
        body = message._replace(**{key: value(getattr(message, key)) for key, value in fields.items()}).pack()
        frame = raw[:HEAD] + body
        return frame + zlib.crc32(frame).to_bytes(4, "little")
    return wander().log(change)


def cut_behind(name, nth):
    """The log up to the nth message of that name."""
    at = [number for number, (_, raw) in enumerate(wander().frames) if BY_ID[raw[3]].NAME == name][nth - 1]
    return lambda number, _, raw: raw if number <= at else None


def sealed(name, seq, *fields):
    kind = BY_NAME[name]
    body = kind(*fields).pack()
    raw = bytes((0x29 | kind.DIRECTION << 2, seq, 0, kind.ID, len(body) + 9)) + body
    return kind.DIRECTION, raw + zlib.crc32(raw).to_bytes(4, "little")
