# Missions with a sensor that fails, in one process without a link: what the core makes of it, and whether it says so.

import math
from array import array
from dataclasses import dataclass
from functools import lru_cache

from firmware_py.pipeline import Tvslam
from host_tools.map_file import MapError
from host_tools.score import HomeTruth, score_map
from protocol import states
from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.faults import parse
from sim_device.home import load_home
from sim_device.sensors.faulty import FaultySensors
from sim_device.virtual_robot import VirtualRobot
from tests.stories.mission import TICK_S, map_of, told


# How a mission went: `said` is what degraded names, `error_cm` the mean deviation of the estimate from the truth.
@dataclass
class Outcome:
    core: Tvslam
    said: list
    robot_s: float
    error_cm: float
    precision: float
    recall: float

    @property
    def ended_well(self):
        return self.core.state == states.DONE and self.core.finished

    def __str__(self):
        reason = states.REASONS[self.core.reason] if self.core.state in (states.DONE, states.FAILED) else "not ended"
        return "%-26s %5.0f s  error %7.1f cm  P %.2f R %.2f  %s" % (
            reason[:26], self.robot_s, self.error_cm, self.precision, self.recall, "+".join(self.said) or "-")


@lru_cache(maxsize=None)
def home_and_truth(name):
    home = load_home(name)
    return home, HomeTruth(home)


def drive(home_name, faults="", seed=1, uwb="paper", odometry="calibrated", max_robot_s=1800):
    home, truth = home_and_truth(home_name)
    robot = VirtualRobot(home, load_robot(), seed, uwb, odometry)
    sensed = FaultySensors(robot, parse(faults).sensors, seed)
    core = told(Tvslam(), robot)
    values = array("i", bytes(4 * VALUES_MAX))
    here, total_m = core.localization, 0.0
    while core.state not in (states.DONE, states.FAILED) and robot.tick * TICK_S < max_robot_s:
        values[0] = robot.tick + 1
        sensed.sense(values)
        core.step(values)
        total_m += math.hypot(here.x_mm / 1000 - robot.x_m, here.y_mm / 1000 - robot.y_m)
        robot.drive(core.left_mm_s, core.right_mm_s)
    try:
        score = score_map(truth, map_of(core))
    except MapError:
        score = {}
    said = [name for bit, name in enumerate(states.DEGRADED) if core.degraded >> bit & 1]
    return Outcome(core, said, robot.tick * TICK_S, 100 * total_m / max(robot.tick, 1),
                   score.get("precision_5cm") or 0.0, score.get("recall_5cm") or 0.0)


# Infrared that is 0.2 s late, or 30 % too bright, puts walls up to 6 cm off: some of them are beyond the 5 cm of the score.
BOUND_CM, BOUND_SHARE = 10.0, 0.75


def is_honest(outcome):
    """The map is sound, or the core says that it may not be."""
    sound = outcome.error_cm <= BOUND_CM and min(outcome.precision, outcome.recall) >= BOUND_SHARE
    return outcome.ended_well and sound or bool(outcome.said) or outcome.core.state == states.FAILED
