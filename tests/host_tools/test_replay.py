"""`host_tools replay LOG`: equal where nothing has changed, and where something has, the step and the field by name."""

import errno
import json
import os
from types import SimpleNamespace

import pytest

from host_tools import cli
from host_tools import replay as replay_command
from host_tools.differences import at_the_end, between_lists, between_same
from host_tools.mission import hashes
from host_tools.recording import Recording
from host_tools.replay import speed, speed_text
from protocol.log import LogWriter
from protocol.messages import BY_ID, BY_NAME
from tests.host_tools.core_driver import CoreDriver
from tests.host_tools.recorded import ASKED_AT, STEPS, changed, cut_behind, sealed, wander


@pytest.fixture
def replay(tmp_path, capsys):
    """The command in this process: (exit code, result file, what it printed, what it complained of)."""
    def run(path, *argv):
        kept = tmp_path / "result.json"
        code = cli.main(["replay", path, "--target", "cpython", *argv, "--json", str(kept)])
        out, err = capsys.readouterr()
        return code, json.loads(kept.read_text()) if kept.exists() else None, out, err
    return run


@pytest.mark.parametrize("target", ["cpython", "unix"])
def test_a_log_replays_to_the_same_answers_hash_and_map(target, written, replay, micropython):
    code, result, out, err = replay(written(wander().log()), "--target", target)
    assert code == 0 and result["equal"], out
    assert result["hash"] == result["log_hash"] == hashes(wander().status._asdict())
    assert (result["steps"], result["robot_s"], result["target"]) == (STEPS, STEPS / 50, target)
    assert result["telemetry_messages"] > 100 and result["telemetry_difference"] is None and result["damage"] is None
    assert "equal: 660 answers" in out and result["hash"]["steps"] in out and "replay:" not in err  # a slow machine shows its progress


def test_the_first_answer_that_differs_is_named_with_what_led_to_it(written, replay):
    code, result, out, _ = replay(written(changed("STEP_RSP", 300, left_mm_s=lambda v: v + 1, hash16=lambda v: v ^ 1)))
    first = result["first_difference"]
    true = wander()._ticks[299]
    assert code == 1 and not result["equal"]
    assert (first["step"], first["message"], first["field"], first["robot_s"]) == (300, "STEP_RSP", "left_mm_s", 6.0)
    assert first["fields"]["left_mm_s"] == {"log": true.answer.left_mm_s + 1, "cpython": true.answer.left_mm_s}
    assert set(first["fields"]) == {"left_mm_s", "hash16"}
    assert first["input"]["ir"] == list(true.question.ir) and first["input"]["left"] == true.question.left
    assert "different at step 300, 6.0 s of the robot: STEP_RSP left_mm_s, hash16" in out
    assert "No message of this step or of the next 5 shows another difference." in out


def test_a_log_with_other_telemetry_is_equal_and_says_so(written, replay):
    code, result, out, _ = replay(written(changed("POSE", 20, bumps=lambda v: v + 3)))
    assert code == 0 and result["equal"]
    told = result["telemetry_difference"]
    assert (told["message"], told["field"]) == ("POSE", "bumps")
    assert "telemetry       differs first at step %d: POSE bumps" % told["step"] in out


def test_the_hash_at_the_end_counts(written, replay):
    code, result, out, _ = replay(written(changed("STATUS_RSP", 2, steps_hi=lambda v: v ^ 1)))
    assert code == 1 and (result["first_difference"]["message"], result["first_difference"]["field"]) == ("STATUS_RSP", "steps_hi")
    assert result["hash"]["steps"] != result["log_hash"]["steps"] and "different at the end: STATUS_RSP steps_hi" in out


def test_a_damaged_log_is_replayed_up_to_the_damage(written, replay):
    log = bytearray(wander().log())
    answer = [number for number, (_, raw) in enumerate(wander().frames) if raw[3] == BY_NAME["STEP_RSP"].ID][399]
    at = log.index(wander().frames[answer][1]) - 6  # the record's own head
    log[at + 12] ^= 4  # a marker comes later, from which on all is sound again
    code, result, out, _ = replay(written(log))
    assert code == 0 and result["equal"] and result["steps"] == 400  # the 400th was asked, and its answer is damaged
    before = sum(raw is not None for _, raw in wander().frames[:answer])
    assert result["damage"] in out and result["damage"].startswith("it is damaged from byte %d on, behind record %d of %d; " % (
        at, before, len(wander().frames)))
    assert result["damage"].endswith(" of them lost; the step before it is 400")
    assert result["log_hash"] == {"steps": None, "map": None} and result["hash"]["steps"]


