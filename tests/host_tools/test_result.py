"""The result file: every key in every result, and the figures of a mission whose errors are known."""

import json
import math

import numpy as np
import pytest

from host_tools import report
from host_tools.result import empty_result, errors_cm, evaluate, mission_map, tum_rows
from host_tools.map_file import encode_map
from host_tools.mission_log import LogError, read_mission, read_truth
from host_tools.peers.dead_reckoning import dead_reckoning
from host_tools.peers.paper_rule import paper_rule
from host_tools.peers.uwb_only import positions
from host_tools.score import HomeTruth
from protocol import states
from tests.host_tools.score_cases import chain, home, rectangle
from tests.host_tools.synthetic_mission import DOCK, GEOMETRY, SyntheticMission

OPTIONS = {"target": "unix", "link": "pty", "mode": "improved", "uwb": "tof", "odometry": "calibrated", "seed": 1}
HOME = home(rectangle(0.5, 0.5, 3.5, 3.5), start=DOCK[:2])
END = {"wall_s": 2.0, "path_m": 8.1, "contacts": 3, "frames": 10, "bytes": 20, "dropped": {"bad_crc": 1}, "resent": 4}
ERROR_KEYS = {"mean_cm", "p95_cm", "max_cm"}
# The contract with scripts, written out once more: a key renamed in the code must fail here.
KEYS = {
    "": {"schema", "home", "target", "link", "mode", "uwb", "odometry", "seed", "finished", "reason", "degraded", "time", "localisation",
         "map", "memory", "tick", "link_stats", "storage", "free_run", "can", "cleaning", "update", "days", "hash"},
    "time": {"robot_s", "wall_s", "real_time_factor", "path_m", "lower_bound_s", "contacts"},
    "localisation": {"stops", "estimate", "dead_reckoning", "uwb_only", "paper_rule", "trajectory_rmse_cm"},
    "localisation.estimate": ERROR_KEYS, "localisation.dead_reckoning": ERROR_KEYS, "localisation.uwb_only": ERROR_KEYS,
    "localisation.paper_rule": ERROR_KEYS,
    "map": {"vectors", "chains", "regions", "true_rooms", "turning_nodes", "edges", "ram_bytes", "ram_capacity_bytes", "stored_bytes",
            "precision_5cm", "recall_5cm", "outline_precision_5cm", "outline_recall_5cm", "hausdorff_p95_cm", "iou_free", "closure_cm"},
    "map.closure_cm": {"before", "after"},
    "memory": {"heap_bytes", "heap_peak_bytes", "static_ram_bytes", "stack_peak_bytes", "flash_bytes", "boot_s", "stores",
               "heap_locked", "allocated_after_boot_bytes"},
    "tick": {"count", "p50_us", "p99_us", "max_us", "instructions_p99", "instructions_max"},
    "link_stats": {"frames", "bytes", "dropped_by_cause", "retransmits"},
    "free_run": {"core_late_ticks", "core_late_ms", "late_answers", "late_answer_ms", "missed_ticks", "drift_ppm", "residual_ms",
                 "clock_jumps", "round_trip_ms", "margin_ms"},
    "storage": {"nvm_bytes", "kept", "found", "erases", "programs", "reads", "written_bytes", "restarts"},
    "can": {"frames", "bus_load", "bus_load_max", "lost", "refused", "dropped"},
    "cleaning": {"coverage", "overlap", "robot_s"},
    "update": {"robot_s", "full_robot_s", "regions_rebuilt"},
    "hash": {"steps", "map"},
}


def result_of(story, folder, the_home=HOME, end=END, **options):
    mission = read_mission(*story.save(folder))
    result = empty_result(the_home.name, OPTIONS | options)
    the_map, _ = mission_map(mission)
    return evaluate(result, mission, HomeTruth(the_home), the_map, end, len(the_home.rooms)), mission


def room_map(**counts):
    return encode_map([chain(rectangle(0.5, 0.5, 3.5, 3.5))], **counts)


def expect_all_keys(result):
    for path, keys in KEYS.items():
        part = result
        for name in filter(None, path.split(".")):
            part = part[name]
        assert set(part) == keys, path
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_an_empty_result_has_every_key_and_measures_nothing():
    result = empty_result("a home", OPTIONS)
    expect_all_keys(result)
    assert result["schema"] == 1 and result["finished"] is False
    for name in ("time", "tick", "cleaning", "update", "hash"):
        assert set(result[name].values()) == {None}, name
    assert result["localisation"]["estimate"]["mean_cm"] is None and result["map"]["vectors"] is None


