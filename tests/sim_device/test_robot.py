# The body: arcs, motors, odometry presets, and what happens at walls.

import math
import random
import statistics
from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point

from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.robot import FRICTION, ODOMETRY
from sim_device.virtual_robot import VirtualRobot
from tests.sim_device.random_homes import hall, home_of, homes

RADIUS_M = 0.17
PULSE_MM = math.pi * 72 / 508
SEEDS = st.integers(0, 2**32 - 1)


def robot_in(home, **settings):
    return VirtualRobot(home, load_robot(), **{"uwb": "none", **settings})


def exact(robot):
    """Wheels, track and grip exactly as nominal, so that geometry alone is tested."""
    body = robot.body
    body.left_scale = body.right_scale = 1.0
    body.track_m = robot.config.track_m
    body._slip = 0.0
    return robot


def drive(robot, left_mm_s, right_mm_s, ticks):
    """Pulses counted (left, right) while driving."""
    values = array("i", bytes(4 * VALUES_MAX))
    total = [0, 0]
    for _ in range(ticks):
        robot.drive(left_mm_s, right_mm_s)
        robot.sense(values)
        total[0] += values[1]
        total[1] += values[2]
    return total


def gap_m(robot):
    """Room between the disc's rim and the nearest wall, by shapely."""
    return robot.home.free.boundary.distance(Point(robot.x_m, robot.y_m)) - RADIUS_M


def test_straight_ahead():
    robot = exact(robot_in(hall(10, 4, (1, 2))))
    left, right = drive(robot, 300, 300, 1000)
    # 20 s at 0.3 m/s less one motor time constant of travel, as a first-order motor lags
    assert robot.x_m - 1 == pytest.approx(0.3 * (20 - 0.02), abs=1e-6)
    assert robot.y_m == pytest.approx(2, abs=1e-9) and robot.path_m == pytest.approx(robot.x_m - 1)
    assert left == right == math.floor((robot.x_m - 1) * 1000 / PULSE_MM + 1e-9)
    assert robot.contacts == 0


def test_a_circle_closes():
    robot = exact(robot_in(hall(6, 6, (3, 2))))
    drive(robot, 0, 0, 1)
    turn_rad_s = (250 - 150) / 235
    drive(robot, 150, 250, 500)
    driven_s = 500 * 0.02 - 0.02  # the motor's lag
    angle, radius = turn_rad_s * driven_s, 0.2 / turn_rad_s
    assert robot.theta_rad == pytest.approx(math.remainder(angle, 2 * math.pi), abs=1e-6)
    assert robot.x_m == pytest.approx(3 + radius * math.sin(angle), abs=2e-4)
    assert robot.y_m == pytest.approx(2 + radius * (1 - math.cos(angle)), abs=2e-4)


def test_the_motor_reaches_63_percent_after_its_time_constant():
    robot = exact(robot_in(hall(10, 4, (1, 2))))
    robot.drive(200, 200)
    first = robot.x_m - 1
    assert first == pytest.approx(0.2 * (0.02 - 0.02 * (1 - math.exp(-1))), abs=1e-9)


def test_commands_beyond_the_motor_saturate():
    robot = exact(robot_in(hall(30, 4, (1, 2))))
    drive(robot, 32767, 32767, 50)
    assert robot.x_m - 1 < 1.01 * (0.3 + 2 * 0.1175)


def test_at_a_wall_the_wheels_turn_and_the_body_does_not():
    robot = exact(robot_in(hall(4, 4, (1, 2))))
    drive(robot, 300, 300, 700)
    assert 0 <= gap_m(robot) < 1e-4
    x = robot.x_m
    left, right = drive(robot, 300, 300, 100)
    assert left == right and left == pytest.approx(600 / PULSE_MM, abs=1)
    assert abs(robot.x_m - x) < 1e-4
    assert robot.body.bump == 1  # ahead
    assert robot.contacts == 1


