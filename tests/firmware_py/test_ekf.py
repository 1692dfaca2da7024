# The integer Kalman filter against the same filter in floats, and against any input at all.

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

ekf_module = watched("firmware_py.collection.ekf")
X, Y, HEADING, DRIFT, TRACK, AXIS = range(6)
NEVER = 0


# The same in floats. `x` is the correction of each state so far.
class Floats:
    def __init__(self, ekf):
        self.p = matrix(ekf)
        self.x = np.zeros(6)

    def move(self, dx_mm, dy_mm, way_mm, turn_bam):
        p = self.p
        for i, j, c in ((X, HEADING, -dy_mm * 2 * math.tau / 65536), (Y, HEADING, dx_mm * 2 * math.tau / 65536),
                        (HEADING, DRIFT, way_mm / 4000), (HEADING, TRACK, turn_bam / 65536)):  # fmt: skip
            f = np.eye(6)
            f[i, j] = c
            p = f @ p @ f.T
        way_mm = abs(way_mm) + abs(turn_bam) / 89
        self.p = p + np.diag([1 + way_mm // 70, 1 + way_mm // 70, 25 * way_mm, 0, 0, 0])

    def correct(self, i, j, rho, z, noise):
        h = np.zeros(6)
        h[i] = 1
        h[j] += rho
        gain = self.p @ h
        s = h @ gain + noise
        self.x += gain * max(-3 * math.sqrt(s), min(z, 3 * math.sqrt(s))) / s
        self.p = self.p - np.outer(gain, gain) / s


def matrix(ekf):
    return np.array(list(ekf.p), float).reshape(6, 6)


def made(calibrate=1):
    ekf = ekf_module.Ekf()
    ekf.begin(calibrate)
    return ekf


STEPS = st.lists(st.tuples(st.integers(-200, 200), st.integers(-200, 200), st.integers(0, 300), st.integers(-6000, 6000),
                           st.integers(-40, 40), st.integers(100, 40000), st.integers(-4096, 4096)), min_size=1, max_size=25)  # fmt: skip


@given(STEPS)
def test_it_is_the_filter_in_floats(steps):
    ekf = made()
    ekf.tie(AXIS, HEADING, 24000)
    floats = Floats(ekf)
    for dx, dy, way, turn, z, noise, rho in steps:
        ekf.move(dx, dy, way, turn)
        floats.move(dx, dy, way, turn)
        assert ekf.correct(X, Y, rho, z << 4, noise, NEVER)
        floats.correct(X, Y, rho / 4096, z, noise)
        if ekf.correct(HEADING, AXIS, -4096, z << 4, 12000, NEVER):
            floats.correct(HEADING, AXIS, -1, z, 12000)
    spread = np.sqrt(np.maximum(floats.p.diagonal(), 1))
    assert np.all(np.abs(matrix(ekf) - floats.p) <= 0.06 * np.outer(spread, spread) + 60)
    assert np.all(np.abs(np.array(list(ekf.rest)) / 1024 - floats.x) <= 0.1 * np.abs(floats.x) + 0.1 * spread + 3)


ANY = st.tuples(st.integers(-1000, 1000), st.integers(-1000, 1000), st.integers(0, 1000), st.integers(-32768, 32767),
                st.sampled_from((X, Y, HEADING)), st.integers(-4096, 4096), st.integers(-(1 << 25), 1 << 25),
                st.integers(0, 1 << 29), st.sampled_from((NEVER, 40)), st.booleans())  # fmt: skip


@given(st.lists(ANY, max_size=60), st.booleans())
def test_no_way_and_no_measurement_make_a_number_too_big(work, calibrate):
    ekf = made(calibrate)
    for dx, dy, way, turn, i, rho, z, noise, most, tied in work:
        for _ in range(3):
            ekf.move(dx, dy, way, turn)
        if tied:
            ekf.tie(AXIS, HEADING, 24000)
        if not ekf.correct(i, (Y, X, AXIS)[i], rho, z, noise, most) and way & 1:
            ekf.doubt()
        assert 0 <= ekf.unsure(Y, X, rho) <= 16384
        p = matrix(ekf)
        assert np.all(p == p.T) and np.all(p.diagonal() >= 0) and p.max() < 2**25
        for state in range(6):
            ekf.taken(state, 10)


@given(STEPS, st.integers(-4096, 4096))
def test_how_unsure_it_is_along_any_direction(steps, rho):
    ekf = made()
    for dx, dy, way, turn, z, noise, at in steps:
        ekf.move(dx, dy, way, turn)
        ekf.correct(X, Y, at, z << 4, noise, NEVER)
    p = matrix(ekf)
    truth = math.sqrt(max(p[X, X] + 2 * p[X, Y] * rho / 4096 + p[Y, Y] * (rho / 4096) ** 2, 0))
    assert abs(ekf.unsure(X, Y, rho) - truth) <= 0.1 * truth + 26


def test_who_doubts_is_less_certain_of_place_and_heading_and_of_nothing_else():
    ekf = made()
    before = matrix(ekf)
    ekf.doubt()
    change = matrix(ekf) - before
    assert np.all(change.diagonal()[:3] > 0) and np.count_nonzero(change) == 3


def test_what_is_far_beyond_belief_counts_for_three_deviations_or_for_nothing():
    ekf = made()
    assert not ekf.correct(X, Y, 0, 1 << 20, 100, 40) and ekf.taken(X, 10) == 0
    assert ekf.correct(X, Y, 0, 1 << 20, 100, NEVER)
    assert ekf.taken(X, 10) == round(64 / math.sqrt(164) * 3)


def test_what_is_taken_leaves_less_than_a_unit():
    ekf = made()
    ekf.correct(X, Y, 0, 150, 64, NEVER)
    whole, rest = ekf.taken(X, 11), ekf.rest[X]
    assert whole > 0 and abs(rest) <= 1024 and ekf.taken(X, 11) == 0


@pytest.mark.parametrize("calibrate", [0, 1])
def test_wheels_and_track_are_learnt_from_headings(calibrate):
    # Dead reckoning drifts by 100 BAM a metre and turns 1 % too little; the walls tell the heading each half metre.
    ekf = made(calibrate)
    p = ekf.p
    heading = drift = track = 0.0
    for k in range(120):
        turn = 16384 if k % 10 == 9 else 0
        heading += 0.5 * (100 - drift) + turn * (0.01 - track)
        ekf.move(500, 0, 500, turn)
        assert ekf.correct(HEADING, AXIS, -4096, round(heading * 16), 12000, NEVER)
        heading -= ekf.taken(HEADING, 10)
        drift += ekf.taken(DRIFT, 10) / 4
        track += ekf.taken(TRACK, 10) / 65536
    if calibrate:
        assert abs(drift - 100) < 8 and abs(track - 0.01) < 0.002 and abs(heading) < 40
        assert p[21] < 290000 // 20 and p[28] < 520000 // 4
    else:
        assert drift == track == 0 and p[21] == p[28] == 0


def test_an_axis_begins_as_uncertain_as_the_heading_it_was_seen_with():
    ekf = made()
    ekf.move(1000, 0, 1000, 0)
    ekf.tie(AXIS, HEADING, 24000)
    p = matrix(ekf)
    assert np.all(p[AXIS, :5] == p[HEADING, :5]) and p[AXIS, AXIS] == p[HEADING, HEADING] + 24000
    heading = p[HEADING, HEADING]
    ekf.correct(HEADING, AXIS, -4096, 0, 100, NEVER)
    assert matrix(ekf)[HEADING, HEADING] > 0.95 * heading  # the axis alone says nothing of the heading
