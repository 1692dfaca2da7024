# A whole mission in one process: the virtual robot and the core, step by step,
# without a link. drive_mission() gives what a story asserts on.

import dataclasses
from array import array
from dataclasses import dataclass
from functools import lru_cache

from firmware_py.pipeline import Tvslam
from host_tools.map_file import VectorMap, decode_map
from host_tools.score import HomeTruth, score_map
from protocol import states
from protocol.parameters import PARAMETERS
from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.virtual_robot import VirtualRobot

TICK_S = 0.02
NUMBERS = {parameter[0]: number for number, parameter in enumerate(PARAMETERS)}


# What came of a mission: the core and the robot as they stand at its end, the
# figures against the home's truth, the states in the order they were entered.
@dataclass
class Mission:
    core: Tvslam
    robot: VirtualRobot
    vector_map: VectorMap
    score: dict
    states: list
    robot_s: float

    @property
    def finished(self):
        return self.core.state == states.DONE


def told(core, robot):
    """The core told its parameters, as the link does it."""
    for name, values in robot.parameters().items():
        for index, value in enumerate(values):
            assert core.set_parameter(NUMBERS[name], index, value) == 0, (name, index, value)
    core.begin()
    return core


def map_of(core):
    """The core's map as the bytes that it sends, read by the host."""
    core.image.begin()
    while not core.image.step(256):
        pass
    return decode_map(bytes(core.image.byte(i) for i in range(core.image.size)))


@lru_cache(maxsize=None)
def drive_mission(home_name, seed=1, uwb="paper", odometry="calibrated", start=None, max_robot_s=14400):
    home = load_home(home_name)
    if start:
        home = dataclasses.replace(home, start=start)
    robot = VirtualRobot(home, load_robot(), seed, uwb, odometry)
    core = told(Tvslam(), robot)
    values = array("i", bytes(4 * VALUES_MAX))
    entered = [core.state]
    while core.state not in (states.DONE, states.FAILED) and robot.tick * TICK_S < max_robot_s:
        values[0] = robot.tick
        robot.sense(values)
        core.step(values)
        robot.drive(core.left_mm_s, core.right_mm_s)
        if core.state != entered[-1]:
            entered.append(core.state)
    vector_map = map_of(core)
    return Mission(core, robot, vector_map, score_map(HomeTruth(home), vector_map), entered, robot.tick * TICK_S)
