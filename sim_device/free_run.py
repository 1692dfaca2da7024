# The free run: the core keeps its own 50 Hz, and the robot's end keeps to the core's clock.
#
#   host    --T-----------------------T------------------------T--      T: the robot moved, sensed, STEP goes out
#               \ STEP     STEP_RSP /     \
#   core    -----[=== step ===]----------- [=== ...                     [: the core's tick, a margin behind T
#
# From T to T is a tick of the robot. What the answer to a STEP says holds from the next T on.

import time

from protocol.messages import BY_NAME
from sim_device.core_clock import CoreClock
from sim_device.links.patience import Patience
from sim_device.links.peer import DEAD_S, RESEND_S
from sim_device.links.peer_errors import silent

TICK_MS = 20
TICK_S = TICK_MS / 1000
JOIN_PINGS = 16
JOIN_APART_S = 0.0073       # neither is a divisor of a millisecond: the pairs lie all over the core's
PING_APART_S = 0.000137
PING_TICKS = 5
PING_BYTES = 32             # on the wire, there and back
MARGIN_MIN_S = 0.002
MARGIN_MAX_S = TICK_S / 2   # beyond it the core would take a STEP for the tick before
LAG_FADES = 0.98            # a tick: after a second a third is left
TOKENS = 65536

_PING, _PONG = BY_NAME["PING"], BY_NAME["PONG"]
_BUMP = 12                  # in the values of STEP


# What was late counts on from the run `before` this one, with a core that is no more.
# join() first, then step(values) once a tick, at once after the robot has sensed: it sends STEP and
# returns at the next T, as Peer.step does but for the speeds, which are those of the tick that has
# passed. Where the answer is not there at T, the robot is driven on here with the speeds that it had; it stands while the core is reset.
class FreeRun:
    def __init__(self, peer, robot, idle=lambda: None, before=None):
        self.clock = CoreClock()
        self.late_answers = before.late_answers if before else 0            # ticks at whose end there was no answer
        self.late_answer_ms = before.late_answer_ms if before else 0.0      # the latest of them
        self.missed_ticks = before.missed_ticks if before else 0    # the same, but the host itself had slept until after the next
        self._peer = peer
        self._robot = robot
        self._idle = idle           # called once a tick, when the core has answered: it is idle until the next
        self._speeds = (0, 0)
        self._bump = 0
        self._at_s = None           # T of this tick
        self._lag_s = 0.0           # from T to the STEP's leaving
        self._longest = PING_BYTES  # of the STEPs so far
        self._ping_s, self._token = None, 0
        self._ticks = 0

    def join(self):
        """The first pairs of the two clocks."""
        for token in range(JOIN_PINGS):
            sent_s = time.monotonic()
            answer = self._peer.ask(_PING(token), _PONG, lambda pong, token=token: pong.token == token)
            self.clock.add(sent_s, time.monotonic(), answer.t_ms)
            time.sleep(JOIN_APART_S)
        self._token = JOIN_PINGS

    def step(self, values):
        if self._at_s is None:
            self._at_s = self._next_s(time.monotonic())
            self._until(self._at_s)
        values[_BUMP] |= self._bump  # a touch in a tick that had no STEP of its own
        self._bump = 0
        wire = self._peer.link.encode_step(values)
        self._peer.send(wire)
        self._longest = max(self._longest, len(wire))
        self._lag_s = max(self._lag_s * LAG_FADES, min(time.monotonic() - self._at_s, MARGIN_MAX_S))
        answer = self._answer(values[0], wire)
        before, self._speeds = self._speeds, answer[1:3]
        return answer[0], *before, *answer[3:]

    def figures(self):
        """For the end event."""
        clock = self.clock
        if clock.residual_ms is None:
            return None
        return {
            "late_answers": self.late_answers, "late_answer_ms": round(self.late_answer_ms, 1), "missed_ticks": self.missed_ticks,
            "drift_ppm": round(clock.drift_ppm, 1), "residual_ms": round(clock.residual_ms, 3), "clock_jumps": clock.jumps,
            "round_trip_ms": round(clock.round_trip_s * 1000, 2), "margin_ms": round(self._margin_s * 1000, 2),
        }

    @property
    def _margin_s(self):
        """How long before the core's tick a STEP leaves: time for its bytes at the rate of a PING and its PONG, and for our own work."""
        way_s = self.clock.round_trip_s * self._longest / PING_BYTES
        return min(max(way_s + self._lag_s + 0.001, MARGIN_MIN_S), MARGIN_MAX_S)

    def _next_s(self, at_s):
        """T of the next tick: a margin before that tick of the core which is nearest to one after `at_s`."""
        margin_s = self._margin_s
        ticks = round(self.clock.core_ms(at_s + margin_s) / TICK_MS) + 1
        return self.clock.host_s(ticks * TICK_MS) - margin_s

    def _answer(self, step, wire):
        """The answer, at the first T at which it is there. Gives up as Peer.step does."""
        peer, sent_s, due_s = self._peer, time.monotonic(), None
        patience = Patience(peer, DEAD_S, sent_s)
        while True:
            self._at_s = self._next_s(self._at_s)
            due_s = due_s or self._at_s
            came_s = self._until(self._at_s, step)
            answer = peer.answer(step)
            if answer is not None:
                if came_s > due_s:
                    self.late_answer_ms = max(self.late_answer_ms, (came_s - due_s) * 1000)
                return answer
            now_s = time.monotonic()
            if peer.resetting:
                self._speeds = (0, 0)
            if patience.over(now_s):
                raise silent(peer.path, "STEP %d" % step, DEAD_S)
            if now_s - sent_s > RESEND_S:
                sent_s = now_s
                peer.resent += 1
                peer.send(wire)
            if now_s > self._at_s + TICK_S:
                self.missed_ticks += 1
            else:
                self.late_answers += 1
            self._drive_on()

    def _drive_on(self):
        self._robot.drive(*self._speeds)
        self._bump |= self._robot.body.bump

    def _until(self, at_s, step=None):
        """Takes in what comes until then; when the answer to `step` came. A PING goes out behind it: the core is idle then."""
        came_s = None
        while True:
            left_s = at_s - time.monotonic()
            if self._peer.take(max(int(left_s * 1000), 0)):
                now_s = time.monotonic()
                self._take_pong(now_s)
                if came_s is None and step is not None and self._peer.answer(step) is not None:
                    came_s = now_s
                    self._ping()
                    self._idle()
            if left_s <= 0:
                return came_s
            if left_s < 0.001:
                time.sleep(left_s)

    def _ping(self):
        self._ticks += 1
        if self._ticks % PING_TICKS == 0:
            time.sleep(self._ticks * PING_APART_S % 0.001)
            self._token = (self._token + 1) % TOKENS
            self._ping_s = time.monotonic()
            self._peer.send(self._peer.link.encode(_PING(self._token)))

    def _take_pong(self, now_s):
        pong = self._peer.newest.pop(_PONG, None)
        if pong is not None and pong.token == self._token and self._ping_s is not None:
            self.clock.add(self._ping_s, now_s, pong.t_ms)
            self._ping_s = None
