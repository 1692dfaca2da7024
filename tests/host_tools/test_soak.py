"""A day of robot time on the MicroPython VM, mission after mission: the memory stays as it is, and so do the hashes."""

import json
import os

import pytest

from tests.host_tools.test_hil_mission import finish, hil

HOURS = float(os.environ.get("SOAK_HOURS", "24"))
HOME = "studio"


@pytest.mark.soak
@pytest.mark.timeout(0)
def test_a_day_of_missions_keeps_memory_and_hashes(project, tmp_path, micropython, record_count):
    kept = tmp_path / "result.json"
    driven_s, seen = 0.0, set()
    while driven_s < 3600 * HOURS:
        code, _, err = finish(hil(project, HOME, "--target", "unix", "--seed", "1", "--json", str(kept)), 3600)
        assert code == 0, err
        result = json.loads(kept.read_text())
        memory = result["memory"]
        assert memory["heap_locked"] and memory["allocated_after_boot_bytes"] == 0 and result["degraded"] == []
        seen.add((result["hash"]["steps"], result["hash"]["map"], memory["heap_bytes"], memory["heap_peak_bytes"]))
        driven_s += result["time"]["robot_s"]
        record_count("simulated seconds of missions on the VM (other hashes or memory)", round(result["time"]["robot_s"]), len(seen) > 1)
        assert len(seen) == 1, seen
