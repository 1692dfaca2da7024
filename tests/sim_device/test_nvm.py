# The robot's non-volatile memory: what flash does, and the file that stands for it.

import os
import resource
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.schema import NVM_UNIT
from sim_device import cli
from sim_device.nvm import NOT_ERASED, OK, OUT_OF_RANGE, SIZE, Nvm, NvmError
from tests.house.tree import PROJECT

CORE = "firmware_py.device:Device"


def test_bytes_are_programmed_once_and_erased_by_the_unit():
    nvm = Nvm(4096)
    assert nvm.read(0, 4096) == (OK, b"\xff" * 4096)
    assert nvm.program(1000, b"abc") == OK and nvm.read(999, 5) == (OK, b"\xffabc\xff")
    assert nvm.program(1002, b"\xff\0") == NOT_ERASED and nvm.read(1002, 2) == (OK, b"c\xff")
    assert nvm.program(1024, b"d") == OK and nvm.erase(0) == OK
    assert nvm.read(1000, 25) == (OK, b"\xff" * 24 + b"d")
    assert (nvm.erases, nvm.programs, nvm.written) == (1, 2, NVM_UNIT + 4)


def test_what_is_not_there_is_refused():
    nvm = Nvm(4096)
    for status in (nvm.read(4000, 97)[0], nvm.read(-1, 2)[0], nvm.erase(4096), nvm.erase(5), nvm.erase(-1024), nvm.program(4095, b"ab")):
        assert status == OUT_OF_RANGE
    assert nvm.written == 0


@given(st.integers(0, NVM_UNIT + 99), st.integers(0, 99))
def test_power_is_lost_at_that_byte_and_only_there(number, seed):
    lost = []
    nvm = Nvm(4096, power=[number], seed=seed, lose_power=lost.append)
    nvm.erase(1024)
    if number < NVM_UNIT:
        assert nvm.off and lost == [number] and nvm.written == number + 1
        assert nvm.read(1024, NVM_UNIT)[1] not in (b"\xff" * NVM_UNIT, b"\0" * NVM_UNIT)
    else:
        assert not nvm.off
    nvm.on()
    nvm.written = NVM_UNIT
    nvm.program(2048, bytes(100))
    at = number - NVM_UNIT
    data = nvm.read(2048, 100)[1]
    assert lost == [number] and data[:max(at, 0)] == bytes(max(at, 0))
    assert at < 0 and data == bytes(100) or at >= 0 and data[at + 1:] == b"\xff" * (99 - at)


def test_a_file_holds_every_byte_at_once(tmp_path):
    path = tmp_path / "nvm"
    nvm = Nvm(path=str(path))
    assert path.read_bytes() == b"\xff" * SIZE
    nvm.program(70, b"abc")
    assert path.read_bytes()[69:74] == b"\xffabc\xff"  # not closed yet
    nvm.close()
    again = Nvm(path=str(path))
    assert again.read(70, 3)[1] == b"abc"
    again.erase(0)
    assert path.read_bytes() == b"\xff" * SIZE


def test_a_memory_is_one_missions(tmp_path):
    nvm = Nvm(path=str(tmp_path / "nvm"))
    with pytest.raises(NvmError, match="another mission's memory"):
        Nvm(path=str(tmp_path / "nvm"))
    nvm.close()
    Nvm(path=str(tmp_path / "nvm")).close()


def folder(path):
    path.mkdir()


def of_another_size(path):
    path.write_bytes(b"\xff" * 5000)


def too_large(path):
    path.write_bytes(b"\xff" * (SIZE + 1))


def device(path):
    path.symlink_to("/dev/null")


@pytest.mark.parametrize("make, words", [(folder, "is a directory"), (of_another_size, "holds 5000 bytes, and this robot's memory 16384"),
                                         (too_large, "no memory of this robot"), (device, "holds 0 bytes")])
def test_what_is_no_memory_is_said_in_one_sentence(tmp_path, capsys, make, words):
    make(tmp_path / "f")
    assert cli.main(["studio", "--core", CORE, "--nvm", str(tmp_path / "f")]) == cli.EXIT_BAD_INPUT
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and words in said[0] and "give" in said[0]


@pytest.mark.parametrize("limit", [0, SIZE // 2])
def test_a_full_disk_is_said_before_the_mission_and_leaves_nothing(tmp_path, limit):
    path = tmp_path / "f"
    run = subprocess.run(
        [sys.executable, "-m", "sim_device", "studio", "--core", CORE, "--nvm", str(path)], cwd=PROJECT, capture_output=True, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)), timeout=60)
    assert run.returncode == cli.EXIT_BAD_INPUT and len(run.stderr.splitlines()) == 1, run.stderr
    assert "cannot be used" in run.stderr and os.path.getsize(path) == 0


def test_one_name_one_file(capsys, tmp_path):
    assert cli.main(["studio", "--core", CORE, "--nvm", str(tmp_path / "f"), "--map", str(tmp_path / "f")]) == cli.EXIT_BAD_INPUT
    assert "has that name already" in capsys.readouterr().err
