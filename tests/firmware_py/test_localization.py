# Dead reckoning corrected by fixes: the replacement rule, the heading between two fixes, the frame that carries both.

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

frame_module, odometry_module, localization_module = watched(
    "firmware_py.storage.frame", "firmware_py.collection.odometry", "firmware_py.collection.localization"
)
BAM = math.tau / 65536


# Says what a test tells it to.
class Fixes:
    def __init__(self):
        self.dx_mm = self.dy_mm = 0
        self.variance_mm2 = self.static = 0
        self.good = True
        self.shifted = []
        self.added = self.waiting = self.worked = 0

    def solve(self):
        return self.good

    def shift(self, dx_mm, dy_mm):
        self.shifted.append((dx_mm, dy_mm))

    def add(self, values, first, x_mm, y_mm):
        self.added += 1
        self.waiting = 2

    def work(self):
        self.worked += 1
        self.waiting -= 1


class Located:
    def __init__(self, fix_mm=20, fix_bam=40, weighted=1, at=(0, 0)):
        self.odometry = odometry_module.Odometry()
        self.odometry.begin(at[0] * 1000, at[1] * 1000, 0, 72000, 235000, 508)
        self.uwb = Fixes()
        self.frame = frame_module.Frame()
        self.here = localization_module.Localization(self.odometry, self.uwb, self.frame)
        self.here.begin(fix_mm, fix_bam, weighted)

    def at(self, x_mm, y_mm, reports=0):
        """The odometry has come there."""
        self.odometry.x_um, self.odometry.y_um = x_mm * 1000, y_mm * 1000
        self.here.update([reports], 0)
        return self.here.x_mm, self.here.y_mm

    def fix(self, dx_mm, dy_mm):
        self.uwb.dx_mm, self.uwb.dy_mm = dx_mm, dy_mm
        self.here.fix()
        return self.here.x_mm, self.here.y_mm


def test_without_a_fix_the_estimate_is_the_odometry():
    located = Located(at=(3000, -2000))
    assert located.at(3500, -1000) == (3500, -1000)
    located.uwb.good = False
    assert located.fix(900, 900) == (3500, -1000) and located.here.fixes == 0


@pytest.mark.parametrize("dx, dy, replaced", [(21, 0, True), (20, 0, False), (15, 15, True), (-14, 14, False), (0, -30, True)])
def test_the_global_position_replaces_the_local_one_beyond_the_threshold(dx, dy, replaced):
    located = Located(fix_mm=20)
    located.at(1000, 500)
    assert located.fix(dx, dy) == ((1000 + dx, 500 + dy) if replaced else (1000, 500))
    assert (located.here.fixes, located.here.replaced) == (1, int(replaced))
    assert located.uwb.shifted == [(dx, dy)] * replaced
    assert located.at(2000, 500) == ((2000 + dx, 500 + dy) if replaced else (2000, 500))
    assert (located.odometry.x_um, located.odometry.y_um) == (2_000_000, 500_000)  # steering sees no jump


def test_the_heading_comes_from_the_direction_between_two_fixes():
    located = Located()
    located.fix(0, 0)
    located.at(4000, 0)
    assert located.fix(0, 140) == (4000, 140)  # two degrees to the left of where dead reckoning went
    assert abs(located.here.heading_bam - 364) < 4
    x, y = located.at(8000, 0)
    assert abs(x - 8000) < 6 and abs(y - 280) < 6


def test_what_an_older_fix_had_replaced_is_no_turn():
    located = Located()
    located.fix(0, 100)      # replaced: 100 mm are made good here
    located.at(4000, 0)
    assert located.fix(0, 0) == (4000, 100)
    assert located.here.heading_bam == 0
    located = Located(fix_mm=200)
    located.fix(0, 100)      # not replaced: the deviation stays, and is the same 4 m on
    located.at(4000, 0)
    located.fix(0, 100)
    assert located.here.heading_bam == 0


