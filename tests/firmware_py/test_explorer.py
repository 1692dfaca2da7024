# The state machine by itself: what it does in the open, at a wall, at a bump, and when nothing moves.

import math

import pytest

from firmware_py.storage.vector_store import BARRIER, SEARCHED
from protocol import states
from tests.firmware_py.puppet import Puppet, wall_ahead

ALL_ROUND = {beam: 40 for beam in range(1, 9)}


def aligned_with_a_wall():
    """A puppet that follows a long wall on its right."""
    puppet = Puppet()
    wall = wall_ahead(1000)
    assert puppet.run(1500, until=lambda core: core.explorer.mapping, ranges=wall)
    puppet.run(100, ranges=wall)
    return puppet, wall


def test_in_the_open_it_goes_straight_for_20_m_and_then_in_a_widening_spiral():
    puppet = Puppet()
    o = puppet.core.odometry
    assert puppet.run(4000, until=lambda core: core.odometry.path_mm >= 20000)
    assert o.turn_bam == 0
    x_m, y_m = o.x_um / 1e6, o.y_um / 1e6
    far = 0
    for turns in (1, 2, 3):
        # s = pi n^2 m after n turns of an Archimedean spiral, one metre wider each
        assert puppet.run(9000, until=lambda core, n=turns: core.odometry.path_mm >= 20000 + 3142 * n * n)
        assert abs(o.turn_bam / 65536 - turns) < 0.15
        radius = math.hypot(o.x_um / 1e6 - x_m, o.y_um / 1e6 - y_m)
        assert far + 0.5 < radius < turns + 0.7
        far = radius
    assert puppet.core.state == states.FIND_WALL


def test_a_wall_in_front_is_aligned_with_and_then_followed():
    puppet, wall = aligned_with_a_wall()
    assert puppet.states[:4] == [states.BOOT, states.INIT, states.FIND_WALL, states.ALIGN] and states.FOLLOW in puppet.states
    core = puppet.core
    before = core.odometry.y_um
    puppet.run(150, ranges=wall)
    assert core.odometry.y_um - before > 700_000  # along the wall at nearly 0.3 m/s, the wall on the right
    assert 190 < 1000 - core.odometry.x_um / 1000 < 235
    assert core.explorer.bumper.bumps == 0


@pytest.mark.parametrize("odd", [0, 1])
def test_a_robot_that_cannot_move_ends_as_stuck(odd):
    puppet, wall = aligned_with_a_wall()
    puppet.run(odd, ranges=wall)
    assert puppet.run(9000, until=lambda core: core.state == states.FAILED, ranges=wall, blocked=True)
    assert states.STUCK in puppet.states
    assert puppet.core.reason == states.REASON_STUCK and not puppet.core.finished
    puppet.run(10, ranges=wall)
    assert puppet.core.state == states.FAILED and (puppet.core.left_mm_s, puppet.core.right_mm_s) == (0, 0)


def test_boxed_in_for_8_s_forgets_the_hits_and_backs_off():
    puppet, _ = aligned_with_a_wall()
    puppet.run(20, ranges=ALL_ROUND, blocked=True)
    stuck = puppet.run(1000, until=lambda core: core.state == states.STUCK, ranges=ALL_ROUND, blocked=True)
    assert stuck and 350 < stuck < 450
    assert puppet.core.hits.used == 0
    left = puppet.run(300, until=lambda core: core.state != states.STUCK)
    assert left and puppet.core.odometry.path_mm > 0


def bumped(puppet, bump=1, **what):
    puppet.step(bump=bump, **what)
    return puppet.core


def test_a_bump_into_the_unseen_backs_off_4_cm_and_turns_left():
    puppet = Puppet()
    puppet.run(100)
    o = puppet.core.odometry
    core = bumped(puppet)
    assert core.state == states.BUMP and (core.left_mm_s, core.right_mm_s) == (0, 0) and core.explorer.bumper.bumps == 1
    x_um, turn = o.x_um, o.turn_bam
    assert puppet.run(300, until=lambda core: core.state == states.ALIGN)
    assert -48_000 < o.x_um - x_um < -38_000
    assert 6500 < o.turn_bam - turn < 8000


