# What `flash` put on a board serves missions: the core from .mpy files on the board's own flash, over its REPL's port.

import json
import os
import pty
import subprocess
import time
import tty

import pytest

from host_tools import cli
from host_tools.core_process import CoreError
from host_tools.core_session import CoreSession
from host_tools.terminal_port import TerminalPort
from protocol.messages import BY_NAME
from tests.board.unix_board import UnixBoard
from tests.host_tools.test_hil_mission import SMALL, finish, hil

END = b"\r\x03\x02\x04"     # firmware_py/ports/machine.py


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    return str(path)


def mission(project, small, target, tmp_path, *words, code=0):
    path = tmp_path / "result.json"
    ended, _, err = finish(hil(project, small, "--target", target, "--json", str(path), *words))
    assert ended == code, err
    return json.loads(path.read_text())


def test_missions_one_after_the_other_on_a_board_that_was_flashed(project, small, micropython, tmp_path, capsys):
    with UnixBoard(micropython, tmp_path) as board:
        assert cli.main(["flash", "--target", "mpremote:" + board.device]) == 0, capsys.readouterr().err
        results = [mission(project, small, "port:" + board.device, tmp_path) for _ in range(2)]
        assert board.starts == 4
        log = str(tmp_path / "m.tvlog")
        expected = mission(project, small, "cpython", tmp_path, "--log", log)["hash"]
        assert cli.main(["replay", log, "--target", "port:" + board.device]) == 0, capsys.readouterr().err
        assert cli.main(["bisect", log, "--targets", "cpython,port:" + board.device]) == 0, capsys.readouterr().err
        assert board.starts == 6
        own_clock = mission(project, small, "port:" + board.device, tmp_path, "--realtime", "--max-robot-s", "2", code=1)
    assert own_clock["time"]["robot_s"] >= 1.9 and own_clock["memory"]["heap_locked"], own_clock["reason"]
    for result in results:
        assert result["hash"] == expected
        assert result["memory"]["heap_locked"] and result["memory"]["allocated_after_boot_bytes"] == 0


def test_the_repl_is_back_when_the_core_was_told_to_stop(project, micropython, tmp_path, capsys):
    with UnixBoard(micropython, tmp_path) as board:
        assert cli.main(["flash", "--target", "mpremote:" + board.device]) == 0, capsys.readouterr().err
        with TerminalPort(board.device) as port:
            CoreSession(port).handshake()
            port.write(b"\r\x03\x03")   # as a person's terminal sends it, who presses Return and Ctrl-C, impatiently
            time.sleep(0.2)
            port.write(b"print(6 * 7)\r")
            limit, said = time.monotonic() + 10, b""
            while b"\n42" not in said and time.monotonic() < limit:
                said += port.read(0.1)
            assert b"\n42" in said
            assert b"Error" not in said.replace(b"KeyboardInterrupt", b"")


# The link on a line of its own, as on a UART: whatever stream main() is given.
@pytest.fixture
def line(micropython, project):
    master, slave = pty.openpty()
    tty.setraw(slave)
    code = "from firmware_py.main_board import main\nmain(open(%r, 'r+b'))" % os.ttyname(slave)
    core = subprocess.Popen([micropython, "-X", "heapsize=320k", "-c", code], cwd=project, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    yield master, core
    core.kill()
    core.communicate()
    os.close(master)
    os.close(slave)


class Master(TerminalPort):
    def __init__(self, fd):
        os.set_blocking(fd, False)
        self._adopt(fd, "the line")


def test_a_line_of_its_own_is_served_and_ends_only_on_all_four_bytes_between_two_frames(line):
    master, core = line
    port = Master(master)
    session = CoreSession(port)
    assert session.handshake().heap_bytes > 150000
    ping = BY_NAME["PING"](1)
    for no_end in (END[:2], END[:3] + b"\x05", b"x" + END, END[1:]):
        port.write(b"\0" + no_end + b"\0")
        session.ask(ping, "PONG")     # it still answers
    port.write(b"\0" + END)
    core.wait(10)       # soft_reset() ends the Unix port; main() alone would have come back to -c with code 0, too
    with pytest.raises(CoreError):
        session.ask(ping, "PONG", patience_s=0.3)

