"""One mission -> the result file's figures. Keys and meanings are a contract with scripts.

Every key is present in every result; what was not measured or does not exist yet is None,
never 0. `empty_result` is the whole skeleton, the functions below fill what they can.
"""

import copy
import random

import numpy as np

from host_tools.lower_bound import lower_bound_s
from host_tools.map_file import KIND_OUTLINE, MapError, decode_map
from host_tools.mission import POSE_FIELDS, STEP_S, hashes
from host_tools.peers.dead_reckoning import dead_reckoning
from host_tools.peers.paper_rule import paper_rule
from host_tools.peers.uwb_only import positions
from host_tools.score import score_map
from protocol import states
from protocol.dialect import name_of, names_of_bits

STOPS = 20
ENDED = (states.DONE, states.FAILED)
MAP_STORES = ("vectors", "chains", "regions", "nodes", "edges")
ERRORS = {"mean_cm": None, "p95_cm": None, "max_cm": None}
SKELETON = {
    "time": dict.fromkeys(("robot_s", "wall_s", "real_time_factor", "path_m", "lower_bound_s", "contacts")),
    "localisation": {"stops": STOPS, "estimate": ERRORS, "dead_reckoning": ERRORS, "uwb_only": ERRORS,
                     "paper_rule": ERRORS, "trajectory_rmse_cm": None},
    "map": dict.fromkeys(("vectors", "chains", "regions", "true_rooms", "turning_nodes", "edges", "ram_bytes",
                          "ram_capacity_bytes", "stored_bytes", "precision_5cm", "recall_5cm", "outline_precision_5cm",
                          "outline_recall_5cm", "hausdorff_p95_cm", "iou_free"))
    | {"closure_cm": {"before": None, "after": None}},
    "memory": {"heap_bytes": None, "heap_peak_bytes": None, "static_ram_bytes": None, "stack_peak_bytes": None,
               "flash_bytes": None, "boot_s": None, "stores": {}, "heap_locked": None, "allocated_after_boot_bytes": None},
    "tick": dict.fromkeys(("count", "p50_us", "p99_us", "max_us", "instructions_p99", "instructions_max")),
    "link_stats": {"frames": None, "bytes": None, "dropped_by_cause": {}, "retransmits": None},
    "free_run": dict.fromkeys(("core_late_ticks", "core_late_ms", "late_answers", "late_answer_ms", "missed_ticks", "drift_ppm",
                               "residual_ms", "clock_jumps", "round_trip_ms", "margin_ms")),
    "storage": dict.fromkeys(("nvm_bytes", "kept", "found", "erases", "programs", "reads", "written_bytes", "restarts")),
    "can": dict.fromkeys(("frames", "bus_load", "bus_load_max", "lost", "refused", "dropped")),
    "cleaning": dict.fromkeys(("coverage", "overlap", "robot_s")),
    "update": dict.fromkeys(("robot_s", "full_robot_s", "regions_rebuilt")),
    "days": [],
    "hash": {"steps": None, "map": None},
}


def empty_result(home_name, options):
    """All keys; `options` gives target, link, mode, uwb, odometry and seed."""
    head = {"schema": 1, "home": home_name}
    head |= {key: options[key] for key in ("target", "link", "mode", "uwb", "odometry", "seed")}
    return head | {"finished": False, "reason": "", "degraded": []} | copy.deepcopy(SKELETON)


def evaluate(result, mission, truth, vector_map, end, rooms):
    """Fill `result` from the mission's log, the home's truth, the decoded map and the robot's closing account."""
    result["map"]["true_rooms"] = rooms
    _status(result, mission)
    _time(result, mission, truth, end)
    _localisation(result, mission)
    _map(result, mission, truth, vector_map)
    _memory(result, mission)
    _tick_and_link(result, mission, end)
    _free_run(result, mission, end)
    _storage(result, end)
    return result


def mission_map(mission):
    """The decoded map or None, and why it is none."""
    if mission.map_bytes is None:
        return None, "the core sent no map"
    try:
        return decode_map(mission.map_bytes), ""
    except MapError as error:
        return None, str(error)


def _status(result, mission):
    status = mission.status
    if status is None:
        return
    if status["state"] in ENDED:  # earlier, what the core knows already of its end is none yet: the map is still to be built
        result["finished"] = bool(status["finished"])
        result["reason"] = name_of(mission.names["reasons"], status["reason"], "reason")
    result["degraded"] = names_of_bits(mission.names["degraded"], status["degraded"])
    result["hash"] = hashes(status)
    if result["finished"]:
        result["map"]["closure_cm"] = {"before": status["closure_before_mm"] / 10, "after": status["closure_after_mm"] / 10}


