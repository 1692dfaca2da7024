# The host's picture of the core's clock, against clocks whose offset, rate and ways are known.

import random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sim_device.core_clock import JUMP_PAIRS, WRAP_MS, CoreClock

PING_S = 0.1
SEEDS = st.integers(0, 1 << 30)


# A core's clock and the link to it: ping(at_s) gives what CoreClock.add takes.
class Far:
    def __init__(self, seed, offset_ms=0.0, drift=0.0, jitter_s=0.0, way_s=0.0002):
        self.random = random.Random(seed)
        self.offset_ms, self.drift, self.jitter_s, self.way_s = offset_ms, drift, jitter_s, way_s

    def ms(self, host_s):
        return self.offset_ms + host_s * 1000 * (1 + self.drift)

    def ping(self, at_s):
        there, back = (self.way_s + self.random.expovariate(1) ** 2 * self.jitter_s for _ in range(2))
        return at_s, at_s + there + back, int(self.ms(at_s + there)) % WRAP_MS


def follow(far, clock, count, start_s=0.0):
    """So many pairs, one each 100 ms and a little; the moment of the last."""
    at_s = start_s
    for _ in range(count):
        at_s += PING_S + far.random.random() * 0.001
        clock.add(*far.ping(at_s))
    return at_s


def error_ms(far, clock, host_s):
    """How far the clock is off, but for whole wraps."""
    return abs((clock.core_ms(host_s) - far.ms(host_s) + WRAP_MS / 2) % WRAP_MS - WRAP_MS / 2)


@given(SEEDS, st.floats(0, WRAP_MS), st.floats(-0.01, 0.01), st.floats(0, 0.0003), st.integers(20, 150))
@example(20, 0.0, 0.009765625, 1e-12, 20)
def test_offset_and_drift_are_found_through_jitter(seed, offset_ms, drift, jitter_s, count):
    far, clock = Far(seed, offset_ms, drift, jitter_s), CoreClock()
    at_s = follow(far, clock, count)
    for ahead_s in (0.0, 0.02, 0.1):
        assert error_ms(far, clock, at_s + ahead_s) < 1.5
        assert clock.host_s(clock.core_ms(at_s + ahead_s)) == pytest.approx(at_s + ahead_s, abs=1e-6)
    assert clock.jumps == 0 and clock.residual_ms < 1
    if count >= 60:
        assert clock.drift_ppm == pytest.approx(drift * 1e6, abs=300)


@given(SEEDS, st.floats(-0.01, 0.01), st.floats(20, 5000) | st.floats(-5000, -20), st.integers(20, 120))
def test_a_jump_is_followed_after_three_pairs(seed, drift, jump_ms, count):
    far, clock = Far(seed, 1e6, drift), CoreClock()
    at_s = follow(far, clock, count)
    far.offset_ms += jump_ms
    at_s = follow(far, clock, JUMP_PAIRS, at_s)
    assert clock.jumps == 1 and error_ms(far, clock, at_s) < 3
    at_s = follow(far, clock, 20, at_s)
    assert clock.jumps == 1 and error_ms(far, clock, at_s + 0.02) < 1.5


@given(SEEDS, st.floats(20, 1e6))
def test_a_stray_pair_changes_nothing(seed, stray_ms):
    far, clock = Far(seed, 1000), CoreClock()
    at_s = follow(far, clock, 40)
    before = clock.core_ms(at_s)
    sent_s, received_s, core_ms = far.ping(at_s + PING_S)
    clock.add(sent_s, received_s, int(core_ms + stray_ms) % WRAP_MS)
    assert clock.core_ms(at_s) == before and clock.jumps == 0
    follow(far, clock, 10, at_s + PING_S)
    assert clock.jumps == 0


def test_a_drift_that_changes_is_followed_and_nothing_adds_up():
    far, clock = Far(5, 1000.0, 0.0), CoreClock()
    at_s = 0.0
    for part in range(40):  # from 0 to 0.4 % and on, as a warming oscillator would not
        drift = 0.0001 * part
        far.offset_ms += at_s * 1000 * (far.drift - drift)
        far.drift = drift
        at_s = follow(far, clock, 50, at_s)
        assert error_ms(far, clock, at_s + 0.02) < 1.5
    assert clock.jumps == 0


def test_the_slow_half_of_the_pairs_is_not_looked_at():
    far, clock = Far(1, 5000.0), CoreClock()
    at_s = 0.0
    for number in range(60):
        at_s += PING_S + 0.00037
        sent_s, received_s, core_ms = far.ping(at_s)
        clock.add(sent_s, received_s + (0.030 if number % 3 == 0 else 0), core_ms)  # its answer was held up
    assert error_ms(far, clock, at_s) < 0.7
