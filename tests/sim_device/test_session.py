# Stories of a mission: the virtual robot as people run it, a core at the far end.

import resource
import signal
import time

import pytest

from protocol import schema
from protocol.parameters import PARAMETERS
from tests.sim_device.fake_core import MAP
from tests.sim_device.faulty_mission import mission
from tests.sim_device.lockstep import Lockstep, messages, read_log

TRUTH_BYTES = 28


@pytest.fixture
def story(tmp_path):
    with Lockstep(tmp_path) as story:
        yield story


def test_a_mission_ends_with_a_map_a_log_and_the_truth(story, tmp_path):
    files = [tmp_path / name for name in ("log", "truth", "map")]
    core = story.core("--steps", 300)
    code, events, err = story.finish(story.sim("--log", str(files[0]), "--truth", str(files[1]), "--map", str(files[2])))
    assert (code, err) == (0, "")
    names = [event["event"] for event in events]
    assert names[:2] == ["ready", "start"] and names[-1] == "end" and set(names[2:-1]) == {"progress"}
    end = events[-1]
    assert end["finished"] and end["steps"] == 300 and end["reason"] == "outline closed"
    assert not any(count for cause, count in end["dropped"].items() if cause != "answered_twice")
    assert files[2].read_bytes() == MAP and end["map_bytes"] == len(MAP)
    assert files[1].stat().st_size == 300 * TRUTH_BYTES
    reader, records = read_log(files[0])
    assert reader.damaged == 0 and reader.left_over == 0 and len(records) == end["frames"]
    assert reader.told["home"] == "studio" and reader.told["messages"][0][1] == schema.MESSAGES[0][1]
    told = messages(records)
    assert [m.step for m in told if m.NAME == "STEP"] == list(range(1, 301))
    assert list(dict.fromkeys(m.step for m in told if m.NAME == "STEP_RSP")) == list(range(1, 301))
    assert core.poll() in (None, 0), "nobody ends the core but itself"
    assert story.names_left() == []


def test_any_start_order(story):
    sim = story.sim()
    story.events_until(sim, "ready")
    time.sleep(0.3)
    story.core("--steps", 20)
    code, events, _ = story.finish(sim)
    assert code == 0 and events[-1]["steps"] == 20


def test_what_is_lost_is_asked_for_again_and_changes_nothing(story, tmp_path):
    truths = []
    for name, core in (("calm", ("--steps", 120)), ("lossy", ("--steps", 120, "--fault", "loses", "--at", 60))):
        code, events, _ = story.run("--truth", str(tmp_path / name), core=core)
        assert code == 0
        assert events[-1]["status"]["steps_lo"] == 120, "a repeated step is executed once"
        assert events[-1]["resent"] >= (0 if name == "calm" else 3)
        truths.append((tmp_path / name).read_bytes())
        story.processes[-2].kill()
        story.processes[-2].wait()
    assert truths[0] == truths[1]


@pytest.mark.parametrize("fault, sentence", [
    ("closes", "the core has closed {link} while it was in use"),
    ("deaf", "the core on {link} has not answered STEP 100 for 3 s"),
    ("refuses", "refused parameter track[0] ="),
    ("old_schema", "message schema is"),
    ("garbage", "but no frame of this protocol"),
    ("silence", "nobody answered on {link} within 2"),
    ("bad_map", "wrong check sum"),
])
def test_a_core_that_fails_is_named_in_one_sentence(story, fault, sentence):
    code, events, err = story.run("--wait", "2" if fault == "silence" else "20", core=("--fault", fault))
    assert code == 3
    assert events[-1]["event"] == "error" and events[-1]["exit"] == 3
    assert sentence.format(link=story.link) in events[-1]["sentence"]
    assert err == "sim_device: %s\n" % events[-1]["sentence"]
    assert story.names_left() == []
    if fault == "deaf":
        assert events[-1]["steps"] == 99 and events[-1]["resent"] >= 10


def test_a_state_without_a_name_goes_by_its_number(story):
    code, events, err = story.run("--max-robot-s", "2", core=("--fault", "odd_state"))
    assert code == 1 and events[-1]["state"] == "state 200" and err == ""
    assert "state 200" in {event["state"] for event in events if event["event"] == "progress"}


