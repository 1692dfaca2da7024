# `hil --target stm32 --realtime`: the emulated part's SysTick follows the host's time, the core runs by it.

import json

import pytest

from tests.host_tools.test_hil_mission import finish, hil
from tests.sim_device.test_free_run import replayed
from tests.stm32.test_mission import HEAP, MISSION, elf  # noqa: F401  (a fixture)

ROBOT_S = 8


@MISSION
def test_the_core_runs_by_its_own_systick_and_its_log_replays(project, tmp_path, elf):  # noqa: F811
    kept, log = tmp_path / "r.json", tmp_path / "log"
    code, out, said = finish(hil(project, "studio", "--target", "stm32", "--heap", HEAP, "--realtime", "--max-robot-s", str(ROBOT_S),
                                 "--json", str(kept), "--log", str(log)))
    assert code == 1 and "free run" in out, said
    result = json.loads(kept.read_text())
    assert result["reason"] == "robot time limit"
    figures, hashes = result["free_run"], result["hash"]
    steps = result["tick"]["count"]
    assert 50 * ROBOT_S <= steps + figures["late_answers"] + figures["missed_ticks"] <= 52 * ROBOT_S
    assert steps >= 10 * ROBOT_S, "a fifth of them, however busy the computer is"
    assert figures["core_late_ticks"] <= 45 * ROBOT_S
    assert abs(figures["drift_ppm"]) < 5000 and figures["residual_ms"] < 5
    (low, high), _ = replayed(log)
    assert hashes["steps"] == "%04x%04x" % (high, low)
    assert result["tick"]["instructions_p99"] is None, "the clock counts no instructions in a free run"
    assert result["memory"]["allocated_after_boot_bytes"] == 0
    assert result["time"]["wall_s"] == pytest.approx(ROBOT_S, rel=0.1, abs=0.5)