def test_a_log_that_breaks_off_says_where(written, replay):
    log = wander().log()[:-500]
    code, result, _, _ = replay(written(log))
    assert code == 0 and STEPS - 20 < result["steps"] <= STEPS
    assert "breaks off at byte" in result["damage"] and result["log_hash"]["steps"] is None


def test_a_log_that_ends_too_early_at_a_record_says_so(written, replay, capsys):
    last = [number for number, (_, raw) in enumerate(wander().frames) if raw[3] == BY_NAME["STEP_RSP"].ID][399]
    log = written(wander().log(lambda number, _, raw: raw if number <= last else None))
    code, result, out, _ = replay(log)
    assert code == 0 and result["steps"] == 400 and result["damage"] is None
    assert "it ends at step 400, before its mission did" in out
    assert cli.main(["bisect", log, "--targets", "cpython,cpython"]) == 0
    assert "it ends at step 400, before its mission did" in capsys.readouterr().out
    assert "before its mission did" not in replay(written(wander().log()))[2]


def test_what_a_core_says_of_itself_on_the_way_is_compared_and_is_no_end(written, replay):
    code, result, out, _ = replay(written(wander().log(cut_behind("STATUS_RSP", 1))))
    assert code == 0 and result["hash"] == result["log_hash"] != {"steps": None, "map": None}
    assert "it ends at step %d, before its mission did" % (ASKED_AT - 1) in out


def test_a_replay_that_takes_no_time_has_a_speed():
    assert speed_text(speed(SimpleNamespace(steps=1), 0.0004)).endswith("in 0.0 s: 2500 steps/s, 50 times real time")


def test_the_result_is_kept_before_it_is_printed_and_whole_or_not_at_all(written, tmp_path, monkeypatch, capsys):
    kept = tmp_path / "r.json"
    args = SimpleNamespace(log=written(wander().log()), json=str(kept))

    def gone(*_):
        raise BrokenPipeError
    with monkeypatch.context() as patch, pytest.raises(BrokenPipeError):
        patch.setattr(replay_command, "say", gone)
        replay_command.answered("replay", args, lambda recording: ({"equal": True}, ["a line"]))
    assert json.loads(kept.read_text()) == {"equal": True}

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr(os, "replace", full)
    assert replay_command.answered("replay", args, lambda recording: ({"equal": False}, ["a line"])) == 2
    assert "r.json cannot be written: no space left" in capsys.readouterr().err
    assert json.loads(kept.read_text()) == {"equal": True}


def test_a_file_for_the_result_is_tried_before_the_run(written, tmp_path, capsys):
    log = written(wander().log())
    for words in (["replay", log, "--target", "port:/dev/there-is-none"], ["bisect", log, "--targets", "cpython,port:/dev/there-is-none"],
                  ["budget", "--target", "port:/dev/there-is-none"]):
        assert cli.main([*words, "--json", str(tmp_path)]) == 2
        assert "is a folder" in capsys.readouterr().err, words
    assert cli.main(["replay", log, "--target", "cpython", "--json", log]) == 2
    assert "is the log, which would be overwritten" in capsys.readouterr().err


def test_a_log_without_a_step_of_the_row_is_replayed_up_to_there(written, replay):
    step = [number for number, (_, raw) in enumerate(wander().frames) if raw[3] == BY_NAME["STEP"].ID][200]
    data = wander().log(lambda number, _, raw: None if number == step else raw)
    code, result, _, _ = replay(written(data))
    assert code == 0 and result["steps"] == 200 and result["damage"] == "it goes from step 200 to step 202"


@pytest.mark.parametrize("data, word", [
    (b"", "ends within its head"), (b"hello", "no log of a TVSLAM link"), (wander().log()[:100], "ends within its head"),
    (LogWriter().head(), "holds no step"),
    (LogWriter().head(messages=[["other"]]), "no schema in its head that can be read"),
])  # fmt: skip
def test_a_file_that_cannot_be_replayed(data, word, written, replay):
    code, result, _, err = replay(written(data))
    assert code == 2 and result is None and word in err and err.count("\n") == 1


def test_a_file_that_is_none(tmp_path, replay):
    for path in (tmp_path, tmp_path / "no"):
        code, _, _, err = replay(str(path))
        assert code == 2 and str(path) in err


