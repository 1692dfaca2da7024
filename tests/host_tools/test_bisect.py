"""`host_tools bisect`: a copy of the core that goes wrong at one known step must be found out at just that step."""

import json
import shutil
import time

import pytest

from host_tools import bisect as bisect_command
from host_tools import cli
from host_tools.progress import Progress
from host_tools.recording import Recording
from tests.firmware_py.device_story import Story as DeviceStory
from tests.host_tools.recorded import wander
from tests.host_tools.test_hil_mission import board

BAD = 333
# Put behind the pipeline of the copy: what is done before and after each step of its core.
SPOILT = """

_sound_step = Tvslam.step


def _spoilt_step(self, values):
    %s
    _sound_step(self, values)
    %s


Tvslam.step = _spoilt_step
"""


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "m.tvlog"
    path.write_bytes(wander().log())
    return str(path)


# A core on a port in this process, which says of its map what it says in BUILD.
class BuildingCore(DeviceStory):
    path = "here"

    def __init__(self):
        super().__init__(joined=False)
        self.device._whole_image = lambda: False

    def write(self, data):
        self.give(data)

    def read(self, timeout_s=0.0):
        data, self.port.out = bytes(self.port.out), bytearray()
        return data


@pytest.fixture
def bisect(project, tmp_path, log, capsys):
    """The command against a spoilt copy of the core: (exit code, result file, stdout, stderr, the copy's port)."""
    def run(before="pass", after="pass"):
        copy = tmp_path / "copy"
        for package in ("firmware_py", "protocol"):
            shutil.copytree(project / package, copy / package)
        with open(copy / "firmware_py" / "pipeline.py", "a") as file:
            file.write(SPOILT % (before, after))
        kept = tmp_path / "b.json"
        with board(copy) as (port, _):
            code = cli.main(["bisect", log, "--targets", "cpython,port:" + port, "--json", str(kept)])
        out, err = capsys.readouterr()
        return code, json.loads(kept.read_text()) if kept.exists() else None, out, err, "port:" + port
    return run


def test_targets_that_agree(log, capsys, micropython, tmp_path):
    code = cli.main(["bisect", log, "--targets", "cpython,unix,cpython", "--json", str(tmp_path / "b.json")])
    out = capsys.readouterr().out
    result = json.loads((tmp_path / "b.json").read_text())
    assert code == 0 and result["equal"] and result["first_difference"] is None, out
    assert list(result["hash"]) == ["cpython", "unix", "cpython #2"] and len({h["steps"] for h in result["hash"].values()}) == 1
    assert result["steps"] == 660 and result["telemetry_messages"] > 100 and "no difference in 660 answers" in out


def test_cores_that_have_no_map_yet_agree(tmp_path):
    path = tmp_path / "m.tvlog"
    path.write_bytes(wander().log(lambda number, _, raw: raw if number < 200 else None))
    result, lines = bisect_command.bisect(Recording(str(path)), {"a": BuildingCore(), "b": BuildingCore()}, Progress())
    assert result["equal"] and result["first_difference"] is None
    assert "no difference in" in lines[-1] and result["steps"] > 50 and lines[-1].endswith("; there is no map yet")


def test_a_value_behind_the_hash_is_found_at_its_step_and_shown_by_name(bisect):
    code, result, out, _, port = bisect(before="self.odometry.x_um += 1000 * (values[0] == 333)")
    first, true = result["first_difference"], wander()._ticks[BAD - 1]
    assert code == 1 and (first["step"], first["message"], first["field"]) == (BAD, "STEP_RSP", "hash16")
    assert result["steps"] == BAD and not result["equal"]
    assert first["fields"]["hash16"]["cpython"] == true.answer.hash16 != first["fields"]["hash16"][port]
    assert first["input"]["ir"] == list(true.question.ir) and first["robot_s"] == 6.66
    poses = [shown for shown in first["deeper"] if shown["message"] == "POSE"]
    assert "odometry_x_um" in poses[0]["fields"] and BAD <= poses[0]["step"] <= BAD + 5
    assert "step 333, 6.66 s of the robot: STEP_RSP hash16" in out and "* odometry_x_um" in out


def test_an_answer_that_differs_names_its_fields(bisect):
    code, result, out, _, port = bisect(after="self.left_mm_s += values[0] == 333")
    first, true = result["first_difference"], wander()._ticks[BAD - 1].answer.left_mm_s
    assert code == 1 and first["step"] == BAD and first["fields"] == {"left_mm_s": {"cpython": true, port: true + 1}}
    assert "* left_mm_s" in out and "STEP 333, in state" in out


def test_a_difference_that_only_telemetry_shows_is_found_too(bisect):
    code, result, _, _, port = bisect(before="self.explorer.bumper.bumps += 5 * (values[0] == 333)")
    first = result["first_difference"]
    assert code == 1 and first["message"] == "POSE" and BAD <= first["step"] <= BAD + 5
    assert first["fields"]["bumps"][port] == first["fields"]["bumps"]["cpython"] + 5
    assert first["input"]["step"] == first["step"] == result["steps"] - 1   # seen when the next answer was there
    assert "STATUS_RSP" in {shown["message"] for shown in first["deeper"]}


def test_telemetry_that_differs_comes_before_the_next_answer_that_does(bisect):
    pose = next(m.step for tick in wander()._ticks[BAD:] for m in tick.telemetry if m.NAME == "POSE")
    _, result, _, _, _ = bisect(before="self.explorer.bumper.bumps += 5 * (values[0] == %d)" % pose,
                                after="self.left_mm_s += values[0] == %d" % (pose + 1))
    first = result["first_difference"]
    assert (first["message"], first["step"], first["input"]["step"]) == ("POSE", pose, pose)


def test_a_core_that_dies_is_named_with_the_step(bisect):
    begin = time.monotonic()
    code, result, _, err, port = bisect(before="assert values[0] < 333")
    assert time.monotonic() - begin < 8  # of them 3 s of silence
    assert code == 3 and result is None
    assert "At step 333 on %s: the core has not answered for 3 s" % port in err


@pytest.mark.parametrize("targets, word", [
    ("unix", "names no two targets"), ("unix,", "names no two targets"), ("cpython,moon", "'moon' is no target"),
    ("cpython,port:/dev/there-is-none", "cannot be opened"),
])  # fmt: skip
def test_targets_that_are_none(log, capsys, targets, word):
    try:
        code = cli.main(["bisect", log, "--targets", targets])
    except SystemExit as exit_:
        code = exit_.code
    assert code == 2 and word in capsys.readouterr().err
