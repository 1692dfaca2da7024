# A robot that is carried away in the middle of its mission: it notices, finds its place again, and the map comes out whole.

import math
from array import array

import pytest

from firmware_py.pipeline import Tvslam
from firmware_py.storage.vector_store import BARRIER, OUTLINE, SEARCHED
from host_tools.score import HomeTruth, score_map
from protocol import states
from protocol.parameters import FLAGS
from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.virtual_robot import VirtualRobot
from tests.docs.test_architecture import table
from tests.stories.mission import NUMBERS, TICK_S, map_of, told

ON = sum(on << bit for bit, (_, on, _) in enumerate(FLAGS))
KIDNAP = 1 << [name for name, _, _ in FLAGS].index("kidnap")
RECOVERED_S = 60
ROBOT_S_MAX = 3000


# A mission in which the robot is carried to (x, y), turned by `turn`, the first time that `when(core)` holds after `after_s`.
class Kidnapping:
    def __init__(self, when, to, turn, after_s=0, flags=ON, home="studio", ends=False, **robot):
        self.home = load_home(home)
        self.robot = VirtualRobot(self.home, load_robot(), **robot)
        self.core = Tvslam()
        self.core.set_parameter(NUMBERS["flags"], 0, flags)
        told(self.core, self.robot)
        self.entered = [states.NAMES[self.core.state]]
        self.errors_cm = []        # from the kidnapping on, each tick
        self.kinds = None          # of the chains on the map while the robot sought its place
        self._values = array("i", bytes(4 * VALUES_MAX))
        while not when(self.core) or self.robot.tick * TICK_S < after_s:
            self.tick()
        self.mapped = self.core.vectors.used
        self.robot.kidnap(*to, self.robot.theta_rad + turn)
        while self.core.state not in (states.DONE, states.FAILED) and self.robot.tick * TICK_S < ROBOT_S_MAX:
            self.tick()
            if self.core.state == states.LOST:
                self.kinds = list(self.core.vectors.kinds[:self.core.vectors.chains])
            here = self.core.localization
            self.errors_cm.append(math.dist((here.x_mm / 10, here.y_mm / 10), (100 * self.robot.x_m, 100 * self.robot.y_m)))
            if ends and len(self.errors_cm) * TICK_S >= RECOVERED_S:
                break

    def tick(self):
        self._values[0] = self.robot.tick
        self.robot.sense(self._values)
        self.core.step(self._values)
        self.robot.drive(self.core.left_mm_s, self.core.right_mm_s)
        if states.NAMES[self.core.state] != self.entered[-1]:
            self.entered.append(states.NAMES[self.core.state])

    def score(self):
        return score_map(HomeTruth(self.home), map_of(self.core))


def following(core):
    return core.explorer.mapping and core.vectors.used > 8 and not core.explorer.inside


def searching(core):
    return core.explorer.inside and core.state == states.SWEEP


def expect_recovery(story):
    after = round(RECOVERED_S / TICK_S)
    assert max(story.errors_cm[:after]) > 100 and max(story.errors_cm[after:]) < 10
    assert story.core.state == states.DONE and story.core.finished, story.entered[-3:]
    score = story.score()
    assert score["outline_precision_5cm"] >= 0.93 and score["outline_recall_5cm"] >= 0.93, score
    leads = table()
    strange = {f"{a} -> {b}" for a, b in zip(story.entered, story.entered[1:]) if b not in leads.get(a, ())}
    assert not strange, strange


@pytest.mark.parametrize("to, turn", [((5.0, 3.0), 2.0), ((1.0, 3.6), -3.0)])
def test_carried_away_on_the_outline_it_begins_that_anew(to, turn):
    story = Kidnapping(following, to, turn, after_s=20)
    expect_recovery(story)
    assert story.entered.count("LOST") == 1 and story.entered[story.entered.index("LOST") + 1] == "FIND_WALL"
    assert story.mapped > 8 and all(kind == BARRIER | SEARCHED for kind in story.kinds)  # of the outline begun before nothing stayed


def test_carried_away_inside_it_goes_on_with_the_search():
    story = Kidnapping(searching, (1.0, 3.6), 1.5)
    expect_recovery(story)
    assert story.entered.count("LOST") == 1 and story.entered[story.entered.index("LOST") + 1] == "SELECT"
    assert OUTLINE | SEARCHED in story.kinds  # it is known, and stays so


def test_by_ranges_in_time_and_on_poor_wheels_too():
    story = Kidnapping(following, (5.0, 3.0), 2.5, after_s=20, uwb="tof", odometry="poor", ends=True)
    assert "LOST" in story.entered and story.errors_cm[-1] < 10


@pytest.mark.parametrize("what", [{"flags": ON & ~KIDNAP}, {"uwb": "none"}, {"uwb": "rssi_real"}], ids=["flag off", "no UWB", "shadowing"])
def test_without_the_flag_or_ranges_that_can_tell_nobody_notices(what):
    story = Kidnapping(following, (5.0, 3.0), 2.0, after_s=20, ends=True, **what)
    assert "LOST" not in story.entered
