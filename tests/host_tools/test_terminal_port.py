"""A terminal is left as it was found, and a name that leads to somebody else's is not taken."""

import os
import signal
import termios
import threading
import tty

import pytest

from host_tools import cli
from host_tools.terminal_port import PortError, TerminalPort

HOUR_S = 3600


@pytest.fixture
def terminal():
    """(master, slave, the slave's name) of somebody's terminal, cooked as terminals are."""
    master, slave = os.openpty()
    yield master, slave, os.ttyname(slave)
    os.close(slave)
    os.close(master)


def link(path, target, age_s=0):
    path.symlink_to(target)
    born = os.stat(target).st_ctime - age_s
    os.utime(path, (born, born), follow_symlinks=False)
    return str(path)


def test_a_port_is_left_as_it_was(terminal):
    _, slave, name = terminal
    before = termios.tcgetattr(slave)
    with pytest.raises(KeyboardInterrupt), TerminalPort(name):
        assert termios.tcgetattr(slave) != before
        raise KeyboardInterrupt
    assert termios.tcgetattr(slave) == before


def test_a_monitor_that_is_ended_leaves_it_as_it_was(terminal, capsys):
    _, slave, name = terminal
    found, before = termios.tcgetattr(slave), signal.signal(signal.SIGTERM, lambda *_: None)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGTERM))
    timer.start()
    try:
        assert cli.main(["monitor", name, "--plain", "--seconds", "5"]) == 0
    finally:
        timer.cancel()
        signal.signal(signal.SIGTERM, before)
    assert "Stopped.\n" in capsys.readouterr().err and termios.tcgetattr(slave) == found


def test_a_name_that_a_killed_robot_left_is_waited_for_and_never_opened(terminal, tmp_path):
    _, slave, name = terminal
    before = termios.tcgetattr(slave)
    left = link(tmp_path / "tap", name, HOUR_S)
    with pytest.raises(PortError, match="tap is a name that an earlier robot has left .*: start `sim_device"):
        TerminalPort.wait(left, 0)
    said = []
    with pytest.raises(PortError):
        TerminalPort.wait(link(tmp_path / "mine", left), 0.01, said.append)   # by a name of one's own, too
    assert said[0].startswith("Waiting for ") and termios.tcgetattr(slave) == before


def test_a_name_as_old_as_its_terminal_is_taken_however_long_that_is_used(terminal, tmp_path):
    master, slave, name = terminal
    tty.setraw(slave)
    now_s = os.stat(name).st_ctime
    tap = link(tmp_path / "tap", name, HOUR_S)
    mine = link(tmp_path / "mine", tap, 24 * HOUR_S)    # made once for the tap of every day
    for path in (name, tap, mine):
        os.utime(name, (now_s - HOUR_S, now_s))     # born an hour ago; written to, and given another mode, since
        with TerminalPort.wait(path, 0) as port:
            os.write(master, b"x")
            assert port.read(1) == b"x"
