"""Table 2: what the map takes in bytes, and the robot time of each representation's own way of exploring."""

from host_tools.evaluation import published
from host_tools.evaluation.run import Run
from host_tools.evaluation.section import Section, number, table
from protocol.parameters import FLAGS

VECTOR_BYTES = 20           # eq. 6 as a plain list: x, y, length, direction, deviation, 32 bits each
NO_TOPOLOGY = "topology"    # the flag without which the core explores by its vectors alone
KB = 1000


def without_topology(plan):
    """The runs of a vector map: none while the core has no such flag."""
    if NO_TOPOLOGY not in [row[0] for row in FLAGS]:
        return []
    return [Run(plan.home, seed=plan.seeds[0], settings=(NO_TOPOLOGY + "=off",), peers=False)]


def table2(plan, done, folder):
    run = plan.main()[0]
    figures, faithful = done[run], done[plan.beside("paper")[0]]["result"]
    ours, grid = figures["result"], figures["grid"] or {}
    plain = [done[other]["result"] for other in without_topology(plan)]
    vectors = ours["map"]["vectors"]
    measured = {
        "grid": (grid.get("bytes"), grid.get("robot_s"),
                 "5 cm log-odds, a byte a cell; full sweep in lanes of 34 cm, the shortest drive possible"),
        "vector": (vectors and vectors * VECTOR_BYTES, plain[0]["time"]["robot_s"] if plain else None,
                   "eq. 6 as a list, %d B a vector; the core without topology" % VECTOR_BYTES),
        "topological-vector": (ours["map"]["ram_bytes"], ours["time"]["robot_s"], "the core's records in use; its own mission"),
    }
    rows = [(name, "%.1f" % published.MEMORY_KB[name], _kb(size), "%.1f" % published.ROBOT_S[name], number(robot_s), how)
            for name, (size, robot_s, how) in measured.items()]
    faithful_s = faithful["time"]["robot_s"]
    rows.append(("... in mode paper", "-", _kb(faithful["map"]["ram_bytes"]), "-", number(faithful_s), "every improvement off"))
    rows.append(("... stored", "-", _kb(ours["map"]["stored_bytes"]), "-", "-", "map.bin"))
    notes = _notes(ours, faithful, plain, grid)
    data = {"bytes": {name: size for name, (size, _, _) in measured.items()}, "robot_s": {name: s for name, (_, s, _) in measured.items()},
            "stored_bytes": ours["map"]["stored_bytes"], "grid": grid, "paper_mode": {"ram_bytes": faithful["map"]["ram_bytes"],
                                                                                      "robot_s": faithful_s}}
    head = ("", "paper KB", "ours KB", "paper s", "ours s", "how")
    return Section("table2", "Table 2: memory and time", table(head, rows), data, "", notes)


def _kb(size):
    return number(None if size is None else size / KB, "%.2f")


def _notes(ours, faithful, plain, grid):
    notes = []
    for name, result in (("improved", ours), ("paper", faithful), *(("vector", each) for each in plain)):
        if not result["finished"]:
            notes.append("The mission of mode %s did not finish (%s): its bytes and time are of what there was." % (name, result["reason"]))
    if not plain:
        notes.append("The vector map's time was not measured: this core has no flag %s to switch off." % NO_TOPOLOGY)
    if not ours["map"]["regions"]:
        notes.append("The core of this evaluation built no regions: its bytes are those of vectors and chains alone.")
    if grid.get("recall_5cm") is not None and ours["map"]["recall_5cm"] is not None:
        notes.append("From the same mission, walls within 5 cm (precision / recall): grid %.3f / %.3f, vectors %.3f / %.3f." % (
            grid["precision_5cm"], grid["recall_5cm"], ours["map"]["precision_5cm"], ours["map"]["recall_5cm"]))
    return notes
