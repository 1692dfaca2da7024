# The free run's pace in time that only the test lets pass: a core that answers when the test says, a host that
# stumbles when the test says. What is driven, when, and by whose word must follow from that alone.

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.messages import BY_NAME
from sim_device import free_run
from sim_device.free_run import MARGIN_MAX_S, TICK_MS, TICK_S, FreeRun
from sim_device.links.peer_errors import PeerError

WAY_S = 0.0004
UNPINGED_MS = 300
STEP_RSP, PONG = BY_NAME["STEP_RSP"], BY_NAME["PONG"]


# Time, the link and the core in one. The answer to step n is (n, n, n, ...) and leaves delays_s[n] after the tick.
class Staged:
    def __init__(self, delays_s, stalls_s=(), drift=0.0):
        self.now_s, self.drift = 100.0, drift
        self.delays_s, self.stalls_s = delays_s, dict(stalls_s)
        self.newest, self.resent, self.coming = {}, 0, []
        self.sent_s, self.came_s = {}, {}
        self.resets = ()        # numbers of the steps at which the core was reset
        self.link = SimpleNamespace(encode_step=lambda values: ("STEP", values[0]), encode=lambda ping: ("PING", ping.token))

    def monotonic(self):
        return self.now_s

    def sleep(self, seconds):
        self.now_s += seconds

    def core_ms(self, host_s):
        return (host_s - 99.0) * 1000 * (1 + self.drift)

    def host_s(self, core_ms):
        return 99.0 + core_ms / 1000 / (1 + self.drift)

    def ask(self, ping, _answer, fits):
        self.now_s += 2 * WAY_S
        pong = PONG(ping.token, int(self.core_ms(self.now_s - WAY_S)))
        assert fits(pong)
        return pong

    def send(self, wire):
        kind, number = wire
        there_s = self.now_s + WAY_S
        if kind == "PING":
            self.coming.append((there_s + WAY_S, PONG, PONG(number, int(self.core_ms(there_s)))))
        elif number not in self.sent_s:
            self.sent_s[number] = self.now_s
            tick = round(self.core_ms(there_s) / TICK_MS + 0.49)
            back_s = self.host_s(tick * TICK_MS) + self.delays_s[number - 1] + WAY_S
            self.came_s[number] = back_s
            self.coming.append((back_s, STEP_RSP, (number, number, number, 4, 0, 0)))

    def take(self, timeout_ms):
        end_s = self.now_s + timeout_ms / 1000
        first_s = min((item[0] for item in self.coming), default=end_s)
        self.now_s = max(self.now_s, min(first_s, end_s))
        came = [item for item in self.coming if item[0] <= self.now_s]
        for item in came:
            self.coming.remove(item)
            self.newest[item[1]] = item[2]
        return bool(came)

    def answer(self, step):
        answer = self.newest.get(STEP_RSP)
        return answer if answer is not None and answer[0] == step else None

    path = "the stage"

    @property
    def resetting(self):
        number = max(self.sent_s)
        return number in self.resets and self.now_s < self.came_s[number] - WAY_S


# Notes when it was driven and how fast; touches something now and then.
class Robot:
    def __init__(self, staged):
        self.staged, self.driven, self.body = staged, [], SimpleNamespace(bump=0)

    def drive(self, left_mm_s, right_mm_s):
        assert left_mm_s == right_mm_s
        self.driven.append((self.staged.now_s, left_mm_s))
        self.body.bump = 4 if len(self.driven) % 7 == 0 else 0


def staged_run(monkeypatch, delays_s, stalls_s=(), drift=0.0, resets=()):
    """(staged, robot, free, [values of each STEP]): the session's loop, as long as there are delays."""
    staged = Staged(delays_s, stalls_s, drift)
    staged.resets = resets
    monkeypatch.setattr(free_run, "time", staged)
    robot, told = Robot(staged), []
    free = FreeRun(staged, robot)
    free.join()
    for number in range(1, len(delays_s) + 1):
        staged.now_s += staged.stalls_s.get(number, 0.0)
        values = [number] + [0] * 11 + [robot.body.bump]
        _, left_mm_s, right_mm_s, _, _, _ = free.step(values)
        told.append(values)
        robot.drive(left_mm_s, right_mm_s)
    return staged, robot, free, told


