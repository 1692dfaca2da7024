# How a loop is recognised: laps of a circle and what must not pass for one.

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

breadcrumbs = watched("firmware_py.storage.breadcrumbs")
OPEN, OUTLINE, ISLAND = breadcrumbs.OPEN, breadcrumbs.OUTLINE_CLOSED, breadcrumbs.ISLAND_CLOSED


class Walk:
    """Round a circle, left (+1) or right (-1), 6 mm a tick; the second lap `off` to the left of the first."""

    def __init__(self, around_mm, side=1, start_mm=0, turn=0, tolerance_mm=150):
        self.crumbs = breadcrumbs.Breadcrumbs()
        self.around_mm, self.side, self.tolerance_mm = around_mm, side, tolerance_mm
        self.path_mm, self.start_mm, self.start_turn = start_mm, start_mm, turn
        self.crumbs.clear(start_mm, turn)

    def go(self, laps, off_mm=0, heading_off=0, vectors=0):
        """-> (what was recognised first, the laps made by then)"""
        radius = self.around_mm / math.tau
        end_mm = self.path_mm + laps * self.around_mm
        while self.path_mm < end_mm:
            lap = (self.path_mm - self.start_mm) / self.around_mm
            turn = round(self.side * lap * 65536)
            a = math.tau * lap * self.side
            r = radius - self.side * off_mm * (lap > 0.5)
            x, y = r * math.sin(a) * self.side, (radius - r * math.cos(a)) * self.side
            self.heading = (turn + heading_off * (lap > 0.5)) & 0xFFFF
            said = self.crumbs.visit(round(x), round(y), self.heading, self.start_turn + turn, self.path_mm, vectors, self.tolerance_mm)
            if said != OPEN:
                return said, lap
            self.path_mm += 6
        return OPEN, laps


@pytest.mark.parametrize("side, around_mm, what", [(1, 8000, OUTLINE), (1, 30000, OUTLINE), (-1, 1600, ISLAND), (-1, 8000, ISLAND)])
def test_a_lap_is_recognised_by_the_way_it_winds(side, around_mm, what):
    walk = Walk(around_mm, side, start_mm=123456, turn=-400000)
    said, lap = walk.go(1.5)
    assert said == what and 0.87 < lap < 1.05
    assert abs(walk.crumbs.loop_mm() - around_mm) < 450 + 0.13 * around_mm


@pytest.mark.parametrize("side, around_mm", [(1, 3300), (-1, 1000)])
def test_a_loop_too_short_to_be_a_barrier_is_none(side, around_mm):
    assert Walk(around_mm, side).go(1.1)[0] == OPEN


def test_a_lap_is_not_closed_beside_the_first_nor_in_another_direction():
    assert Walk(12000).go(1.1, off_mm=400)[0] == OPEN
    assert Walk(12000, tolerance_mm=450).go(1.1, off_mm=400)[0] == OUTLINE
    assert Walk(12000).go(1.06, heading_off=5500)[0] == OPEN
    assert Walk(12000).go(1.1, off_mm=100, heading_off=1500)[0] == OUTLINE


def test_back_and_forth_is_no_lap():
    crumbs = breadcrumbs.Breadcrumbs()
    crumbs.clear(0, 0)
    for path in range(0, 40000, 6):
        x = abs(path % 10000 - 5000)
        assert crumbs.visit(x, 0, 0 if path % 10000 > 5000 else 32768, 0, path, 0, 150) == OPEN


def test_a_long_way_halves_the_crumbs_and_still_closes():
    walk = Walk(130_000)
    said, lap = walk.go(1.2)
    assert said == OUTLINE and 0.98 < lap < 1.02
    assert walk.crumbs.lost == 192 and walk.crumbs._spacing_mm == 2000 and walk.crumbs.used <= 128


def test_a_loop_cut_out_leaves_the_lap_as_if_it_had_not_been():
    # round an island once, then the outline: without excise() the winding would be one turn short
    walk = Walk(8000)
    assert walk.go(0.5) == (OPEN, 0.5)
    crumbs = walk.crumbs
    x, y = round(8000 / math.tau * math.sin(math.pi)), round(8000 / math.tau * 2)
    island = 0
    for i in range(400):
        said = crumbs.visit(x, y, 32768 - i * 164 & 0xFFFF, 32768 - i * 164, walk.path_mm + i * 6, 7, 150)
        if said == ISLAND:
            island = i
            break
    assert 345 < island < 400
    crumbs.excise()
    used = crumbs.used
    assert used <= 17
    for i in range(1, 800):
        a = math.pi + math.pi * i * 6 / 4000
        turn = round(a * 65536 / math.tau)
        x, y = round(8000 / math.tau * math.sin(a)), round(8000 / math.tau * (1 - math.cos(a)))
        said = crumbs.visit(x, y, turn & 0xFFFF, turn - 65536, walk.path_mm + (island + i) * 6, 9, 150)
        if said != OPEN:
            break
    assert said == OUTLINE and 0.8 < i * 6 / 4000 < 1.1


def test_the_crumb_that_closes_says_how_much_was_mapped_then():
    walk = Walk(8000)
    walk.go(0.06, vectors=3)
    walk.go(0.5, vectors=50)
    said, _ = walk.go(1, vectors=90)
    assert said == OUTLINE and walk.crumbs.vectors[walk.crumbs.closed_at] in (3, 50)
    assert walk.crumbs.vectors[0] == 3


ANY = st.integers(-(2**28), 2**28)


@given(st.lists(st.tuples(ANY, ANY, st.integers(0, 65535), ANY, st.integers(0, 3000)), max_size=300), st.integers(150, 6000))
def test_any_walk_fits_the_crumbs(steps, tolerance_mm):
    crumbs = breadcrumbs.Breadcrumbs()
    crumbs.clear(0, 0)
    path = 0
    for x, y, heading, turn, far in steps:
        path += far
        if crumbs.visit(x, y, heading, turn, path, 5, tolerance_mm) == ISLAND:
            crumbs.excise()
        assert 0 < crumbs.used <= crumbs.CAPACITY


def test_a_room_off_a_corridor_does_not_close_the_outline_however_far_the_crumbs_are_apart():
    # 130 m of corridor, then from the near jamb of a door of 0.9 m round the room to the far one: there the robot
    # heads as it did at the near jamb, after a whole turn, 0.9 m short of it.
    crumbs = breadcrumbs.Breadcrumbs()
    crumbs.clear(0, 0)
    for path in range(0, 130_000, 6):
        assert crumbs.visit(path, 9000, 0, 0, path, 1, 150) == OPEN
    x, y, turn = 0, 0, -32768
    for length, dx, dy in ((3000, -1, 0), (4000, 0, -1), (7000, 1, 0), (4000, 0, 1), (3100, -1, 0)):
        for far in range(0, length, 6):
            path += 6
            assert crumbs.visit(x + dx * far, y + dy * far, turn & 0xFFFF, turn, path, 1, 150) == OPEN
        x, y, turn = x + dx * length, y + dy * length, turn + 16384
    assert x == 900 and crumbs._spacing_mm == 2000
