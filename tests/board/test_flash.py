# `host_tools flash --target mpremote:DEVICE` against the real MicroPython VM with a real littlefs behind a pty, and what
# can go wrong: each with one sentence, and mended by repeating the command.

import contextlib
import os
import pty
import signal
import subprocess
import sys
import threading
import time

import pytest

from host_tools import board, cli
from host_tools.board import BoardError
from host_tools.board_files import compiled, sources
from host_tools.board_flash import MAIN, MARK, START, install
from tests.board.unix_board import UnixBoard

FILES = 6 | 3 << 8      # .mpy version 6.3; the machine code's kind from bit 10 on
A_FILE = "/lib/firmware_py/pipeline.mpy"
NOT_NEEDED = "/lib/firmware_py/ports/pins.mpy"  # spoilt, it does not bring the VM down


@pytest.fixture
def flash(capsys):
    def run(board, *words):
        device = board if isinstance(board, str) else board.device
        code = cli.main(["flash", "--target", "mpremote:" + device, *words])
        out, err = capsys.readouterr()
        assert err.count("\n") == (1 if code else 0) and "Traceback" not in out + err
        return code, out, err
    return run


@pytest.fixture
def unix_board(micropython, tmp_path):
    with UnixBoard(micropython, tmp_path) as unix:
        yield unix


def test_it_copies_verifies_starts_and_then_finds_everything_there(flash, unix_board):
    code, out, _ = flash(unix_board)
    assert code == 0 and "copied  " + A_FILE in out and "core    runs" in out and "port:" + unix_board.device in out
    assert unix_board.starts == 2
    code, out, _ = flash(unix_board)    # the core, which runs now, makes way
    assert code == 0 and "0 copied, %d were there, 0 stale" % (len(sources()) + 1) in out and "copied  /" not in out


def test_what_is_on_the_board_is_what_was_compiled(flash, unix_board):
    assert flash(unix_board, "--no-start")[0] == 0
    said = unix_board.while_off((
        "import binascii\nfor d in ('protocol', 'firmware_py/storage'):\n for f in os.listdir('/lib/' + d):\n"
        "  if f.endswith('.mpy'): print('/lib/%s/%s' % (d, f), binascii.hexlify(open('/lib/%s/%s' % (d, f), 'rb').read()).decode())\n"
        "print('main.py' in os.listdir('/'))"))
    *lines, main = said.splitlines()
    there = {path: bytes.fromhex(text) for path, text in (line.split() for line in lines)}
    wanted = compiled(FILES | 2 << 10)
    assert there == {path: c for path, c in wanted.items() if path.startswith("/lib/protocol/") or "/storage/" in path}
    assert main == "False"


def test_a_spoilt_a_lost_a_stale_and_a_shadowing_file_are_put_right(flash, unix_board):
    assert flash(unix_board)[0] == 0
    unix_board.while_off((
        "c = bytearray(open(%r, 'rb').read())\nc[700] ^= 1\nput(%r, c)\n"
        "os.remove('/lib/protocol/link.mpy')\n"
        "put('/lib/firmware_py/device.py', '1/0')\n"     # would be imported in place of device.mpy
        "os.mkdir('/lib/firmware_py/old')\nput('/lib/firmware_py/old/x.mpy', 'x')\n"
        "os.mkdir('/lib/others')\nput('/lib/others/device.py', 'x')\nput('/diary.txt', 'x')\n" % (NOT_NEEDED, NOT_NEEDED)))
    code, out, err = flash(unix_board)
    assert code == 0 and "2 stale ones removed" in out and "core    runs" in out, err
    assert [line.split()[1] for line in out.splitlines() if line.startswith("copied")] == [
        NOT_NEEDED, "/lib/protocol/link.mpy", "/main.py"]
    said = unix_board.while_off("print(os.listdir('/lib/firmware_py'), os.listdir('/lib/others'), os.listdir('/'))")
    assert "'old'" not in said and "'device.py'" in said.partition("]")[2] and "'diary.txt'" in said


