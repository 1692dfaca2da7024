# The README's table of figures: the worst of the seeds, and "no" where something is not so.

import argparse
import copy

import pytest

from benchmarks import figures
from host_tools import hil_options
from host_tools.result import empty_result


def result(**changes):
    made = empty_result("home", dict(target="unix", link="pty", mode="improved", uwb="paper", odometry="calibrated", seed=1))
    made |= {"finished": True, "hash": {"steps": "0a", "map": "0b"}}
    made["time"] |= {"contacts": 1, "real_time_factor": 120.4, "robot_s": 110.0, "lower_bound_s": 100.0}
    made["map"] |= {"precision_5cm": 0.98, "recall_5cm": 0.97, "iou_free": 0.99, "regions": 5, "true_rooms": 5}
    made["localisation"]["estimate"] = {"mean_cm": 1.0, "p95_cm": 2.0, "max_cm": 3.0}
    made["memory"]["allocated_after_boot_bytes"] = 0
    for path, value in changes.items():
        *way, last = path.split("__")
        place = made
        for key in way:
            place = place[key]
        place[last] = value
    return made


@pytest.fixture
def results():
    return {kind: [result(), result(), result()] for kind in figures.KINDS}


def test_the_worst_seed_is_told(results):
    results["unix"][1] = result(map__recall_5cm=0.91, map__regions=4, time__contacts=4,
                                time__real_time_factor=61.0, time__robot_s=130.0)
    error = {"mean_cm": 1.5, "p95_cm": 4.0, "max_cm": 9.0}
    results["tof"][2] = result(localisation__estimate=error, map__precision_5cm=0.93)
    results["unix"][2] = result(memory__allocated_after_boot_bytes=16)
    cells = figures.row("home", results)
    assert cells == ("home", "12 of 12", "1.0 cm", "1.5 cm", "1.0 cm", "0.980 / 0.910", "0.930 / 0.970", "0.990", "4-5 / 5", "4", "1.30",
                     "61", "16 B", "yes")
    assert len(cells) == len(figures.HEAD)


def test_what_was_not_measured_is_a_dash(results):
    results["tof"][0] = result(finished=False, map__recall_5cm=None)
    results["unix"][0] = result(map__regions=None, time__lower_bound_s=None)
    cells = figures.row("home", results)
    assert cells[1] == "11 of 12" and cells[6] == "0.980 / -" and cells[8] == "- / 5" and cells[10] == "-"


def test_the_emulated_part_counts_where_it_ran(results):
    results["stm32"] = [result()]
    assert figures.good(results) and figures.row("home", results)[1] == "13 of 13"
    results["stm32"] = [result(hash__steps="ff")]
    assert not figures.good(results)


@pytest.mark.parametrize("change", [{"finished": False}, {"degraded": ["vectors"]}, {"hash__map": "ff"}, {"hash__steps": None}])
def test_one_bad_mission_is_not_good(results, change):
    assert figures.good(results)
    bad = copy.deepcopy(results)
    bad["cpython"][2] = result(**change)
    if change == {"hash__steps": None}:
        bad["unix"][2] = result(**change)
    assert not figures.good(bad)
    if "hash__map" in change:
        assert figures.row("home", bad)[-1] == "NO"


def test_the_table_is_markdown(results):
    lines = figures.markdown([figures.row("home", results)]).splitlines()
    assert len(lines) == 3 and len({line.count("|") for line in lines}) == 1


@pytest.mark.parametrize("options", [*figures.KINDS.values(), figures.STM32])
def test_hil_takes_every_option_that_is_used(options):
    parser = argparse.ArgumentParser()
    hil_options.add_arguments(parser)
    hil_options.check(parser.parse_args(["studio", "--seed", "1", "--json", "r.json", *options]))