def _time(result, mission, truth, end):
    time = result["time"]
    if len(mission.step):
        time["robot_s"], time["wall_s"] = round(mission.robot_s, 2), end.get("wall_s")
        time["path_m"], time["contacts"] = end.get("path_m"), end.get("contacts")
    if time["wall_s"]:
        time["real_time_factor"] = time["robot_s"] / time["wall_s"]
    speed_m_s, turn_rad_s = mission.parameter("speed_max") / 1000, mission.parameter("turn_max") / 1000
    time["lower_bound_s"] = lower_bound_s(truth, speed_m_s, turn_rad_s, lanes=mission.visited(states.SWEEP))


def _localisation(result, mission):
    estimate, actual = mission.matched_poses()
    if not len(estimate):
        return
    figures = result["localisation"]
    error = np.hypot(estimate[:, 1] - actual[:, 1], estimate[:, 2] - actual[:, 2])
    figures["trajectory_rmse_cm"] = 100 * float(np.sqrt(np.mean(error ** 2)))
    for method, error_m in stop_errors(mission, *stops(mission, result["seed"])).items():
        figures[method] = errors_cm(error_m)


def stops(mission, seed):
    """(rows in mission.step, estimated (n, 2), true (n, 2)) of 20 places at random along the mission, seeded."""
    estimate, actual = mission.matched_poses()
    chosen = sorted(random.Random(seed).sample(range(len(estimate)), min(STOPS, len(estimate))))
    return np.searchsorted(mission.step, estimate[chosen, 0]), estimate[chosen, 1:3], actual[chosen, 1:3]


def stop_errors(mission, rows, estimate_xy, true_xy):
    """{method: metres at each stop, NaN where it had no position}; the peers read the same sensor stream as the core did."""
    local, fixes, rule = peer_tracks(mission)
    heard = np.isfinite(fixes).any()
    return {"estimate": _distance(estimate_xy, true_xy), "dead_reckoning": _distance(local[rows, :2], true_xy),
            "uwb_only": _fix_errors(mission, fixes, rows),
            "paper_rule": _distance(rule[rows, :2], true_xy) if heard else np.full(len(rows), np.nan)}


def peer_tracks(mission):
    """(dead-reckoned poses, fixes of each UWB report, poses by the paper's rule)"""
    local = dead_reckoning(mission.left, mission.right, mission.geometry, mission.dock)
    fixes = positions(mission.uwb_anchor, mission.uwb_strength_cdb, mission.uwb_range_mm, mission.uwb_model, mission.anchors)
    at_turn = np.full((len(mission.turn_rows), 2), np.nan)
    turn_rows = mission.turn_rows.copy()
    if len(fixes):
        # The report next after the turn, as the robot waits for it; its own row, so that both speak of one place.
        report = np.minimum(np.searchsorted(mission.uwb_row, mission.turn_rows), len(fixes) - 1)
        at_turn, turn_rows = fixes[report], mission.uwb_row[report]
    order = np.argsort(turn_rows, kind="stable")
    thresholds = mission.parameter("fix_distance") / 1000, mission.parameter("fix_angle") * 2 * np.pi / 65536
    return local, fixes, paper_rule(local, turn_rows[order], at_turn[order], thresholds, mission.dock)


def _fix_errors(mission, fixes, rows):
    """Each stop's last fix against the truth at that fix's own step: the robot's drive since is not the UWB's fault."""
    errors = np.full(len(rows), np.nan)
    report = np.searchsorted(mission.uwb_row, rows, side="right") - 1
    heard = np.flatnonzero(report >= 0)
    step = mission.step[mission.uwb_row[report[heard]]]
    at = np.minimum(np.searchsorted(mission.truth[:, 0], step), len(mission.truth) - 1)
    same = mission.truth[at, 0] == step
    errors[heard[same]] = _distance(fixes[report[heard]][same], mission.truth[at[same], 1:3])
    return errors


def _distance(a, b):
    return np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1])


def errors_cm(error_m):
    """Mean, 95th percentile and maximum; NaN (no position at that stop) is left out."""
    error_m = error_m[np.isfinite(error_m)]
    if not len(error_m):
        return dict(ERRORS)
    return {"mean_cm": 100 * float(np.mean(error_m)), "p95_cm": 100 * float(np.percentile(error_m, 95)),
            "max_cm": 100 * float(np.max(error_m))}


