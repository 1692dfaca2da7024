# The whole virtual robot: bit-identical runs, what it tells the core, what it refuses.

import subprocess
import sys
from array import array

import pytest

from protocol.parameters import PARAMETERS
from protocol.schema import VALUES_MAX
from sim_device.config import DEFAULT, RobotError, load_robot
from sim_device.virtual_robot import VirtualRobot
from tests.sim_device.random_homes import drawn_home, hall

# The mission of the determinism tests: run here and in a fresh process.
MISSION = """
import hashlib, sys
from array import array
from sim_device.config import load_robot
from sim_device.virtual_robot import VirtualRobot
from tests.sim_device.random_homes import drawn_home

def trace(seed, uwb, odometry):
    robot = VirtualRobot(drawn_home(5), load_robot(), seed, uwb, odometry)
    values = array("i", bytes(4 * 112))
    digest = hashlib.sha256()
    for tick in range(1500):
        robot.sense(values)
        digest.update(values.tobytes())
        digest.update(f"{robot.x_m!r} {robot.y_m!r} {robot.theta_rad!r} {robot.contacts}".encode())
        robot.drive(*((300, 280) if tick % 200 < 150 else (-200, 150)))
    return digest.hexdigest()
"""


def trace(*settings):
    scope = {}
    exec(MISSION, scope)
    return scope["trace"](*settings)


@pytest.mark.parametrize("uwb", ["paper", "rssi_real", "tof", "tof_nlos", "none"])
def test_runs_are_bit_identical(uwb):
    assert trace(3, uwb, "poor") == trace(3, uwb, "poor")


def test_another_process_gives_the_same_bits(project):
    code = MISSION + "\nprint(trace(3, 'rssi_real', 'calibrated'))"
    out = subprocess.run([sys.executable, "-c", code], cwd=project, capture_output=True, text=True, check=True, timeout=60,
                         env={"PYTHONHASHSEED": "77", "PYTHONPATH": "."})
    assert out.stdout.strip() == trace(3, "rssi_real", "calibrated")


def test_another_seed_gives_other_readings():
    assert len({trace(seed, "paper", "calibrated") for seed in (1, 2, 3)}) == 3


def test_the_uwb_preset_leaves_the_body_and_the_other_sensors_alone():
    """Streams of noise are apart: a change of one sensor must not reshuffle the rest."""
    home = drawn_home(5)
    robots = [VirtualRobot(home, load_robot(), uwb=preset) for preset in ("none", "tof_nlos")]
    rows = [array("i", bytes(4 * VALUES_MAX)) for _ in robots]
    for _ in range(300):
        for robot, values in zip(robots, rows):
            robot.sense(values)
            robot.drive(300, 250)
        assert rows[0][1:13] == rows[1][1:13]
    assert (robots[0].x_m, robots[0].y_m) == (robots[1].x_m, robots[1].y_m)


def test_the_parameters_are_those_of_the_protocol():
    home = hall(6, 4, (1.5, 2.25), rooms=[(2, 2), (4, 2)])
    robot = VirtualRobot(home, load_robot())
    told = robot.parameters()
    table = {name: (count, low, high) for name, _, count, low, high, _ in PARAMETERS}
    for name, values in told.items():
        count, low, high = table[name]
        assert len(values) <= count and all(type(v) is int and low <= v <= high for v in values), name
    assert (told["dock_x"], told["dock_y"], told["dock_heading"]) == ([1500000], [2250000], [0])
    assert told["anchor_count"] == [6] == [len(robot.anchors)] and told["anchor_height"] == [2300] * 6
    assert list(zip(told["anchor_x"], told["anchor_y"])) == [(0, 0), (6000, 0), (6000, 4000), (0, 4000), (2000, 2000), (4000, 2000)]


def test_wrong_presets_and_a_body_too_large_are_said(tmp_path):
    home = hall(4, 4, (0.2, 2))
    with pytest.raises(ValueError, match="unknown UWB preset 'gps'.*paper"):
        VirtualRobot(home, load_robot(), uwb="gps")
    with pytest.raises(ValueError, match="unknown odometry preset 'good'.*poor"):
        VirtualRobot(home, load_robot(), odometry="good")
    path = tmp_path / "wide.toml"
    path.write_text(DEFAULT.read_text().replace("radius_m = 0.17", "radius_m = 0.25"))
    with pytest.raises(RobotError, match="body.radius_m.*0.200 m away"):
        VirtualRobot(home, load_robot(path))
