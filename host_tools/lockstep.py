"""A fresh core led through a recorded mission: told its parameters, asked step by step, its telemetry kept.

Contract: every failure is a CoreError; nothing waits longer than DEAD_S. `send` and `answer` are
two calls, so that several cores can work on the same step at once.
"""

import time

from host_tools.core_process import CoreError
from host_tools.core_session import DEAD_S, REPEAT_S, CoreSession
from host_tools.recording import TELEMETRY
from protocol import schema
from protocol.dialect import SchemaError
from protocol.host_link import RELIABLE
from protocol.messages import BY_NAME
from protocol.parameters import PARAMETERS

STORE_SECTION = 2  # of IDENTIFY


class LockstepCore(CoreSession):
    def __init__(self, name, port):
        super().__init__(port)
        self.name = name
        self.heard = []         # telemetry since the last answer
        self._heard_before = []  # between the last answer and the one before
        self._answered = None
        self._wire = b""
        self._seq = 0           # of the last reliable question
        self._wanted = None     # SEQ of the answer that is waited for, and that answer
        self._found = None

    def tell(self, question):
        """PARAM_SET before the mission."""
        number, index, value = question
        there = self._number(PARAMETERS[number][0], index, value)
        if there is None:
            return
        answer = self.ask_reliably(question._replace(parameter=there))
        status = getattr(answer, "status", None)
        if status == schema.PARAM_LOCKED:
            raise CoreError("%s has begun a mission already, and did not start anew when told to: press its reset button, or run its "
                            "command once more." % self.name)
        if status != schema.PARAM_OK:
            raise CoreError("%s does not take the log's parameter %s.%d = %d (status %s): replay the log with the version that "
                            "wrote it." % (self.name, PARAMETERS[number][0], index, value, status))

    def _number(self, name, index, value):
        """The core's own number of this parameter; None where it has not got it, and need not be told."""
        try:
            return self.link.parameter(name, index, value)
        except SchemaError as error:
            raise CoreError("%s cannot be told: %s." % (self.name, error)) from None

    def ask_reliably(self, question):
        """The answer, which may be ERROR: the question is taken once, however often it has to be repeated."""
        self._seq = self._seq + 1 & 255
        self._wanted, wire = self._seq, self.encode(question, self._seq)
        end = time.monotonic() + DEAD_S
        while time.monotonic() < end:
            self._write(wire)
            again = time.monotonic() + REPEAT_S
            while time.monotonic() < again:
                self._read()
                if self._found is not None:
                    self.link.ack = self._seq
                    answer, self._found = self._found, None
                    return answer
        raise CoreError("%s has not answered %s for %g s." % (self.name, question.NAME, DEAD_S))

    def send(self, question):
        self._wire = self.encode(question)
        self._write(self._wire)

    def answer(self, question):
        """(STEP_RSP, the telemetry that followed the answer before)"""
        try:
            return self._await(question)
        except CoreError as error:
            raise CoreError("At step %d on %s: %s" % (question.step, self.name, error)) from None

    def _await(self, question):
        start = sent = time.monotonic()
        while True:
            for message in self._read():
                if message.NAME == "STEP_RSP" and message.step == question.step:
                    return message, self._heard_before
                if message.NAME == "ERROR" and message.message_id == question.ID:
                    raise CoreError("the core refuses it (error %d, detail %d); is it one that has just been started?" % (
                        message.code, message.detail))
            now = time.monotonic()
            if now - start > DEAD_S:
                raise CoreError("the core has not answered for %g s." % DEAD_S)
            if now - sent > REPEAT_S:
                sent = now
                self._write(self._wire)

    def _read(self):
        messages = []
        for message, ctl, seq, _ in self._take():
            if ctl & RELIABLE:
                if seq == self._wanted:
                    self._wanted, self._found = None, message
                continue
            messages.append(message)
            if message.NAME in TELEMETRY:
                self.heard.append(message)
            elif message.NAME == "STEP_RSP" and message.step != self._answered:
                self._answered = message.step
                self._heard_before, self.heard = self.heard, []
        return messages

    def status(self):
        return self._need(BY_NAME["STATUS"](0), "STATUS_RSP")

    def stores(self):
        """Each store's STORE record, in order."""
        return [self._need(BY_NAME["IDENTIFY"](STORE_SECTION, index), "STORE", lambda got, want=index: got.index == want)
                for index in range(self.hello.stores)]

    def map_bytes(self):
        """Empty where it has none: it is about to build it."""
        info = self.ask(BY_NAME["MAP_INFO"](0), "MAP_INFO_RSP")
        data = b""
        while info is not None and len(data) < info.size:
            at = len(data)
            data += self._need(BY_NAME["MAP_READ"](info.generation, at), "MAP_DATA",
                               lambda got, at=at: got.offset == at and len(got.data) > 0).data
        return data

    def _need(self, request, answer, fits=lambda message: True):
        message = self.ask(request, answer, fits)
        if message is None:
            raise CoreError("%s answers %s with an ERROR." % (self.name, request.NAME))
        return message
