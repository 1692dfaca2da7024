# Where a robot is that was set down anywhere: noticed, found by ranges alone, the filter begun again; or given up.

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.pipeline import Tvslam
from firmware_py.collection.uwb import SOURCE_STRENGTH as STRENGTH
from protocol import states
from sim_device.virtual_robot import VirtualRobot
from sim_device.config import RobotError, load_robot
from tests.firmware_py.core_run import WatchedTvslam
from tests.firmware_py.puppet import Puppet, told
from tests.firmware_py.test_uwb import ANCHORS, FLIGHT, HEIGHT, made, record, report
from tests.sim_device.random_homes import hall

EVERY = 5       # ticks between two reports


# A puppet in the open among transmitters, that is somewhere else than its odometry says: there + turned way of the odometry.
class Carried:
    def __init__(self, kind=Tvslam, anchors=ANCHORS, noise_mm=0, **parameters):
        self.anchors = anchors
        self.puppet = Puppet(told(kind, uwb_source=FLIGHT, anchor_count=len(anchors), anchor_x=[x for x, _ in anchors], dock_x=4_000_000,
                                  anchor_y=[y for _, y in anchors], anchor_height=[HEIGHT] * len(anchors), dock_y=1_000_000, **parameters))
        self.core = self.puppet.core
        self.rng = random.Random(1)
        self.noise_mm = noise_mm
        self.put(4000, 1000, 0)

    def put(self, x_mm, y_mm, turn_rad):
        o = self.core.odometry
        self.from_odometry = o.x_um / 1000, o.y_um / 1000
        self.heading_was = o.heading_bam * math.tau / 65536
        self.at, self.turn = (x_mm, y_mm), turn_rad

    @property
    def truth(self):
        """x, y in mm; a core that found itself has begun its odometry anew, so only while it has not."""
        o = self.core.odometry
        dx, dy = o.x_um / 1000 - self.from_odometry[0], o.y_um / 1000 - self.from_odometry[1]
        c, s = math.cos(self.turn), math.sin(self.turn)
        return self.at[0] + c * dx - s * dy, self.at[1] + s * dx + c * dy

    def run(self, ticks, heard=True, until=None):
        for tick in range(ticks):
            at = self.truth
            records = ()
            if heard and tick % EVERY == 0:
                records = sorted((record(k, at, self.anchors, bias_mm=self.rng.gauss(0, self.noise_mm))
                                  for k in range(len(self.anchors))), key=lambda r: -r[1])
            before = self.core.odometry.heading_bam * math.tau / 65536
            self.puppet.step(uwb=records)
            if until is not None and self.core.state in until:
                return at, before + self.turn
        return None


@pytest.mark.parametrize("place, tenths", [((600, 4466), 8), ((7400, 5500), -31), ((1500, 3500), 16), ((6000, 5000), 0)])
def test_it_finds_place_and_heading_wherever_it_was_put(place, tenths):
    carried = Carried(WatchedTvslam, noise_mm=20)
    carried.run(100)
    carried.put(*place, tenths / 10)
    assert carried.run(200, until=[states.LOST])
    (x, y), heading = carried.run(1500, until=[states.FIND_WALL])
    here = carried.core.localization
    assert math.dist((here.x_mm, here.y_mm), (x, y)) < 60
    off = (here.heading_bam * math.tau / 65536 - heading + math.pi) % math.tau - math.pi
    assert abs(off) < math.radians(10)
    p = here._ekf.p
    assert p[0] == p[7] >= 10000 and (off * 65536 / math.tau) ** 2 < 9 * p[14]  # honest: within three deviations
    assert not any(here._ekf.p[i] for i in (1, 2, 8, 13)) and carried.core.uwb.strife == 0


def test_it_is_noticed_after_two_seconds_and_not_before():
    carried = Carried()
    carried.run(100)
    carried.put(4000, 4500, 1)
    carried.run(95)
    assert carried.core.state == states.FIND_WALL and 0 < carried.core.uwb.strife < 20
    carried.run(10)
    assert carried.core.state == states.LOST


