"""`evaluate`: the figures from made-up missions, what is kept, what is refused; and one small evaluation in earnest."""

import json
import os
import signal
import subprocess
import sys
import time
from array import array

import numpy as np
import pytest

from host_tools import cli, evaluate
from host_tools.evaluation import ablation, growth, localisation, pool, table2
from host_tools.evaluation.larger_core import larger_core
from host_tools.evaluation.run import FIGURES, MAX_ROBOT_S, Run, ended_well, kept
from host_tools.evaluation.section import METHODS, Plan
from host_tools.map_file import Records, encode_records
from host_tools.result import empty_result
from protocol.map_code import ABOUT, EDGES
from protocol.parameters import FLAGS
from sim_device.home import HOMES
from tests.host_tools.test_hil_mission import SMALL, hil
from tests.host_tools.test_hil_processes import alive, wait_until

PLACES = [[0.1 * i, 1.0] for i in range(20)]


@pytest.fixture
def home(tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    return str(path)


def figures(run, error_cm=2.0, finished=True, robot_s=3000.0):
    result = empty_result("small", {"target": "cpython", "link": "memory"} | run.asdict())
    result |= {"finished": finished, "reason": "outline closed" if finished else "robot time limit"}
    result["map"] |= {"vectors": 400, "ram_bytes": 3000, "stored_bytes": 1200, "precision_5cm": 0.98, "recall_5cm": 0.97, "iou_free": 0.99}
    result["time"]["robot_s"] = robot_s
    result["localisation"]["estimate"] = {"mean_cm": error_cm, "p95_cm": 2 * error_cm, "max_cm": 3 * error_cm}
    error = {method: [error_cm * (1 + i)] * 20 for i, method in enumerate(METHODS)}
    return {"run": run.asdict(), "result": result, "stops": {"true_xy": PLACES, "error_cm": error}, "missing": {},
            "grid": {"bytes": 256000, "precision_5cm": 0.9, "recall_5cm": 0.9, "robot_s": 7000.0}}


def a_map(topology):
    """A triangle, and if asked for one region with two turning nodes and the edge between."""
    records = Records(3, 1, *(1, 2, 1) if topology else ())
    for i, (x, y) in enumerate([(0, 0), (200, 0), (0, 200)]):
        records.xs[i], records.ys[i] = x, y
    records.counts[0] = 3
    if topology:
        records.regions[:] = array("H", [0, 3, 50, 2 | 1 << 8, 0, 0])
        records.shared[:4] = array("H", [20, 40, 60, 40])
        records.shared[ABOUT:ABOUT + 2] = array("H", [1 << 8, 1])
        records.shared[EDGES] = 1 | 4 << 8
    return records


def keep(folder, run, **changes):
    """As the worker leaves it."""
    place = os.path.join(folder, run.key)
    os.makedirs(place, exist_ok=True)
    track = np.array([[x + 0.01 * run.seed, y, x, y] for x, y in PLACES])
    np.save(os.path.join(place, "track.npy"), track)
    with open(os.path.join(place, FIGURES), "w") as file:
        json.dump(figures(run, **changes), file)


def kept_evaluation(home, out, makers, seeds=10, **changes):
    plan = Plan(home, tuple(range(1, seeds + 1)), str(out / "runs"))
    for run in set(evaluate.runs_for(plan, makers)):
        keep(plan.folder, run, **changes)
    return plan


def test_all_figures_come_from_what_is_kept_with_the_papers_beside(home, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    kept_evaluation(home, out, list(evaluate.FIGURES.values()))
    assert cli.main(["evaluate", "--figures", "all", "--out", str(out), "--home", home]) == 0
    said = capsys.readouterr().out
    page, told = (out / "evaluation.md").read_text(), json.loads((out / "evaluation.json").read_text())
    assert set(told["sections"]) == set(evaluate.FIGURES)
    for picture in ("fig5a", "fig5b", "fig6", "fig7", "fig8", "fig9"):
        assert (out / (picture + ".png")).stat().st_size > 5000 and picture + ".png" in page
    for text in (said, page):
        for papers in ("418.0", "202.0", "28.2", "7033.6", "3503.4", "3029.5", "458", "under 8", "about 5"):
            assert papers in text, papers
        for preset in ("UWB paper, odometry calibrated", "UWB tof, odometry poor", "UWB rssi_real, odometry poor", "mode paper"):
            assert preset in text, preset
    assert "| grid | 418.0 | 256.00 | 7033.6 | 7000.0 |" in page
    assert told["sections"]["6"]["data"]["improved, UWB paper, odometry calibrated"]["estimate"] == [2.0] * 9
    assert told["sections"]["5b"]["data"]["repetitions"] == 10


def test_a_mission_that_did_not_finish_is_told_and_left_out_of_the_means(home, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    plan = kept_evaluation(home, out, [localisation.fig6], seeds=3)
    keep(plan.folder, plan.main()[1], error_cm=900.0, finished=False)
    assert cli.main(["evaluate", "--figures", "6", "--out", str(out), "--home", home, "--seeds", "3"]) == evaluate.EXIT_NOT_FINISHED
    said = capsys.readouterr()
    assert "(2 runs)" in said.out and "| this core | 2.0 |" in said.out
    assert "1 of " in said.err and "seed 2" in said.err


def test_a_repetition_may_be_ended_after_an_hour_a_whole_mission_may_not(home):
    plan = Plan(home, (1, 2))
    whole, repeated = plan.main()
    assert not ended_well(whole, figures(whole, finished=False, robot_s=3600.0)) and ended_well(whole, figures(whole))
    assert ended_well(repeated, figures(repeated, finished=False, robot_s=3600.0))
    assert not ended_well(repeated, figures(repeated, finished=False))
    assert [run.max_robot_s for run in plan.beside("paper")] == [MAX_ROBOT_S]


def test_what_is_not_installed_is_named_and_not_measured(home, tmp_path):
    pytest.importorskip("matplotlib")
    plan = kept_evaluation(home, tmp_path, [localisation.fig6], seeds=2)
    done = {}
    for run in evaluate.runs_for(plan, [localisation.fig6]):
        done[run] = figures(run)
        del done[run]["stops"]["error_cm"]["batch"]
        done[run]["missing"] = {"batch": "gtsam"}
    section = localisation.fig6(plan, done, str(tmp_path))
    assert "| batch optimum (gtsam) | - | - | - | - |" in section.lines
    note = section.notes[-1]
    assert note.startswith("gtsam is not installed") and "tvslam[evaluate]" in note


def test_a_vector_map_is_timed_by_the_core_without_ways_which_may_fail(home, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    plan = kept_evaluation(home, out, [table2.table2])
    run = table2.without_ways(plan)
    keep(plan.folder, run, finished=False, robot_s=3900.0)
    assert cli.main(["evaluate", "--figures", "table2", "--out", str(out), "--home", home]) == 0
    said = capsys.readouterr().out
    assert "3503.4 | 3900.0 |" in said and "The mission without ways did not finish (robot time limit)" in said
    folder = larger_core(dict(run.limits), str(tmp_path / "core"))
    argv = [sys.executable, "-c", "from firmware_py.building import frontier; print(frontier._LONGEST)"]
    assert subprocess.run(argv, cwd=folder, env=os.environ | {"PYTHONPATH": os.getcwd()}, capture_output=True, text=True,
                          check=True).stdout.split() == ["0"]


def test_the_topologys_share_of_the_bytes(home, tmp_path):
    plan = Plan(home, (1,), str(tmp_path))
    run = plan.main()[0]
    result = figures(run)["result"]
    assert table2.topology_bytes(result) is None and table2.stored_topology_bytes(plan, run) is None
    result["map"]["regions"] = 2
    result["memory"]["stores"] = {name: {"used": 2, "capacity": 4, "bytes": 40} for name in ("vectors", *table2.TOPOLOGY)}
    assert table2.topology_bytes(result) == 60
    keep(plan.folder, run)
    for topology in (True, False):
        data = encode_records(a_map(topology))
        with open(os.path.join(plan.folder, run.key, "map.bin"), "wb") as file:
            file.write(data)
        share = table2.stored_topology_bytes(plan, run)
        assert share is None if not topology else 0 < share == len(data) - len(encode_records(a_map(False)))


def test_deviations_are_those_of_the_errors_about_their_mean():
    places = np.array([[1.0, 1.0], [5.0, 5.0]])
    tracks = [np.array([[1.0 + dx, 1.0 + dy, 1.0, 1.0]]) for dx, dy in ((0.13, 0.0), (0.07, 0.0), (0.10, 0.03), (0.10, -0.03))]
    deviation = localisation.deviations_cm(places, tracks)
    assert deviation[0] == pytest.approx(100 * np.sqrt(4 * 0.03 ** 2 / 3)) and np.isnan(deviation[1])


def test_exponents():
    x = [450, 900, 1800, 3600]
    assert growth.exponent(x, [2 * v ** 1.3 for v in x], [True] * 4) == pytest.approx(1.3)
    assert growth.exponent(x, [1, 2, 4, 1000], [True, True, True, False]) == pytest.approx(1.0)
    assert growth.exponent(x, [5, None, None, None], [True] * 4) is None


def test_growth_and_ablation_make_their_tables(home, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(growth, "FLOORS", ("1x1", "2x1"))
    plan = Plan(home, (1, 2), str(tmp_path))
    done = {run: figures(run) for run in growth.runs(plan)}
    section = growth.growth(plan, done, str(tmp_path))
    assert section.data["vectors"] == [458, 924] and section.data["exponents"]["robot_s"] == pytest.approx(0)
    assert (tmp_path / "growth.png").exists()
    named = ablation.variants()
    flags = [row[0] for row in FLAGS if row[1]]
    assert all("only " + flag in named and "without " + flag in named for flag in flags) and len(named) == 2 + 2 * len(flags)
    done = {run: figures(run) for run in evaluate.runs_for(plan, [ablation.ablation])}
    assert len(ablation.ablation(plan, done, str(tmp_path)).lines) == 2 + len(named)


def test_a_run_is_kept_under_its_home_options_and_code(home, tmp_path, monkeypatch):
    run = Run(home)
    others = [{"seed": 2}, {"mode": "paper"}, {"settings": ("wall_offset=off",)}, {"peers": False}]
    keys = {run.key, *(Run(home, **other).key for other in others)}
    assert len(keys) == 5 and Run(home).key == run.key
    monkeypatch.setattr("host_tools.evaluation.run.code_hash", lambda: "other code")
    assert run.key not in keys
    monkeypatch.undo()
    (tmp_path / "small.json").write_text(json.dumps(SMALL | {"start": [0.5, 1.4]}))
    assert run.key not in keys
    keep(str(tmp_path), run)
    assert kept(str(tmp_path), run)["result"]["finished"] and kept(str(tmp_path), Run(home, seed=9)) is None
    with open(os.path.join(tmp_path, run.key, FIGURES), "w") as file:
        file.write('{"half')
    assert kept(str(tmp_path), run) is None


def test_a_larger_core_has_other_limits_only(tmp_path):
    folder = larger_core({"VECTORS_MAX": 2000}, str(tmp_path))
    argv = [sys.executable, "-c", "from firmware_py.limits import VECTORS_MAX, CHAINS_MAX; print(VECTORS_MAX, CHAINS_MAX)"]
    assert subprocess.run(argv, cwd=folder, capture_output=True, text=True, check=True).stdout.split() == ["2000", "64"]
    with pytest.raises(ValueError, match="NO_SUCH_MAX"):
        larger_core({"NO_SUCH_MAX": 1}, str(tmp_path / "other"))


@pytest.mark.parametrize("argv, words", [
    ([], ("--figures all",)),
    (["--figures", "5c"], ("5c", "5a, 5b")),
    (["--figures", ""], ("(empty)",)),
    (["--figures", "all", "--home", "no_such_home"], ("no_such_home",)),
])
def test_what_cannot_be_served_is_refused_with_one_sentence(tmp_path, capsys, argv, words):
    assert cli.main(["evaluate", "--out", str(tmp_path), *argv]) == evaluate.EXIT_USAGE
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and all(word in said for word in words), said


def test_a_folder_that_cannot_be_made_is_named(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert cli.main(["evaluate", "--figures", "7", "--out", str(tmp_path / "file" / "out")]) == evaluate.EXIT_USAGE
    assert "file" in capsys.readouterr().err


class Quiet:
    def text(self, text):
        pass

    note = text

    def clear(self):
        pass


def test_a_run_in_earnest_has_the_hashes_of_the_other_targets_and_is_not_run_twice(project, home, tmp_path):
    run = Run(home, peers=False)
    (first,) = pool.figures_of([run], str(tmp_path / "runs"), 1, Quiet()).values()
    result = first["result"]
    assert result["finished"] and result["localisation"]["estimate"]["mean_cm"] < 5 and len(first["stops"]["true_xy"]) == 20
    for name in ("map.bin", "map.geojson", "track.npy"):
        assert os.path.getsize(tmp_path / "runs" / run.key / name) > 60
    process = hil(project, home, "--target", "unix", "--nvm", "none", "--json", str(tmp_path / "unix.json"))
    assert process.wait(100) == 0
    assert json.loads((tmp_path / "unix.json").read_text())["hash"] == result["hash"]
    begun = time.monotonic()
    assert pool.figures_of([run], str(tmp_path / "runs"), 1, Quiet()) == {run: first}
    assert time.monotonic() - begun < 1


def test_a_run_that_gives_no_figures_says_why(home, tmp_path):
    with pytest.raises(pool.RunError, match="no_such_flag"):
        pool.figures_of([Run(home, settings=("no_such_flag=on",))], str(tmp_path), 1, Quiet())


def test_an_interruption_leaves_no_process_and_keeps_what_there_is(project, tmp_path):
    out = tmp_path / "out"
    argv = [sys.executable, "-m", "host_tools", "evaluate", "--figures", "8", "--home", str(HOMES / "office_458.json"), "--out", str(out)]
    process = subprocess.Popen(argv, cwd=project, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    children = []
    try:
        wait_until(lambda: (out / "runs").exists() and len(_below(process.pid)) >= 2, 30)
        time.sleep(0.5)
        children = _below(process.pid)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 130 and "the same command goes on from there" in said and "Traceback" not in said, said
    wait_until(lambda: not any(map(alive, children)), 5)


def _below(pid):
    """The processes started by that one, and by those."""
    try:
        with open("/proc/%d/task/%d/children" % (pid, pid)) as file:
            children = [int(word) for word in file.read().split()]
    except OSError:
        return []
    return [each for child in children for each in [child, *_below(child)]]
