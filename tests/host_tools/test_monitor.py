"""`host_tools monitor` as a user starts it: in a process of its own, on a real pty."""

import os
import subprocess
import sys
import time
import tty

import pytest

from host_tools import cli
from protocol import states
from tests.host_tools.tap_story import Story


class Tap:
    """The virtual robot's side of a tap: a pty behind a name."""

    def __init__(self, path):
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.symlink(os.ttyname(self.slave), path)

    def close(self):
        if self.master >= 0:
            os.close(self.slave)
            os.close(self.master)
            self.master = -1


@pytest.fixture
def tap(tmp_path):
    made = []

    def make():
        made.append(Tap(tmp_path / "tap"))
        return made[-1]
    yield make
    for each in made:
        each.close()


@pytest.fixture
def monitor(tmp_path, project):
    started = []

    def start(*words):
        started.append(subprocess.Popen(
            [sys.executable, "-m", "host_tools", "monitor", str(tmp_path / "tap"), *words], cwd=project,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return started[-1]
    yield start
    for process in started:
        process.kill()
        process.communicate()


def first_line(stream):
    return stream.readline().strip()


def test_started_first_it_waits_and_follows_to_the_end(monitor, tap):
    process = monitor("--plain")
    assert first_line(process.stderr).startswith("Waiting for ")
    robot, story = tap(), Story()
    assert first_line(process.stdout).startswith("Watching ")
    os.write(robot.master, story.hello())
    for step in range(0, story.last_step + 1, 50):
        os.write(robot.master, story.frames(step))
        time.sleep(0.01)
    os.write(robot.master, story.frames(story.last_step) + story.telemetry(story.last_step))
    time.sleep(0.2)
    robot.close()
    out, err = process.communicate(timeout=20)
    assert (process.returncode, err) == (0, "")
    lines = out.splitlines()
    assert any(line.split()[2:3] == ["DONE"] for line in lines)
    assert any(line.split()[:1] == ["vectors"] and "4/768" in line for line in lines)
    assert lines[-1].startswith("The mission ended: DONE after 46.7 s of robot time")


def test_all_that_it_writes_is_identify(monitor, tap):
    from protocol.frame_reader import BOTH
    from protocol.host_link import HostLink
    robot = tap()
    process = monitor("--plain", "--seconds", "2.5")
    assert process.wait(20) == 0
    said = HostLink(listen=BOTH, any_epoch=True).feed(os.read(robot.master, 4096))
    assert len(said) >= 2 and {message.NAME for message in said} == {"IDENTIFY"}


def test_a_failed_mission_exits_1(monitor, tap):
    robot, story = tap(), Story(end_state=states.FAILED)
    process = monitor("--plain")
    assert first_line(process.stdout).startswith("Watching ")
    os.write(robot.master, story.frames(story.last_step))
    _, err = process.communicate(timeout=20)
    assert process.returncode == 1 and err.startswith("The mission ended: FAILED")


def test_closed_while_in_use_exits_3(monitor, tap):
    robot = tap()
    process = monitor("--plain")
    assert first_line(process.stdout).startswith("Watching ")
    os.write(robot.master, Story().frames(50))
    time.sleep(0.3)
    robot.close()
    _, err = process.communicate(timeout=20)
    assert process.returncode == 3
    assert "was closed by its other end while in use. Last: FOLLOW" in err and err.count("\n") == 1


def test_a_silent_tap_exits_3(monitor, tap):
    tap()
    process = monitor("--plain", "--wait", "1")
    _, err = process.communicate(timeout=20)
    assert process.returncode == 3 and "nothing was heard in 1 s: is the core running" in err


def test_a_stream_of_garbage_exits_3(monitor, tap):
    robot = tap()
    process = monitor("--plain")
    assert first_line(process.stdout).startswith("Watching ")
    for _ in range(50):
        os.write(robot.master, b"this is some other program's log\r\n")
        time.sleep(0.08)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 3 and "no frames of this protocol" in err


def test_a_port_that_never_comes(tmp_path, capsys):
    assert cli.main(["monitor", str(tmp_path / "tap"), "--plain", "--wait", "0.3"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("Waiting for ") and "does not exist after 0.3 s: start `sim_device" in lines[1]


@pytest.mark.parametrize("make, sentence", [
    (lambda path: path.write_text("not a terminal"), "is not a terminal"),
    (lambda path: path.mkdir(), "cannot be opened: is a directory"),
])
def test_a_port_that_is_none(tmp_path, capsys, make, sentence):
    make(tmp_path / "tap")
    assert cli.main(["monitor", str(tmp_path / "tap"), "--plain"]) == 2
    err = capsys.readouterr().err
    assert sentence in err and err.count("\n") == 1


@pytest.mark.parametrize("word", ["0", "-1", "nan", "ten"])
def test_a_rate_that_is_none(word, capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(["monitor", "x", "--rate", word])
    assert left.value.code == 2 and "--rate" in capsys.readouterr().err
