# A bad line between the virtual robot and the emulated part: the mission is the one of a good line.

import json

import pytest

from tests.host_tools.test_hil_mission import SMALL, finish, hil
from tests.stm32.test_mission import HEAP, elf  # noqa: F401

SHORT = ("--max-robot-s", "2", "--seed", "2")


@pytest.mark.timeout(200)
def test_a_bad_line_gives_the_hashes_of_a_good_one(project, tmp_path, elf):  # noqa: F811
    home, kept = tmp_path / "small.json", tmp_path / "result.json"
    home.write_text(json.dumps(SMALL))
    results = []
    for argv in (("--target", "cpython", "--link", "memory"),
                 ("--target", "stm32", "--heap", HEAP, "--faults", "drop=0.2,flip=0.02,dup=0.1,reorder=0.1")):
        code, _, err = finish(hil(project, str(home), *argv, *SHORT, "--json", str(kept)))
        assert code in (0, 1), err
        results.append(json.loads(kept.read_text()))
    good, bad = results
    assert bad["hash"] == good["hash"] and bad["tick"]["count"] == 100 and bad["link_stats"]["retransmits"] > 30