def test_a_held_bumper_counts_once():
    puppet = Puppet()
    puppet.run(100)
    puppet.run(200, bump=1)
    assert puppet.core.explorer.bumper.bumps == 1
    puppet.step()
    puppet.step(bump=1)
    assert puppet.core.explorer.bumper.bumps == 2


def test_a_bump_into_a_known_wall_keeps_8_mm_more_from_it_for_a_while():
    puppet, wall = aligned_with_a_wall()
    core = puppet.core
    puppet.run(1 + core.tick % 2, ranges=wall)  # it has looked
    core.follower.nearest_mm = 180
    assert bumped(puppet, bump=1 << 6, ranges=wall).state != states.BUMP
    puppet.step(ranges=wall)
    assert core.follower.disc_mm == 207  # 8 mm, decaying by 3 mm a second
    puppet.run(200, ranges=wall)
    assert core.follower.disc_mm == 200


def test_the_arc_is_counted_from_where_the_wall_was_lost():
    puppet, _ = aligned_with_a_wall()
    core = puppet.core
    core.explorer._leg_turn += 200_000  # a long way round to the right since the last leg began
    core.explorer.state = states.CORNER_OUT
    core.hits.clear()
    assert not puppet.run(100, until=lambda core: core.state == states.FIND_WALL)


@pytest.mark.parametrize("sector, x_mm, y_mm", [(0, 170, 0), (2, 0, 170), (4, -170, 0), (6, 0, -170)])
def test_the_bump_is_remembered_where_it_was(sector, x_mm, y_mm):
    puppet = Puppet()
    puppet.step()
    core = bumped(puppet, bump=1 << sector)
    held = [(core.hits.xs[i], core.hits.ys[i]) for i in range(64) if core.hits.buckets[i] != 255]
    assert len(held) == 1 and abs(held[0][0] - x_mm) <= 6 and abs(held[0][1] - y_mm) <= 2


def test_nine_bumps_in_10_s_are_stuck():
    puppet, wall = aligned_with_a_wall()
    for _ in range(8):
        puppet.core.follower.nearest_mm = 100
        bumped(puppet, ranges=wall)
        puppet.core.explorer.state = states.FOLLOW
        puppet.step(ranges=wall)
    assert puppet.core.explorer.stuck == 0
    assert bumped(puppet, ranges=wall).explorer.stuck == 1


def test_a_wall_that_vanishes_before_it_was_followed_costs_no_map():
    puppet = Puppet()
    core = puppet.core
    core.vectors.open_chain(BARRIER | SEARCHED)  # an island recorded before
    for x in range(4):
        core.vectors.append(x * 100, 0, 5, 0)
    assert puppet.run(1500, until=lambda core: core.state == states.ALIGN, ranges=wall_ahead(1000))
    core.hits.clear()
    assert puppet.run(400, until=lambda core: core.state == states.CORNER_OUT)
    turn = core.odometry.turn_bam
    assert puppet.run(3000, until=lambda core: core.state == states.FIND_WALL)
    assert -74000 < core.odometry.turn_bam - turn < -72000  # 400 degrees of arc, then on
    assert core.vectors.used == 4


def test_a_wall_lost_in_aligning_and_found_again_is_aligned_with_and_mapped():
    puppet = Puppet()
    wall = wall_ahead(1000)
    assert puppet.run(1500, until=lambda core: core.state == states.ALIGN, ranges=wall)
    puppet.core.hits.clear()
    assert puppet.run(400, until=lambda core: core.state == states.CORNER_OUT)
    assert not puppet.core.explorer.mapping
    assert puppet.run(3000, until=lambda core: core.explorer.mapping, ranges=wall)
    assert puppet.core.state == states.FOLLOW and puppet.states[-2] == states.ALIGN


def test_the_course_changes_from_try_to_try():
    explorer = Puppet().core.explorer
    courses = set()
    for _ in range(8):
        explorer.leave()
        courses.add(explorer._course_turn)
    assert len(courses) == 8 and max(courses) - min(courses) > 8000
