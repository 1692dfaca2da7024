# The core on the emulated part behind a CAN adapter: SLCAN on its USART2.

import json

import pytest

from tests.host_tools.test_hil_mission import SMALL, finish, hil
from tests.stm32.test_mission import HEAP, elf  # noqa: F401  (a fixture)

TICK_MAX = 1_200_000    # instructions, half of the 20 ms that a step has


@pytest.mark.timeout(300)
@pytest.mark.parametrize("link", ["slcan", "slcan-fd"])
def test_over_can_the_mission_is_the_one_of_the_other_targets(project, tmp_path, elf, link):  # noqa: F811
    home = tmp_path / "small.json"
    home.write_text(json.dumps(SMALL))
    results = []
    for argv in (["--target", "cpython", "--link", "memory"], ["--target", "stm32", "--heap", HEAP, "--link", link]):
        kept = tmp_path / "result.json"
        code, _, said = finish(hil(project, str(home), *argv, "--max-robot-s", "5", "--json", str(kept)))
        assert code == 1, said      # the time limit
        results.append(json.loads(kept.read_text()))
    expected, over = results
    assert over["hash"] == expected["hash"] and over["time"]["robot_s"] == expected["time"]["robot_s"] == 5
    assert over["can"]["frames"] > 500 and over["can"]["dropped"] == over["can"]["lost"] == 0
    assert over["memory"]["heap_locked"] and over["memory"]["allocated_after_boot_bytes"] == 0
    assert 50_000 < over["tick"]["instructions_p99"] <= over["tick"]["instructions_max"] < TICK_MAX
