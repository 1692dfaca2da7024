# Dead reckoning loses no fraction, however the pulses fall into ticks.

import math

from hypothesis import given
from hypothesis import strategies as st

from firmware_py.collection.odometry import Odometry as PlainOdometry
from tests.firmware_py.watched import watched

Odometry = watched("firmware_py.collection.odometry").Odometry

WHEEL_UM, TRACK_UM, PULSES = 72000, 235000, 508
UM_A_PULSE = math.pi * WHEEL_UM / PULSES


def made(x_um=0, y_um=0, heading_bam=0, kind=Odometry):
    odometry = kind()
    odometry.begin(x_um, y_um, heading_bam, WHEEL_UM, TRACK_UM, PULSES, 1)
    return odometry


def floats(ticks):
    """The same kinematics without a rounding: (x, y) in um, heading in rad, um driven."""
    x = y = heading = driven = 0.0
    for left, right in ticks:
        s = (left + right) / 2 * UM_A_PULSE
        turned = (right - left) * UM_A_PULSE / TRACK_UM
        x += s * math.cos(heading + turned / 2)
        y += s * math.sin(heading + turned / 2)
        heading += turned
        driven += abs(s)
    return x, y, heading, driven


def test_a_square_of_one_metre():
    side = round(1e6 / UM_A_PULSE)
    quarter = round(math.pi / 2 * TRACK_UM / 2 / UM_A_PULSE)  # a whole number of pulses: not quite 90 degrees
    ticks = ([(1, 1)] * side + [(-1, 1)] * quarter) * 4
    odometry = made()
    for left, right in ticks:
        odometry.update(left, right)
    x, y, heading, _ = floats(ticks)
    assert math.hypot(odometry.x_um - x, odometry.y_um - y) < 500
    assert math.hypot(odometry.x_um, odometry.y_um) < 10_000
    assert odometry.path_mm == math.floor(4 * side * UM_A_PULSE / 1000)
    assert abs(odometry.turn_bam - heading / math.tau * 65536) < 2


def test_a_million_ticks_lose_nothing():
    odometry = made(kind=PlainOdometry)
    for _ in range(500_000):
        odometry.update(1, 1)
        odometry.update(-1, -1)
    assert (odometry.x_um, odometry.y_um, odometry.heading_bam) == (0, 0, 0)
    for _ in range(1_000_000):
        odometry.update(0, 1)
        odometry.update(1, 0)
    assert odometry.heading_bam == 0


@given(st.lists(st.integers(-30, 30), max_size=60), st.integers(0, 65535), st.randoms(use_true_random=False))
def test_on_a_straight_line_only_the_sum_of_the_pulses_counts(ticks, heading_bam, rng):
    ends = []
    for _ in range(2):
        odometry = made(heading_bam=heading_bam)
        for pulses in ticks:
            odometry.update(pulses, pulses)
        ends.append((odometry.x_um, odometry.y_um, odometry.heading_bam))
        rng.shuffle(ticks)
    # the two floors (distance, coordinate) may each hold back less than a micrometre
    assert abs(ends[0][0] - ends[1][0]) <= 1 and abs(ends[0][1] - ends[1][1]) <= 1 and ends[0][2] == ends[1][2]


@given(st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), max_size=200), st.integers(0, 65535))
def test_heading_depends_on_the_difference_alone(ticks, heading_bam):
    odometry = made(heading_bam=heading_bam)
    for left, right in ticks:
        odometry.update(left, right)
    difference = sum(right - left for left, right in ticks)
    exact = heading_bam + difference * UM_A_PULSE / TRACK_UM / math.tau * 65536
    assert abs((odometry.heading_bam - exact + 32768) % 65536 - 32768) <= 1.5


@given(st.lists(st.tuples(st.integers(-25, 25), st.integers(-25, 25)), max_size=300))
def test_it_follows_the_floats(ticks):
    odometry = made()
    for left, right in ticks:
        odometry.update(left, right)
    x, y, _, driven = floats(ticks)
    assert math.hypot(odometry.x_um - x, odometry.y_um - y) <= 20 + driven * 3e-4


@given(st.lists(st.tuples(st.integers(-32768, 32767), st.integers(-32768, 32767)), min_size=1, max_size=50))
def test_a_broken_encoder_moves_nothing_and_is_counted(ticks):
    odometry = made()
    broken = sum(max(abs(left), abs(right)) > 64 for left, right in ticks)
    for left, right in ticks:
        odometry.update(left, right)
    assert odometry.glitches == broken
    assert odometry.path_mm <= (len(ticks) - broken) * 64 * UM_A_PULSE / 1000 + 1
