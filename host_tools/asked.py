"""A log's questions, each joined with its answer, in the order in which the core took them."""

import collections
from typing import NamedTuple


# One question as it was: mostly a STEP. Its answer (None where the log has none), and what was told after a STEP's answer.
class Tick(NamedTuple):
    question: object
    answer: object
    telemetry: list


# question(), answer() and telemetry() take what the log holds, in its order. A Tick comes out when a later STEP is answered, as
# telemetry belongs to the answer before it, or of rest(). A reliable question and its answer have a key in common; a STEP_RSP
# says its step.
class Asked:
    def __init__(self):
        self._open = collections.deque()    # [question, key]
        self._done = []                     # Ticks that wait for the next STEP's answer
        self._step = None                   # of them the one with a STEP

    def question(self, message, key):
        for entry in self._open:
            if entry[0] == message:
                entry[1] = key      # asked once more, in another epoch
                return
        self._open.append([message, key])

    def answer(self, message, key):
        """The Ticks that are complete now. What answers nothing that is open came twice."""
        place = self._place(message, key)
        if place is None:
            return []
        ticks = []
        if message.NAME == "STEP_RSP":
            ticks, self._done = self._done, []
        for _ in range(place):
            self._done.append(Tick(self._open.popleft()[0], None, []))
        tick = Tick(self._open.popleft()[0], message, [])
        if message.NAME == "STEP_RSP":
            self._step = tick
        self._done.append(tick)
        return ticks

    def telemetry(self, message):
        if self._step is not None:
            self._step.telemetry.append(message)

    def rest(self):
        ticks = [*self._done, *(Tick(question, None, []) for question, _ in self._open)]
        self._done, self._step = [], None
        self._open.clear()
        return ticks

    def _place(self, message, key):
        for place, (question, asked_by) in enumerate(self._open):
            if message.NAME == "STEP_RSP":
                if question.NAME == "STEP" and question.step == message.step:
                    return place
            elif question.NAME != "STEP" and (asked_by == key if key else fits(question, message)):
                return place
        return None


def fits(question, message):
    """Of questions that were not asked reliably only PARAM_SET is part of a mission."""
    return question.NAME == "PARAM_SET" and message.NAME == "PARAM_VALUE" and question[:2] == message[:2]
