# `flash --target mpremote:DEVICE` against a 32-bit board: the emulated Cortex-M3 with a littlefs in its RAM. Here the .mpy
# files are loaded by what they are made for: 31-bit small ints, and the machine code of an ARMv7-M.

import contextlib
import io
import re

import pytest

from host_tools import cli
from host_tools.board_files import sources
from tests.stm32.emulated_board import elf, emulated_board, run_on

STEPS = """
from array import array
from firmware_py.pipeline import Tvslam
core = Tvslam()
core.begin()
values = array("i", bytes(4 * 112))
x = 1
for n in range(400):
    values[0] = n + 1
    for i in range(1, 13):
        x = x * 75 % 65537
        values[i] = x % 12 if i < 3 else x % 1024 if i < 11 else x % 3000 if i == 11 else 0
    core.step(values)
print(core.hash_lo, core.hash_hi)
"""
BOOT = """
import gc
gc.collect()
before = gc.mem_alloc()
from firmware_py.device import Device
from firmware_py.ports import rolling_viper
from protocol.crc32 import crc32_into
class Port:
    heap_bytes = heap_code_bytes = heap_boot_bytes = locked = 0
    def heap_used(self):
        return 0
device = Device(Port(), 1)
gc.collect()
print(gc.mem_alloc() - before)
print(type(crc32_into).__name__)
print(type(rolling_viper.collect).__name__)
"""


@pytest.fixture(scope="module")
def firmware(stm32_elf):
    return elf()    # after stm32_elf, which brings MicroPython's source


def flash(device, capsys):
    code = cli.main(["flash", "--target", "mpremote:" + device, "--no-start"])
    return code, *capsys.readouterr()


@pytest.mark.timeout(400)   # with the build of the firmware, once
def test_the_copied_core_runs_on_a_32_bit_board_and_gives_the_hash_of_cpython(firmware, project, capsys):
    with emulated_board(firmware, 256 << 10) as device:
        code, out, err = flash(device, capsys)
        assert code == 0 and "Cortex-M3" in out and "%d verified on the board" % len(sources()) in out, err
        code, out, _ = flash(device, capsys)
        assert code == 0 and "0 copied, %d were there" % len(sources()) in out
        heap_bytes, *machine_code = run_on(device, BOOT).split("\r\n")
        told = re.search(r"\| heap, words of 4 bytes \| ([\d,]+)", (project / "docs/porting.md").read_text())[1]
        assert int(heap_bytes) == pytest.approx(int(told.replace(",", "")), rel=0.15), "docs/porting.md tells what a board needs"
        assert machine_code == ["function", "function", ""]
        said = run_on(device, STEPS)
    expected = io.StringIO()
    with contextlib.redirect_stdout(expected):
        exec(STEPS, {})
    assert said.strip() == expected.getvalue().strip()


def test_a_ram_disk_that_is_too_small(firmware, capsys):
    with emulated_board(firmware, 48 << 10) as device:
        code, out, err = flash(device, capsys)
        assert code == 3 and "its flash is full" in err and err.count("\n") == 1
        assert run_on(device, "print(6 * 7)").strip() == "42"
