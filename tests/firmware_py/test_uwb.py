# Fixes from UWB (Paper eq. 3) against the same sums in floats: from true ranges to the deviation that they tell of.

import math
from array import array

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.puppet import NUMBERS
from tests.firmware_py.watched import watched

parameters_module, uwb_module = watched("firmware_py.parameters", "firmware_py.collection.uwb")
STRENGTH, FLIGHT = uwb_module.SOURCE_STRENGTH, uwb_module.SOURCE_TIME_OF_FLIGHT
ANCHORS = [(0, 0), (8000, 0), (8000, 6000), (0, 6000), (4000, 3000)]
HEIGHT = 2300
LEVEL_1M, GAMMA = -4700, 1700


def made(source=STRENGTH, weighted=1, anchors=ANCHORS, **others):
    table = parameters_module.Parameters()
    told = {"uwb_source": source, "anchor_count": len(anchors), "anchor_x": [a[0] for a in anchors],
            "anchor_y": [a[1] for a in anchors], "uwb_level_1m": LEVEL_1M, "uwb_gamma": GAMMA, **others}  # fmt: skip
    for name, values in told.items():
        for i, value in enumerate(values if isinstance(values, list) else [values]):
            assert table.set(NUMBERS[name], i, value) == 0, (name, value)
    uwb = uwb_module.Uwb()
    uwb.begin(table, weighted)
    return uwb


def record(anchor, at, anchors=ANCHORS, bias_mm=0, level=None, sigma_db=0.1):
    mm = math.dist((*anchors[anchor], HEIGHT), (*at, 0)) + bias_mm
    s = math.log(10) * sigma_db / (10 * GAMMA / 1000)
    strength = LEVEL_1M - 1000 * GAMMA / 1000 * math.log10(mm / 1000 / math.exp(-s * s / 2))
    return anchor, round(strength) if level is None else level, round(mm)


def report(uwb, records, seen_from):
    uwb.add(told(records), 0, *seen_from)
    work_off(uwb)


def told(records):
    return array("i", [len(records), *[v for r in records for v in r]] + [0] * 4)


def work_off(uwb):
    while uwb.waiting:
        uwb.work()


AXIS = st.integers(-80, 80)


@pytest.mark.parametrize("source", [STRENGTH, FLIGHT])
@given(st.integers(500, 7500), st.integers(500, 5500), AXIS, AXIS)
def test_true_ranges_tell_the_deviation(source, x, y, dx, dy):
    uwb = made(source, weighted=0)
    for _ in range(20):
        report(uwb, [record(a, (x + dx, y + dy)) for a in range(5)], (x, y))
    assert uwb.solve()
    assert math.hypot(uwb.dx_mm - dx, uwb.dy_mm - dy) <= 12 + 0.05 * math.hypot(dx, dy)


RANGES = st.lists(st.tuples(st.integers(0, 4), st.integers(-90, 90)), min_size=8, max_size=40)


@given(RANGES, st.integers(1000, 7000), st.integers(1000, 5000))
def test_it_is_the_weighted_least_squares_solution(ranges, x, y):
    # time of flight: all weights are equal
    uwb = made(FLIGHT, weighted=0)
    a, b = np.zeros((2, 2)), np.zeros(2)
    for anchor, bias in ranges:
        report(uwb, [record(anchor, (x, y), bias_mm=bias)], (x, y))
        a *= 31 / 32
        b *= 31 / 32
        u = np.array([ANCHORS[anchor][0] - x, ANCHORS[anchor][1] - y]) / math.dist((*ANCHORS[anchor], HEIGHT), (x, y, 0))
        a += np.outer(u, u)
        b -= u * bias
    if np.linalg.cond(a) > 8 or not uwb.solve():
        return
    assert np.hypot(*(np.linalg.solve(a, b) - (uwb.dx_mm, uwb.dy_mm))) < 12


def test_the_mean_of_a_log_normal_range_is_taken_back():
    # alpha = exp(-s^2 / 2): with 1 dB a range of 4.6 m would come out 43 mm long
    anchors = [(5000, 1000), (1000, 5000)]
    uwb = made(STRENGTH, weighted=0, anchors=anchors, uwb_sigma=100)
    for _ in range(20):
        report(uwb, [record(a, (1000, 1000), anchors, sigma_db=1) for a in range(2)] * 7, (1000, 1000))
    assert uwb.solve() and abs(uwb.dx_mm) < 20 and abs(uwb.dy_mm) < 20


def fixed_at(uwb, x=3000, y=2500, records=None, times=20):
    for _ in range(times):
        report(uwb, records or [record(a, (x + 40, y)) for a in range(5)], (x, y))
    return uwb.solve()


def test_too_few_reports_or_too_poor_a_geometry_solve_nothing():
    assert not fixed_at(made(), times=5)
    assert fixed_at(made(), times=6)
    assert not fixed_at(made(weighted=0), records=[record(0, (3000, 2500))])
    assert not fixed_at(made(uwb_source=0))


def test_what_is_too_weak_unknown_or_an_outlier_counts_for_nothing():
    assert not fixed_at(made(uwb_level_min=-5000))
    assert not fixed_at(made(), records=[(9, -5300, 3000)])
    uwb = made(FLIGHT)
    assert not fixed_at(uwb, records=[record(a, (3000, 2500), bias_mm=1000) for a in range(5)])
    assert uwb.outliers == 100


