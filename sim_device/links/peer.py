# The core as the virtual robot sees it: questions, their answers, and what comes unasked.

import time

from protocol.frame_reader import BYTES_IN, BYTES_OUT, FRAMES_IN, FRAMES_OUT
from protocol.host_link import HANDSHAKE_MAX, RELIABLE, HostLink
from protocol.host_window import Window
from protocol.messages import BY_NAME
from sim_device.links.acquaintance import Acquaintance
from sim_device.links.asked import Asked, overtaken
from sim_device.links.patience import Patience
from sim_device.links.peer_errors import Interrupted, PeerError, Restarted, is_garbage, nobody, refused, silent
from sim_device.links.telling_order import TellingOrder

RESEND_S = 0.2          # of what is not reliable, and of the free run's steps
DEAD_S = 3.0
ASK_HELLO_S = 0.5
SILENT_TRIES = 8        # repeats in vain, half a second: is it still the core that we know?

_HELLO, _IDENTIFY, _ERROR, _STORE, _ACK = (BY_NAME[name] for name in ("HELLO", "IDENTIFY", "ERROR", "STORE", "ACK"))
_STEP, _STEP_RSP = BY_NAME["STEP"], BY_NAME["STEP_RSP"]


# One core at the far end of a link (Pty, MemoryLink, either with faults). A question that has got no answer is repeated, byte for
# byte, as host_window.py says, and after 3 s of the link's time PeerError names it.
# Every frame of both directions passes to `taps` and, where given, `log`: while the core is busy with
# a question, as keeping it takes a tenth of a step; keep() hands over what is still held.
# `newest` holds the last message of every kind, by class; `stores` every STORE by name.
class Peer:
    def __init__(self, pty, taps, log=None, stop=lambda: False):
        self.newest = {}
        self.stores = {}
        self.hello = None
        self.resent = 0             # of what is not the window's
        self.reopened = 0           # epochs that a stray frame cost
        self.link = HostLink(sink=self._passes)
        self.window = Window()
        self._clock = pty.clock
        self._pty = pty
        self._taps = taps
        self._log = log
        self._acquaintance = Acquaintance(pty, taps, log)
        self._stop = stop
        self._passed = []
        self._boots = set()         # numbers of cores that are no more
        self._confirmed = False     # the core has spoken in this epoch
        self._order = TellingOrder()

    @property
    def path(self):
        return self._pty.path

    @property
    def resetting(self):
        return self._pty.resetting

    @property
    def repeats(self):
        return self.resent + self.window.repeats

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
        return {**causes, "answered_twice": self.window.duplicates, "pty_full": self._pty.dropped}

    def meet(self, wait_s):
        """Waits for the core's HELLO and answers it; the HELLO."""
        start_s = asked_s = self._clock()
        came_s = None
        self.newest.pop(_HELLO, None)
        while _HELLO not in self.newest:
            now_s = self._clock()
            self._look_up(now_s)
            there = self._receive(50)
            if there:
                came_s = came_s or now_s
            if now_s - start_s > wait_s or came_s and is_garbage(self.link.counters, now_s - came_s):
                raise PeerError(nobody(self._pty.path, self.link.counters, now_s - start_s))
            if there is not None and now_s - asked_s > ASK_HELLO_S:
                asked_s = now_s  # it was lost, or said before we came: a core that is asked says it again
                self._pty.write(self.link.encode(_IDENTIFY(0, 0)))
        return self.begin(self.newest[_HELLO])

    def begin(self, hello):
        """Joins the core that said this, or the one that has taken its place by then; its HELLO."""
        while True:
            if refusal := self.link.refusal(hello):
                raise PeerError("%s: %s" % (self._pty.path, refusal))
            if self.hello is not None and hello.boot_id != self.hello.boot_id:
                self._boots.add(self.hello.boot_id)
                self.newest.clear()     # said by a core that is no more
                self.stores.clear()
            self.hello = hello
            self._pty.resetting = False
            self._open(self.link.welcome(hello))
            try:
                self._acquaintance.make(self, hello)
                return hello
            except Restarted as again:
                hello = again.hello

    def ask(self, question, answer, fits=lambda message: True, dead_s=DEAD_S):
        """The message of class `answer` for which fits(message) holds. Refused if the core answers ERROR."""
        if question.RELIABLE:
            return self.ask_all([(question, answer, fits)], dead_s)[0]
        self.newest.pop(answer, None)
        for _ in self._tries(self.link.encode(question), dead_s):
            if (message := self.newest.get(answer)) is not None and fits(message):
                return message
        raise silent(self._pty.path, question.NAME + " with " + answer.NAME, dead_s)

    def ask_all(self, questions, dead_s=DEAD_S):
        """The answers to [(question, answer's class, fits)] in their order."""
        return list(self.each_answer(questions, dead_s))

    def each_answer(self, questions, dead_s=DEAD_S):
        """The same one by one, as they come; as many questions are out at once as the core can retain answers."""
        asked = [Asked(question.NAME, lambda seq, question=question: self.link.encode(question, seq), kind, fits)
                 for question, kind, fits in questions]
        waiting = iter(asked)
        for head in asked:
            while not self.window.full and (further := next(waiting, None)) is not None:
                self._post(further)
            self._until(head, dead_s, lambda head=head: "%s with %s" % (head.name, head.kind.NAME))
            yield head.answer

    def step(self, values, dead_s=DEAD_S):
        """One lockstep: STEP of these flat values (codec.py); its STEP_RSP."""
        step = values[0]
        asked = Asked("STEP", lambda seq: self.link.encode_step(values, seq), _STEP_RSP, lambda message: message[0] == step, step)
        self._post(asked)
        self.keep()
        self._until(asked, dead_s, lambda: "STEP %d" % step)
        return asked.answer

    def answer(self, step):
        """The free run's: that step's STEP_RSP, if it has come."""
        answer = self.newest.get(_STEP_RSP)
        if answer is not None and answer[0] == step:
            return answer
        error = self.newest.pop(_ERROR, None)
        if error is not None and error.message_id == _STEP.ID and not overtaken(error, step):
            raise refused(self._pty.path, error)
        return None

    def send(self, wire):
        self._pty.write(wire)

    def take(self, timeout_ms):
        """Waits for what comes, for whoever keeps its own time; True if anything did."""
        came = self._receive(timeout_ms)
        self._look_up(self._clock())
        return bool(came)

    def _post(self, asked):
        question = self.window.open()
        question.asked = asked
        wire = asked.make(question.seq)
        self.window.sent(question, wire, int(self._clock() * 1e6))
        self._pty.write(wire)

    def _until(self, asked, dead_s, what):
        """Waits for that answer; repeats what is due."""
        window, clock = self.window, self._clock
        now_s = clock()
        patience = Patience(self._pty, dead_s, now_s)
        while asked.answer is None:
            self._receive(min(window.wait_us(int(now_s * 1e6)) // 1000 + 1, 20))
            if asked.answer is not None:
                break
            now_s = clock()
            if patience.over(now_s):
                raise silent(self._pty.path, what(), dead_s)
            for question in window.due(int(now_s * 1e6)):
                self._repeat(question)
            self._look_up(now_s)
        if type(asked.answer) is _ERROR:
            raise refused(self._pty.path, asked.answer)

    def _repeat(self, question):
        if not self._confirmed:
            self._pty.write(self.link.invitation())  # our WELCOME may be what was lost
        elif question.tries % SILENT_TRIES == 0:
            self._pty.write(self.link.encode(_IDENTIFY(0, 0)))
        self._pty.write(question.wire)

    def _tries(self, wire, dead_s):
        """Sends the frame, then yields whenever something came, repeating the frame, until the time is over."""
        write, clock = self._pty.write, self._clock
        write(wire)
        sent_s = clock()
        patience = Patience(self._pty, dead_s, sent_s)
        while True:
            if self._receive(20):
                yield
            now_s = clock()
            if patience.over(now_s):
                return
            if now_s - sent_s > RESEND_S:
                sent_s = now_s
                self.resent += 1
                write(wire)
            self._look_up(now_s)

    def _look_up(self, now_s):
        self.keep()
        self._taps.service(time.monotonic())
        if self._stop():
            raise Interrupted

    def _receive(self, timeout_ms):
        """Takes in what comes; True if anything did, None if nobody is there."""
        data = self._pty.read(timeout_ms)
        if not data:
            if data is None:
                if self.hello is not None and not self._pty.resetting:
                    raise PeerError("the core has closed %s while it was in use: start both again" % self._pty.path)
                self.link.reader.reset()
                time.sleep(timeout_ms / 1000)
                return None
            self._pty.flush()
            return False
        for message, ctl, seq, ack in self.link.take(data):
            if ctl & RELIABLE:
                self._answered(message, seq)
            elif message.ID > HANDSHAKE_MAX:
                self._heard(message, seq, ack)
            else:
                self.newest[type(message)] = message
                if type(message) is _HELLO and self.hello is not None:
                    self._greeted_again(message)
        return True

    def _answered(self, message, seq):
        self._confirmed = True
        question = self.window.answered(seq, int(self._clock() * 1e6))
        if question is None:
            return
        self.link.ack = self.window.ack
        if question.asked.takes(message):
            question.asked.answer = self.newest[type(message)] = message
        else:
            # A frame of 256 questions ago, delayed until its number was due again: in another epoch it is none.
            self.reopened += 1
            self._open(self.link.reopen(), (question, *self.window.out.values()))

    def _heard(self, message, seq, ack):
        """What was not asked reliably: the newest of each kind wins."""
        kind = type(message)
        self._confirmed = True
        self.window.heard(ack)
        if not self._order.takes(kind, seq):
            return
        self.newest[kind] = message
        if kind is _STORE:
            self.stores[message.name] = message
        elif kind is _ACK:
            self.window.lost(message.missing)

    def _greeted_again(self, hello):
        if hello.boot_id in self._boots:
            return  # it was long under way
        if hello.boot_id != self.hello.boot_id:
            raise Restarted(hello)
        taken = hello.capabilities & 3
        if taken == 0:
            self._pty.write(self.link.invitation())  # our WELCOME was lost
        elif taken != self.link.epoch:
            self._open(self.link.reopen(taken), tuple(self.window.out.values()))

    def _open(self, invitation, again=()):
        """A new epoch, and in it these questions once more."""
        self.window.restart()
        self._confirmed = False
        self._order.restart()
        self._pty.write(invitation)
        for question in sorted(again, key=lambda question: question.first_us):
            self._post(question.asked)

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
