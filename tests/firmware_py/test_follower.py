# The disc that rolls along remembered hits: single points, and any points against a scan by brute force.

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.firmware_py.puppet import bam
from tests.firmware_py.watched import watched

hit_ring, follower = watched("firmware_py.storage.hit_ring", "firmware_py.collection.follower")
fixed = watched("firmware_py.fixed")
WINDOW = 3641
BODY_MM, DISC_MM, TIGHT_MM = 170, 200, 174


def seeing(points, heading_bam=0, disc_mm=DISC_MM, tight_mm=TIGHT_MM):
    """A follower at the origin that has looked at these points: (bearing in degrees, mm)."""
    hits = hit_ring.HitRing()
    f = follower.Follower(hits)
    f.disc_mm, f.tight_mm = disc_mm, tight_mm
    for degrees, mm in points:
        b = bam(degrees)
        hits.add((mm * fixed.cosine(b) + 16384) >> 15, (mm * fixed.sine(b) + 16384) >> 15, 0)
    f.look(0, 0, heading_bam, WINDOW)
    return f


def test_without_a_point_there_is_no_wall():
    assert seeing([]).solve() == follower.NO_WALL
    assert seeing([(-90, 345)]).solve() != follower.NO_WALL
    assert seeing([(-90, 355)]).solve() == follower.NO_WALL


@pytest.mark.parametrize("degrees", [25, 90, 150])
def test_a_point_on_the_left_is_no_wall_to_follow(degrees):
    assert seeing([(degrees, 200)]).solve() == follower.NO_WALL


@pytest.mark.parametrize("mm, degrees", [(200, 0), (210, -6), (220, -12), (190, 7.2), (180, 14.4)])
def test_one_point_on_the_right_is_kept_at_the_disc(mm, degrees):
    # 6 degrees a cm outside the disc, 1.2 times as much inside it
    assert abs(seeing([(-90, mm)]).solve() - bam(degrees)) <= 90


def test_deeper_than_9_cm_turns_no_further():
    solutions = [seeing([(-90, mm)]).solve() for mm in (112, 100, 60)]
    assert max(solutions) - min(solutions) < 300


def test_the_reference_may_lie_behind_on_the_left_and_the_heading_is_not_wrapped():
    # 170 degrees left is 190 right: rolling along it means to turn right by 100
    assert abs(seeing([(170, 200)]).solve() - bam(-100)) <= 90


def test_a_dead_end_is_left_by_turning_left():
    ends = [(-90, 200), (-60, 200), (-30, 200), (0, 200), (30, 200), (60, 200), (90, 200), (110, 200)]
    assert bam(180) < seeing(ends).solve() < bam(220)


def test_a_passage_that_the_body_fits_through_is_entered_in_its_middle():
    # 40 cm wide: the standing disc would turn round, so it shrinks until it agrees with the body
    passage = [(side * degrees, mm) for side in (1, -1) for degrees, mm in ((90, 200), (75, 207), (60, 231), (105, 207), (120, 231))]
    f = seeing(passage)
    assert f._scan(DISC_MM, 109) > bam(57)
    assert abs(f.solve()) < bam(8)


def test_all_but_boxed_in_it_takes_the_way_that_only_the_next_5_cm_leave():
    ring = [(degrees, 190) for degrees in range(65, 296, 15)]  # a gap of 130 degrees in front
    assert abs(seeing(ring).solve()) < bam(10)
    assert seeing(ring + [(0, 190)]).solve() == follower.BOXED_IN


@given(st.integers(0, 65535))
def test_all_is_relative_to_the_heading(heading_bam):
    assert abs(seeing([(-90 + heading_bam * 360 / 65536, 210)], heading_bam).solve() - bam(-6)) <= 220


def blocked(heading, points, disc_mm):
    for degrees, mm in points:
        e = mm - disc_mm
        a = 16384 - 109 * e if e > 0 else 16384 - 131 * max(e, -90)
        if abs((heading - degrees + 32768) % 65536 - 32768) < a:
            return True
    return False


NEAR = st.lists(st.tuples(st.integers(-180, 179), st.integers(60, 340)), min_size=1, max_size=20)


@given(NEAR)
def test_the_first_heading_that_no_point_blocks(points):
    # wary: no squeezing, one scan
    f = seeing(points, tight_mm=DISC_MM)
    assume(f.reference_mm < 350)
    looked = [(f.near_bearing[i], f.near_mm[i]) for i in range(f.near)]
    first = f._first(DISC_MM, 109)
    heading = f._scan(DISC_MM, 109)
    if heading == follower.BOXED_IN:
        assert all(blocked(h, looked, DISC_MM) for h in range(first, first + 65536, 64))
    else:
        assert not blocked(heading, looked, DISC_MM)
        assert all(blocked(h, looked, DISC_MM) for h in range(first, heading, 64))


@given(st.lists(st.tuples(st.integers(-180, 179), st.integers(1, 349)), max_size=64), st.integers(60, 360), st.integers(60, 300))
def test_any_points_and_any_body_come_to_an_end(points, disc_mm, body_mm):
    f = seeing(points, disc_mm=disc_mm, tight_mm=body_mm + 4)
    f.body_mm = body_mm
    f.look(0, 0, 0, WINDOW)
    heading = f.solve()
    assert heading in (follower.NO_WALL, follower.BOXED_IN) or -3 * 65536 < heading < 3 * 65536
