# Fixed-point geometry against the floats of the host, with every number watched.

import math
from array import array

from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

fixed = watched("firmware_py.fixed")

BAM = math.tau / 65536
COORDINATES = st.integers(-11500, 11500)  # the distance stays below 16384


def test_sine_of_every_angle():
    worst = max(abs(fixed.sine(b) - 32768 * math.sin(b * BAM)) for b in range(65536))
    assert worst <= 3


@given(st.integers(-(2**29), 2**29))
def test_angles_repeat_after_a_turn(bam):
    assert fixed.sine(bam) == fixed.sine(bam & 0xFFFF)
    assert fixed.cosine(bam) == fixed.sine((bam + 16384) & 0xFFFF)
    assert -32768 <= fixed.wrap(bam) <= 32767 and (fixed.wrap(bam) - bam) % 65536 == 0


@given(st.integers(-(2**30) + 1, 2**30 - 1) | st.integers(-32770, -32766) | st.integers(32765, 32769))
def test_int16_is_the_nearest_that_an_array_holds(value):
    held = array("h", [fixed.int16(value)])[0]
    assert held == sorted((-32768, value, 32767))[1]


@given(COORDINATES, COORDINATES)
def test_polar(dx, dy):
    packed = fixed.polar(dx, dy)
    distance, bearing = packed >> 16, packed & 0xFFFF
    assert abs(distance - math.hypot(dx, dy)) <= 1 + math.hypot(dx, dy) * 0.002
    if dx or dy:
        apart = (bearing - math.atan2(dy, dx) / BAM + 32768) % 65536 - 32768
        assert abs(apart) <= 0.12 / 360 * 65536


@given(st.integers(0, 2**30 - 1))
def test_isqrt(n):
    assert fixed.isqrt(n) == math.isqrt(n)


@given(st.integers(1, 2**27), st.integers(1, 2**27), st.integers(1, 4096), st.integers(0, 12))
def test_ratio_is_the_floor(numerator, denominator, divisor, bits):
    exact = (numerator << bits) // (denominator * divisor)
    if exact < 2**29:
        assert fixed.ratio(numerator, denominator, divisor, bits) == exact
