# How well the robot knows where it is: the first minutes of missions with each kind of UWB and of wheels, against the truth.

import math
from array import array
from functools import lru_cache

import pytest

from firmware_py.pipeline import Tvslam
from protocol import states
from protocol.parameters import FLAGS
from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.virtual_robot import VirtualRobot
from tests.stories.mission import NUMBERS, TICK_S, told

DRIVEN_S = 150
ON = sum(on << bit for bit, (_, on, _) in enumerate(FLAGS))
BIT = {name: 1 << bit for bit, (name, _, _) in enumerate(FLAGS)}


@lru_cache(maxsize=None)
def driven(uwb, odometry, without=(), home="studio", seed=1):
    """(core, robot, mean error in cm) after at most 150 s of a mission."""
    robot = VirtualRobot(load_home(home), load_robot(), seed=seed, uwb=uwb, odometry=odometry)
    core = Tvslam()
    core.set_parameter(NUMBERS["flags"], 0, ON - sum(BIT[name] for name in without))
    told(core, robot)
    values = array("i", bytes(4 * VALUES_MAX))
    errors = []
    for step in range(1, round(DRIVEN_S / TICK_S) + 1):
        values[0] = step
        robot.sense(values)
        core.step(values)
        here = core.localization
        errors.append(math.dist((here.x_mm / 10, here.y_mm / 10), (100 * robot.x_m, 100 * robot.y_m)))
        if core.state in (states.DONE, states.FAILED):
            break
        robot.drive(core.left_mm_s, core.right_mm_s)
    return core, robot, sum(errors) / len(errors)


@pytest.mark.parametrize("uwb, odometry, most_cm", [
    ("paper", "calibrated", 1.6), ("tof", "calibrated", 2.0), ("tof", "poor", 2.4), ("none", "calibrated", 12),
    ("rssi_real", "calibrated", 25),
])  # fmt: skip
def test_the_error_stays_within_what_the_sensors_allow(uwb, odometry, most_cm):
    assert driven(uwb, odometry)[2] <= most_cm


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_poor_wheels_are_found_out(seed):
    core, robot, _ = driven("tof", "poor", seed=seed)
    mismatch = robot.body.right_scale - robot.body.left_scale
    drift = core.localization._drift / 4 / 65536 * math.tau * robot.config.track_m
    track = core.localization._track / 65536
    wider = robot.body.track_m / robot.config.track_m
    assert abs(drift - mismatch) < 0.5 * abs(mismatch) and abs(mismatch) > 0.0029
    assert abs(1 / (1 + track) - wider) < 0.6 * abs(wider - 1) and abs(wider - 1) > 0.0099


def test_without_the_filter_poor_wheels_are_not():
    assert driven("tof", "poor", without=("filter",))[2] > 2 * driven("tof", "poor")[2]


def test_a_filter_that_may_not_calibrate_leaves_dead_reckoning_alone():
    core, _, error_cm = driven("tof", "poor", without=("self_calibration",))
    assert core.localization._drift == core.localization._track == 0 and error_cm < 4