def test_two_empty_results_share_nothing():
    one, other = empty_result("a", OPTIONS), empty_result("b", OPTIONS)
    one["localisation"]["estimate"]["mean_cm"] = 1
    one["map"]["closure_cm"]["before"] = 1
    assert other["localisation"]["dead_reckoning"]["mean_cm"] is None and other["localisation"]["estimate"]["mean_cm"] is None
    assert other["map"]["closure_cm"]["before"] is None


def test_a_finished_mission(tmp_path):
    story = SyntheticMission().finish(room_map())
    result, mission = result_of(story, tmp_path)
    expect_all_keys(result)
    assert result["finished"] is True and result["reason"] == states.REASONS[states.REASON_CLOSED]
    time = result["time"]
    assert time["robot_s"] == pytest.approx(story.number * 0.02)
    assert time["real_time_factor"] == pytest.approx(story.number * 0.02 / 2.0)
    assert (time["path_m"], time["contacts"], time["wall_s"]) == (8.1, 3, 2.0)
    assert result["hash"] == {"steps": "00adbeef", "map": "10000002"}
    assert result["map"]["closure_cm"] == {"before": 12.3, "after": 0.4}
    assert (result["map"]["vectors"], result["map"]["chains"]) == (4, 1)
    assert result["map"]["stored_bytes"] == len(room_map()) < 10 + 4 * 6 + 4 + 4
    assert result["map"]["ram_bytes"] == 4 * 6 + 1 * 4 and result["map"]["ram_capacity_bytes"] == 768 * 6 + 64 * 4
    assert result["map"]["regions"] is None and result["map"]["true_rooms"] == 1
    assert result["map"]["outline_precision_5cm"] == result["map"]["outline_recall_5cm"] == 1.0
    assert result["map"]["iou_free"] == pytest.approx(1.0)
    assert result["memory"]["stores"]["points"] == {"used": 7, "capacity": 64, "bytes": 512}
    assert (result["memory"]["heap_bytes"], result["memory"]["heap_peak_bytes"]) == (196608, 98304)
    assert result["memory"]["allocated_after_boot_bytes"] == 0 and result["memory"]["heap_locked"] is True
    assert result["tick"]["count"] == story.number
    assert result["tick"]["p50_us"] == result["tick"]["max_us"] == 20000 and result["tick"]["instructions_max"] is None
    assert result["link_stats"] == {"frames": 10, "bytes": 20, "dropped_by_cause": {"bad_crc": 1}, "retransmits": 4}


@pytest.mark.parametrize("state", [states.BUILD, states.SAVE])
def test_a_mission_whose_map_is_not_built_yet_has_not_finished(tmp_path, state):
    result, _ = result_of(SyntheticMission().finish(state=state), tmp_path)
    assert (result["finished"], result["reason"]) == (False, "") and result["map"]["closure_cm"]["before"] is None


def test_position_errors_are_those_that_were_put_in(tmp_path):
    figures = result_of(SyntheticMission(offset_m=(0.03, 0.04)).finish(), tmp_path)[0]["localisation"]
    for key in ("mean_cm", "p95_cm", "max_cm"):
        assert figures["estimate"][key] == pytest.approx(5.0, abs=1e-3)  # 3-4-5
    assert figures["trajectory_rmse_cm"] == pytest.approx(5.0, abs=1e-3)
    assert figures["dead_reckoning"]["max_cm"] < 1e-6  # the encoders of the story are exact
    assert figures["uwb_only"]["max_cm"] < 0.2  # ranges to 1 mm
    assert figures["paper_rule"]["max_cm"] < 2.0  # within the rule's threshold of 20 mm nothing is replaced


def test_signal_strength_is_turned_into_range_by_the_papers_equation(tmp_path):
    figures = result_of(SyntheticMission(source=1).finish(), tmp_path)[0]["localisation"]
    assert figures["uwb_only"]["max_cm"] < 0.5  # levels to 0.01 dB are ranges to 0.14 %


def test_without_uwb_its_columns_are_null(tmp_path):
    figures = result_of(SyntheticMission(source=0).finish(), tmp_path)[0]["localisation"]
    assert set(figures["uwb_only"].values()) == set(figures["paper_rule"].values()) == {None}
    assert figures["dead_reckoning"]["mean_cm"] is not None


def test_a_step_sent_twice_counts_once(tmp_path):
    once, _ = result_of(SyntheticMission().finish(), tmp_path)
    twice, _ = result_of(SyntheticMission(repeat_steps=True).finish(), tmp_path)
    assert twice["time"]["robot_s"] == once["time"]["robot_s"]
    assert twice["localisation"] == once["localisation"]


