# Each sensor against its stated error model, in halls where the truth is known by hand.

import math
import random
import statistics
from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import LineString, Point

from sim_device.config import load_robot
from sim_device.sensors import infrared, ultrasonic
from sim_device.sensors.encoder import Encoder
from sim_device.sensors.infrared import Infrared, nominal_counts
from sim_device.sensors.noise import generator
from sim_device.sensors.ultrasonic import NO_ECHO, NO_READING, Ultrasonic
from sim_device.sensors.uwb import Field, Uwb, anchor_places
from sim_device.world import World
from tests.sim_device.random_homes import hall, home_of, homes, place_in

SEEDS = st.integers(0, 2**32 - 1)


# Encoder


@given(st.lists(st.floats(-0.5, 0.5), max_size=300), st.integers(16, 4096))
def test_the_encoder_loses_no_fraction(turns, pulses):
    encoder = Encoder(pulses)
    angle = 0.0
    total = 0
    for turn in turns:
        angle += turn
        total += encoder.read(angle)
        assert -1e-9 <= angle * pulses / (2 * math.pi) - total <= 1 + 1e-9


# Infrared


def test_the_curve_is_the_data_sheets():
    # 0.40 V at 30 cm, 2.25 V more at 4 cm (typical values of the data sheet, +-0.15 and +-0.3 V)
    assert nominal_counts(300) == round(0.40 / 3.3 * 1023)
    assert (nominal_counts(40) - nominal_counts(300)) * 3.3 / 1023 == pytest.approx(2.25, abs=0.06)
    for mm, volt in infrared.CURVE:
        assert nominal_counts(mm) == round(volt / 3.3 * 1023)


def test_the_curve_falls_beyond_the_fold_and_rises_before_it():
    counts = [nominal_counts(mm) for mm in range(0, 401)]
    peak = infrared.FOLD_MM
    assert counts[peak] == max(counts)
    assert all(a <= b for a, b in zip(counts[:peak], counts[1:peak + 1]))
    assert all(a > b for a, b in zip(counts[peak:160], counts[peak + 1:161])), "every millimetre up to 16 cm is a count of its own"
    assert all(a >= b for a, b in zip(counts[160:], counts[161:]))
    assert nominal_counts(5000) == counts[400]


def infrared_of(seed=1):
    bearings = [s.bearing_rad for s in load_robot().of_kind("infrared")]
    return Infrared(bearings, 0.12, seed), bearings


@given(homes(), SEEDS)
def test_infrared_distances_are_shapelys(home, seed):
    sensor, bearings = infrared_of()
    world = World(home)
    rng = random.Random(seed)
    for _ in range(10):
        x, y = place_in(home, rng)
        theta = rng.uniform(-4, 4)
        segments = world.within(x, y, sensor.reach_m)
        got = sensor.distances_m(segments, x, y, math.cos(theta), math.sin(theta))
        for distance, bearing in zip(got, bearings):
            a = theta + bearing
            beam = LineString([(x, y), (x + sensor.reach_m * math.cos(a), y + sensor.reach_m * math.sin(a))])
            hit = beam.intersection(home.free.boundary)
            assert distance == pytest.approx(sensor.reach_m if hit.is_empty else hit.distance(Point(x, y)), abs=1e-6)


def readings(seed, wall_m, count=400):
    """Raw counts of the eight sensors with a long wall wall_m ahead of the centre, nothing else near."""
    sensor, _ = infrared_of(seed)
    home = hall(20, 20, (10, 10))
    segments = World(home).within(20 - wall_m, 10, sensor.reach_m)
    values = array("i", bytes(64))
    rows = []
    for _ in range(count):
        sensor.read(values, 3, segments, 20 - wall_m, 10, 1.0, 0.0)
        rows.append(list(values[3:11]))
    return rows


def test_the_noise_is_three_counts():
    rows = readings(1, 0.22)
    for sensor in range(8):
        assert statistics.stdev(row[sensor] for row in rows) == pytest.approx(3.0, abs=0.4)


def test_parts_differ_by_two_percent():
    gains = [statistics.mean(row[0] for row in readings(seed, 0.22, 50)) / nominal_counts(100) for seed in range(60)]
    assert statistics.mean(gains) == pytest.approx(1, abs=0.01)
    assert 0.013 < statistics.stdev(gains) < 0.028


def test_each_sensor_sees_along_its_own_bearing():
    means = [statistics.mean(column) for column in zip(*readings(1, 0.25))]
    nominal = [nominal_counts(1000 * (0.25 / math.cos(math.radians(a)) - 0.12)) for a in (0, 60, 18, 40)]
    assert means[:4] == pytest.approx(nominal, rel=0.08)
    nothing = nominal_counts(400)
    assert means[4:] == pytest.approx([nothing] * 4, rel=0.1), "beside and behind there is no wall within reach"


