# A whole mission in one process: the virtual robot and the core, step by step,
# without a link. drive_mission() gives what a story asserts on.

import dataclasses
from array import array
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from firmware_py.pipeline import Tvslam
from host_tools.map_file import CHAIN_COUNT_MAX, FLAG_CHAIN_END, Chain, VectorMap
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


def map_of(store):
    """The core's vector store as the host's map, chains of over 255 records joined."""
    chains = []
    goes_on = False
    for c in range(store.chains):
        at = slice(store.firsts[c], store.firsts[c] + store.counts[c])
        if goes_on:
            part = chains.pop()
            at = slice(part.start, at.stop)
        goes_on = store.counts[c] == CHAIN_COUNT_MAX and not store.flags[at.stop - 1] & FLAG_CHAIN_END
        chains.append(slice(at.start, at.stop) if goes_on else (at, store.kinds[c]))
    made = []
    for at, kind in (c for c in chains if isinstance(c, tuple)):
        xy = np.column_stack([store.xs[at], store.ys[at]]) * 0.005
        flags = np.array(store.flags[at])
        made.append(Chain(kind & 3, bool(kind & 4), kind >> 3, xy, np.array(store.sigmas[at]), flags,
                          len(xy) > 1 and not flags[-1] & FLAG_CHAIN_END))  # fmt: skip
    return VectorMap(made)


@lru_cache(maxsize=None)
def drive_mission(home_name, seed=1, uwb="paper", odometry="calibrated", start=None, max_robot_s=3600):
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
    vector_map = map_of(core.vectors)
    return Mission(core, robot, vector_map, score_map(HomeTruth(home), vector_map), entered, robot.tick * TICK_S)