def questions_between(nth, status):
    """A log in which parameter 0 is asked to be set behind the nth step's answer, reliably; the answer says `status`."""
    data, writer, steps = b"", LogWriter(), 0
    data += writer.head()
    rows = []
    for direction, raw in wander().frames:
        rows.append((direction, raw))
        steps += BY_ID[raw[3]].NAME == "STEP_RSP"
        if steps == nth and BY_ID[raw[3]].NAME == "STEP_RSP":
            rows += [sealed("PARAM_SET", 200, 0, 0, 0), sealed("PARAM_VALUE", 200, 0, 0, status, 1)]
    for number, (direction, raw) in enumerate(rows):
        data += writer.record(number * 100, direction, raw)
    return data


@pytest.mark.parametrize("nth", [1, 300, STEPS])
def test_what_is_asked_between_steps_is_asked_again_in_its_turn(nth, written, replay):
    ticks = list(Recording(written(questions_between(nth, 3))).ticks())
    names = [tick.question.NAME for tick in ticks]
    assert names.count("PARAM_SET") == 1 and names.index("PARAM_SET") == nth and len(ticks) == STEPS + 1
    assert ticks[nth].answer.status == 3
    assert [tick.telemetry for tick in ticks if tick.question.NAME == "STEP"] == [tick.telemetry for tick in wander()._ticks]
    code, result, out, _ = replay(written(questions_between(nth, 3)))   # locked since the first step
    assert code == 0 and result["equal"] and result["hash"] == result["log_hash"], out


def test_another_answer_between_steps_is_a_difference(written, replay):
    for nth in (300, STEPS):
        code, result, out, _ = replay(written(questions_between(nth, 0)))
        first = result["first_difference"]
        assert code == 1 and (first["message"], first["field"]) == ("PARAM_VALUE", "status"), out
        assert first["fields"]["status"] == {"log": 0, "cpython": 3} and first["step"] == min(nth + 1, STEPS)


def test_a_core_that_drives_already_is_refused(written, replay):
    data = changed("PARAM_SET", 1, parameter=lambda _: 0)
    with CoreDriver("locked") as core:
        code, _, _, err = replay(written(data), "--target", "port:" + core.path)
    assert code == 3 and "has begun a mission already" in err


def test_a_core_that_cannot_be_had(written, replay):
    path = written(wander().log())
    for target, code, word in (("moon", 2, "is no target"), ("port:/dev/there-is-none", 2, "cannot be opened")):
        assert (found := replay(path, "--target", target))[0] == code and word in found[3]
    code, _, _, err = replay(path, "--target", "unix", "--heap", "40k")
    assert code == 3 and "heap" in err and err.count("\n") == 1
    code, _, _, err = replay(path, "--target", "unix", "--link", "semihost")
    assert code == 2 and "--target stm32" in err


def test_telemetry_is_compared_by_what_it_is():
    pose = [message for tick in wander()._ticks for message in tick.telemetry if message.NAME == "POSE"][:2]
    point = BY_NAME["POINT"](1, 0, 5, 6, 7)
    kinds = {"a": pose, "b": [pose[0], point]}
    assert between_lists(3, kinds).fields == {"message": {"a": "POSE", "b": "POINT"}}
    assert between_lists(3, {"a": pose, "b": pose[:1]}).fields == {"message": {"a": "POSE", "b": "nothing"}}
    assert between_same(3, kinds) is None
    assert between_lists(3, {"a": [point], "b": [point._replace(x=9)]}).fields == {"x": {"a": 5, "b": 9}}
    assert between_same(3, {"a": [point, *pose], "b": [*pose, point._replace(y=9)]}).fields == {"y": {"a": 6, "b": 9}}


def test_what_belongs_to_the_machine_is_no_difference():
    status = wander().status
    other = status._replace(heap_bytes=1, heap_used_bytes=2, heap_locked=0, allocated_after_boot_bytes=0, late_ms=7)
    assert at_the_end(9, {"a": status, "b": other}, {"a": b"map", "b": b"map"}) is None
    assert at_the_end(9, {"a": status, "b": other}, {"a": b"map", "b": b"mop"}).fields == {"byte 1": {"a": 97, "b": 111}}
    assert at_the_end(9, {"a": status, "b": other}, {"a": b"map", "b": b"ma"}).names == "map bytes"
    assert at_the_end(9, {"a": status, "b": other._replace(path_mm=0)}, {}).names == "STATUS_RSP path_mm"
