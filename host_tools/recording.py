"""A recorded log as a mission to run again: what the core was told, what it was asked step by step, what it answered.

    recording = Recording(path)             LogUnusable: a sentence
    recording.parameters                    [(number, index, value)] in the order of the log, by today's numbers
    recording.before                        what else was asked before the first step, as Ticks
    for tick in recording.ticks(): ...      up to the end or the first damage
    recording.damage, .status, .map_bytes   known after that
"""

import collections
import os
from typing import NamedTuple

from host_tools.mission import MissionBuilder
from protocol import schema
from protocol.log import LogError, LogReader
from protocol.messages import BY_ID, BY_NAME, MessageError
from protocol.parameters import PARAMETERS

CHUNK_BYTES = 1 << 16
HEADER_BYTES = 5  # CTL SEQ ACK ID LEN
CRC_BYTES = 4
TELEMETRY = ("POSE", "STORE", "VECTOR", "POINT")    # what does not depend on the machine
NEEDED = ("STEP", "STEP_RSP", "PARAM_SET")
# Reliable questions that change nothing in the core, and the parameters, which are told in a list of their own before
# the first step; every other one is part of the mission, is asked again in its turn, and its answer compared.
NO_PART = ("STATUS", "MAP_INFO", "MAP_READ", "PARAM_GET", "PARAM_LIST")
AT_THE_END = ("STATUS_RSP", "MAP_INFO_RSP", "MAP_DATA")
OF_THE_CLOCK = ("tick_ms",)      # a free run's pace: a replay does not wait for it
STEP_MASK = (1 << 30) - 1
AGAIN_MAX = 1000
NUMBERS = {row[0]: number for number, row in enumerate(PARAMETERS)}


class LogUnusable(Exception):
    """One sentence: this file cannot be replayed."""


# One question as it was: mostly a STEP, its answer (None where the log ends before it), the telemetry that followed it.
class Tick(NamedTuple):
    question: object
    answer: object
    telemetry: list


# Reads the file once, in order. Contract: `ticks` ascend by one without repeats; what the log holds
# after its first damage is left out, since nobody knows what it missed.
class Recording:
    def __init__(self, path):
        self.path = path
        self.parameters = []
        self.damage = ""
        self.read_bytes = 0
        self._boot_id = None
        self._reader = LogReader()
        self._end = MissionBuilder()
        try:
            self._file = open(path, "rb")
            self.size_bytes = os.fstat(self._file.fileno()).st_size
            self._messages = self._decoded()
            self._first = self._until_first_step()
        except OSError as error:
            raise LogUnusable("The log %s cannot be read: %s." % (path, (error.strerror or str(error)).lower())) from None
        except LogError as error:
            raise LogUnusable("The log %s cannot be replayed: %s." % (path, error)) from None
        self._built = None

    @property
    def status(self):
        """The STATUS_RSP at the mission's end by its fields; None where the log has none."""
        return self._ended().status

    @property
    def map_bytes(self):
        return self._ended().map_bytes

    @property
    def share(self):
        """How much of the file has been read, 0 to 1."""
        return self.read_bytes / self.size_bytes if self.size_bytes else 1.0

    def ticks(self):
        asked, pending, tick = self._first.step, collections.deque([self._first]), None
        for message in self._messages:
            name = message.NAME
            if name == "HELLO" and message.boot_id != self._boot_id:
                self.damage = "its core was started anew at step %d, and what follows is another mission" % asked
                break
            if name == "STEP":
                ahead = message.step - asked & STEP_MASK
                if ahead == 1:
                    asked = message.step
                    pending.append(message)
                elif 0 < ahead <= STEP_MASK - AGAIN_MAX:  # less is one more time what was not answered at once
                    self.damage = "it goes from step %d to step %d" % (asked, message.step)
                    break
            elif name == "STEP_RSP":
                if any(question.step == message.step for question in pending):
                    if tick is not None:
                        yield tick
                    while pending[0].step != message.step:
                        yield Tick(pending.popleft(), None, [])
                    tick = Tick(pending.popleft(), message, [])
            elif name in AT_THE_END:
                self._end.add(name, message._asdict())
            elif tick is not None and name in TELEMETRY:
                tick.telemetry.append(message)
        if tick is not None:
            yield tick
        for question in pending:
            yield Tick(question, None, [])

    def _ended(self):
        if self._built is None:
            self._built = self._end.build()
        return self._built

    def _until_first_step(self):
        for message in self._messages:
            if message.NAME == "STEP":
                return message
            if message.NAME == "HELLO":
                self._boot_id = message.boot_id
            if message.NAME == "PARAM_SET":
                name = self._name(message.parameter)
                if name not in OF_THE_CLOCK:
                    self.parameters.append((NUMBERS[name], message.index, message.value))
        raise LogUnusable("The log %s holds no step of a mission%s." % (self.path, ": " + self.damage if self.damage else ""))

    def _name(self, number):
        """A parameter may have got another number since."""
        told = self._reader.told["parameters"]
        name = told[number][0] if number < len(told) else "number %d" % number
        if name not in NUMBERS:
            raise LogUnusable("The log %s sets the parameter %s, which this core does not have: replay it with the version "
                              "that wrote it." % (self.path, name))
        return name

    def _decoded(self):
        kinds = None
        with self._file as file:
            while self.damage == "" and (chunk := file.read(CHUNK_BYTES)):
                self.read_bytes += len(chunk)
                before = self._reader.sound
                found = self._reader.feed(chunk)
                if kinds is None and self._reader.told is not None:
                    kinds = self._kinds()
                for number, record in enumerate(found[:self._reader.sound - before], before):
                    kind = kinds.get(record.frame[3]) if len(record.frame) >= HEADER_BYTES + CRC_BYTES else None
                    if kind is not None:
                        try:
                            yield kind.unpack(record.frame[HEADER_BYTES:-CRC_BYTES])
                        except MessageError as error:
                            self.damage = "record %d is no message of its kind (%s)" % (number, error)
                            return
                if self._reader.damaged_at is not None:
                    self.damage = "it is damaged from byte %d on" % self._reader.damaged_at
        if not self.damage and self._reader.told is None:
            raise LogError("it ends within its head")
        if not self.damage and self._reader.left_over:
            self.damage = "it breaks off at byte %d, in the middle of a record" % (self.read_bytes - self._reader.left_over)

    def _kinds(self):
        """{id: class} of the messages that this log has in the layout of today."""
        told = [_body_of(row) for row in self._reader.told["messages"]]
        same = [row[0] for row in schema.MESSAGES if _body_of(_listed(row)) in told]
        other = [name for name in NEEDED if BY_NAME[name].ID not in same]
        if other:
            raise LogUnusable("The log %s was written with another %s message: replay it with the version that wrote it." % (
                self.path, other[0]))
        wanted = {BY_NAME[name].ID for name in NEEDED + AT_THE_END + TELEMETRY + ("HELLO",)}
        return {number: BY_ID[number] for number in wanted.intersection(same)}


def _body_of(row):
    """Whether a message is repeated changes nothing in it."""
    return row[:3] + row[4:]


def _listed(part):
    return [_listed(item) for item in part] if isinstance(part, tuple) else part
