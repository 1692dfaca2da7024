# `hil --target stm32`: the core in the flash of an emulated STM32F205 maps a home over its USART and by
# semihosting, as every other target does; what goes wrong in the emulator is named, and nothing of it is left.

import json
import os
import re
import signal
import time

import pytest

from host_tools import stm32_image
from host_tools.processes import Children
from host_tools.qemu import USART, Emulator, EmulatorError, tick_costs
from tests.host_tools.test_hil_mission import SMALL, by_command, children_of, finish, hil, wait_until_driving
from tests.host_tools.test_hil_processes import alive, wait_until

HEAP = os.environ.get("STM32_TEST_HEAP", "27k")
HEAP_USED_MAX = 24_000  # of 27,648 B: the rest is for what the core does not do yet
TICK_P99_MAX = 480_000  # 4 ms at 120 MHz, one cycle an instruction
NAMED_S = 3.0
MISSION = pytest.mark.timeout(300)


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    return str(path)


@pytest.fixture(scope="session")
def elf(stm32_tools_here):
    return stm32_image.image(int(HEAP.rstrip("k")) * 1024)


@pytest.fixture
def underway(project, tmp_path, small, elf):
    """A mission on the emulator that has begun, and the processes that it started."""
    begun = []

    def begin(link):
        process = hil(project, small, "--target", "stm32", "--heap", HEAP, "--link", link, "--json", str(tmp_path / "r.json"))
        begun.append(process)
        wait_until_driving(process)
        children = children_of(process.pid)
        assert len(children) == 2
        begun.extend(children)
        return process, by_command(children, "qemu")

    yield begin
    process, *children = begun
    process.kill()
    process.wait()
    wait_until(lambda: not any(map(alive, children)))


@MISSION
def test_a_mission_ends_as_on_the_computer(project, tmp_path, small, elf):
    results = {}
    for name, argv in (("cpython", ["--target", "cpython"]),
                       ("pty", ["--target", "stm32", "--heap", HEAP]),
                       ("semihost", ["--target", "stm32", "--heap", HEAP, "--link", "semihost"])):
        kept = tmp_path / (name + ".json")
        code, _, said = finish(hil(project, small, *argv, "--json", str(kept)))
        assert code == 0, said
        results[name] = json.loads(kept.read_text())
    expected = results.pop("cpython")
    for name, result in results.items():
        assert result["finished"] and result["hash"] == expected["hash"], name
        assert result["map"] == expected["map"] and result["time"]["robot_s"] == expected["time"]["robot_s"]
        assert result["memory"]["heap_locked"] and result["memory"]["allocated_after_boot_bytes"] == 0
        assert result["memory"]["heap_peak_bytes"] <= result["memory"]["heap_bytes"] <= int(HEAP.rstrip("k")) * 1024
        assert result["memory"]["heap_peak_bytes"] <= HEAP_USED_MAX
        for key, low, high in (("flash_bytes", 100_000, 1 << 20), ("static_ram_bytes", 500, 8 << 10), ("stack_peak_bytes", 500, 10 << 10),
                               ("boot_s", 0.01, 3)):
            assert low < result["memory"][key] < high, key
        tick = result["tick"]
        # Every step decodes two dozen fields and multiplies: it cannot cost less, and 20 ms of the part are its bound.
        assert 50_000 < tick["instructions_p99"] <= tick["instructions_max"] < 2_400_000
        assert tick["instructions_p99"] <= TICK_P99_MAX
    # The emulator counts instructions: the way of the bytes, and the load of this machine, must not show.
    assert results["pty"]["tick"]["instructions_p99"] == pytest.approx(results["semihost"]["tick"]["instructions_p99"], rel=0.1)


@MISSION
@pytest.mark.parametrize("link", ["pty", "semihost"])
def test_an_emulator_that_dies_is_named(underway, link):
    process, qemu = underway(link)
    begin = time.monotonic()
    os.kill(qemu, signal.SIGKILL)
    code, _, said = finish(process)
    assert time.monotonic() - begin < NAMED_S + 1  # and the end of the other processes, and the result
    assert code == 3 and "the emulator was ended by signal SIGKILL" in said, said


