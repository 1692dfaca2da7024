"""No orphan, ever: not after Ctrl-C, not after a crash, not after kill -9 of the parent."""

import os
import signal
import subprocess
import sys
import time

import pytest

from host_tools.processes import Children, signals_as_interrupt

SLEEPER = [sys.executable, "-c", "print('up', flush=True); import time; time.sleep(600)"]
STUBBORN = [sys.executable, "-c", "import signal, time\nfor s in (2, 15): signal.signal(s, signal.SIG_IGN)\n"
            "print('up', flush=True)\ntime.sleep(600)"]


def alive(pid):
    """A zombie is dead: whoever adopted it has not looked yet."""
    try:
        with open("/proc/%d/stat" % pid) as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_until(condition, seconds=10):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited %g s in vain" % seconds
        time.sleep(0.02)


def started(children, argv):
    child = children.start("child", argv)
    wait_until(lambda: "up" in child.text())
    return child


def test_a_child_ends_with_its_block():
    with Children() as children:
        child = started(children, SLEEPER)
    assert child.popen.returncode == -signal.SIGINT or child.popen.returncode == 1


def test_a_child_that_heeds_no_request_is_killed():
    with Children() as children:
        child = started(children, STUBBORN)
        begin = time.monotonic()
        assert child.stop(patience_s=0.2) == -signal.SIGKILL
        assert time.monotonic() - begin < 5


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt])
def test_children_end_when_the_block_fails(failure):
    child = None
    with pytest.raises(failure):
        with Children() as children:
            child = started(children, SLEEPER)
            raise failure
    assert not alive(child.popen.pid)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the kernel's help is Linux's")
def test_children_die_with_a_parent_that_is_killed():
    story = ("from host_tools.processes import Children\nimport sys, time\n"
             "child = Children().start('child', %r)\nprint(child.popen.pid, flush=True)\ntime.sleep(600)" % (STUBBORN,))
    parent = subprocess.Popen([sys.executable, "-c", story], stdout=subprocess.PIPE, text=True, cwd=os.getcwd())
    child = int(parent.stdout.readline())
    assert alive(child)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_until(lambda: not alive(child))


def test_the_last_words_of_a_child_are_kept():
    with Children() as children:
        child = children.start("child", [sys.executable, "-c", "import sys; print('to say'); sys.exit('why')"])
        assert child.wait(10) == 1
        assert sorted(child.text().splitlines()) == ["to say", "why"]


def test_a_flood_of_output_is_bounded_and_blocks_nobody():
    with Children() as children:
        child = children.start("child", [sys.executable, "-c", "for i in range(100000): print('line', i)"])
        assert child.wait(30) == 0
        lines = child.text().splitlines()
        assert len(lines) == 200 and lines[-1] == "line 99999"


def test_a_request_to_terminate_is_an_interrupt():
    with pytest.raises(KeyboardInterrupt):
        with signals_as_interrupt():
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5)
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