def test_a_transmitter_that_jumps_about_weighs_less():
    calm, wild = made(FLIGHT), made(FLIGHT)
    for uwb, size in ((calm, 0), (wild, 400)):
        for i in range(40):
            bias = size if i & 1 else -size
            report(uwb, [record(0, (3000, 2500), bias_mm=bias), *[record(a, (3000, 2500)) for a in (1, 2, 3)]], (3000, 2500))
        assert uwb.solve()
    assert wild.variance_mm2 > calm.variance_mm2


def test_after_the_estimate_has_moved_nothing_is_left_of_the_deviation():
    uwb = made(weighted=0)
    assert fixed_at(uwb) and uwb.dx_mm > 30
    uwb.shift(uwb.dx_mm, uwb.dy_mm)
    assert uwb.solve() and abs(uwb.dx_mm) <= 2 and abs(uwb.dy_mm) <= 2
    uwb.clear()
    assert not uwb.solve()


def test_the_newest_three_seconds_count():
    uwb = made(FLIGHT, weighted=0)
    fixed_at(uwb, records=[record(a, (3080, 2500)) for a in range(5)], times=100)
    fixed_at(uwb, records=[record(a, (3000, 2500)) for a in range(5)], times=100)
    assert uwb.solve() and abs(uwb.dx_mm) < 10


def test_a_report_is_worked_off_in_two_ticks_and_a_move_in_between_changes_nothing():
    anchors = [[4000 + 300 * k, 200 * k * (k % 3)] for k in range(15)]
    solved = []
    for moved_after in (None, 0, 1):
        uwb = made(FLIGHT, anchors=anchors)
        for _ in range(20):
            uwb.add(told([record(a, (3040, 2500), anchors) for a in range(15)]), 0, 3000, 2500)
            work_off(uwb)
        uwb.add(told([record(a, (3040, 2500), anchors) for a in range(15)]), 0, 3000, 2500)
        for tick in range(2):
            assert uwb.waiting > 0
            if tick == moved_after:
                uwb.shift(25, -10)
            uwb.work()
        assert uwb.waiting == 0 and uwb.reports == 21
        if moved_after is None:
            uwb.shift(25, -10)
        assert uwb.solve()
        solved.append((uwb.dx_mm, uwb.dy_mm))
    assert all(math.dist(a, solved[0]) <= 2 for a in solved), solved
    assert math.dist(solved[0], (15, 10)) < 8


def test_reports_that_come_faster_than_they_are_worked_off_all_count():
    uwb = made(FLIGHT, weighted=0)
    for _ in range(10):
        uwb.add(told([record(a, (3040, 2500)) for a in range(5)]), 0, 3000, 2500)
    work_off(uwb)
    assert uwb.reports == 10 and uwb.solve() and abs(uwb.dx_mm - 40) < 8


ANY = st.tuples(st.integers(0, 40), st.integers(-32768, 32767), st.integers(0, 65535))
PLACES = st.tuples(st.integers(-20000, 20000), st.integers(-20000, 20000))


@given(st.lists(PLACES, min_size=1, max_size=32), st.lists(st.tuples(PLACES, st.lists(ANY, min_size=1, max_size=15)), max_size=12),
       st.sampled_from((STRENGTH, FLIGHT)), st.integers(0, 1), st.integers(1000, 6000), st.integers(0, 2000))  # fmt: skip
def test_no_report_and_no_parameter_makes_a_number_too_big(anchors, reports, source, weighted, gamma, sigma):
    uwb = made(source, weighted, [list(a) for a in anchors], uwb_gamma=gamma, uwb_sigma=sigma, uwb_level_min=-20000)
    for at, records in reports:
        for _ in range(3):
            report(uwb, records, at)
        if uwb.solve():
            assert abs(uwb.dx_mm) < 4000 and abs(uwb.dy_mm) < 4000
            uwb.shift(uwb.dx_mm, uwb.dy_mm)


def test_weak_geometry_with_all_weight_in_it_is_no_number_too_big():
    # two bundles of transmitters, 12 degrees apart, near and exact, that contradict each other: the worst for shift()
    anchors = [[1600, 1600]] * 8 + [[1900, 1300]] * 7
    uwb = made(STRENGTH, 0, anchors, uwb_sigma=0)
    for _ in range(200):
        report(uwb, [record(a, (0, 0), anchors, bias_mm=100 if a < 8 else -100) for a in range(15)], (0, 0))
    for _ in range(5):
        if uwb.solve():
            uwb.shift(uwb.dx_mm, uwb.dy_mm)
    uwb.shift(3999, -3999)
    assert uwb.reports == 0  # so far that it begins anew


def test_a_range_of_great_uncertainty_has_no_weight():
    uwb = made(STRENGTH, 0, [[15000, 0], [0, 15000]], uwb_sigma=2000)
    far = [record(a, (0, 0), [(15000, 0), (0, 15000)], sigma_db=3) for a in range(2)]
    for _ in range(20):
        report(uwb, far, (0, 0))
    assert uwb.reports == 0


@given(st.integers(0, 3), st.integers(-40, 40), st.integers(-40, 40), st.integers(0, 30))
def test_who_stands_at_a_transmitter_is_told_nothing_by_it(range_mm, dx, dy, height):
    uwb = made(FLIGHT, anchors=[(0, 0), *ANCHORS[1:]], anchor_height=[height])
    report(uwb, [(0, -5000, range_mm)], (dx, dy))
    assert (uwb.reports, uwb.outliers) == (0, 0)
