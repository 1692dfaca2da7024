"""Table 2: what the map takes in bytes, and the robot time of each representation's own way of exploring."""

import os

from host_tools.evaluation import published
from host_tools.evaluation.run import Run
from host_tools.evaluation.section import Section, number, table
from host_tools.map_file import decode_records, encode_records

VECTOR_BYTES = 20                            # eq. 6 as a plain list: x, y, length, direction, deviation, 32 bits each
NO_WAYS = (("building/frontier.py:_LONGEST", 0),)  # no leg is that short: the core goes straight, and round what stands between
TOPOLOGY = ("regions", "nodes", "edges")
KB = 1000


def without_ways(plan):
    """The run of a vector map: the core that explores by its vectors alone. A peer: it may fail."""
    return Run(plan.home, seed=plan.seeds[0], limits=NO_WAYS, peers=False)


def table2(plan, done, folder):
    run = plan.main()[0]
    figures, faithful, plain = done[run], done[plan.beside("paper")[0]]["result"], done[without_ways(plan)]["result"]
    ours, grid = figures["result"], figures["grid"] or {}
    ram, stored = ours["map"]["ram_bytes"], ours["map"]["stored_bytes"]
    vectors = ours["map"]["vectors"]
    measured = {
        "grid": (grid.get("bytes"), grid.get("robot_s"), grid.get("robot_s"),
                 "5 cm log-odds, a byte a cell; a full sweep in lanes of 34 cm, computed: the shortest drive possible"),
        "vector": (vectors and vectors * VECTOR_BYTES, plain["time"]["robot_s"], None,
                   "eq. 6 as a list, %d B a vector; the core without ways: straight on, and round what stands between" % VECTOR_BYTES),
        "topological-vector": (ram, ours["time"]["robot_s"], ours["time"]["lower_bound_s"], "the core's records in use; its own mission"),
    }
    rows = [(name, "%.1f" % published.MEMORY_KB[name], _kb(size), "%.1f" % published.ROBOT_S[name], number(robot_s), number(least_s), how)
            for name, (size, robot_s, least_s, how) in measured.items()]
    topology, kept_topology = topology_bytes(ours), stored_topology_bytes(plan, run)
    inner = (("... of it the topology", topology, None, "regions, turning nodes, edges"), ("... stored", stored, None, "map.bin"),
             ("... of it the topology", kept_topology, None, "map.bin less the same map without it"),
             ("... in mode paper", faithful["map"]["ram_bytes"], faithful["time"]["robot_s"], "every improvement off"))
    rows += [(name, "-", _kb(size), "-", number(robot_s), "-", how) for name, size, robot_s, how in inner]
    data = {"bytes": {name: size for name, (size, *_) in measured.items()}, "robot_s": {name: of[1] for name, of in measured.items()},
            "lower_bound_s": ours["time"]["lower_bound_s"], "topology_bytes": topology, "stored_bytes": stored,
            "stored_topology_bytes": kept_topology, "grid": grid,
            "paper_mode": {"ram_bytes": faithful["map"]["ram_bytes"], "robot_s": faithful["time"]["robot_s"]}}
    head = ("", "paper KB", "ours KB", "paper s", "ours s", "shortest possible s", "how")
    return Section("table2", "Table 2: memory and time", table(head, rows), data, "", _notes(ours, faithful, plain, grid))


def topology_bytes(result):
    """Of the records in use, those of the topology; None without one."""
    if not result["map"]["regions"]:
        return None
    stores = result["memory"]["stores"]
    return sum(stores[name]["used"] * stores[name]["bytes"] // stores[name]["capacity"] for name in TOPOLOGY)


def stored_topology_bytes(plan, run):
    try:
        with open(os.path.join(plan.folder, run.key, "map.bin"), "rb") as file:
            data = file.read()
    except FileNotFoundError:
        return None
    records = decode_records(data)
    if not records.ready:
        return None
    records.ready = False
    return len(data) - len(encode_records(records))


def _kb(size):
    return number(None if size is None else size / KB, "%.2f")


def _notes(ours, faithful, plain, grid):
    notes = []
    for name, result in (("of mode improved", ours), ("of mode paper", faithful), ("without ways", plain)):
        if not result["finished"]:
            notes.append("The mission %s did not finish (%s): its bytes and time are of what there was." % (name, result["reason"]))
    if not ours["map"]["regions"]:
        notes.append("The core of this evaluation built no regions: its bytes are those of vectors and chains alone.")
    if grid.get("recall_5cm") is not None and ours["map"]["recall_5cm"] is not None:
        notes.append("From the same mission, walls within 5 cm (precision / recall): grid %.3f / %.3f, vectors %.3f / %.3f." % (
            grid["precision_5cm"], grid["recall_5cm"], ours["map"]["precision_5cm"], ours["map"]["recall_5cm"]))
    return notes