def test_a_replacement_between_two_marks_is_no_turn():
    located = Located()
    located.fix(0, 0)
    located.at(1000, 0)      # too near the mark for a heading
    located.fix(0, 50)
    located.at(4000, 0)
    located.fix(0, 0)        # 50 mm in 4 m
    assert abs(located.here.heading_bam - round(math.atan2(50, 4000) / BAM)) < 4
    located = Located()
    located.fix(0, 0)
    located.at(0, 1000)
    located.fix(-50, 0)
    located.at(0, 4000)
    located.fix(0, 0)
    assert abs(located.here.heading_bam - round(math.atan2(50, 4000) / BAM)) < 4


@pytest.mark.parametrize("x_mm, dy_mm, fix_bam", [(2400, 200, 40), (4000, 20, 60), (13000, 900, 40)])
def test_no_heading_from_a_short_or_a_long_way_or_within_the_threshold(x_mm, dy_mm, fix_bam):
    located = Located(fix_bam=fix_bam)
    located.fix(0, 0)
    located.at(x_mm, 0)
    located.fix(0, dy_mm)
    assert located.here.heading_bam == 0


def test_the_paper_takes_the_heading_from_half_a_metre():
    for x_mm, turned in ((490, False), (510, True)):
        located = Located(weighted=0)
        located.fix(0, 0)
        located.at(x_mm, 0)
        located.fix(0, 20)
        assert (located.here.heading_bam != 0) is turned


def test_an_uncertain_fix_turns_less():
    turns = []
    for weighted, variance in ((0, 10**5), (1, 0), (1, 1000), (1, 10**5)):
        located = Located(weighted=weighted, fix_bam=0)
        located.uwb.variance_mm2 = variance
        located.fix(0, 0)
        located.at(4000, 0)
        located.fix(0, 140)
        turns.append(located.here.heading_bam)
    assert turns[0] == turns[1] > turns[2] > turns[3]


def test_reports_reach_the_receiver_with_the_estimate():
    located = Located()
    located.at(10, 10, reports=0)
    located.at(10, 10, reports=3)
    assert (located.uwb.added, located.uwb.worked) == (1, 0)
    for _ in range(4):
        located.at(10, 10)
    assert (located.uwb.added, located.uwb.worked) == (1, 2)


MM = st.integers(-400_000, 400_000)
DEVIATION = st.integers(-3999, 3999)


@given(st.lists(st.tuples(MM, MM, DEVIATION, DEVIATION, st.booleans()), max_size=40), st.booleans(), st.integers(0, 10**6))
def test_any_fixes_anywhere_make_no_number_too_big(work, weighted, variance):
    located = Located(fix_mm=8, weighted=weighted)
    located.uwb.variance_mm2 = variance
    for x, y, dx, dy, fixed in work:
        located.at(x, y)
        if fixed:
            located.fix(dx, dy)


def test_far_from_the_last_fix_the_estimate_goes_on():
    located = Located()
    located.fix(0, 0)
    located.at(4000, 0)
    located.fix(0, 140)
    for x in range(4000, 60001, 250):
        x_mm, y_mm = located.at(x, 0)
    turn = located.frame.turn_bam * BAM
    assert abs(x_mm - 4000 - 56000 * math.cos(turn)) < 40 and abs(y_mm - 140 - 56000 * math.sin(turn)) < 40


@given(st.integers(-30000, 30000), st.integers(-30000, 30000), st.integers(0, 65535), st.integers(-9000, 9000), st.integers(-9000, 9000))
def test_the_frame_turns_about_its_anchor_and_may_be_anchored_anywhere(x, y, turn, ax, ay):
    frame = frame_module.Frame()
    frame.rotate(turn)
    frame.put(x, y)
    c, s = math.cos(turn * BAM), math.sin(turn * BAM)
    far = 2 + math.hypot(x, y) * 2e-4
    assert abs(frame.x - (x * c - y * s)) <= far and abs(frame.y - (x * s + y * c)) <= far
    before = (frame.x, frame.y)
    frame.move(ax, ay)
    if max(abs(x - ax), abs(y - ay)) <= 32000:
        frame.put(x, y)
        assert abs(frame.x - before[0]) <= 2 * far and abs(frame.y - before[1]) <= 2 * far
