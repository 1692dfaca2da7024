"""How bytes, time, cost of a tick and error grow with the floor: the office once, twice, four and eight times.

y = a x^b by least squares of the logarithms over the floor's true vectors; an exponent of 1 is in proportion.
The core is a copy with capacities that hold the largest floor; its transmitters stay 32, the protocol's most.
"""

import os
import sys

import numpy as np

from host_tools.core_process import packages_folder
from host_tools.evaluation.run import MAX_ROBOT_S, Run
from host_tools.evaluation.section import Section, canvas, number, save, table
from host_tools.processes import Children
from sim_device.home import load_home

FLOORS = ("1x1", "2x1", "2x2", "4x2")
LIMITS = (("VECTORS_MAX", 4000), ("CHAINS_MAX", 250))
MEASURES = {"ram_bytes": "bytes of map in RAM", "stored_bytes": "bytes stored", "robot_s": "robot time, s", "tick_us": "tick, us, median",
            "tick_p99_us": "tick, us, 99 %", "mean_cm": "mean error, cm"}

PLACES = {"ram_bytes": ("map", "ram_bytes"), "stored_bytes": ("map", "stored_bytes"), "robot_s": ("time", "robot_s"),
          "tick_us": ("tick", "p50_us"), "tick_p99_us": ("tick", "p99_us"), "mean_cm": ("localisation", "mean_cm")}


class GrowthError(Exception):
    """One sentence: the floors could not be drawn."""


def homes(folder):
    """The floors as files, drawn by the generator of the office."""
    place = os.path.join(os.path.abspath(folder), "floors")
    os.makedirs(place, exist_ok=True)
    paths = []
    for floors in FLOORS:
        paths.append(os.path.join(place, "office_458%s.json" % ("_x%d" % tiles(floors) if tiles(floors) > 1 else "")))
        if os.path.exists(paths[-1]):
            continue
        with Children() as children:
            argv = [sys.executable, "-m", "sim_device.homes", place, "--floors", floors]
            child = children.start("the generator", argv, cwd=packages_folder())
            if child.wait(60) != 0:
                raise GrowthError("The floors could not be drawn: %s." % (child.text() or "no answer within a minute"))
    return paths


def runs(plan):
    return [Run(path, seed=plan.seeds[0], limits=LIMITS, peers=False, max_robot_s=MAX_ROBOT_S * tiles(floors))
            for floors, path in zip(FLOORS, homes(plan.folder))]


def tiles(floors):
    columns, rows = map(int, floors.split("x"))
    return columns * rows


def growth(plan, done, folder):
    vectors, measured, rows = [], {key: [] for key in MEASURES}, []
    of = runs(plan)
    for run in of:
        home, result = load_home(run.home), done[run]["result"]
        vectors.append(sum(map(len, home.rings)))
        for key, (part, name) in PLACES.items():
            measured[key].append(figure_of(result, part, name))
        ended = "yes" if result["finished"] else result["reason"]
        rows.append([home.name, str(vectors[-1]), *(number(values[-1]) for values in measured.values()), ended])
    whole = [done[run]["result"]["finished"] for run in of]
    exponents = {key: exponent(vectors, values, whole) for key, values in measured.items()}
    rows.append(["exponent", "", *(number(exponents[key], "%.2f") for key in MEASURES), ""])
    notes = [] if all(whole) else ["Exponents are fitted over the %d missions that finished." % sum(whole)]
    notes.append("A tick's time is the host's, core and link in one process under CPython: it compares floors, not targets.")
    data = {"vectors": vectors, "measured": measured, "exponents": exponents}
    lines = table(("floor", "true vectors", *MEASURES.values(), "finished"), rows)
    section = Section("growth", "Growth: the office floor %s times" % ", ".join(FLOORS), lines, data, "growth.png", notes)
    _draw(vectors, measured, exponents, os.path.join(folder, section.picture))
    return section


def figure_of(result, part, name):
    place = result[part]["estimate"] if part == "localisation" else result[part]
    return place[name]


def _draw(vectors, measured, exponents, path):
    figure, axes = canvas()
    for key, label in MEASURES.items():
        if all(values_ok(measured[key])):
            axes.plot(vectors, np.array(measured[key]) / measured[key][0], "o-", linewidth=1, markersize=4,
                      label=label + ("" if exponents[key] is None else " (exponent %.2f)" % exponents[key]))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("true vectors", fontsize=9)
    axes.set_ylabel("as a multiple of one floor", fontsize=9)
    axes.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=3)
    save(figure, path)


def values_ok(values):
    return [value is not None and value > 0 for value in values]


def exponent(x, y, whole):
    """b of y = a x^b; None with fewer than two floors to fit."""
    good = [keep and ok for keep, ok in zip(whole, values_ok(y))]
    if sum(good) < 2:
        return None
    x, y = (np.log([value for value, keep in zip(values, good) if keep]) for values in (x, y))
    return float(np.polyfit(x, y, 1)[0])
