# A core on a string: it is told what it senses, and its wheels turn as it asks, or not at all.
# No assertion lives here.

import math
from array import array

from firmware_py.collection.infrared_curve import RANGE_MM8
from firmware_py.pipeline import Tvslam
from protocol.parameters import PARAMETERS
from protocol.schema import VALUES_MAX

NUMBERS = {parameter[0]: number for number, parameter in enumerate(PARAMETERS)}
BEARINGS = (0, 60, -18, -40, -65, -90, -120, -180)
NOTHING = 999
MM_A_PULSE = math.pi * 72 / 508


def bam(degrees):
    return round(degrees * 65536 / 360)


def count_of(range_mm):
    """The reading of an infrared sensor at that distance, by the core's own table."""
    if range_mm >= 400:
        return 0
    ranges = [RANGE_MM8[i] | RANGE_MM8[i + 1] << 8 for i in range(0, len(RANGE_MM8), 2)]
    best = min(range(1023), key=lambda c: abs((ranges[c >> 3] * (8 - (c & 7)) + ranges[(c >> 3) + 1] * (c & 7)) / 64 - range_mm))
    return best


_COUNTS = [count_of(mm) for mm in range(400)]


def told(kind=Tvslam, **parameters):
    """A core that has its parameters, as begun: name=value, or name=[values]."""
    core = kind()
    for name, values in {"ir_bearing": [bam(b) for b in BEARINGS], **parameters}.items():
        for index, value in enumerate(values if isinstance(values, list) else [values]):
            assert core.set_parameter(NUMBERS[name], index, value) == 0, (name, value)
    core.begin()
    return core


class Puppet:
    """ranges: {beam 1..8: mm}, or a function of (x_mm, y_mm, heading in rad) that gives them."""

    def __init__(self, core=None, **parameters):
        self.core = core or told(**parameters)
        self._values = array("i", bytes(4 * VALUES_MAX))
        self._left = self._right = 0.0
        self.states = [self.core.state]

    def step(self, ranges=None, bump=0, blocked=False, uwb=()):
        core, values = self.core, self._values
        values[0] += 1
        left, right = (0, 0) if blocked else (core.left_mm_s, core.right_mm_s)
        self._left += left * 0.02 / MM_A_PULSE
        self._right += right * 0.02 / MM_A_PULSE
        values[1], values[2] = int(self._left), int(self._right)
        self._left -= values[1]
        self._right -= values[2]
        if callable(ranges):
            o = core.odometry
            ranges = ranges(o.x_um / 1000, o.y_um / 1000, o.heading_bam / 65536 * math.tau)
        for j in range(8):
            mm = (ranges or {}).get(j + 1, NOTHING)
            values[3 + j] = _COUNTS[int(mm)] if 0 <= mm < 400 else 0
        values[11], values[12] = 0, bump
        values[13] = len(uwb)
        for k, record in enumerate(uwb):
            values[14 + 3 * k:17 + 3 * k] = array("i", record)
        core.step(values)
        if core.state != self.states[-1]:
            self.states.append(core.state)
        return core

    def run(self, ticks, until=None, **what):
        """-> the ticks made when `until(core)` held, or None."""
        for tick in range(ticks):
            self.step(**what)
            if until is not None and until(self.core):
                return tick + 1
        return None


def wall_ahead(x_mm, until_y_mm=1e9):
    """What the eight beams see of a wall across the way at x, from the left up to y."""

    def ranges(x, y, heading):
        seen = {}
        for j, degrees in enumerate(BEARINGS):
            b = heading + math.radians(degrees)
            if math.cos(b) > 0.01:
                d = (x_mm - x) / math.cos(b)
                if d > 120 and -until_y_mm <= y + d * math.sin(b) <= until_y_mm:
                    seen[j + 1] = d - 120
        return seen

    return ranges