@pytest.mark.parametrize("flags", [0x0FBF, 0x1FBF & ~0x80], ids=["flag off", "no filter"])
def test_without_the_flag_or_the_filter_it_goes_on(flags):
    carried = Carried(flags=flags)
    carried.put(4000, 4500, 1)
    carried.run(400)
    assert carried.core.state == states.FIND_WALL


def test_nor_in_mode_paper():
    carried = Carried(mode=1)
    carried.put(4000, 4500, 1)
    carried.run(400)
    assert states.LOST not in carried.puppet.states


def test_transmitters_that_fall_silent_end_it_after_a_minute():
    carried = Carried()
    carried.run(100)
    carried.put(4000, 4500, 1)
    carried.run(200, until=[states.LOST])
    carried.run(2900, heard=False)
    assert carried.core.state == states.LOST
    carried.run(200, heard=False)
    core = carried.core
    assert (core.state, core.reason, core.finished) == (states.FAILED, states.REASON_LOST, False)
    assert (core.left_mm_s, core.right_mm_s) == (0, 0)


def test_transmitters_in_a_row_tell_no_place():
    carried = Carried(anchors=[(0, 0), (3000, 0), (6000, 0), (9000, 0)])
    carried.run(100)
    carried.put(1000, 1000, 0)
    carried.run(3500)
    assert carried.core.reason in (0, states.REASON_LOST) and states.DONE not in carried.puppet.states


@given(st.integers(500, 7500), st.integers(500, 5500), st.lists(st.integers(0, 4000), min_size=5, max_size=5))
def test_walls_alone_never_contradict(x, y, longer):
    """Whatever they add to any of the ranges, seen from where the robot is."""
    uwb = made(FLIGHT)
    for _ in range(30):
        report(uwb, [record(k, (x, y), bias_mm=longer[k]) for k in range(5)], (x, y))
    assert uwb.strife == 0


def test_half_a_metre_that_walls_drew_the_estimate_away_does_not():
    uwb = made(FLIGHT)
    for _ in range(30):
        report(uwb, [record(k, (4000, 3000)) for k in range(5)], (4700, 3700))
    assert uwb.strife == 0


@pytest.mark.parametrize("source, off_mm", [(STRENGTH, 1200), (FLIGHT, 2500)])
def test_a_wrong_estimate_does_and_one_report_that_agrees_takes_two_back(source, off_mm):
    uwb = made(source)
    for n in range(10):
        report(uwb, [record(k, (4000, 3000)) for k in range(5)], (4000 + off_mm, 3000 + off_mm // 2))
        assert uwb.contradicted and uwb.strife == n + 1
    report(uwb, [record(k, (4000, 3000)) for k in range(5)], (4000, 3000))
    assert not uwb.contradicted and uwb.strife == 8
    uwb.forget()
    assert uwb.strife == 0 and uwb.reports == 0 and not any(uwb._seen_mm)


def test_the_virtual_robot_is_set_down_where_there_is_room_and_its_wheels_do_not_notice():
    robot = VirtualRobot(hall(4, 3, (1, 1)), load_robot(), uwb="none")
    for _ in range(50):
        robot.drive(200, 250)
    wheels = robot.body.left_rad, robot.body.right_rad
    robot.kidnap(3, 2, 4)
    assert (robot.x_m, robot.y_m) == (3, 2) and robot.theta_rad == pytest.approx(4 - math.tau)
    assert (robot.body.left_rad, robot.body.right_rad) == wheels
    robot.drive(0, 0)
    assert (robot.x_m, robot.y_m) == (3, 2)  # it stands
    with pytest.raises(RobotError, match="a wall is 0.100 m away"):
        robot.kidnap(0.1, 2, 0)
    assert (robot.x_m, robot.y_m) == (3, 2)
