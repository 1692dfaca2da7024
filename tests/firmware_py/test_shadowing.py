# A gamma for each transmitter, in sight and behind walls: learnt from strengths, and what they then tell of the place.

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

module = watched("firmware_py.collection.shadowing")
BEHIND = 32  # gammas behind walls come after those in sight


def made(learn=True, sigma_cdb=160):
    shadowing = module.Shadowing()
    shadowing.begin(1700, sigma_cdb, learn)
    return shadowing


def loss_cdb(metres, gamma, wall_db=0.0, shadow_db=0.0):
    return round(100 * (wall_db + shadow_db + 10 * gamma * math.log10(metres)))


@given(st.integers(1, 2**29))
def test_the_logarithm(n):
    assert abs(module.log2_q12(n) / 4096 - math.log2(n)) < 0.01


@given(st.integers(3500, 12000), st.integers(-700, 700))
def test_a_strength_tells_how_much_nearer_the_transmitter_is(expected_mm, nearer_mm):
    shadowing = made()
    assert shadowing.look(3, loss_cdb((expected_mm - nearer_mm) / 1000, 1.7), expected_mm, 300)
    # linearised at the expected distance, as the filter is
    told = expected_mm * math.log(expected_mm / (expected_mm - nearer_mm))
    assert abs(shadowing.z_mm - told) < 0.02 * abs(told) + 0.015 * expected_mm


@pytest.mark.parametrize("gamma, wall_db, at", [(1.35, 0, 0), (2.1, 0, 0), (4.4, 4, BEHIND), (3.0, 4, BEHIND)])
def test_a_transmitters_own_gamma_is_learnt_and_no_other(gamma, wall_db, at):
    shadowing, draw = made(), random.Random(7)
    for _ in range(60):
        metres = draw.uniform(2.5, 12)
        shadowing.look(5, loss_cdb(metres, gamma, wall_db, draw.gauss(0, 1)), round(1000 * metres), 200)
    assert abs(shadowing.gammas[5 + at] - 1000 * gamma) < 130
    assert shadowing.spreads[5 + at] < 150
    assert (shadowing.gammas[6], shadowing.gammas[6 + BEHIND], shadowing.gammas[5 + BEHIND - at]) == (1700, 3500, 3500 if not at else 1700)


def test_what_is_learnt_makes_a_range_more_certain():
    shadowing = made()
    assert shadowing.look(1, loss_cdb(6, 2.0), 6000, 100)
    first = (shadowing.z_mm, shadowing.sigma_mm)
    for _ in range(80):
        shadowing.look(1, loss_cdb(6, 2.0), 6000, 100)
    assert abs(shadowing.z_mm) < 0.4 * abs(first[0]) and shadowing.sigma_mm < 0.85 * first[1]


def test_who_may_not_learn_does_not():
    shadowing = made(learn=False)
    for _ in range(20):
        assert shadowing.look(1, loss_cdb(6, 2.0), 6000, 100)
    assert set(shadowing.gammas) == {1700, 3500} and set(shadowing.spreads) == {300, 970}


def test_what_neither_air_nor_walls_explain_tells_nothing():
    shadowing = made()
    assert not shadowing.look(0, loss_cdb(6, 1.7) - 3500, 6000, 100)   # 35 dB stronger than it can be
    assert not shadowing.look(0, loss_cdb(6, 1.7), 100, 100)           # right under it
    assert shadowing.gammas[0] == 1700


ANY = st.tuples(st.integers(0, 31), st.integers(-20000, 45000), st.integers(0, 60000), st.integers(0, 8192))


@given(st.lists(ANY, max_size=60), st.integers(0, 2000), st.integers(1000, 6000), st.booleans())
def test_no_strength_makes_a_number_too_big(work, sigma_cdb, gamma, learn):
    shadowing = module.Shadowing()
    shadowing.begin(gamma, sigma_cdb, learn)
    for anchor, loss, expected_mm, unsure_mm in work:
        if shadowing.look(anchor, loss, expected_mm, unsure_mm):
            assert shadowing.sigma_mm >= 0
        assert all(1000 <= g <= 8000 for g in shadowing.gammas) and all(0 <= s <= 970 for s in shadowing.spreads)
