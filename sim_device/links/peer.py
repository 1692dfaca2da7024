# The core as the virtual robot sees it: a question, its answer, and what comes unasked.

import time

from protocol import parameters, schema
from protocol.frame_reader import BYTES_IN, BYTES_OUT, FRAMES_IN, FRAMES_OUT
from protocol.host_link import HostLink
from protocol.messages import BY_ID, BY_NAME

RESEND_S = 0.2
DEAD_S = 3.0
GARBAGE_BYTES = 512
GARBAGE_S = 3.0
ASK_HELLO_S = 1.0

_HELLO, _IDENTIFY, _ERROR, _STORE = (BY_NAME[name] for name in ("HELLO", "IDENTIFY", "ERROR", "STORE"))
_STEP, _STEP_RSP = BY_NAME["STEP"], BY_NAME["STEP_RSP"]
_PARAMETER_NAMES = [row[0] for row in parameters.PARAMETERS]


class PeerError(Exception):
    """One sentence: what was waited for, and what came instead."""


class Refused(PeerError):
    """The core answered ERROR; `code` is its number."""

    def __init__(self, sentence, code):
        super().__init__(sentence)
        self.code = code


class Interrupted(Exception):
    """The caller's stop() became true while we waited."""


# One core at the far end of a Pty. Questions go out one at a time; an unanswered
# one is repeated, byte for byte, every 200 ms, and after 3 s PeerError names it.
# Every frame of both directions passes to `taps` and, where given, `log`: while the core is busy with
# a question, as keeping what passed takes a tenth of a step; keep() hands over what is still held.
# `newest` holds the last message of every kind, by class; `stores` every STORE by name.
class Peer:
    def __init__(self, pty, taps, log=None, stop=lambda: False):
        self.newest = {}
        self.stores = {}
        self.hello = None
        self.resent = 0
        self.link = HostLink(sink=self._passes)
        self._pty = pty
        self._taps = taps
        self._log = log
        self._stop = stop
        self._passed = []

    @property
    def frames(self):
        return self.link.counters[FRAMES_IN] + self.link.counters[FRAMES_OUT]

    @property
    def bytes(self):
        return self.link.counters[BYTES_IN] + self.link.counters[BYTES_OUT]

    @property
    def dropped_by_cause(self):
        """Frames that came and were not used, by cause, and those that the core would not take from the pty."""
        causes = {name: count for name, count in self.link.counts().items() if name.startswith("bad_") or name in ("overrun", "stale")}
        return {**causes, "pty_full": self._pty.dropped}

    def meet(self, wait_s):
        """Waits for the core's HELLO and answers it; the HELLO."""
        start_s = asked_s = time.monotonic()
        came_s = None
        while _HELLO not in self.newest:
            now_s = time.monotonic()
            self._look_up(now_s)
            if self._receive(50):
                came_s = came_s or now_s
            if now_s - start_s > wait_s or came_s and self._is_garbage(now_s - came_s):
                raise PeerError(self._nobody(now_s - start_s))
            if came_s and now_s - asked_s > ASK_HELLO_S:
                asked_s = now_s  # something came, but no HELLO: a core that was welcomed before says it when asked
                self._pty.write(self.link.encode(_IDENTIFY(0, 0)))
        hello = self.newest[_HELLO]
        refusal = self.link.refusal(hello)
        if refusal is not None:
            raise PeerError("%s: %s" % (self._pty.path, refusal))
        self._pty.write(self.link.welcome(hello))
        self.hello = hello
        return hello

    def ask(self, question, answer, fits=lambda message: True, dead_s=DEAD_S):
        """The first message of class `answer` for which fits(message) holds. Refused if the core answers ERROR."""
        newest = self.newest
        newest.pop(answer, None)
        newest.pop(_ERROR, None)
        for _ in self._tries(self.link.encode(question), dead_s):
            message = newest.pop(answer, None)
            if message is not None and fits(message):
                return message
            self._check_error(question.ID)
        raise PeerError("the core on %s has not answered %s with %s for %g s" % (
            self._pty.path, question.NAME, answer.NAME, dead_s))

    def step(self, values, dead_s=DEAD_S):
        """One lockstep: STEP of these flat values (codec.py); its STEP_RSP."""
        for _ in self._tries(self.link.encode_step(values), dead_s):
            answer = self.answer(values[0])
            if answer is not None:
                return answer
        raise self.silent(values[0], dead_s)

    def answer(self, step):
        """That step's STEP_RSP, if it has come."""
        answer = self.newest.get(_STEP_RSP)
        if answer is not None and answer[0] == step:
            return answer
        if _ERROR in self.newest:
            self._check_error(_STEP.ID)
        return None

    def silent(self, step, dead_s):
        return PeerError("the core on %s has not answered STEP %d for %g s" % (self._pty.path, step, dead_s))

    def send(self, wire):
        self._pty.write(wire)

    def take(self, timeout_ms):
        """Waits for what comes, for whoever keeps its own time; True if anything did."""
        came = self._receive(timeout_ms)
        self._look_up(time.monotonic())
        return came

    def _tries(self, wire, dead_s):
        """Sends the frame, then yields whenever something came, repeating the frame, until the time is over."""
        write, receive, clock = self._pty.write, self._receive, time.monotonic
        write(wire)
        start_s = sent_s = clock()
        self.keep()
        while True:
            if receive(20):
                yield
            now_s = clock()
            if now_s - start_s > dead_s:
                return
            if now_s - sent_s > RESEND_S:
                sent_s = now_s
                self.resent += 1
                write(wire)
            self._look_up(now_s)

    def _look_up(self, now_s):
        self.keep()
        self._taps.service(now_s)
        if self._stop():
            raise Interrupted

    def _receive(self, timeout_ms):
        """Takes in what comes; True if anything did."""
        data = self._pty.read(timeout_ms)
        if not data:
            if data is None:
                if self.hello is not None:
                    raise PeerError("the core has closed %s while it was in use: start both again" % self._pty.path)
                self.link.reader.reset()
                time.sleep(timeout_ms / 1000)
            self._pty.flush()
            return False
        newest = self.newest
        for message in self.link.feed(data):
            kind = type(message)
            newest[kind] = message
            if kind is _STORE:
                self.stores[message.name] = message
            elif kind is _HELLO and self.hello is not None:
                self._greeted_again(message)
        return True

    def _greeted_again(self, hello):
        if hello.boot_id != self.hello.boot_id:
            raise PeerError("the core on %s has started anew in the middle of the mission" % self._pty.path)
        self._pty.write(self.link.welcome(hello))  # our WELCOME was lost

    def _passes(self, direction, raw):
        self._passed.append((time.monotonic_ns(), direction, raw))

    def keep(self):
        """Tap and log get the frames that passed until now."""
        passed, self._passed = self._passed, []
        tap, log = self._taps.frame, self._log
        for now_ns, direction, raw in passed:
            tap(raw)
            if log is not None:
                log.frame(now_ns, direction, raw)

    def _check_error(self, asked):
        error = self.newest.pop(_ERROR, None)
        if error is None or error.message_id != asked:
            return
        why = {
            schema.ERROR_UNKNOWN_ID: "it does not know this message",
            schema.ERROR_STEP_ORDER: "it expects step %d" % error.detail,
            schema.ERROR_RANGE: "a value is out of range",
            schema.ERROR_STALE: "its map is of generation %d now" % error.detail,
            schema.ERROR_NOT_READY: "it is not ready for that",
        }.get(error.code, "error %d" % error.code)
        if error.code == schema.ERROR_NOT_READY and asked == _STEP.ID and 0 <= error.detail < len(_PARAMETER_NAMES):
            why = "it needs parameter %s first" % _PARAMETER_NAMES[error.detail]
        raise Refused("the core on %s refused %s: %s" % (self._pty.path, BY_ID[asked].NAME, why), error.code)

    def _is_garbage(self, since_s):
        counters = self.link.counters
        return since_s > GARBAGE_S and counters[BYTES_IN] > GARBAGE_BYTES and counters[FRAMES_IN] == 0

    def _nobody(self, waited_s):
        counters, path, waited_s = self.link.counters, self._pty.path, round(waited_s, 1)
        if counters[FRAMES_IN]:
            return "frames arrive on %s, but no HELLO within %g s: is another program than the core at its far end?" % (path, waited_s)
        if counters[BYTES_IN]:
            return "bytes arrive on %s (%d of them), but no frame of this protocol within %g s: something else than the core is there" % (
                path, counters[BYTES_IN], waited_s)
        return "nobody answered on %s within %g s: start the core on it" % (path, waited_s)
