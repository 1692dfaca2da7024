# The host's half of the reliable layer: which questions are out, which answers came, what to repeat and when.
#
#   question = window.open(); wire = link.encode(message, question.seq); window.sent(question, wire, now_us)
#   answered = window.answered(seq, now_us)         the question, None if that answer came before
#   for question in window.due(now_us): ...         to be sent again, as they were
#
# Times are ints of microseconds, of any clock that does not go back. Host only.

from protocol.round_trip import RoundTrip

IDLE_US = 50_000
SIZE = 2    # questions out at once: the core retains so many answers


class Question:
    __slots__ = ("seq", "wire", "first_us", "last_us", "tries", "missed", "asked")

    def __init__(self, seq):
        self.seq = seq
        self.wire = b""
        self.first_us = self.last_us = 0
        self.tries = 0
        self.missed = False     # known to be lost: no need to wait
        self.asked = None       # the asker's own


# SEQ goes 1, 2, ... 255, 0, 1 in each epoch, and an answer has that of its question. ACK is
# cumulative: every answer up to it came. No question is opened before the one SIZE before it is answered, `full` says so: thus
# its own ACK, which a repeat does not renew, lets the core retain its answer.
class Window:
    def __init__(self):
        self.round_trip = RoundTrip()
        self.repeats = 0        # of questions, in all
        self.duplicates = 0     # answers that came once more
        self.restart()

    def restart(self):
        """A new epoch: nothing is out."""
        self.out = {}
        self._last = 0
        self.ack = 0
        self._twice = None      # SEQ of the newest answer whose question was repeated

    @property
    def full(self):
        return self._last - self.ack & 255 >= SIZE

    def open(self):
        self._last = self._last + 1 & 255
        question = self.out[self._last] = Question(self._last)
        return question

    def sent(self, question, wire, now_us):
        question.wire = wire
        question.first_us = question.last_us = now_us

    def answered(self, seq, now_us):
        question = self.out.pop(seq, None)
        if question is None:
            self.duplicates += 1
            if seq == self._twice:
                self._twice = None
                self.round_trip.needless()  # the core took it twice
            return None
        self.round_trip.add(now_us - question.first_us, question.tries)
        if self._twice is not None:
            self.round_trip.needed()  # on a line that keeps its order the second answer would have come before this one
        self._twice = seq if question.tries else None
        oldest = next(iter(self.out), None)
        self.ack = self._last if oldest is None else oldest - 1 & 255
        for other in self.out.values():
            if question.seq - other.seq & 255 < SIZE:
                other.missed = not other.tries  # its answer was overtaken
        return question

    def heard(self, taken):
        """A frame after the answers said that the core took the questions up to this one."""
        for question in self.out.values():
            if taken - question.seq & 255 < 128 and not question.tries:
                question.missed = True

    def lost(self, seq):
        """The core said that this question is missing: it has dropped those behind it, too."""
        for question in self.out.values():
            if question.seq - seq & 255 < SIZE:
                question.missed = True

    def due(self, now_us):
        late = [question for question in self.out.values()
                if question.missed or now_us - question.last_us >= self.round_trip.timeout_us(question.tries)]
        for question in late:
            question.missed = False
            question.last_us = now_us
            question.tries += 1
            self.repeats += 1
        return late

    def wait_us(self, now_us):
        """Until the next one is due."""
        waits = [0 if question.missed else question.last_us + self.round_trip.timeout_us(question.tries) - now_us
                 for question in self.out.values()]
        return max(0, min(waits)) if waits else IDLE_US
