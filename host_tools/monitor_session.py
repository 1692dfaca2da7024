"""From a port to the monitor's state, and to the one sentence with which a watch ends.

Contract: `pump()` reads what has come and never blocks; it raises WatchEnded when
the watch is over. `clock` and `port` come from the caller, so that a test needs
neither time nor a terminal. IDENTIFY is all that is ever written.
"""

import time

from host_tools.monitor_rows import number, summary
from host_tools.monitor_state import MonitorState
from host_tools.terminal_port import PortClosed
from protocol.dialect import SchemaError
from protocol.frame_reader import BOTH
from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from protocol.schema_pull import SchemaPull, hash_of

SILENCE_S = 10.0        # lockstep gives up after 3 s without an answer: 10 s of nothing is an end
GARBAGE_S = 3.0         # so long may a cut frame and line noise at the start last
GARBAGE_BYTES = 512     # some frames' worth
ASK_EVERY_S = 1.0

EXIT_OK = 0
EXIT_PEER = 3


class WatchEnded(Exception):
    """The sentence to show and the code to leave with."""

    def __init__(self, sentence, code):
        super().__init__(sentence)
        self.sentence = sentence
        self.code = code


class MonitorSession:
    def __init__(self, port, first_frame_s=60.0, clock=time.monotonic):
        self.port = port
        self.state = MonitorState()
        self.link = HostLink(listen=BOTH, any_epoch=True)
        self.closed_after_end = False
        self._clock = clock
        self._first_frame_s = first_frame_s
        self._opened = self._heard = self._good = clock()
        self._asked = self._question = None
        self._pull = None       # of a schema that is not known here
        self._pull_s = 0.0

    def pump(self):
        """Take in all that waits; True when anything came."""
        if self.closed_after_end:
            return False
        now = self._clock()
        try:
            came = self._read_all(now)
            self._ask(now)
        except PortClosed as closed:
            self._on_closed(closed)
            return False
        self._check_core(now)
        self._check_silence(now)
        return came

    def waiting_for(self):
        """What has not come yet, for the status line; "" when all is well."""
        if not self.state.messages:
            return "%s is open, nothing heard from the core yet" % self.port.path
        quiet_s = self.quiet_s()
        return "nothing heard for %.0f s" % quiet_s if quiet_s > 2 and not self.state.ended else ""

    def quiet_s(self):
        """How long ago anything came."""
        return self._clock() - self._heard

    def _read_all(self, now):
        came = False
        for _ in range(64):     # at most 64 reads, then the screen has its turn again
            data = self.port.read()
            if not data:
                break
            came = True
            self._heard = now
            for message in self.link.feed(data):
                self._good = now
                self.state.apply(message)
                if message.NAME == "HELLO":
                    self._meet(message, now)
                elif message.NAME == "IDENTITY" and self._pull is not None and self._pull.fits(message):
                    self._learn(message)
        return came

    def _ask(self, now):
        """A viewer that came late has missed HELLO: ask until it is known. So with a schema, piece by piece."""
        if self.state.hello is not None and self._pull is None:
            return
        question = BY_NAME["IDENTIFY"](section=0, offset=0) if self._pull is None else self._pull.question()
        if question != self._question or now - self._asked >= ASK_EVERY_S:
            self._asked, self._question = now, question
            self.port.write(self.link.encode(question))

    def _meet(self, hello, now):
        if self.link.meet(hello):
            self._pull = None
            self._speak()
        elif self._pull is None or self._pull.hash != hash_of(hello):
            self._pull, self._pull_s = SchemaPull(hello), now

    def _learn(self, identity):
        try:
            self._pull.take(identity)
            if self._pull.whole:
                self.link.adopt(self._pull.dialect())
                self._pull = None
                self._speak()
        except SchemaError as error:
            raise WatchEnded("On %s %s." % (self.port.path, error), EXIT_PEER) from None

    def _speak(self):
        """The names of states and parameters are the core's own."""
        spoken = self.link.names, tuple(row[0] for row in self.link.dialect.parameters)
        if (self.state.names, self.state.parameter_names) != spoken:
            self.state.forget_mission()  # it was heard in another schema
            self.state.names, self.state.parameter_names = spoken

    def _check_core(self, now):
        refusal = self.state.hello and self.link.refusal(self.state.hello)
        if not refusal and self._pull is not None and now - self._pull_s > SILENCE_S:
            refusal = "the core's schema is %08x, this host's %08x, and nobody there tells it: update the older of the two" % (
                self._pull.hash, self.link.dialect.hash)
        if refusal:
            raise WatchEnded("On %s %s." % (self.port.path, refusal), EXIT_PEER)

    def _check_silence(self, now):
        if not self.state.messages:
            taken = self.link.counts()["bytes_in"]
            if taken > GARBAGE_BYTES and now - self._opened > GARBAGE_S:
                raise WatchEnded(
                    "%s sends bytes that are no frames of this protocol (%s bytes, not one good frame): is it the tap of "
                    "sim_device?" % (self.port.path, number(taken)), EXIT_PEER)
            if now - self._opened > self._first_frame_s:
                raise WatchEnded(
                    "%s is open, but nothing was heard in %g s: is the core running on the robot link?" % (
                        self.port.path, self._first_frame_s), EXIT_PEER)
        elif now - self._good > SILENCE_S and not self.state.ended:
            what = "has sent only garbage" if self._heard > self._good else "has said nothing"
            raise WatchEnded("The peer on %s %s for %g s; last: %s." % (
                self.port.path, what, SILENCE_S, summary(self.state)), EXIT_PEER)

    def _on_closed(self, closed):
        if not self.state.ended:
            raise WatchEnded("%s Last: %s." % (closed, summary(self.state)), EXIT_PEER) from None
        self.closed_after_end = True    # a screen stays open so that the map can be looked at


def end_of_mission(state):
    """The sentence and code of a mission that came to its end, whichever it was."""
    done = state.state_name == "DONE"
    return WatchEnded("The mission ended: %s." % summary(state), EXIT_OK if done else 1)