def test_what_the_core_says_of_itself_on_the_way_is_told_once(story, tmp_path):
    code, events, err = story.run("--log", str(tmp_path / "log"), core=("--fault", "ill", "--at", "600", "--steps", "2100"))
    assert (code, err) == (0, "")
    assert [(event["step"], event["names"]) for event in events if event["event"] == "degraded"] == [(1000, ["infrared"])]
    told = messages(read_log(tmp_path / "log")[1])
    assert [m.step for m in told if m.NAME == "STATUS_RSP"] == [500, 1000, 1500, 2000, 2100]


def test_a_core_that_starts_anew_begins_its_mission_where_the_robot_stands(story, tmp_path):
    code, events, err = story.run("--log", str(tmp_path / "log"), core=("--fault", "restarts", "--steps", 200))
    assert (code, err) == (0, "")
    assert [event["step"] for event in events if event["event"] == "restart"] == [100] and events[-1]["restarts"] == 1
    told = messages(read_log(tmp_path / "log")[1])
    hellos = [at for at, m in enumerate(told) if m.NAME == "HELLO"]
    last_pose = [m for m in told[:hellos[-1]] if m.NAME == "POSE"][-1]
    number = [row[0] for row in PARAMETERS].index("dock_x")
    docks = [m.value for m in told if m.NAME == "PARAM_VALUE" and m.parameter == number]
    assert docks[0] == 500000 and abs(docks[-1] - last_pose.x_um) < 40000
    assert list(dict.fromkeys(m.step for m in told if m.NAME == "STEP_RSP")) == list(range(1, 201))


def test_a_core_that_gives_up_is_no_failure_of_ours(story):
    code, events, err = story.run(core=("--fault", "fails", "--steps", 50))
    assert (code, err) == (1, "")
    assert not events[-1]["finished"] and events[-1]["state"] == "FAILED" and events[-1]["reason"].startswith("stuck")


def test_a_core_without_a_map_is_said_to_have_none(story, tmp_path):
    code, events, _ = story.run("--map", str(tmp_path / "map"), core=("--fault", "no_map", "--steps", 50))
    assert code == 0 and events[-1]["map_bytes"] is None


def test_robot_time_is_limited(story):
    code, events, _ = story.run("--max-robot-s", "2", core=("--steps", 10**6))
    assert code == 1
    assert events[-1]["reason"] == "robot time limit" and events[-1]["steps"] == 100 and events[-1]["map_bytes"] == len(MAP)


def test_a_mission_that_is_cut_off_while_its_map_is_built_has_not_finished(story):
    code, events, _ = story.run("--max-robot-s", "1", core=("--fault", "builds"))
    assert code == 1 and events[-1]["status"]["finished"] == 1
    assert (events[-1]["finished"], events[-1]["reason"]) == (False, "robot time limit")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_cleanly(story, tmp_path, number):
    story.core("--steps", 10**6)
    sim = story.sim("--log", str(tmp_path / "log"), "--tap", str(tmp_path / "tap"))
    story.events_until(sim, "progress")
    sim.send_signal(number)
    code, events, err = story.finish(sim)
    assert (code, err) == (130, "")
    assert events[-1]["event"] == "end" and events[-1]["reason"] == "interrupted" and not events[-1]["finished"]
    reader, records = read_log(tmp_path / "log")
    assert reader.left_over == 0 and reader.damaged == 0
    assert messages(records[-2000:])[-1].NAME in ("MAP_DATA", "STATUS_RSP"), "what there is was collected"
    assert story.names_left() == []


def test_a_second_interrupt_ends_also_what_is_asked_at_the_end(story):
    story.core("--steps", 20, "--fault", "deaf_at_end")
    sim = story.sim()
    story.events_until(sim, "start")
    time.sleep(1.0)
    for _ in range(2):
        sim.send_signal(signal.SIGINT)
        time.sleep(0.1)
    code, events, err = story.finish(sim)
    assert (code, err) == (130, "") and events[-1]["reason"] == "interrupted"


def test_an_interrupt_while_nobody_is_there(story):
    sim = story.sim()
    story.events_until(sim, "ready")
    sim.send_signal(signal.SIGINT)
    code, events, _ = story.finish(sim)
    assert code == 130 and events[-1]["reason"] == "interrupted" and events[-1]["steps"] == 0
    assert story.names_left() == []


