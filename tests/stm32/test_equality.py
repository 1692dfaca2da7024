# One stream, one log, three targets: what the core answers in CPython it answers in MicroPython on the emulated
# Cortex-M3, where an int that needs more than 31 bits, or an allocation, shows.

import contextlib
import json
import signal
import subprocess
import sys

import pytest
from hypothesis import Phase, example, given, settings

from host_tools import cli
from host_tools.core_process import private_pty
from host_tools.emulated_core import EmulatedPort
from host_tools.processes import Children
from host_tools.qemu import Emulator
from tests.host_tools.recorded import WANDER, wander
from tests.host_tools.test_hil_mission import SMALL, by_command, children_of, finish, hil
from tests.host_tools.test_hil_processes import alive, wait_until
from tests.stm32.test_mission import HEAP, elf  # noqa: F401
from tests.stories.streams import expect_equal
from tests.strategies import examples, settings_of_a_robot, streams

HOMES = ("vac_flat_d", "giraff_c", "tb3_house")


@pytest.fixture(scope="module")
def fresh_core(elf):  # noqa: F811
    """One emulator; `with fresh_core() as port:` a core that has just been started on it."""
    with Children() as children:
        emulator = Emulator(children, elf, realtime=True)
        emulator.boot()

        @contextlib.contextmanager
        def fresh():
            with EmulatedPort(*private_pty()) as port:
                port.start_core(emulator)
                yield port
            wait_until(lambda: emulator.poll() is not None, 3)  # it has seen its link close

        yield fresh
        emulator.stop()


# Without shrinking: each try would drive the emulator, and the message names step and field as it is.
@settings(max_examples=examples(15), phases=(Phase.explicit, Phase.reuse, Phase.generate))
@given(settings_of_a_robot(), streams(max_segments=4, max_ticks=120))
@example([], WANDER)
def test_any_stream_has_the_same_answers_on_the_cortex_m3(fresh_core, parameters, segments):
    with fresh_core() as port:
        expect_equal("stm32", port, parameters, segments)


@pytest.fixture
def replay(tmp_path, capsys):
    def run(log, target, *argv):
        kept = tmp_path / "replay.json"
        code = cli.main(["replay", str(log), "--target", target, "--json", str(kept), *argv])
        out, err = capsys.readouterr()
        assert code == 0, out + err
        return json.loads(kept.read_text())
    return run


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "m.tvlog"
    path.write_bytes(wander().log())
    return path


def expect_one_hash(project, tmp_path, replay, home):
    log, kept = tmp_path / "m.tvlog", tmp_path / "hil.json"
    code, _, said = finish(hil(project, home, "--target", "cpython", "--log", str(log), "--json", str(kept)))
    assert code == 0, said
    expected = json.loads(kept.read_text())
    for target, argv in (("unix", ()), ("stm32", ("--heap", HEAP))):
        result = replay(log, target, *argv)
        assert result["hash"] == result["log_hash"] == expected["hash"], target
        assert result["steps"] == expected["tick"]["count"] and result["telemetry_difference"] is None


@pytest.mark.timeout(300)
def test_a_mission_replays_to_one_hash_on_three_targets(project, tmp_path, replay, elf, micropython):  # noqa: F811
    home = tmp_path / "small.json"
    home.write_text(json.dumps(SMALL))
    expect_one_hash(project, tmp_path, replay, str(home))


@pytest.mark.soak
@pytest.mark.parametrize("home", HOMES)
def test_real_homes_replay_to_one_hash_on_three_targets(project, real_homes, tmp_path, replay, elf, micropython, home):  # noqa: F811
    expect_one_hash(project, tmp_path, replay, str(real_homes / f"{home}.json"))


def test_the_usart_gives_the_same_answers(log, replay, elf):  # noqa: F811
    assert replay(log, "stm32", "--heap", HEAP, "--link", "pty")["steps"] == 660


def test_two_targets_side_by_side(log, capsys, elf, micropython):  # noqa: F811
    assert cli.main(["bisect", str(log), "--targets", "unix,stm32", "--heap", HEAP]) == 0
    assert "no difference in 660 answers" in capsys.readouterr().out


@pytest.mark.parametrize("heap, code, word", [
    ("120k", 2, "does not fit the STM32F205"), ("8k", 3, "ran out of heap on the emulated STM32; give --heap 25k or more."),
])
def test_a_heap_that_is_none_is_named(log, capsys, elf, heap, code, word):  # noqa: F811
    assert cli.main(["replay", str(log), "--target", "stm32", "--heap", heap]) == code
    assert word in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_no_emulator_outlives_a_replay(project, log, elf, number):  # noqa: F811
    argv = [str(log), "--target", "stm32", "--heap", HEAP, "--link", "pty"]
    process = subprocess.Popen([sys.executable, "-m", "host_tools", "replay", *argv], cwd=project, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    wait_until(lambda: any("qemu" in command_of(pid) for pid in children_of(process.pid)), 20)
    qemu = by_command(children_of(process.pid), "qemu")
    process.send_signal(number)
    _, said = process.communicate(timeout=10)
    wait_until(lambda: not alive(qemu))
    assert process.returncode == (130 if number == signal.SIGTERM else -signal.SIGKILL) and "Traceback" not in said


def command_of(pid):
    with contextlib.suppress(OSError):
        with open("/proc/%d/cmdline" % pid) as file:
            return file.read()
    return ""
