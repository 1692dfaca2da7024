"""Missions on a bad line through the command line: on every target and link the hashes of a good one."""

import json
import signal
from types import SimpleNamespace

import pytest

from host_tools.mission_run import _Watch
from tests.host_tools.test_hil_mission import SMALL, finish, hil

SHORT = ("--max-robot-s", "6", "--seed", "2")
STEPS = 300
BAD = "drop=0.2,flip=0.02,dup=0.1,reorder=0.1"


# Runs hil in a small home: its result file, and what it said.
class Runs:
    def __init__(self, project, folder):
        self.project, self.folder = project, folder
        self.home = folder / "small.json"
        self.home.write_text(json.dumps(SMALL))

    def of(self, *argv):
        path = self.folder / "result.json"
        code, said, err = finish(hil(self.project, str(self.home), *argv, *SHORT, "--json", str(path)))
        assert code in (0, 1), err
        result = json.loads(path.read_text())
        assert result["tick"]["count"] == STEPS
        return result, said + err


@pytest.fixture(scope="module")
def runs(project, tmp_path_factory):
    return Runs(project, tmp_path_factory.mktemp("runs"))


@pytest.fixture(scope="module")
def calm(runs):
    result, _ = runs.of("--target", "cpython", "--link", "memory")
    assert result["link_stats"]["retransmits"] == 0
    return result


@pytest.mark.timeout(120)
@pytest.mark.parametrize("link", ["pty", "slcan"])
def test_a_bad_line_gives_the_hashes_of_a_good_one(runs, calm, micropython, link):
    got, _ = runs.of("--target", "unix", "--link", link, "--faults", BAD)
    assert got["hash"] == calm["hash"] and got["map"] == calm["map"] and got["link_stats"]["retransmits"] > 100
    dropped = got["link_stats"]["dropped_by_cause"]
    assert sum(dropped[cause] + dropped["core_" + cause] for cause in ("bad_crc", "bad_cobs")) > 0


@pytest.mark.timeout(120)
def test_a_core_that_is_killed_and_started_anew_on_its_pty_goes_on(runs, calm, micropython):
    got, said = runs.of("--target", "unix", "--faults", "reset@step=40,reset@step=41,cut@step=90:0.5s,reset@step=200")
    assert said.count("the core is reset at step") == 3
    assert got["hash"]["steps"] != calm["hash"]["steps"] and got["memory"]["allocated_after_boot_bytes"] == 0


@pytest.mark.timeout(120)
def test_what_a_mission_met_is_kept_and_done_again(runs, calm, tmp_path):
    kept = tmp_path / "met.txt"
    memory = ("--target", "cpython", "--link", "memory")
    once, _ = runs.of(*memory, "--faults", BAD, "--keep-faults", str(kept))
    items = [line for line in kept.read_text().splitlines() if not line.startswith("#")]
    assert len(items) > 100 and all("@up=" in item or "@down=" in item for item in items)
    again, _ = runs.of(*memory, "--faults", "@%s" % kept)
    assert again["hash"] == once["hash"] == calm["hash"] and again["link_stats"] == once["link_stats"]


def test_why_the_robot_gave_up_is_told_and_not_that_the_core_was_hung_up_on_then(runs):
    code, _, err = finish(hil(runs.project, str(runs.home), "--target", "cpython", *SHORT, "--faults", "cut@step=50:60s"))
    said = err.splitlines()[-1]
    assert code == 3 and "the core on the link has not answered STEP 50 for 3 s" in said


GAVE_UP = "the core on the link has not answered STEP 50 for 3 s"
CLOSED = "the core has closed the link while it was in use: start both again"
HANGUP = "tvslam: the link was closed by its other end before the mission was done: start both again"


@pytest.mark.parametrize("first", ["robot", "core"])
@pytest.mark.parametrize("error, code, printed, cause", [
    (GAVE_UP, 3, HANGUP, GAVE_UP), (GAVE_UP, -signal.SIGHUP, "", GAVE_UP), ("", 3, HANGUP, HANGUP[8:]), (CLOSED, 3, HANGUP, HANGUP[8:]),
    (GAVE_UP, 4, "tvslam: the heap is too small", "the heap is too small"),
    (GAVE_UP, 1, "Traceback\nValueError: x", "the core failed: ValueError: x"),
])
def test_whoever_saw_the_cause_tells_it_whoever_ended_first(first, error, code, printed, cause):
    watch = _Watch(None)
    watch.error, watch.core = error, ended(code, printed)
    watch.robot = ended(3, "")
    if first == "core":
        watch.robot.poll = iter([None, 3, 3, 3]).__next__   # it ends while it is waited for
    assert watch.outcome().sentence == cause


def ended(code, printed):
    """A Child that has ended."""
    return SimpleNamespace(poll=lambda: code, wait=lambda _: code, stop=lambda _: code, text=lambda: printed,
                           popen=SimpleNamespace(returncode=code))