def test_a_full_disk_ends_no_mission_and_loses_nothing_that_was_written(story, tmp_path):
    limit = 100_000
    code, events, _ = story.run(
        "--log", str(tmp_path / "log"), "--log-rest", str(tmp_path / "rest"), core=("--steps", 3000),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    end = events[-1]
    assert (code, end["event"], end["finished"], end["steps"]) == (3, "end", True, 3000) and end["map_bytes"]
    assert "log is incomplete: it could not be written any further after %d bytes: File too large" % limit in end["incomplete"]
    reader, records = read_log(tmp_path / "log")
    assert reader.damaged_at is None and len(records) > 1500 and reader.left_over < 300
    assert "breaks off at byte" in reader.damage
    (tmp_path / "whole").write_bytes((tmp_path / "log").read_bytes() + (tmp_path / "rest").read_bytes())
    reader, more = read_log(tmp_path / "whole")
    assert more[:len(records)] == records and len(more) > 1.8 * len(records) and reader.damaged_at is None


def test_two_missions_do_not_write_one_log(story, tmp_path):
    story.core("--steps", 10**6)
    first = story.sim("--log", str(tmp_path / "log"))
    story.events_until(first, "progress")
    before = (tmp_path / "log").stat().st_size
    with Lockstep(tmp_path) as second:
        second.link = tmp_path / "other"
        code, events, _ = second.finish(second.sim("--log", str(tmp_path / "log")))
    assert code == 2 and "is being written by another mission: give another name" in events[-1]["sentence"]
    assert (tmp_path / "log").stat().st_size >= before
    first.send_signal(signal.SIGINT)
    assert story.finish(first)[0] == 130
    assert read_log(tmp_path / "log")[0].damage == ""


def test_a_killed_robot_leaves_a_log_up_to_a_moment_before(story, tmp_path):
    log, truth = tmp_path / "log", tmp_path / "truth"
    story.core("--steps", 10**6)
    sim = story.sim("--realtime", "--log", str(log), "--truth", str(truth))
    story.events_until(sim, "progress")
    time.sleep(1.0)
    sim.kill()
    sim.wait()
    reader, records = read_log(log)
    assert reader.damaged_at is None
    steps = [message.step for message in messages(records) if message.NAME == "STEP"]
    assert steps[-1] > 30, "a second was driven: 50 steps, of which the last quarter of a second may be missing"
    assert truth.stat().st_size > 30 * TRUTH_BYTES


def test_real_time_is_fifty_steps_a_second(story):
    code, events, _ = story.run("--realtime", core=("--steps", 60))
    assert code == 0
    assert 1.1 <= events[-1]["wall_s"] <= 3.0


def test_a_core_that_restarts_while_the_clocks_are_joined_is_joined_again(story):
    code, events, err = story.run("--realtime", core=("--fault", "restarts_when_pinged", "--steps", 30))
    assert (code, err) == (0, "")
    assert events[-1]["restarts"] == 2 and [event["event"] for event in events][:4] == ["ready", "restart", "restart", "start"]


def test_who_reads_the_events_may_go_away(story):
    story.core("--steps", 10**6)
    sim = story.sim()
    story.events_until(sim, "progress")
    sim.stdout.close()
    sim.wait(20)
    assert sim.returncode == 130 and sim.stderr.read() == "" and story.names_left() == []
    sim.stdout = None


def test_for_people_there_are_plain_lines(story):
    story.core("--steps", 50)
    sim = story.sim(json_lines=False)
    out, err = sim.communicate(timeout=60)
    assert sim.returncode == 0 and out == ""
    assert "waiting for the core" in err and "finished: outline closed (DONE). 1.0 s of robot time" in err


def test_the_mode_reaches_the_core(story, tmp_path):
    code, _, _ = story.run("--mode", "paper", "--log", str(tmp_path / "log"), core=("--steps", 5))
    assert code == 0
    names = [row[0] for row in PARAMETERS]
    told = {names[m.parameter]: m.value for m in messages(read_log(tmp_path / "log")[1]) if m.NAME == "PARAM_VALUE"}
    assert told["mode"] == 1 and told["dock_x"] == 500000


def test_stores_that_were_not_told_of_are_asked_for():
    # A mission of one step, and one on a line that lost half of them: telemetry is not repeated.
    for steps, faults in ((1, ""), (60, "drop=0.2")):
        got = mission(steps=steps, faults=faults).session
        assert sorted(store.index for store in got.peer.stores.values()) == list(range(got.peer.hello.stores))
