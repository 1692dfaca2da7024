# The tables of fixed.py, made again from what their comments say.

import math

from firmware_py.tables import ATAN_BAM, HYPOT_Q16, SINE_Q15


def entries(table):
    return [low | high << 8 for low, high in zip(table[0::2], table[1::2])]


def test_sine():
    assert entries(SINE_Q15) == [min(32767, round(32768 * math.sin(i * math.pi / 256))) for i in range(129)]


def test_arc_tangent():
    assert entries(ATAN_BAM) == [round(math.atan(i / 256) * 65536 / (2 * math.pi)) for i in range(257)]


def test_hypotenuse():
    assert entries(HYPOT_Q16) == [round((math.hypot(1, i / 256) - 1) * 65536) for i in range(257)]
