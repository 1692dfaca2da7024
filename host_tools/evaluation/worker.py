"""One run in a process of its own: `python -m host_tools.evaluation.worker FOLDER` reads FOLDER/run.json, drives the mission,
measures, and writes map.bin and, last of all and whole, figures.json. On stdout a JSON line now and then: how far it is.
"""

import argparse
import json
import os
import sys
import tempfile

import numpy as np

from host_tools import hil_options
from host_tools import result as scoring
from host_tools.evaluation.larger_core import larger_core
from host_tools.evaluation.run import FIGURES, from_dict
from host_tools.export import geojson
from host_tools.mission_log import LogError, read_mission
from host_tools.mission_run import run_mission
from host_tools.peers import batch, kalman, occupancy
from host_tools.peers.odometry_steps import events
from host_tools.processes import signals_as_interrupt
from host_tools.score import HomeTruth
from host_tools.whole_file import whole_file, write_result
from sim_device.home import load_home

TRACK_EACH = 5  # of the poses, one each 0.1 s


def main(folder):
    with open(os.path.join(folder, "run.json"), encoding="utf-8") as file:
        run = from_dict(json.load(file))
    try:
        with signals_as_interrupt(), tempfile.TemporaryDirectory(prefix="tvslam-") as scratch:
            figures = measured(run, scratch, folder)
    except (KeyboardInterrupt, LogError) as error:
        print("interrupted" if isinstance(error, KeyboardInterrupt) else error, file=sys.stderr)
        return 130 if isinstance(error, KeyboardInterrupt) else 3
    if isinstance(figures, str):
        print(figures, file=sys.stderr)
        return 3
    write_result(os.path.join(folder, FIGURES), figures)
    return 0


def measured(run, scratch, folder):
    """The figures of the run, or a sentence: why there are none."""
    parser = argparse.ArgumentParser()
    hil_options.add_arguments(parser)
    args = parser.parse_args([run.home, "--target", "cpython", "--link", "memory", "--mode", run.mode, "--uwb", run.uwb, "--odometry",
                              run.odometry, "--seed", str(run.seed), "--max-robot-s", str(run.max_robot_s),
                              "--nvm", "none"]
                             + [word for setting in run.settings for word in ("--set", setting)])
    hil_options.check(args)
    if run.limits:
        args.core_folder = larger_core(dict(run.limits), scratch)
    log, truth_path = os.path.join(scratch, "log"), os.path.join(scratch, "truth")
    outcome = run_mission(args, run.home, scratch, log, truth_path, _Told())
    if outcome.interrupted:
        raise KeyboardInterrupt
    if outcome.exit_code in (2, 3):
        return outcome.sentence
    home, mission = load_home(run.home), read_mission(log, truth_path)
    truth = HomeTruth(home)
    vector_map, _ = scoring.mission_map(mission)
    result = scoring.evaluate(scoring.empty_result(home.name, vars(args)), mission, truth, vector_map, outcome.end, len(home.rooms))
    if not result["finished"] and result["reason"] in ("", "running"):
        result["reason"] = outcome.sentence or outcome.end.get("reason") or "ended before the mission did"
    if vector_map is not None:
        with whole_file(os.path.join(folder, "map.bin")) as beside, open(beside, "wb") as file:
            file.write(mission.map_bytes)
        with whole_file(os.path.join(folder, "map.geojson")) as beside, open(beside, "w", encoding="utf-8") as file:
            json.dump(geojson(vector_map, home.name), file)
    with whole_file(os.path.join(folder, "track.npy")) as beside, open(beside, "wb") as file:
        np.save(file, _track(mission))
    return {"run": run.asdict(), "result": result, **_peers(run, mission, truth)}


def _track(mission):
    """(n, 4) estimated and true x, y, twice a second."""
    estimate, actual = mission.matched_poses()
    return np.hstack([estimate[::TRACK_EACH, 1:3], actual[::TRACK_EACH, 1:3]]).astype(np.float32)


def _peers(run, mission, truth):
    rows, estimate, actual = scoring.stops(mission, run.seed)
    errors = scoring.stop_errors(mission, rows, estimate, actual)
    tracks, missing = _tracks(mission, rows) if run.peers and len(rows) else ({}, {})
    for name, xy in tracks.items():
        errors[name] = np.hypot(xy[:, 0] - actual[:, 0], xy[:, 1] - actual[:, 1])
    speed_m_s, turn_rad_s = mission.parameter("speed_max") / 1000, mission.parameter("turn_max") / 1000
    grid = occupancy.scores(occupancy.built(mission, truth.free.bounds), truth) if run.peers else None
    if grid is not None:
        grid["robot_s"] = occupancy.sweep_s(truth, speed_m_s, turn_rad_s)
    return {"stops": {"true_xy": actual.tolist(), "error_cm": {name: _centimetres(each) for name, each in errors.items()}},
            "missing": missing, "grid": grid}


def _tracks(mission, rows):
    """({method: (len(rows), 2) positions}, {method: the library that it lacks})"""
    every, _ = events(mission, rows)
    tracks, missing = {}, {}
    for name, library, track in (
            ("ekf", "filterpy", lambda: kalman.extended(mission, every)),  # everywhere: the optimum starts from there
            ("ukf", "filterpy", lambda: kalman.unscented(mission, rows)),
            ("batch", "gtsam", lambda: batch.optimum(mission, rows, tracks.get("ekf")))):
        try:
            tracks[name] = track()
        except ImportError:
            missing[name] = library
    if "ekf" in tracks:
        tracks["ekf"] = tracks["ekf"][np.searchsorted(every, rows)]
    return tracks, missing


def _centimetres(error_m):
    return [round(100 * float(value), 4) if np.isfinite(value) else None for value in error_m]


# How far the mission is, for whoever started us.
class _Told:
    def show(self, event):
        print(json.dumps({"robot_s": event.get("robot_s")}), flush=True)

    def note(self, text):
        pass

    def clear(self):
        pass


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
