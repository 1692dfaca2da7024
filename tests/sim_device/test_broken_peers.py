# The core as a process of its own on a real pty, and what may happen to a process: stopped, killed, started too early, a line that is
# held open by nobody. No deadlock, and the sentence names who is to blame.

import contextlib
import os
import pty
import signal
import sys
import time
import tty

import pytest

from sim_device.links.peer import DEAD_S
from tests.sim_device.lockstep import Lockstep

GRACE_S = 2.0   # for a busy machine, beyond the three seconds


@pytest.fixture
def story(tmp_path):
    with Lockstep(tmp_path) as story:
        yield story


def real_core(story, path=None):
    return story._start([sys.executable, "-m", "firmware_py", str(path or story.link)])


def driving(story, sim):
    events = story.events_until(sim, "progress")
    while events[-1]["step"] < 5:
        events += story.events_until(sim, "progress")


def expect_named(story, sim, since_s, *words):
    code, events, err = story.finish(sim)
    assert code == 3 and time.monotonic() - since_s < DEAD_S + GRACE_S, err
    assert all(word in events[-1]["sentence"] for word in words) and err == "sim_device: %s\n" % events[-1]["sentence"]


def test_a_core_that_is_stopped_in_mid_mission_is_named_in_three_seconds(story):
    sim, core = story.sim(), real_core(story)
    driving(story, sim)
    os.kill(core.pid, signal.SIGSTOP)
    expect_named(story, sim, time.monotonic(), "the core on %s has not answered STEP" % story.link, "for 3 s")


def test_a_core_that_is_stopped_for_a_second_is_waited_for(story):
    sim, core = story.sim("--max-robot-s", "40"), real_core(story)
    driving(story, sim)
    os.kill(core.pid, signal.SIGSTOP)
    time.sleep(1)
    os.kill(core.pid, signal.SIGCONT)
    code, events, err = story.finish(sim)
    assert (code, err) == (1, "") and events[-1]["steps"] == 2000 and events[-1]["reason"] == "robot time limit"


def test_a_core_that_is_killed_is_named(story):
    sim, core = story.sim(), real_core(story)
    driving(story, sim)
    core.kill()
    core.wait()
    expect_named(story, sim, time.monotonic(), str(story.link), "start both again")


def test_a_pty_that_nobody_reads_and_its_echo_are_no_core(story):
    # Somebody has opened the far end, with the echo that a new terminal has, and does nothing: our own words come back.
    sim = story.sim("--wait", "3")
    story.events_until(sim, "ready")
    fd = os.open(story.link, os.O_RDWR | os.O_NOCTTY)
    try:
        expect_named(story, sim, time.monotonic(), "on %s" % story.link, "start the core on it")
    finally:
        os.close(fd)


def test_garbage_and_half_a_frame_before_the_core_comes_cost_nothing(story):
    sim = story.sim("--max-robot-s", "1")
    story.events_until(sim, "ready")
    fd = os.open(story.link, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(fd)
    os.write(fd, os.urandom(300) + b"\0\x03\x21\x01\x04")
    real_core(story)
    code, events, err = story.finish(sim)
    os.close(fd)
    assert (code, err) == (1, "") and events[-1]["steps"] == 50


def passed_on(source, other):
    """What came from `source` goes to both: it hears itself. OSError once it has gone."""
    try:
        data = os.read(source, 4096)
    except BlockingIOError:
        return
    os.write(source, data)
    os.write(other, data)


def test_an_echo_on_the_line_changes_nothing(story):
    # Between both a line that gives each end back what it said, as a two-wire one does.
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    sim = story.sim("--max-robot-s", "2")
    story.events_until(sim, "ready")
    robot = os.open(story.link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    tty.setraw(robot)
    real_core(story, os.ttyname(slave))
    try:
        while sim.poll() is None:
            with contextlib.suppress(OSError):
                passed_on(robot, master)
                passed_on(master, robot)
            time.sleep(0.0005)
    finally:
        for fd in (master, slave, robot):
            os.close(fd)
    code, events, err = story.finish(sim)
    assert (code, err) == (1, "") and events[-1]["steps"] == 100 and events[-1]["dropped"]["bad_header"] > 50


def test_core_and_robot_may_come_in_either_order(story):
    core = real_core(story)
    time.sleep(0.5)
    assert core.poll() is None and not os.path.lexists(story.link)
    code, events, err = story.finish(story.sim("--max-robot-s", "1"))
    assert (code, err) == (1, "") and events[-1]["steps"] == 50
