# The core as a process: what it says of a heap that is too small, of a path that is no terminal, of a host that goes.

import os
import pty
import subprocess
import sys
import time
from pathlib import Path

import pytest

from firmware_py.limits import UNIX_HEAP_BYTES
from tests.house.tree import PROJECT

MICROPYTHON = Path(sys.executable).with_name("micropython")


def micropython(heap_bytes, path):
    return [str(MICROPYTHON), "-X", f"heapsize={heap_bytes}", "-m", "firmware_py", str(path)]


def cpython(path):
    return [sys.executable, "-m", "firmware_py", str(path)]


def run(command):
    return subprocess.run(command, cwd=PROJECT, capture_output=True, text=True, timeout=20)


def first_bytes(command, master):
    """What a core says first on its pty, and the core."""
    core = subprocess.Popen(command, cwd=PROJECT, stdout=subprocess.PIPE, text=True)
    os.set_blocking(master, False)
    said = b""
    end_s = time.monotonic() + 10
    while not said.endswith(b"\0") and time.monotonic() < end_s and core.poll() is None:
        try:
            said += os.read(master, 256)
        except OSError:
            time.sleep(0.01)
    return said, core


def test_the_heap_that_the_sentence_asks_for_is_enough():
    master, slave = pty.openpty()
    said, core = first_bytes(micropython(UNIX_HEAP_BYTES, os.ttyname(slave)), master)
    core.kill()
    assert said.startswith(b"\0") and len(said) > 20, core.communicate()[0]


@pytest.mark.parametrize("share", [3, 2])
def test_a_heap_too_small_says_how_much_is_needed(share, tmp_path):
    ended = run(micropython(UNIX_HEAP_BYTES // share, tmp_path / "nowhere"))
    assert ended.returncode == 4
    assert ended.stdout.strip() == "tvslam: the heap is too small to boot: give at least 272 KiB, as in -X heapsize=288k"


@pytest.mark.parametrize("command", [cpython, lambda path: micropython(288 * 1024, path)], ids=["cpython", "unix"])
def test_a_path_that_is_no_terminal(command, tmp_path):
    file = tmp_path / "file"
    file.write_text("not a terminal")
    ended = run(command(file))
    assert ended.returncode == 2
    assert ended.stdout.strip() == f"tvslam: {file} is not a terminal: give a serial port or a pty"


@pytest.mark.parametrize("path", ["", "slcan:", "slcan-fd:"])
def test_no_path_is_not_waited_for(path):
    ended = run(cpython(path))
    assert ended.returncode == 2 and ended.stdout.startswith("usage: firmware_py PATH") and ended.stdout.count("\n") == 1


@pytest.mark.parametrize("command", [cpython, lambda path: micropython(288 * 1024, path)], ids=["cpython", "unix"])
def test_a_host_that_goes_away_is_named(command):
    master, slave = pty.openpty()
    path = os.ttyname(slave)
    said, core = first_bytes(command(path), master)
    assert said
    os.close(slave)
    os.close(master)
    end = core.communicate(timeout=10)[0].strip()
    assert end == f"tvslam: {path} was closed by its other end before the mission was done: start both again"
    assert core.returncode == 3