def test_counts_stay_within_the_converter():
    for wall_m in (0.12, 0.13, 0.155, 0.16, 2.0):
        assert all(0 <= v <= 1023 for row in readings(3, wall_m, 50) for v in row)


# Ultrasonic


def echoes(home, x, y, theta, ticks=300, seed=1):
    sensor = Ultrasonic(World(home), 0.0, 0.15, seed)
    return [sensor.read(tick, x, y, math.cos(theta), math.sin(theta)) for tick in range(ticks)]


def test_a_reading_every_third_tick():
    got = echoes(hall(4, 4, (1, 2)), 2, 2, 0)
    assert all((mm == NO_READING) == (tick % 3 != 0) for tick, mm in enumerate(got))


def test_the_wall_ahead_and_its_noise():
    got = [mm for mm in echoes(hall(4, 4, (1, 2)), 2, 2, 0, 3000) if mm]
    assert statistics.mean(got) == pytest.approx(1850, abs=1)
    assert statistics.stdev(got) == pytest.approx(ultrasonic.NOISE_MM, rel=0.15)


def test_beyond_three_metres_there_is_no_echo():
    assert set(echoes(hall(9, 9, (1, 2)), 4.5, 4.5, 0)) == {NO_READING, NO_ECHO}
    assert NO_ECHO not in echoes(hall(9, 9, (1, 2)), 6.0, 4.5, 0)


def test_the_cone_catches_a_post_beside_the_axis():
    post = [[2.9, 2.2], [3.0, 2.2], [3.0, 2.45], [2.9, 2.45]]  # 12 degrees left of the axis
    got = [mm for mm in echoes(hall(7, 4, (1, 2), [post]), 2, 2, 0) if mm]
    assert statistics.mean(got) < 800


def test_a_wall_at_a_flat_angle_is_silent():
    """Along a wall 0.3 m to the right, end wall out of range: the cone's edge meets it at 75 degrees from its normal."""
    flat = echoes(hall(20, 20, (1, 2)), 10, 0.3, 0)
    steep = echoes(hall(20, 20, (1, 2)), 10, 0.3, -math.pi / 4)
    assert set(flat) == {NO_READING, NO_ECHO}
    assert NO_ECHO not in steep


# UWB

FLOOR = [(x, y) for x in range(12) for y in range(12)]


def comb(walls):
    """A hall of 18 m with so many thin walls across it, each open at one end."""
    posts = [[[2 + i, 0.05], [2.1 + i, 0.05], [2.1 + i, 3.9], [2 + i, 3.9]] for i in range(walls)]
    return hall(18, 4, (1, 2), posts, rooms=[(1, 2), (17, 2)])


def records(home, preset, x, y, reports=1, seed=1):
    """[{anchor: (strength, range)}] of so many reports at one place."""
    uwb = Uwb(home, preset, seed)
    values = array("i", bytes(4 * 112))
    result = []
    for k in range(reports):
        uwb.read(values, 13, 5 * k, x, y)
        rows = [tuple(values[14 + 3 * i:17 + 3 * i]) for i in range(values[13])]
        assert [s for _, s, _ in rows] == sorted((s for _, s, _ in rows), reverse=True), "strongest first"
        result.append({anchor: (strength, mm) for anchor, strength, mm in rows})
    return uwb, result


def slant(uwb, anchor, x, y):
    ax, ay, az = uwb.anchors[anchor]
    return math.sqrt((ax - x) ** 2 + (ay - y) ** 2 + (az - 0.1) ** 2)


def test_anchors_are_the_far_corners_and_the_rooms():
    home = home_of([[0, 0], [5, -1], [6, 3], [2, 2.5], [0, 4]], rooms=[(1, 1), (4, 1.5)], start=(1, 1))
    assert anchor_places(home) == ([(0, 0, 2.4), (5, -1, 2.4), (6, 3, 2.4), (0, 4, 2.4), (1, 1, 2.4), (4, 1.5, 2.4)], 4)


def test_many_rooms_give_32_anchors_spread_over_the_home():
    home = hall(13, 13, (6, 6), rooms=[(x + 0.5, y + 0.5) for x, y in FLOOR])
    places, _ = anchor_places(home)
    assert len(places) == len(set(places)) == 32
    for x, y in FLOOR:
        assert min(math.dist((x, y), p[:2]) for p in places) < 3


