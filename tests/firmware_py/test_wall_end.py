# Round the end of a wall that is thinner than the gap between two beams: a robot that drives, and the rule by itself.

import json

import pytest

from firmware_py.collection import rolling
from firmware_py.collection.wall_end import WallEnd
from firmware_py.pipeline import Tvslam
from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.virtual_robot import VirtualRobot
from tests.stories.mission import told

TURN = 65536


def room_with_a_wall_in_it(path, thick_m):
    outline = [(0, 0), (2, 0), (2, 1.6), (2 + thick_m, 1.6), (2 + thick_m, 0), (4.1, 0), (4.1, 3), (0, 3)]
    path.write_text(json.dumps({"name": "end", "units": "m", "outline": outline, "obstacles": [], "rooms": [], "start": [0.6, 1.5]}))
    return load_home(str(path))


@pytest.mark.parametrize("thick_m, seed", [(0.07, 1), (0.08, 1), (0.10, 2)])
def test_the_robot_rounds_the_end_of_a_thin_wall_without_touching_it(tmp_path, thick_m, seed):
    # Without the rule it touches each of these three.
    robot = VirtualRobot(room_with_a_wall_in_it(tmp_path / "end.json", thick_m), load_robot(), seed=seed)
    core = told(Tvslam(), robot)
    values = [0] * VALUES_MAX
    for tick in range(1, 4000):
        values[0] = tick
        robot.sense(values)
        core.step(values)
        robot.drive(core.left_mm_s, core.right_mm_s)
        if core.explorer.inside:
            break
    assert core.explorer.inside and core.explorer.bumper.bumps == 0


class Rolling:
    """Odometry and follower in one: where the robot is, and what is next to it on its right."""

    def __init__(self):
        self.x_um = self.y_um = self.path_mm = self.turn_bam = self.heading_bam = 0
        self.reference_bearing, self.reference_mm, self.gap_mm = -TURN // 4, 220, rolling.REACH_MM
        self.end = WallEnd()

    def limit(self, degrees, mm=0):
        """Turned by so much and driven so far: the course, if the follower wants 10 degrees more to the right -> degrees"""
        self.turn_bam = self.heading_bam = degrees * TURN // 360
        self.path_mm += mm
        return self.end.limit(self, self, self.turn_bam, self.turn_bam - 10 * TURN // 360) * 360 / TURN

    def round(self, degrees):
        # Round one place: the robot goes where it stays square to its right.
        from math import cos, radians, sin
        self.x_um, self.y_um = [round(220_000 * f(radians(degrees + 90))) for f in (cos, sin)]
        return self.limit(degrees, 4)


def test_round_one_place_it_turns_100_degrees_then_goes_4_cm_straight_on():
    robot = Rolling()
    assert all(robot.round(d) == pytest.approx(d - 10, abs=0.1) for d in range(0, -100, -2))
    held = [robot.round(-101) for _ in range(10)]
    assert held == pytest.approx([-100] * 10, abs=0.1), "40 mm by 4"
    robot.round(-101)
    assert robot.round(-101) == pytest.approx(-111, abs=0.1), "there was no more"


def test_it_goes_on_as_long_as_the_wall_does_but_no_farther_than_14_cm():
    robot = Rolling()
    for d in range(0, -102, -2):
        robot.round(d)
    straight = 0
    while robot.limit(-101, 4) > -101:
        straight += 4
        robot.y_um -= 4000    # what is on its right comes along
        assert straight < 200
    assert 130 <= straight <= 145


def test_with_something_ahead_it_is_left_to_the_follower():
    robot = Rolling()
    for d in range(0, -102, -2):
        robot.round(d)
    robot.gap_mm = 150
    assert robot.round(-101) == pytest.approx(-111, abs=0.1)


def test_along_a_wall_nothing_is_held():
    robot = Rolling()
    for k in range(100):
        robot.x_um = k * 10_000
        assert robot.limit(-k * 3, 10) == pytest.approx(-k * 3 - 10, abs=0.1)