def test_turning_points_are_told_once_each(tmp_path):
    mission = read_mission(*SyntheticMission().finish().save(tmp_path))
    turned = np.diff(mission.right - mission.left) > 0
    assert mission.turn_rows == pytest.approx(np.flatnonzero(turned) + 1) and len(mission.turn_rows) == 4


def test_stops_depend_on_the_seed_and_on_nothing_else(tmp_path):
    story = SyntheticMission().finish()
    mission = read_mission(*story.save(tmp_path))
    mission.pose[:, 1] += np.linspace(0, 1, len(mission.pose))  # an error that grows
    figures = []
    for seed in (1, 1, 2):
        result = evaluate(empty_result("h", OPTIONS | {"seed": seed}), mission, HomeTruth(HOME), None, {}, 1)
        figures.append(result["localisation"]["estimate"])
    assert figures[0] == figures[1] != figures[2]
    assert figures[0]["mean_cm"] < figures[0]["p95_cm"] <= figures[0]["max_cm"]


def test_an_unfinished_mission_has_no_closure_and_no_enclosed_space(tmp_path):
    result, _ = result_of(SyntheticMission().finish(room_map(), finished=0, reason=states.REASON_TOO_LONG), tmp_path)
    expect_all_keys(result)
    assert result["finished"] is False and result["reason"] == states.REASONS[states.REASON_TOO_LONG]
    assert result["map"]["closure_cm"] == {"before": None, "after": None}
    assert result["map"]["iou_free"] is None and result["map"]["outline_recall_5cm"] == 1.0


def test_a_store_that_ran_full_is_named_and_the_mission_is_finished_all_the_same(tmp_path):
    result, _ = result_of(SyntheticMission().finish(room_map(), reason=states.REASON_STORE_FULL, degraded=0b11), tmp_path)
    assert result["finished"] is True and result["degraded"] == ["vectors", "chains"]
    assert result["reason"] == states.REASONS[states.REASON_STORE_FULL]


def test_on_cpython_there_is_no_heap_to_measure(tmp_path):
    memory = result_of(SyntheticMission().finish(heap_bytes=0), tmp_path)[0]["memory"]
    assert memory["heap_bytes"] is memory["heap_peak_bytes"] is memory["allocated_after_boot_bytes"] is None


@pytest.mark.parametrize("factor, text", [(None, "factor -"), (2.71, "factor 2.7 "), (84.3, "factor 84 ")])
def test_how_near_to_real_time_is_told_to_a_tenth(factor, text):
    result = empty_result("a home", OPTIONS)
    result["time"]["real_time_factor"] = factor
    assert any(text in line for line in report.table(result))


def test_a_map_with_a_chunk_missing_is_no_map(tmp_path):
    story = SyntheticMission().finish(encode_map([chain(rectangle(0, 0, 1, 1)) for _ in range(40)]), drop_chunk=88)
    result, mission = result_of(story, tmp_path)
    assert mission.map_bytes is None and mission_map(mission) == (None, "the core sent no map")
    assert result["map"]["vectors"] is None and result["map"]["recall_5cm"] is None


def test_a_log_cut_short_is_scored_as_far_as_it_goes(tmp_path):
    story = SyntheticMission()
    story.log, story.truth = story.log[:len(story.log) // 2], story.truth[:-5]
    result, mission = result_of(story, tmp_path, end={})
    expect_all_keys(result)
    assert 0 < len(mission.step) < story.number and len(mission.truth) == story.number - 1
    assert result["finished"] is False and result["localisation"]["estimate"]["mean_cm"] == pytest.approx(5.0, abs=1e-3)
    assert result["time"]["wall_s"] is None and result["time"]["contacts"] is None


@pytest.mark.parametrize("content", [None, b"", b"no log at all", b"TVSLAM1\n\xff\xff\xff\x7f"])
def test_a_log_that_is_none_is_one_sentence(tmp_path, content):
    path = tmp_path / "mission.log"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LogError) as caught:
        read_mission(path, tmp_path / "no-truth")
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")
    assert len(read_truth(tmp_path / "no-truth")) == 0