@given(delays_s=st.lists(st.floats(0.0005, 0.003) | st.floats(0.0005, 0.15), min_size=5, max_size=60), drift=st.floats(-0.01, 0.01))
def test_each_tick_is_driven_by_the_newest_answer_that_was_there_when_it_began(delays_s, drift):
    with pytest.MonkeyPatch.context() as patch:
        staged, robot, free, _ = staged_run(patch, delays_s, drift=drift)
    tick_s = TICK_S / (1 + drift)
    begin_s = staged.sent_s[1]
    for number, (end_s, speed) in enumerate(robot.driven):
        assert end_s == pytest.approx(begin_s + (number + 1) * tick_s, abs=MARGIN_MAX_S), "nothing adds up"
        at_s = end_s - tick_s
        newest = max((step for step, came_s in staged.came_s.items() if came_s < at_s - 0.002), default=0)
        allowed = max((step for step, came_s in staged.came_s.items() if came_s < at_s + 0.002), default=0)
        assert newest <= speed <= allowed
    assert len(robot.driven) == len(delays_s) + free.late_answers and free.missed_ticks == 0
    for step, sent_s in staged.sent_s.items():
        beyond_ms = staged.core_ms(sent_s) % TICK_MS
        # Milliseconds are all that PONG tells, and the first pairs span a tenth of a second: the drift is not known better at first,
        # and waiting for late answers no PING goes out.
        unknown_ms = 1 + abs(drift) * UNPINGED_MS
        assert TICK_MS / 2 - unknown_ms <= beyond_ms or beyond_ms < unknown_ms, "a margin before the core's tick, hardly ever behind it"
        if step > 1:
            assert sent_s > staged.came_s[step - 1], "one outstanding"


@given(stalls_s=st.dictionaries(st.integers(5, 35), st.floats(0.02, 0.4), max_size=4))
def test_a_host_that_stumbles_drives_on_for_the_time_that_passed(stalls_s):
    with pytest.MonkeyPatch.context() as patch:
        staged, robot, free, _ = staged_run(patch, [0.001] * 40, stalls_s)
    passed = (staged.now_s - staged.sent_s[1]) / TICK_S
    assert len(robot.driven) == pytest.approx(passed, abs=1)
    assert len(robot.driven) == 40 + free.late_answers + free.missed_ticks
    stalled = sum(stalls_s.values()) / TICK_S
    assert stalled - 3 * len(stalls_s) <= free.missed_ticks <= stalled, "the host's own, not the core's"


def test_a_touch_in_a_tick_without_a_step_is_told_with_the_next_one(monkeypatch):
    _, robot, free, told = staged_run(monkeypatch, [0.001] * 5 + [0.030] + [0.001] * 3)
    assert free.late_answers == 1
    assert [values[0] for values in told if values[12]] == [7] and len(robot.driven) == 10


def test_the_margin_follows_the_way_and_the_worst_answer_is_kept(monkeypatch):
    _, _, free, _ = staged_run(monkeypatch, [0.001] * 20 + [0.075] + [0.001] * 3)
    figures = free.figures()
    assert figures["late_answers"] == 3 and 50 < figures["late_answer_ms"] < 75
    assert figures["margin_ms"] == pytest.approx(2, abs=0.5) and figures["round_trip_ms"] == pytest.approx(0.8, abs=0.01)
    assert abs(figures["drift_ppm"]) < 3000 and figures["residual_ms"] < 0.5


def test_silence_ends_it(monkeypatch):
    with pytest.raises(PeerError, match="STEP 3 for 3 s"):
        staged_run(monkeypatch, [0.001, 0.001, 60.0])


def test_while_the_core_is_reset_the_robot_stands_and_waits_longer(monkeypatch):
    _, robot, free, _ = staged_run(monkeypatch, [0.001] * 5 + [9.0] + [0.001] * 3, resets=(6,))
    speeds = [speed for _, speed in robot.driven]
    assert 440 < free.late_answers < 460 and speeds[:5] == [0, 1, 2, 3, 4]
    assert set(speeds[5:5 + free.late_answers]) == {0} and speeds[-2:] == [7, 8]
    with pytest.raises(PeerError, match="STEP 3 for 3 s"):
        staged_run(monkeypatch, [0.001, 0.001, 60.0], resets=(3,))
