# Driving to a place: straight where nothing stands in the way, else round it, and it ends.

import math
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

traveller = watched("firmware_py.collection.traveller")
MM = st.integers(-20000, 20000)
BAM = st.integers(0, 65535)


class Road:
    """What the follower sees: a heading is free unless `blocked`, to which it answers by how much to turn away."""

    def __init__(self, gap_mm=350, blocked=0):
        self.body_mm = 170
        self.gap_mm = gap_mm
        self.blocked = blocked

    def free(self, heading, _disc_mm, _slope):
        return heading + self.blocked


def here(x_mm, y_mm, heading_bam=0):
    return SimpleNamespace(x_mm=x_mm, y_mm=y_mm, heading_bam=heading_bam)


def going_to(x_mm, y_mm, wall=False):
    it = traveller.Traveller()
    it.begin(x_mm, y_mm, wall)
    return it


@given(MM, MM, BAM)
def test_on_free_ground_the_heading_is_the_goals(x, y, heading):
    it = going_to(x, y)
    said = it.step(here(0, 0, heading), Road(), 0)
    far = math.hypot(x, y)
    if abs(far - 120) > 5:
        assert said == (traveller.ARRIVED if far < 120 else traveller.GOING)
    if said == traveller.GOING:
        bearing = (heading + it.heading_bam) * math.pi / 32768
        assert -32768 <= it.heading_bam < 32768 and not it.around
        assert abs(math.remainder(bearing - math.atan2(y, x), math.tau)) < 0.01


def test_a_wall_is_reached_when_it_stands_before_the_robot():
    it = going_to(1000, 0, wall=True)
    assert it.step(here(0, 0), Road(gap_mm=20), 0) == traveller.GOING, "that is another wall"
    assert it.step(here(700, 0), Road(gap_mm=200), 0) == traveller.GOING
    assert it.step(here(700, 0), Road(gap_mm=40), 0) == traveller.AT_WALL
    place = going_to(1000, 0)
    assert place.step(here(700, 0), Road(gap_mm=40), 0) == traveller.GOING, "a place is no wall"


def test_an_obstacle_is_left_only_nearer_to_the_goal_than_it_was_met():
    it = going_to(5000, 0)
    assert it.step(here(0, 0), Road(blocked=12000), 0) == traveller.GOING and it.around
    for x_mm, free in ((0, False), (100, False), (200, True)):
        it.step(here(x_mm, 0), Road(), 1000)
        assert it.around != free, x_mm


def test_nearer_it_stays_beside_what_still_blocks_the_way():
    it = going_to(5000, 0)
    it.step(here(0, 0), Road(blocked=12000), 0)
    it.step(here(1000, 0), Road(blocked=2000), 1000)
    assert it.around


def test_a_small_turn_is_no_obstacle():
    it = going_to(5000, 0)
    assert it.step(here(0, 0), Road(blocked=5000), 0) == traveller.GOING
    assert not it.around and it.heading_bam == 5000


def test_who_has_gone_round_for_15_m_is_lost():
    it = going_to(5000, 0)
    it.step(here(0, 0), Road(blocked=12000), 2000)
    assert it.step(here(0, 0), Road(blocked=12000), 17000) == traveller.GOING
    assert it.step(here(0, 0), Road(blocked=12000), 17001) == traveller.LOST
    it.begin(5000, 0, False)
    assert it.step(here(0, 0), Road(), 17002) == traveller.GOING, "another goal, another try"


def test_a_way_that_only_turns_aside_has_an_end():
    it = going_to(5000, 0)
    aside = Road(blocked=5000)
    assert it.step(here(0, 0), aside, 1000) == traveller.GOING
    assert it.step(here(0, 0), aside, 1000 + 10000 + 15000 - 20) == traveller.GOING
    assert it.step(here(0, 0), aside, 1000 + 10000 + 15000 + 20) == traveller.LOST
    it.begin(5000, 0, False)
    assert it.step(here(0, 0), aside, 30000) == traveller.GOING
