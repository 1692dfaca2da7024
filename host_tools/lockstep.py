"""A fresh core led through a recorded mission: told its parameters, asked step by step, its telemetry kept.

Contract: every failure is a CoreError; nothing waits longer than DEAD_S. `send` and `answer` are
two calls, so that several cores can work on the same step at once.
"""

import time

from host_tools.core_process import CoreError
from host_tools.core_session import DEAD_S, REPEAT_S, CoreSession
from host_tools.recording import TELEMETRY
from protocol import schema
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

    def tell(self, parameters):
        for number, index, value in parameters:
            if PARAMETERS[number][0] == "tick_ms":
                continue  # a free run is replayed without its pauses: its steps are the same
            answer = self._need(BY_NAME["PARAM_SET"](number, index, value), "PARAM_VALUE",
                                lambda got, place=(number, index): (got.parameter, got.index) == place)
            if answer.status == schema.PARAM_LOCKED:
                raise CoreError("%s has begun a mission already, and did not start anew when told to: press its reset button, or run its "
                                "command once more." % self.name)
            if answer.status != schema.PARAM_OK:
                raise CoreError("%s does not take the log's parameter %s.%d = %d (status %d): replay the log with the version that "
                                "wrote it." % (self.name, PARAMETERS[number][0], index, value, answer.status))

    def send(self, question):
        self._wire = self.link.encode(question)
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
        messages = super()._read()
        for message in messages:
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
        info = self._need(BY_NAME["MAP_INFO"](0), "MAP_INFO_RSP")
        data = b""
        while len(data) < info.size:
            at = len(data)
            data += self._need(BY_NAME["MAP_READ"](info.generation, at), "MAP_DATA",
                               lambda got, at=at: got.offset == at and len(got.data) > 0).data
        return data

    def _need(self, request, answer, fits=lambda message: True):
        message = self.ask(request, answer, fits)
        if message is None:
            raise CoreError("%s answers %s with an ERROR." % (self.name, request.NAME))
        return message