def test_a_copy_that_was_broken_off_is_finished_by_the_next(flash, unix_board):
    unix_board.pull_after = 60000
    code, out, err = flash(unix_board)
    done = out.count("copied  /")
    assert code == 3 and 3 < done < len(sources()) and "unplugged while in use; plug it in again" in err
    unix_board.plug_in()
    code, out, _ = flash(unix_board)
    assert code == 0 and "core    runs" in out
    assert len(sources()) + 1 - done - 1 <= out.count("copied  /") <= len(sources()) + 1 - done


def test_so_is_one_whose_program_was_killed(unix_board, project, flash):
    process = subprocess.Popen([sys.executable, "-m", "host_tools", "flash", "--target", "mpremote:" + unix_board.device],
                               cwd=project, stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        if A_FILE in line:
            process.send_signal(signal.SIGKILL)
            break
    process.communicate()
    code, out, err = flash(unix_board)
    assert code == 0, err
    assert 0 < out.count("copied  /") < len(sources()) - 10 and "core    runs" in out


def test_a_file_that_was_left_open_spoils_nothing(unix_board):
    with board.Board(unix_board.device) as there:
        there._transport.exec("f=open('/half','wb')\nw=f.write")
        there._transport.exec("w(b'half')")     # and whoever was at it is killed
    with board.Board(unix_board.device) as there:
        there.write("/half", b"whole")
        there._transport.exec("f=w=0\nimport gc\ngc.collect()")
        assert there.read("/half") == b"whole"


@pytest.mark.parametrize("flash_kib", [40, 66])     # one that cannot hold it, one that seems to but for what littlefs needs
def test_a_flash_that_is_full(flash, micropython, tmp_path, flash_kib):
    with UnixBoard(micropython, tmp_path, flash_bytes=flash_kib << 10) as small:
        code, out, err = flash(small)
    assert code == 3 and "its flash is full" in err and "remove files of yours" in err and "runs" not in out


@pytest.mark.parametrize("without", [("hashlib",), ("hashlib", "binascii")])
def test_a_board_without_sha256_is_verified_by_its_crc_or_by_reading_back(flash, micropython, tmp_path, without):
    with UnixBoard(micropython, tmp_path, without=without) as poor:
        assert flash(poor, "--no-start")[0] == 0
        code, out, _ = flash(poor, "--no-start")
        assert code == 0 and "0 copied" in out
        poor.while_off("f = open(%r, 'r+b')\nf.seek(9)\nf.write(b'#')\nf.close()" % A_FILE)
        code, out, _ = flash(poor, "--no-start")
        assert code == 0 and "1 copied" in out and "copied  " + A_FILE in out


def test_a_main_py_of_somebody_else_stays(flash, unix_board):
    unix_board.while_off("put('/main.py', 'print(1)\\n')")
    code, out, err = flash(unix_board)
    assert code == 3 and "has a /main.py of its own" in err and "--no-start" in err and "copied" not in out
    assert flash(unix_board, "--no-start")[0] == 0
    assert unix_board.while_off("print(open('/main.py').read())") == "print(1)\n\n"


def test_a_package_of_somebody_else_stays(flash, unix_board):
    unix_board.while_off("os.mkdir('/lib/protocol')\nput('/lib/protocol/modbus.py', 'x')")
    code, out, err = flash(unix_board)
    assert code == 3 and "/lib/protocol on it is another project's" in err and "copied" not in out


def test_a_main_py_of_ones_own(flash, unix_board, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("print('mine')\nfrom firmware_py.main_board import main\nmain()\n")
    assert flash(unix_board, "--main", str(mine))[0] == 0
    code, out, _ = flash(unix_board)
    assert code == 0 and "1 copied" in out and "copied  /main.py" in out
    code, _, err = flash(unix_board, "--main", str(tmp_path / "none.py"))
    assert code == 2 and "none.py cannot be read" in err


def test_a_core_that_does_not_start_is_named_with_its_cause(flash, unix_board, tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("import no_such_module\n")
    code, _, err = flash(unix_board, "--main", str(broken))
    assert code == 3 and "does not start" in err and "no module named 'no_such_module'" in err


def test_a_heap_that_is_too_small_is_named_with_its_cause(flash, micropython, tmp_path):
    with UnixBoard(micropython, tmp_path, heap="100k") as small:
        code, _, err = flash(small)
    assert code == 3 and "does not start" in err and "MemoryError" in err


def test_a_port_that_is_missing_or_none(flash):
    code, _, err = flash("/dev/there-is-no-such-port")
    assert code == 2 and "there is no such port; plug the board in" in err
    code, _, err = flash("/dev/null")
    assert code == 2 and "not a terminal" in err


@pytest.mark.parametrize("noise", [b"", b"hello \x00\xff"])
def test_a_port_that_is_silent_or_no_micropython(flash, monkeypatch, noise):
    monkeypatch.setattr(board, "ANSWER_S", 0.5)
    master, slave = pty.openpty()
    try:
        os.write(master, noise)
        began = time.monotonic()
        code, _, err = flash(os.ttyname(slave))
        assert code == 3 and "does not answer as a MicroPython does; press its reset button" in err
        assert time.monotonic() - began < 10
    finally:
        os.close(master)
        os.close(slave)


def test_a_port_that_talks_without_end(flash, monkeypatch):
    monkeypatch.setattr(board, "ENTER_S", 2.0)
    master, slave = pty.openpty()
    over = threading.Event()

    def talk():
        os.set_blocking(master, False)
        while not over.is_set():
            with contextlib.suppress(BlockingIOError):
                os.write(master, os.urandom(512))
            time.sleep(0.001)
    talker = threading.Thread(target=talk)
    talker.start()
    try:
        began = time.monotonic()
        code, _, err = flash(os.ttyname(slave))
        assert code == 3 and "it talks on without an answer; press its reset button" in err
        assert time.monotonic() - began < 6
    finally:
        over.set()
        talker.join()
        os.close(master)
        os.close(slave)


def test_a_board_with_other_mpy_files():
    with pytest.raises(BoardError, match="takes .mpy files of version 5, mpy-cross .* makes version 6 here; put MicroPython"):
        compiled(5)
    with pytest.raises(BoardError, match="takes no .mpy files; put a firmware on it that does"):
        compiled(0)
    with pytest.raises(BoardError, match="machine code is of a kind .50. that is not known"):
        compiled(FILES | 50 << 10)


def test_machine_code_goes_only_where_it_runs():
    cortex_m0, without, older = compiled(FILES | 4 << 10), compiled(FILES), compiled(6 | 1 << 8 | 4 << 10)
    machine_code = {path for path in cortex_m0 if path.endswith("_viper.mpy")}
    assert len(machine_code) > 1 and all(cortex_m0[path][2] >> 2 == 4 for path in machine_code)
    plain = {path: content for path, content in cortex_m0.items() if path not in machine_code}
    assert without == older == plain and all(content[2:4] == b"\x00\x1f" for content in plain.values())


def test_a_core_without_machine_code_starts_as_well(unix_board):
    with board.Board(unix_board.device) as there:
        install(there, {**compiled(FILES), MAIN: (MARK + START).encode()}, say=lambda text: None)
        files, _ = there.files("/lib")
        assert not [path for path in files if "viper" in path]
        assert there.restart().parameters > 20


def test_the_arguments_of_a_board_are_for_a_board(capsys):
    assert cli.main(["flash", "--target", "stm32", "--no-start"]) == 2
    assert "--no-start are for a board" in capsys.readouterr().err
    assert cli.main(["flash", "--target", "mpremote:"]) == 2
    assert "is no target: give stm32 or mpremote:DEVICE" in capsys.readouterr().err
