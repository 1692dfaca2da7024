"""A recorded log as a mission to run again: what the core was told, what it was asked step by step, what it answered.

    recording = Recording(path)             LogUnusable: a sentence
    recording.before                        what was asked before the first step, as Ticks; parameters by today's numbers
    for tick in recording.ticks(): ...      up to the end or the first damage
    recording.damage, .status, .map_bytes, .over    known after that
"""

import os

from host_tools.asked import Asked
from host_tools.mission import MissionBuilder
from protocol import schema, states
from protocol.dialect import SchemaError
from protocol.host_link import RELIABLE
from protocol.log import LogError, LogReader
from protocol.messages import BY_ID, BY_NAME, MessageError
from protocol.parameters import PARAMETERS
from protocol.translation import of_log

CHUNK_BYTES = 1 << 16
TELEMETRY = ("POSE", "STORE", "VECTOR", "POINT")    # what does not depend on the machine
NEEDED = ("STEP", "STEP_RSP", "PARAM_SET")
AT_THE_END = ("STATUS_RSP", "MAP_INFO", "MAP_INFO_RSP", "MAP_DATA")
ENDED = (states.DONE, states.FAILED)
# Questions that leave the core as it is. Every other reliable one is part of the mission: it is asked again in its turn.
NO_PART = ("STATUS", "MAP_INFO", "MAP_READ", "PARAM_GET", "PARAM_LIST")
OF_THE_CLOCK = ("tick_ms",)      # a free run's pace: a replay does not wait for it
STEP_MASK = (1 << 30) - 1
AGAIN_MAX = 1000
NUMBERS = {row[0]: number for number, row in enumerate(PARAMETERS)}


class LogUnusable(Exception):
    """One sentence: this file cannot be replayed."""


