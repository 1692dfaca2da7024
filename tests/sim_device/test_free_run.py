# Stories of the free run: the real core by its own clock, on CPython and in the MicroPython VM, the virtual
# robot beside it. How many ticks are late is this machine's business; that they are counted, and that the
# log tells what happened, is ours.

import signal
import sys
import time
from array import array
from pathlib import Path

import pytest

from firmware_py.pipeline import Tvslam
from protocol import schema
from tests.sim_device.lockstep import Lockstep, messages, read_log

DRIFTING_CORE = Path(__file__).with_name("drifting_core.py")
ROBOT_S = 4
TICKS = 50 * ROBOT_S


@pytest.fixture
def story(tmp_path):
    with Lockstep(tmp_path) as story:
        yield story


def cpython_core(story, *arguments):
    return story._start([sys.executable, str(DRIFTING_CORE), str(story.link), *arguments])


def free_run(story, log, robot_s=ROBOT_S, timeout_s=60):
    """The end event of a free run of that long with the core that was started."""
    code, events, err = story.finish(story.sim("--realtime", "--max-robot-s", str(robot_s), "--log", str(log)), timeout_s)
    assert (code, err) == (1, "")
    end = events[-1]
    assert end["reason"] == "robot time limit" and end["wall_s"] == pytest.approx(robot_s, abs=0.5)
    return end


def replayed(log):
    """(hash at the end, messages): the log's STEPs once more, in lockstep, in this process; each answer is as it was."""
    core, told = None, messages(read_log(log)[1])
    newest, hashes = 0, {}
    values = array("i", bytes(4 * schema.VALUES_MAX))
    core = Tvslam()
    for m in told:
        if m.NAME == "PARAM_SET":
            core.set_parameter(m.parameter, m.index, m.value)
        elif m.NAME == "STEP" and m.step == newest + 1:
            if newest == 0:
                core.begin()
            newest = m.step
            flat = [m.step, m.left, m.right, *m.ir, m.ultrasonic_mm, m.bump, len(m.uwb), *(v for record in m.uwb for v in record)]
            values[:len(flat)] = array("i", flat)
            core.step(values)
            hashes[newest] = core.hash_lo
        elif m.NAME == "STEP_RSP":
            assert m.hash16 == hashes[m.step], m.step
    return (core.hash_lo, core.hash_hi), told


def expect_equal_hashes(end, log):
    of_core = end["status"]["steps_lo"], end["status"]["steps_hi"]
    of_replay, told = replayed(log)
    assert of_core == of_replay
    return told


@pytest.mark.parametrize("target", ["cpython", "unix"])
def test_the_core_runs_by_its_own_clock_and_its_log_replays(story, tmp_path, target, micropython):
    if target == "cpython":
        cpython_core(story)
    else:
        story._start([micropython, "-X", "heapsize=320k", "-m", "firmware_py", str(story.link)])
    end = free_run(story, tmp_path / "log")
    told = expect_equal_hashes(end, tmp_path / "log")
    figures, status = end["free_run"], end["status"]
    assert TICKS <= end["steps"] + figures["late_answers"] + figures["missed_ticks"] < TICKS + 10
    assert end["steps"] > TICKS / 4 and figures["clock_jumps"] == 0
    # Both read one oscillator here: what the regression sees beyond that is its own error.
    assert abs(figures["drift_ppm"]) < 3000 and figures["residual_ms"] < 5
    assert 2 <= figures["margin_ms"] <= 10
    assert status["late_ticks"] <= TICKS and status["allocated_after_boot_bytes"] == 0
    pongs = [m for m in told if m.NAME == "PONG"]
    assert len(pongs) >= TICKS / 20, "asked for during the whole mission"


@pytest.mark.parametrize("rate", [0.99, 1.01])
def test_a_core_whose_clock_drifts_is_kept_to(story, tmp_path, rate):
    cpython_core(story, "--rate", str(rate))
    code, events, _ = story.finish(story.sim("--realtime", "--max-robot-s", str(ROBOT_S), "--log", str(tmp_path / "log")))
    end = events[-1]
    figures = end["free_run"]
    assert code == 1 and figures["drift_ppm"] == pytest.approx((rate - 1) * 1e6, abs=2500)
    assert figures["residual_ms"] < 5 and figures["clock_jumps"] == 0
    expect_equal_hashes(end, tmp_path / "log")


@pytest.mark.parametrize("jump_ms", [-230, 1010])
def test_a_core_whose_clock_jumps_is_followed(story, tmp_path, jump_ms):
    """After a jump the core's grid lies elsewhere: the host finds it again, and the mission goes on."""
    cpython_core(story, "--jump-ms", str(jump_ms), "--jump-at-s", "3")
    code, events, _ = story.finish(story.sim("--realtime", "--max-robot-s", "6", "--log", str(tmp_path / "log")))
    end = events[-1]
    assert code == 1 and end["free_run"]["clock_jumps"] >= 1 and end["free_run"]["residual_ms"] < 5
    assert end["steps"] > 100
    assert end["status"]["late_ms"] >= (jump_ms - 40 if jump_ms > 0 else 0)
    expect_equal_hashes(end, tmp_path / "log")


def test_a_core_that_was_paused_is_late_and_goes_on(story, tmp_path):
    core = cpython_core(story)
    sim = story.sim("--realtime", "--max-robot-s", str(ROBOT_S), "--log", str(tmp_path / "log"))
    story.events_until(sim, "progress")
    time.sleep(1)
    core.send_signal(signal.SIGSTOP)
    time.sleep(0.3)
    core.send_signal(signal.SIGCONT)
    code, events, err = story.finish(sim)
    end = events[-1]
    figures, status = end["free_run"], end["status"]
    assert (code, err) == (1, "") and end["reason"] == "robot time limit"
    assert status["late_ticks"] >= 13 and status["late_ms"] >= 260
    assert figures["late_answers"] >= 13 and figures["late_answer_ms"] >= 250
    assert end["steps"] > TICKS / 4 and end["steps"] + figures["late_answers"] + figures["missed_ticks"] >= TICKS
    assert end["wall_s"] == pytest.approx(ROBOT_S, abs=0.5), "the robot did not wait"
    expect_equal_hashes(end, tmp_path / "log")


def test_the_robots_end_that_was_paused_catches_up(story, tmp_path):
    cpython_core(story)
    sim = story.sim("--realtime", "--max-robot-s", str(ROBOT_S), "--log", str(tmp_path / "log"))
    story.events_until(sim, "progress")
    sim.send_signal(signal.SIGSTOP)
    time.sleep(0.3)
    sim.send_signal(signal.SIGCONT)
    code, events, _ = story.finish(sim)
    end = events[-1]
    assert code == 1 and end["free_run"]["missed_ticks"] >= 13 and end["status"]["late_ticks"] >= 13
    assert end["wall_s"] == pytest.approx(ROBOT_S, abs=0.5)
    expect_equal_hashes(end, tmp_path / "log")


def test_a_core_that_falls_silent_is_named(story):
    core = cpython_core(story)
    sim = story.sim("--realtime")
    story.events_until(sim, "progress")
    core.send_signal(signal.SIGSTOP)
    code, events, err = story.finish(sim)
    assert code == 3 and "has not answered STEP" in err and "for 3 s" in err
    assert events[-1]["free_run"]["late_answers"] > 100