def test_dead_reckoning_of_a_circle():
    # One wheel stands still: the robot turns about it on a circle of half the track.
    diameter, track, pulses = GEOMETRY
    metres = math.pi * diameter / pulses
    count = round(2 * math.pi * track / metres)
    path = dead_reckoning(np.zeros(count), np.ones(count), GEOMETRY, (1.0, 2.0, 0.0))
    assert path[-1, 2] == pytest.approx(2 * math.pi, abs=metres / track)
    assert path[:, 1].max() == pytest.approx(2.0 + track, abs=1e-4) and path[:, 0].max() == pytest.approx(1.0 + track / 2, abs=1e-4)
    assert path[-1, :2] == pytest.approx((1.0, 2.0), abs=1e-3)


def test_uwb_with_fewer_than_three_anchors_gives_no_position():
    model = {"source": 2, "level_1m_db": -47, "gamma": 1.7, "sigma_db": 0, "level_min_db": -90}
    anchors = np.array([(0, 0, 2), (4, 0, 2), (0, 4, 2)], float)
    ids = np.array([(0, 1, 2), (0, 1, -1), (0, 1, 9)])
    ranges = np.rint(np.hypot(np.hypot(anchors[:, 0] - 1, anchors[:, 1] - 1.5), 2) * 1000)
    found = positions(ids, np.zeros((3, 3)), np.tile(ranges, (3, 1)), model, anchors)
    assert found[0] == pytest.approx((1, 1.5), abs=0.002)
    assert np.isnan(found[1:]).all()


def test_uwb_below_the_threshold_of_strength_is_not_used():
    model = {"source": 1, "level_1m_db": -47, "gamma": 1.7, "sigma_db": 0, "level_min_db": -70}
    anchors = np.array([(0, 0, 2), (4, 0, 2), (0, 4, 2), (4, 4, 2)], float)
    slant = np.hypot(np.hypot(anchors[:, 0] - 1, anchors[:, 1] - 1.5), 2)
    levels = (-47 - 17 * np.log10(slant)) * 100
    weak = levels.copy()
    weak[3] = -8000  # a wrong range of 87 m, too weak to count
    found = positions(np.tile(np.arange(4), (2, 1)), np.vstack([levels, weak]), np.zeros((2, 4)), model, anchors)
    assert found[0] == pytest.approx((1, 1.5), abs=1e-6) and found[1] == pytest.approx((1, 1.5), abs=1e-6)


def test_the_papers_rule_replaces_position_and_heading_at_turning_points():
    # Truth: 10 m along x, then 10 m along y. The encoders see a heading 0.1 rad off from the start.
    t = np.linspace(0, 10, 101)
    truth = np.vstack([np.column_stack([t, 0 * t]), np.column_stack([10 + 0 * t[1:], t[1:]])])
    turned = np.array([[math.cos(0.1), math.sin(0.1)], [-math.sin(0.1), math.cos(0.1)]])
    local = np.column_stack([truth @ turned, np.where(np.arange(201) <= 100, 0.1, 0.1 + math.pi / 2)])
    turns = [0, 100]
    corrected = paper_rule(local, turns, truth[turns], (0.02, 0.01), (0, 0, 0))
    assert corrected[99, :2] == pytest.approx(local[99, :2])  # before the second fix nothing is known
    assert corrected[100, :2] == pytest.approx(truth[100]) and corrected[200, :2] == pytest.approx(truth[200], abs=1e-9)
    assert corrected[200, 2] == pytest.approx(math.pi / 2)


def test_the_papers_rule_keeps_what_lies_within_its_thresholds():
    local = np.column_stack([np.linspace(0, 4, 41), np.zeros(41), np.zeros(41)])
    near = np.array([(1.0, 0.015), (3.0, 0.015)])
    assert paper_rule(local, [10, 30], near, (0.02, 0.01), (0, 0, 0)) == pytest.approx(local)
    far = near + (0, 0.01)
    assert paper_rule(local, [10, 30], far, (0.02, 0.01), (0, 0, 0))[-1, 1] == pytest.approx(0.025)


def test_errors_leave_out_places_without_a_position():
    assert errors_cm(np.array([0.01, np.nan, 0.03])) == pytest.approx({"mean_cm": 2.0, "p95_cm": 2.9, "max_cm": 3.0})
    assert set(errors_cm(np.array([np.nan])).values()) == {None}


def test_trajectories_have_a_row_each_tenth_of_a_second(tmp_path):
    story = SyntheticMission().finish()
    estimate, truth = tum_rows(read_mission(*story.save(tmp_path)))
    assert np.diff(estimate[:, 0]) == pytest.approx(0.1)
    assert truth[:, 1:] == pytest.approx(story.true_path[::5])
    assert estimate[:, 1:3] - truth[:, 1:3] == pytest.approx(np.tile((0.03, 0.04), (len(truth), 1)), abs=1e-6)