def _map(result, mission, truth, vector_map):
    figures = result["map"]
    counts = {} if vector_map is None else {"regions": vector_map.regions, "nodes": vector_map.nodes, "edges": vector_map.edges}
    for name in counts.keys() & mission.stores.keys():
        mission.stores[name]["used"] = counts[name]  # a store is told every few seconds; these were filled in the last ones
    stores = [mission.stores[name] for name in MAP_STORES if name in mission.stores]
    if stores:
        figures["ram_bytes"] = sum(store["used"] * store["record_bytes"] for store in stores)
        figures["ram_capacity_bytes"] = sum(store["capacity"] * store["record_bytes"] for store in stores)
    if vector_map is None:
        return
    figures["stored_bytes"] = len(mission.map_bytes)
    figures["vectors"], figures["chains"] = len(vector_map.vectors()), len(vector_map.chains)
    for key, name in (("regions", "regions"), ("turning_nodes", "nodes"), ("edges", "edges")):
        figures[key] = counts[name] if vector_map.regions else None  # a finished map has at least one region: none means not built
    figures |= score_map(truth, vector_map)
    if not result["finished"] or not len(vector_map.vectors(KIND_OUTLINE)):
        figures["iou_free"] = None  # an open outline encloses nothing


def _memory(result, mission):
    memory, status = result["memory"], mission.status
    memory["stores"] = {name: {"used": store["used"], "capacity": store["capacity"],
                               "bytes": store["capacity"] * store["record_bytes"]}
                        for name, store in sorted(mission.stores.items(), key=lambda item: item[1]["index"])}
    if status is None:
        return
    memory["heap_locked"] = bool(status["heap_locked"])
    if status["heap_bytes"]:  # CPython has no heap of its own to measure
        memory["heap_bytes"], memory["heap_peak_bytes"] = status["heap_bytes"], status["heap_used_bytes"]
        memory["allocated_after_boot_bytes"] = status["allocated_after_boot_bytes"]


def _tick_and_link(result, mission, end):
    tick, stats = result["tick"], result["link_stats"]
    if mission.parameter("tick_ms"):
        tick["count"] = len(mission.tick_us)  # each answer waits for the core's tick: that time is no cost
    elif len(mission.tick_us):
        # On a host the link's way there and back is in it: only an emulated or real board separates the two.
        tick["count"] = len(mission.tick_us)
        tick |= {"p50_us": float(np.percentile(mission.tick_us, 50)), "p99_us": float(np.percentile(mission.tick_us, 99)),
                 "max_us": float(np.max(mission.tick_us))}
    stats["frames"], stats["bytes"], stats["retransmits"] = end.get("frames"), end.get("bytes"), _both_ends(end)
    dropped = dict(end.get("dropped") or {})
    for name, value in (mission.link or {}).items():
        if name.startswith("bad_") or name in ("overrun", "telemetry_dropped"):
            dropped["core_" + name] = value
    stats["dropped_by_cause"] = dropped


def _both_ends(end):
    """Questions sent again, and answers that the core sent again; the host's alone where the core did not tell its own."""
    return None if end.get("resent") is None else end["resent"] + (end.get("core_resent") or 0)


def _free_run(result, mission, end):
    """By whose clock the mission ran, how well the two were joined, and what came too late."""
    figures = result["free_run"]
    figures |= end.get("free_run") or {}
    if mission.parameter("tick_ms") and mission.status is not None:
        figures["core_late_ticks"], figures["core_late_ms"] = mission.status["late_ticks"], mission.status["late_ms"]


def _storage(result, end):
    """What the core kept in the non-volatile memory, what each core that began found there, and what it cost."""
    figures, told = result["storage"], end.get("storage") or {}
    figures |= {key: told[key] for key in figures.keys() & told.keys()}
    figures["restarts"] = end.get("restarts")


def can_bus(result, counted):
    """What the hub of a CAN link counted; its load is that of a robot that takes 50 steps a second. -> a note where that is too much."""
    figures, robot_s = result["can"], result["time"]["robot_s"]
    figures |= {key: counted[key] for key in ("frames", "lost", "refused", "dropped") if key in counted}
    if counted and robot_s:
        figures["bus_load"] = round(counted["busy_s"] / robot_s, 4)
        figures["bus_load_max"] = round(counted["step_s_max"] / STEP_S, 4)
    if (figures["bus_load"] or 0) > 1:
        return "A CAN bus of 500 kbit/s cannot carry that at 50 steps a second: it would be busy for %.0f %% of the time." % (
            100 * figures["bus_load"])
    if (figures["bus_load_max"] or 0) > 1:
        return "At 50 steps a second the busiest step would be late: it keeps a CAN bus of 500 kbit/s for %.0f ms of 20." % (
            1000 * counted["step_s_max"])
    return ""


def tum_rows(mission):
    """((n, 4), (n, 4)) t_s, x_m, y_m, heading_rad of estimate and truth, one each 0.1 s."""
    estimate, actual = mission.matched_poses()
    picked = np.column_stack([estimate[:, 0] * STEP_S, estimate[:, 1:4]])
    return picked, np.column_stack([actual[:, 0] * STEP_S, actual[:, 1:4]])


def pose_column(mission, name):
    return mission.pose[:, POSE_FIELDS.index(name)]
