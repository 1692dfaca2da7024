# UWB reports to the deviation of the position (Paper eq. 3), integers only.

from array import array
from ..fixed import isqrt, power2
from ..limits import ANCHORS_MAX

SOURCE_NONE = 0
SOURCE_STRENGTH = 1
SOURCE_TIME_OF_FLIGHT = 2

_AGE_SHIFT = const(5)          # each report fades the older ones by 1/32: about three seconds of them count
_AXIS_MAX_MM = const(20000)    # no transmitter is heard farther off
_GATE_MM = const(120)          # a range farther off than this and four deviations is an outlier
_RESIDUAL_MAX_MM = const(900)
_TOF_SIGMA_MM = const(100)
_DEVIATION_MAX_MM = const(800) # a range less accurate than that has no weight
_SOLUTION_MAX_MM = const(4000) # farther off, the geometry is too poor
_SEEN_SHIFT = const(3)         # over the last eight reports or so
_SEEN_MAX_MM = const(2000)
_PRIOR = const(3000)           # 29 mm: what dead reckoning is trusted for where the ranges say little
_UNIT = const(2560000)         # square millimetres times information


class Uwb:
    # Weighted least squares of the deviation (dx, dy) of the true from the estimated position, over the
    # ranges of the last reports (Paper eq. 3 averages n samples of one transmitter; here all count,
    # each by its own accuracy, linearised at the estimate; transmitter heights are known).
    #   add(values, first, x_mm, y_mm): the records of a STEP, seen from the estimate
    #   solve(): dx_mm, dy_mm, reports -> False when the geometry or the reports are too few
    #   clear(): after the estimate was replaced
    # variance_mm2: of one axis of the solution. A and its right-hand side hold information: 1 is worth
    # a deviation of 1600 mm (1 / 2.56e6 a square millimetre). Allocates in __init__ only.

    def __init__(self):
        self.dx_mm = 0
        self.dy_mm = 0
        self.variance_mm2 = 0
        self.reports = 0
        self.outliers = 0
        self._prior = 0
        self._source = 0
        self._anchors = 0
        self._table = None
        self._first_x = 0
        self._first_y = 0
        self._first_z = 0
        self._level_1m = 0
        self._level_min = 0
        self._gamma = 1700
        self._spread_q12 = 0   # relative deviation of a range
        self._alpha_q12 = 4096
        self._seen_mm = array("h", bytes(2 * ANCHORS_MAX))
        self._sums = array("i", bytes(20))  # a11, a12, a22, b1, b2

    def begin(self, parameters, weighted):
        self._prior = _PRIOR if weighted else 0
        self._source = parameters.of("uwb_source")
        self._anchors = parameters.of("anchor_count")
        self._table = parameters.values
        self._first_x = parameters.first("anchor_x")
        self._first_y = parameters.first("anchor_y")
        self._first_z = parameters.first("anchor_height")
        self._level_1m = parameters.of("uwb_level_1m")
        self._level_min = parameters.of("uwb_level_min")
        gamma = parameters.of("uwb_gamma")
        sigma = parameters.of("uwb_sigma")
        self._gamma = gamma
        # s = ln 10 sigma / (10 gamma); alpha = exp(-s^2 / 2), to the second order
        s = sigma * 9431 // gamma           # Q12: ln(10) / 10 * 4096 * 10
        self._spread_q12 = s if s > 20 else 20
        self._alpha_q12 = 4096 - (s * s >> 13) if s < 2048 else 3584

    def clear(self):
        for i in range(5):
            self._sums[i] = 0
        self.reports = 0

    def shift(self, dx_mm, dy_mm):
        # The estimate has moved by (dx, dy): the reports that count now deviate by so much less.
        s = self._sums
        if (s[0] + s[2] >> 10) * (abs(dx_mm) + abs(dy_mm)) > 1 << 19:
            self.clear()  # so far that they were linearised elsewhere, and that a product would pass 2**30
            return
        s[3] -= s[0] * dx_mm + s[1] * dy_mm
        s[4] -= s[1] * dx_mm + s[2] * dy_mm
        if abs(s[3]) > 1 << 29 or abs(s[4]) > 1 << 29:
            self.clear()

    def add(self, values, first, x_mm, y_mm):
        n = values[first]
        if n <= 0 or self._source == SOURCE_NONE:
            return
        sums = self._sums
        for i in range(5):
            sums[i] -= sums[i] >> _AGE_SHIFT
        used = 0
        first += 1
        while n > 0:
            n -= 1
            if self._range(values, first, x_mm, y_mm):
                used += 1
            first += 3
        if used and self.reports < 1000:
            self.reports += 1

    def _range(self, values, first, x_mm, y_mm):
        anchor = values[first]
        if anchor < 0 or anchor >= self._anchors or values[first + 1] < self._level_min:
            return False
        dx = self._table[self._first_x + anchor] - x_mm
        dy = self._table[self._first_y + anchor] - y_mm
        dz = self._table[self._first_z + anchor]
        if not (-_AXIS_MAX_MM < dx < _AXIS_MAX_MM and -_AXIS_MAX_MM < dy < _AXIS_MAX_MM):
            return False
        expected = isqrt(dx * dx + dy * dy + dz * dz)
        if expected < 100:
            return False
        if self._source == SOURCE_STRENGTH:
            # Paper eq. 3: d = alpha 10^((PL_1 - P) / (10 gamma)) = alpha 2^(log2(10) / 10 ...)
            d = self._level_1m - values[first + 1]
            if d > 20000 or d < -20000:
                return False
            d = power2(d * 13607 // self._gamma)
            if d > 40000:
                return False
            d = d * self._alpha_q12 >> 12
            deviation = d * self._spread_q12 >> 12
        else:
            d = values[first + 2]
            if d <= 0 or d > 40000:
                return False
            deviation = _TOF_SIGMA_MM
        e = expected - d
        gate = _GATE_MM + 4 * deviation
        if gate > _RESIDUAL_MAX_MM:
            gate = _RESIDUAL_MAX_MM
        if self._prior:
            deviation = self._seen(anchor, e if e >= 0 else -e, deviation)
        if e > gate or e < -gate:
            self.outliers = (self.outliers + 1) & 0xFFFF
            return False
        if deviation > _DEVIATION_MAX_MM:
            return False
        # A move by u (towards the transmitter) shortens the range by 1: e = u . (dx, dy)
        w = 640000 // (deviation * deviation) if deviation > 25 else 1024  # 64 at 100 mm
        ux = (dx * 64) // expected
        uy = (dy * 64) // expected
        sums = self._sums
        sums[0] += w * ux * ux >> 10
        sums[1] += w * ux * uy >> 10
        sums[2] += w * uy * uy >> 10
        sums[3] += w * ux * e >> 4
        sums[4] += w * uy * e >> 4
        return True

    def _seen(self, anchor, size, deviation):
        # What this transmitter's ranges deviate by lately, if that is more than the model says: behind
        # walls it is many times as much.
        seen = self._seen_mm[anchor]
        seen += (size if size < _SEEN_MAX_MM else _SEEN_MAX_MM) - seen >> _SEEN_SHIFT
        self._seen_mm[anchor] = seen
        seen = seen * 5 >> 2  # from a mean to a deviation
        return seen if seen > deviation else deviation

    def solve(self):
        prior = self._prior
        a = self._sums[0] + prior
        b = self._sums[1]
        c = self._sums[2] + prior
        p = self._sums[3]
        q = self._sums[4]
        # The same by halves until every product stays below 2**30; unit is what one of A is worth then.
        unit = _UNIT
        while a > 8191 or c > 8191:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
            unit >>= 1
        det = a * c - b * b
        mean = a + c >> 1
        if self.reports < 6 or det < 4096 or (prior == 0 and det < mean * mean >> 5):
            return False  # too few, or all in one direction, within 10 degrees
        self.variance_mm2 = (a + c) * (unit // 2 + 1 >> 6) // (det >> 6)
        while p > 16383 or p < -16384 or q > 16383 or q < -16384:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
        det = a * c - b * b
        if det < 64:
            return False
        self.dx_mm = (c * p - b * q) // det
        self.dy_mm = (a * q - b * p) // det
        return abs(self.dx_mm) < _SOLUTION_MAX_MM and abs(self.dy_mm) < _SOLUTION_MAX_MM
