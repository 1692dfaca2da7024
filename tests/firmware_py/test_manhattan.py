# Which way most walls stand, and what a piece of wall tells of the heading.

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

manhattan_module = watched("firmware_py.collection.manhattan")
BAM = math.tau / 65536


def degrees(angle):
    return round(angle / 360 * 65536)


def walls(manhattan, angle, length_mm=3000, bend=0.0, seen=None):
    """Hits each 20 mm along a wall; the directions told (BAM, in the map) and how far each is off the axis."""
    x, y, told = 50.0, -70.0, []
    at = math.radians(angle)
    for _ in range(length_mm // 20):
        x, y, at = x + 20 * math.cos(at), y + 20 * math.sin(at), at + bend
        manhattan.add(round(x), round(y))
        if manhattan.waiting:
            bam = manhattan.chord_bam
            off = manhattan.off(bam)
            told.append((bam, off))
            elected = manhattan.match() if off < 32767 else manhattan.miss()
            if seen is not None:
                seen.append(elected)
    manhattan.add(-5000, -5000)  # elsewhere
    manhattan.waiting = False
    return told


@given(st.integers(0, 359))
def test_a_chord_has_the_direction_of_its_wall(angle):
    told = walls(manhattan_module.Manhattan(), angle)
    assert len(told) >= 4
    assert all(abs((bam - degrees(angle) + 32768) % 65536 - 32768) < degrees(0.8) for bam, _ in told)


def test_a_bend_and_a_jump_are_no_chords():
    manhattan = manhattan_module.Manhattan()
    assert walls(manhattan, 0, bend=0.02) == []  # radius 1 m
    for x in range(0, 4000, 700):
        manhattan.add(x, 0)
    assert not manhattan.waiting


@pytest.mark.parametrize("askew", [0, 3, 30, -44])
def test_square_walls_elect_their_axis(askew):
    manhattan = manhattan_module.Manhattan()
    for angle in (0, 90, 180, 270):
        told = walls(manhattan, angle + askew)
    assert abs(manhattan.axis_bam - degrees(askew)) < degrees(0.7)
    assert len(told) >= 4 and all(abs(off) < degrees(1) for _, off in told)


def test_walls_in_every_direction_elect_none():
    manhattan = manhattan_module.Manhattan()
    seen = []
    for angle in range(0, 1440, 25):
        assert all(off == 32767 for _, off in walls(manhattan, angle, 560, seen=seen))
    assert len(seen) > 30 and not any(seen)


def test_a_slanted_wall_changes_nothing_but_a_part_of_the_home_that_stands_askew_does():
    manhattan = manhattan_module.Manhattan()
    walls(manhattan, 90, 8000)
    for _ in range(5):
        assert all(off == 32767 for _, off in walls(manhattan, 40, 600))
        assert all(abs(off) < degrees(1) for _, off in walls(manhattan, 0, 5000)[1:])
    for angle in (40, 130, 40, 310, 220, 130):
        walls(manhattan, angle, 6000)
    assert abs(manhattan.axis_bam - degrees(40)) < degrees(2)  # the older votes fade


@given(st.lists(st.tuples(st.integers(-500_000, 500_000), st.integers(-500_000, 500_000), st.integers(0, 65535)), max_size=60))
def test_any_hits_make_no_number_too_big(hits):
    manhattan = manhattan_module.Manhattan()
    for x, y, bam in hits:
        manhattan.add(x, y)
        if manhattan.off(bam) == 32767:
            manhattan.miss()
        else:
            manhattan.match()
        assert -8192 <= manhattan.axis_bam <= 8192