@pytest.mark.parametrize("sector", range(8))
def test_the_bumper_tells_the_sector(sector):
    """Drive into the wall at x = 4 with the body turned so that the wall lies in this sector."""
    robot = exact(robot_in(hall(4, 4, (3.8, 2))))
    body = robot.body
    body.theta_rad = -sector * math.pi / 4 + 0.1
    body.cos, body.sin = math.cos(body.theta_rad), math.sin(body.theta_rad)
    body._move(0.05, 0, 0.05)
    body._feel()
    assert body.bump == 1 << sector


def test_sliding_along_a_wall_keeps_the_tangential_share():
    robot = exact(robot_in(hall(9, 9, (2, 8.7))))
    body = robot.body
    body.theta_rad = math.radians(30)
    body.cos, body.sin = math.cos(body.theta_rad), math.sin(body.theta_rad)
    drive(robot, 300, 300, 100)
    x = robot.x_m
    drive(robot, 300, 300, 200)
    assert 0 <= gap_m(robot) < 0.001
    assert robot.x_m - x == pytest.approx(FRICTION * math.cos(math.radians(30)) * 0.3 * 4, rel=0.01)
    assert body.bump and robot.contacts == 1


def test_a_corner_holds_from_two_sides():
    robot = exact(robot_in(hall(4, 4, (3.5, 3.5))))
    body = robot.body
    body.theta_rad = math.pi / 4 + 0.02
    body.cos, body.sin = math.cos(body.theta_rad), math.sin(body.theta_rad)
    drive(robot, 300, 300, 400)
    assert robot.x_m == pytest.approx(4 - RADIUS_M, abs=1e-3) and robot.x_m <= 4 - RADIUS_M
    assert robot.y_m == pytest.approx(4 - RADIUS_M, abs=1e-3) and robot.y_m <= 4 - RADIUS_M
    assert bin(body.bump).count("1") == 2


def test_it_slides_round_a_curved_wall():
    """In a round room of 24 facets, full speed at a slant to the wall must not stick where two facets meet."""
    circle = [[round(3 * math.cos(k * math.pi / 12), 3), round(3 * math.sin(k * math.pi / 12), 3)] for k in range(24)]
    robot = exact(robot_in(home_of(circle)))
    drive(robot, 300, 300, 500)  # against the corner at (3, 0)
    turned = 0.0
    for _ in range(400):
        before = math.atan2(robot.y_m, robot.x_m)
        drive(robot, 260, 300, 5)
        body = robot.body
        body.theta_rad = math.atan2(robot.y_m, robot.x_m) + math.radians(60)
        body.cos, body.sin = math.cos(body.theta_rad), math.sin(body.theta_rad)
        turned += math.remainder(math.atan2(robot.y_m, robot.x_m) - before, 2 * math.pi)
    slid_m = 400 * 0.1 * 0.28 * math.sin(math.radians(60)) * FRICTION
    assert turned == pytest.approx(slid_m / (3 - RADIUS_M), rel=0.1), "six facets on, as on a straight wall"
    assert 0 <= gap_m(robot) < 0.001


def test_a_new_contact_needs_a_fifth_of_a_second_without():
    robot = exact(robot_in(hall(4, 4, (3.6, 2))))
    drive(robot, 300, 300, 60)
    assert robot.contacts == 1
    for back, contacts in ((5, 1), (30, 2)):  # 0.1 s away is the same contact, 0.6 s away is not
        drive(robot, -200, -200, back)
        drive(robot, 300, 300, back + 10)
        assert robot.contacts == contacts


def test_it_leaves_the_wall_freely():
    robot = exact(robot_in(hall(4, 4, (3.6, 2))))
    drive(robot, 300, 300, 60)
    x = robot.x_m
    drive(robot, -300, -300, 50)
    # 1 s at 0.3 m/s less two time constants (from +0.3 to -0.3), but the wall stops what the first tick still goes forward
    forward = 0.6 * 0.02 * (1 - math.exp(-1)) - 0.3 * 0.02
    assert x - robot.x_m == pytest.approx(0.3 * (1 - 2 * 0.02) + forward, abs=1e-4)
    assert robot.body.bump == 0