def test_reports_come_at_10_hz_and_hold_at_most_15():
    home = hall(13, 13, (6, 6), rooms=[(x + 0.5, y + 0.5) for x, y in FLOOR])
    uwb = Uwb(home, "paper", 1)
    values = array("i", bytes(4 * 112))
    counts = []
    for tick in range(20):
        uwb.read(values, 13, tick, 6, 6)
        counts.append(values[13])
    assert counts == [15, 0, 0, 0, 0] * 4


def test_none_is_silent():
    uwb, result = records(hall(4, 4, (1, 1)), "none", 1, 1, 5)
    assert result == [{}] * 5
    assert uwb.parameters() == {"uwb_source": [0], "anchor_count": [0]}


def test_out_of_range_and_behind_five_walls_is_silent():
    _, (heard,) = records(hall(30, 4, (1, 2)), "paper", 1, 2)
    assert set(heard) == {0, 3}, "the corners at 30 m are beyond 20 m"
    for walls, far_heard in ((4, True), (5, False)):
        _, (heard,) = records(comb(walls), "paper", 1, 2)
        assert (5 in heard) == far_heard, walls


@pytest.mark.parametrize("walls, sigma_cdb", [(0, 10), (2, 10), (3, 100), (4, 100)])
def test_the_papers_residual(walls, sigma_cdb):
    uwb, result = records(comb(walls), "paper", 1, 2, 600)
    path = -4700 - 1700 * math.log10(slant(uwb, 5, 1, 2))
    errors = [report[5][0] - path for report in result]
    assert statistics.mean(errors) == pytest.approx(0, abs=sigma_cdb / 6)
    assert statistics.stdev(errors) == pytest.approx(sigma_cdb, rel=0.15)
    assert {report[5][1] for report in result} == {0}, "a strength report holds no range"
    assert uwb.parameters()["uwb_source"] == [1]


@pytest.mark.parametrize("walls, sigma_mm", [(0, 100), (2, 100), (3, 300)])
def test_time_of_flight(walls, sigma_mm):
    uwb, result = records(comb(walls), "tof", 1, 2, 600)
    errors = [report[5][1] - 1000 * slant(uwb, 5, 1, 2) for report in result]
    assert statistics.mean(errors) == pytest.approx(0, abs=sigma_mm / 6)
    assert statistics.stdev(errors) == pytest.approx(sigma_mm, rel=0.15)
    assert uwb.parameters()["uwb_source"] == [2]


def biases(preset, field, home, x, y, truth):
    """Mean error at anchor 5 per seed: what averaging at one place leaves."""
    means = []
    for seed in range(40):
        uwb, result = records(home, preset, x, y, 40, seed)
        means.append(statistics.mean(report[5][field] for report in result) - truth(uwb))
    return means


def test_walls_make_tof_nlos_long_for_good():
    clear = biases("tof_nlos", 1, comb(0), 1, 2, lambda uwb: 1000 * slant(uwb, 5, 1, 2))
    behind = biases("tof_nlos", 1, comb(2), 1, 2, lambda uwb: 1000 * slant(uwb, 5, 1, 2))
    assert abs(statistics.mean(clear)) < 20 and statistics.stdev(clear) < 30
    assert min(behind) > 0
    assert statistics.mean(behind) == pytest.approx(500, rel=0.25)
    assert statistics.stdev(behind) > 120


def test_real_signal_strength_is_off_by_a_fixed_field():
    los = biases("rssi_real", 0, comb(0), 1, 2, lambda uwb: -4700 - 1700 * math.log10(slant(uwb, 5, 1, 2)))
    nlos = biases("rssi_real", 0, comb(2), 1, 2, lambda uwb: -5100 - 3500 * math.log10(slant(uwb, 5, 1, 2)))
    # At 16.2 m (12.1 decades of a dB): gamma's spread gives 0.3 * 12.1 = 3.6 dB, shadowing 1.6 dB
    assert 250 < statistics.stdev(los) < 600
    assert 700 < statistics.stdev(nlos) < 1800
    _, result = records(comb(0), "rssi_real", 1, 2, 200)
    assert statistics.stdev(report[5][0] for report in result) < 50, "averaging has little to average"


def test_the_field_is_smooth_over_a_metre_and_a_half():
    field = Field(generator(1, "a test"), 4000)
    here = field.at(3.0, 4.0)
    assert here.std() == pytest.approx(1, abs=0.05) and abs(here.mean()) < 0.06
    for step_m in (0.0, 0.2, 1.5, 3.0, 8.0):
        there = field.at(3.0 + step_m * 0.6, 4.0 + step_m * 0.8)
        assert (here * there).mean() == pytest.approx(math.exp(-(step_m / 1.5) ** 2 / 2), abs=0.06)