# Reads the file once, in order. Contract: of `ticks` those with a STEP ascend by one without repeats, the others stand where
# they were asked; what the log holds after its first damage is left out, since nobody knows what it missed.
class Recording:
    def __init__(self, path):
        self.path = path
        self.before = []
        self.damage = ""
        self.read_bytes = 0
        self._step = None   # the last that was asked
        self._boot_id = None
        self._reader = LogReader()
        self._end = MissionBuilder()
        self._asked = Asked()
        self._map_asked = False
        try:
            self._file = open(path, "rb")
            self.size_bytes = os.fstat(self._file.fileno()).st_size
            self._messages = self._decoded()
            self._until_first_step()
        except OSError as error:
            raise LogUnusable("The log %s cannot be read: %s." % (path, (error.strerror or str(error)).lower())) from None
        except LogError as error:
            raise LogUnusable("The log %s cannot be replayed: %s." % (path, error)) from None
        self._built = None

    @property
    def parameters(self):
        """[(number, index, value)] of those told before the first step."""
        return [tuple(tick.question) for tick in self.before if tick.question.NAME == "PARAM_SET"]

    @property
    def status(self):
        """The STATUS_RSP behind the last step by its fields; None where the log has none."""
        return self._ended().status

    @property
    def over(self):
        """Whether the log goes to its mission's end. A core is asked for its STATUS on the way, too, for its map only then."""
        return self.status is not None and (self._map_asked or self.status["state"] in ENDED)

    @property
    def map_bytes(self):
        return self._ended().map_bytes

    @property
    def share(self):
        """How much of the file has been read, 0 to 1."""
        return self.read_bytes / self.size_bytes if self.size_bytes else 1.0

    def ticks(self):
        asked = self._asked
        for message, key in self._messages:
            name = message.NAME
            if name == "HELLO" and message.boot_id != self._boot_id:
                self.damage = "its core was started anew at step %d, and what follows is another mission" % self._step
                break
            if name == "STEP":
                ahead = message.step - self._step & STEP_MASK
                if ahead == 1:
                    self._step = message.step
                    self._end.goes_on()
                    self._map_asked = False
                    asked.question(message, key)
                elif 0 < ahead <= STEP_MASK - AGAIN_MAX:  # less is one more time what was not answered at once
                    self.damage = "it goes from step %d to step %d" % (self._step, message.step)
                    break
            elif name in AT_THE_END:
                self._map_asked = self._map_asked or name == "MAP_INFO"
                self._end.add(name, message._asdict())
            elif name in TELEMETRY:
                asked.telemetry(message)
            elif message.DIRECTION == schema.UP:
                yield from asked.answer(self._by_name(message), key)
            else:
                asked.question(self._by_name(message), key)
        yield from asked.rest()

    def _ended(self):
        if self._built is None:
            self._built = self._end.build()
        return self._built

    def _until_first_step(self):
        for message, key in self._messages:
            if message.NAME == "STEP":
                self.before += self._asked.rest()
                self._asked.question(message, key)
                self._step = message.step
                return
            if message.NAME == "HELLO":
                if self._boot_id not in (None, message.boot_id):    # what the one before was told went with it
                    self.before, self._asked = [], Asked()
                self._boot_id = message.boot_id
            elif message.DIRECTION == schema.UP:
                self.before += self._asked.answer(self._by_name(message), key)
            elif message.NAME not in NO_PART and not self._of_the_clock(message):
                self._asked.question(self._by_name(message), key)
        raise LogUnusable("The log %s holds no step of a mission%s." % (self.path, ": " + self.damage if self.damage else ""))

    def _of_the_clock(self, message):
        return message.NAME == "PARAM_SET" and PARAMETERS[self._by_name(message).parameter][0] in OF_THE_CLOCK

    def _by_name(self, message):
        """A parameter may have got another number since."""
        if message.NAME not in ("PARAM_SET", "PARAM_VALUE"):
            return message
        told = self._reader.told["parameters"]
        name = told[message.parameter][0] if message.parameter < len(told) else "number %d" % message.parameter
        if name not in NUMBERS and message.NAME == "PARAM_VALUE":
            return message      # it answers a question that is no part of the mission
        if name not in NUMBERS:
            raise LogUnusable("The log %s sets the parameter %s, which this core does not have: replay it with the version "
                              "that wrote it." % (self.path, name))
        return message._replace(parameter=NUMBERS[name])

    def _decoded(self):
        """(message, key) of what a replay needs; the key is what a reliable question and its answer have in common."""
        kinds = None
        with self._file as file:
            while self.damage == "" and (chunk := file.read(CHUNK_BYTES)):
                self.read_bytes += len(chunk)
                before = self._reader.sound
                found = self._reader.feed(chunk)
                if kinds is None and self._reader.told is not None:
                    kinds = self._kinds()
                for number, record in enumerate(found[:self._reader.sound - before], before):
                    try:
                        message = record.message(kinds)
                    except MessageError as error:
                        self.damage = "record %d is no message of its kind (%s)" % (number, error)
                        return
                    if message is not None:
                        yield message, _key(record.frame)
                if self._reader.damaged_at is not None:
                    self._damaged(file)
        if not self.damage and self._reader.told is None:
            raise LogError("it ends within its head")
        if not self.damage and self._reader.damage:
            self._damaged()

    def _damaged(self, file=None):
        """Says where, and, having read to the end, what is lost."""
        while file is not None and (chunk := file.read(CHUNK_BYTES)):
            self._reader.feed(chunk)
        self.damage = "it %s%s" % (self._reader.damage, "" if self._step is None else "; the step before it is %d" % self._step)

    def _kinds(self):
        """{id: what unpacks it} of the messages that are wanted, as this log has them."""
        reliable = {kind.NAME for kind in BY_ID.values() if kind.RELIABLE} - {*NO_PART}
        wanted = {*NEEDED, *AT_THE_END, *TELEMETRY, "HELLO", *reliable}
        try:
            translation = of_log(self._reader.told)
        except SchemaError as error:
            raise LogUnusable("The log %s has no schema in its head that can be read: %s." % (self.path, error)) from None
        if translation is None:
            return {BY_NAME[name].ID: BY_NAME[name] for name in wanted}
        flaw = translation.unread(NEEDED)
        if flaw:
            raise LogUnusable("The log %s was written with another schema: %s; replay it with the version that wrote it." % (
                self.path, flaw))
        return translation.readable(wanted)


def _key(frame):
    return (frame[0] >> 5 & 3, frame[1]) if frame[0] & RELIABLE else None