def absurd_drive(home, seed, ticks):
    """Random and extreme speeds; after every tick the centre must be legal."""
    robot = robot_in(home, seed=seed & 0xFFFF, odometry="poor")
    rng = random.Random(seed)
    left = right = 0
    world = robot.world
    x, y = robot.x_m, robot.y_m
    for tick in range(ticks):
        if tick % 20 == 0:
            left, right = rng.choice([(300, 300), (-300, -300), (535, 535), (535, -535), (300, 200), (32767, -32768),
                                      (rng.randint(-400, 400), rng.randint(-400, 400))])
        robot.drive(left, right)
        assert world.clearance(robot.x_m, robot.y_m, 1.0) >= RADIUS_M - 1e-9, (tick, home.name)
        assert math.hypot(robot.x_m - x, robot.y_m - y) < 0.0125, "no jump: at most what the motors can do in a tick"
        x, y = robot.x_m, robot.y_m
        if tick % 50 == 0:
            assert home.free.contains(Point(x, y)) and gap_m(robot) >= -1e-9, (tick, home.name)
    assert home.free.contains(Point(x, y)) and gap_m(robot) >= -1e-9


@given(homes(), SEEDS)
def test_no_drive_gets_the_disc_into_a_wall(home, seed):
    if home.free.boundary.distance(Point(home.start)) >= RADIUS_M:
        absurd_drive(home, seed, 400)


@pytest.mark.parametrize("name", ["giraff_a", "rmf_office", "vac_flat_30"])
def test_no_drive_gets_the_disc_into_a_wall_of_a_real_home(real_homes, name):
    absurd_drive(load_home(real_homes / f"{name}.json"), 11, 3000)


def dead_reckoning_error(preset, seed):
    """Distance between the truth and the pose summed from pulses, after 40 m with turns."""
    robot = robot_in(hall(60, 60, (30, 30)), odometry=preset, seed=seed)
    values = array("i", bytes(4 * VALUES_MAX))
    x, y, theta = 30.0, 30.0, 0.0
    for tick in range(7000):
        turning = tick % 500 >= 450
        robot.drive(*((-90, 90) if turning else (300, 300)))
        robot.sense(values)
        left, right = values[1] * PULSE_MM / 1000, values[2] * PULSE_MM / 1000
        turn = (right - left) / 0.235
        x += (left + right) / 2 * math.cos(theta + turn / 2)
        y += (left + right) / 2 * math.sin(theta + turn / 2)
        theta += turn
    assert robot.contacts == 0
    return math.hypot(x - robot.x_m, y - robot.y_m)


def test_odometry_drifts_as_its_preset_says():
    assert set(ODOMETRY) == {"calibrated", "poor"}
    calibrated = [dead_reckoning_error("calibrated", seed) for seed in range(1, 5)]
    poor = [dead_reckoning_error("poor", seed) for seed in range(1, 5)]
    assert 0.001 < max(calibrated) < 0.5
    assert min(poor) > max(calibrated)
    assert max(poor) < 6


@pytest.mark.parametrize("preset", ["calibrated", "poor"])
def test_slip_grows_with_the_root_of_the_way(preset):
    """With perfect wheels, the heading after s metres is off by slip * sqrt(2 s) / track."""
    slip = ODOMETRY[preset]["slip"]
    lefts, rights = [], []
    for seed in range(60):
        robot = exact(robot_in(hall(9, 9, (1, 4.5)), seed=seed))
        body = robot.body
        body._slip = slip
        for _ in range(340):
            body.drive(300, 300)
        along, turned = robot.x_m - 1, body.theta_rad * 0.235
        lefts.append(along - turned / 2 - 340 * 0.006 + 0.006)
        rights.append(along + turned / 2 - 340 * 0.006 + 0.006)
    expected = slip * math.sqrt(2.034)
    for travel in (lefts, rights):
        assert statistics.stdev(travel) == pytest.approx(expected, rel=0.3)