@MISSION
@pytest.mark.parametrize("link", ["pty", "semihost"])
def test_an_emulator_that_hangs_is_named(underway, link):
    process, qemu = underway(link)
    begin = time.monotonic()
    os.kill(qemu, signal.SIGSTOP)
    code, _, said = finish(process)
    assert time.monotonic() - begin < NAMED_S + 2
    assert code == 3 and re.search(r"not answered STEP \d+ .*3 s", said) and "the core on it was silent" in said, said


@MISSION
def test_an_interrupted_mission_leaves_no_emulator(underway):
    process, qemu = underway("semihost")
    process.send_signal(signal.SIGINT)
    code, out, _ = finish(process)
    assert code == 1 and "interrupted" in out
    assert not alive(qemu)


def test_a_hardware_fault_is_named_with_its_registers(elf):
    with Children() as children:
        emulator = Emulator(children, elf)
        emulator.boot()
        begin = time.monotonic()
        emulator._send(b"import micropython\n@micropython.asm_thumb\ndef undefined():\n data(2, 0xDE00)\nundefined()\n\x04")
        wait_until(lambda: emulator.poll() is not None, NAMED_S)
        assert time.monotonic() - begin < NAMED_S
        assert "hardware fault" in emulator.sentence() and re.search(r"R15:\s+[0-9A-F]{8}", emulator.sentence())
        emulator.stop()


def test_an_image_that_does_not_boot_is_named(stm32_tools_here, tmp_path):
    image = tmp_path / "firmware.elf"
    image.write_bytes(b"this is no program")
    with Children() as children, pytest.raises(EmulatorError, match="the emulator was ended by signal SIGABRT.*Lockup"):
        Emulator(children, image).boot()


def test_a_core_that_cannot_start_says_why(elf):
    with Children() as children:
        emulator = Emulator(children, elf)
        emulator.boot()
        emulator.start_core("/there/is/no/such/link")
        with pytest.raises(EmulatorError, match="/there/is/no/such/link cannot be opened"):
            emulator.await_core()
        emulator.stop()


def test_the_repl_serves_again_when_the_core_has_ended(elf):
    with Children() as children:
        emulator = Emulator(children, elf)
        emulator.boot()
        emulator.start_core(USART)
        emulator.await_core()
        assert emulator.poll() is None
        assert emulator.wait(3.0) == 3  # no mission, so none was done
        emulator._send(b"print(6 * 7)\n\x04")
        wait_until(lambda: "OK42" in emulator._text, 3)
        emulator.stop()


def test_the_stack_is_seen_where_it_was_deepest(elf):
    with Children() as children:
        emulator = Emulator(children, elf)
        emulator.boot()
        shallow = emulator.memory()["stack_peak_bytes"]
        emulator._send(b"def down(n):\n if n:\n  down(n - 1)\ndown(25)\nprint('up again')\n\x04")
        wait_until(lambda: "up again" in emulator._text, 3)
        deep = emulator.memory()["stack_peak_bytes"]
        assert shallow + 25 * 40 < deep < 10 << 10, (shallow, deep)  # a call takes more than 40 bytes; the VM stops at 10 KiB
        emulator.stop()
        assert emulator.memory()["stack_peak_bytes"] is None, "an emulator that is gone tells nothing"


def test_without_an_emulator_its_package_is_named(project, small, tmp_path):
    code, _, said = finish(hil(project, small, "--target", "stm32", env={**os.environ, "PATH": str(tmp_path)}))
    assert code == 2 and "qemu-system-arm" in said and "apt" in said and said.count("\n") == 1, said


def costs(largest, **steps_of_bin):
    bins = [str(steps_of_bin.get("bin%d" % i, 0)) for i in range(48)]
    return tick_costs("tvslam: costs %d 9600 40 240000 %s\n" % (largest, " ".join(bins)))


def test_costs_are_counted_in_instructions():
    # 98 of 100 steps below 30,000 instructions: the 99th is in a bin of 250,000 behind 40 of 10,000.
    assert costs(1_000_000, bin2=98, bin41=2) == {"instructions_p99": 900_000, "instructions_max": 1_041_666}
    assert costs(500_000, bin2=98, bin41=2)["instructions_p99"] == 520_833, "no step took longer than the longest"
    assert costs(1_000_000, bin2=198, bin41=2)["instructions_p99"] == 30_000
    assert costs(9_000_000, bin2=90, bin47=10)["instructions_p99"] == 9_375_000, "above the last bin's lower edge nothing else is known"
    assert costs(0) == tick_costs("nothing") == {}
