# Running-sum total least squares of one wall, in the wall's own frame.

from ..fixed import polar, isqrt, sine, cosine

_SAMPLES_MAX = const(1000)
_EXTENT_MAX = const(1000)    # units of u; beyond it the unit doubles
_OFFSET_MAX = const(900)     # mm of v
_ALIGN_AT = const(16)        # samples (32 cm) after which the frame is turned onto the line


class LineFit:
    # Samples (x, y) in mm; u runs along the wall from the first sample in units of
    # 2**shift mm (4 mm at first, doubled each time the wall outgrows 1000 units, so that a wall
    # of 30 m keeps every sum below 2**30), v across it in mm.
    #   add(x, y) -> False when the line is full (1000 samples) or the sample lies out of its frame.
    #   solve(): slope, mean, direction; then residual(x, y), along(x, y).
    # first, last: its first sample, and the farthest along: a wall of which one comes back ends there.
    # Nothing is allocated after __init__.

    def __init__(self):
        self.n = 0
        self.first_x = 0
        self.first_y = 0
        self.last_x = 0
        self.last_y = 0
        self.point_x = 0      # a point on the fitted line, mm
        self.point_y = 0
        self.cos_q14 = 16384  # direction of the fitted line
        self.sin_q14 = 0
        self.sigma_mm = 0
        self._c = 16384
        self._s = 0
        self._shift = 2
        self._su = self._sv = self._suu = self._suv = self._svv = 0
        self._u = 0
        self._v = 0
        self._top = 0         # u of `last`

    def begin(self, x, y):
        self.n = 1
        self.first_x = self.last_x = self.point_x = x
        self.first_y = self.last_y = self.point_y = y
        self._shift = 2
        self._su = self._sv = self._suu = self._suv = self._svv = self._top = 0
        self.sigma_mm = 0

    def add(self, x, y):
        if self.n == 1:
            if not self._orient(x - self.first_x, y - self.first_y):
                return False
        self._rotate(x, y)
        if self.n >= _SAMPLES_MAX or self._v > _OFFSET_MAX or self._v < -_OFFSET_MAX:
            return False
        while self._u > _EXTENT_MAX or self._u < -_EXTENT_MAX:
            if self._shift == 7:
                return False
            self._shift += 1
            self._u >>= 1
            self._top >>= 1
            self._su >>= 1
            self._suv >>= 1
            self._suu >>= 2
        u = self._u
        v = self._v
        self._su += u
        self._sv += v
        self._suu += u * u
        self._suv += u * v
        self._svv += v * v
        self.n += 1
        if u >= self._top:
            self._top = u
            self.last_x = x
            self.last_y = y
        if self.n == _ALIGN_AT and self._suu < 60000 and self._svv < 60000:
            self._align()
        return True

    def _align(self):
        # Two samples 2 cm apart set the frame's direction, 1 mm of noise is 3 degrees there: over a
        # long wall v would leave the frame, and sigma drown in it. Turn frame and sums (Q10) onto the line.
        self.solve()
        unit = self._shift
        k = (self.cos_q14 * self._c + self.sin_q14 * self._s) >> 18
        s = (self.sin_q14 * self._c - self.cos_q14 * self._s) >> 18
        su = self._su
        suu = self._suu
        suv = self._suv
        svv = self._svv >> unit
        self._su = (k * su + (s * self._sv >> unit)) >> 10
        self._sv = (k * self._sv - (s * su << unit)) >> 10
        kk = k * k >> 10
        ks = k * s >> 10
        ss = s * s >> 10
        self._suu = (kk * suu + (2 * ks * suv >> unit) + (ss * svv >> unit)) >> 10
        self._suv = ((kk - ss) * suv - ks * ((suu << unit) - svv)) >> 10
        svv = (kk * svv - 2 * ks * suv + (ss * suu << unit)) >> 10
        self._svv = svv << unit if svv > 0 else 0
        self._c = self.cos_q14
        self._s = self.sin_q14

    def _orient(self, dx, dy):
        if dx > 9000 or dx < -9000 or dy > 9000 or dy < -9000:
            return False
        bearing = polar(dx, dy) & 0xFFFF
        self._c = self.cos_q14 = cosine(bearing) >> 1
        self._s = self.sin_q14 = sine(bearing) >> 1
        return True

    def _rotate(self, x, y):
        dx = x - self.first_x
        dy = y - self.first_y
        if dx > 32000 or dx < -32000 or dy > 32000 or dy < -32000:
            self._u = 0
            self._v = 32000
            return
        self._u = (dx * self._c + dy * self._s) >> (14 + self._shift)
        self._v = (dy * self._c - dx * self._s + 8192) >> 14

    def solve(self):
        # The first sample is the origin of the frame: it counts in n with u = v = 0.
        n = self.n
        if n < 2:
            return
        mean_u = self._su // n
        mean_v = self._sv // n
        suu = _centred(self._suu, self._su, self._su, mean_u, n)
        suv = _centred(self._suv, self._su, self._sv, mean_u, n)
        svv = _centred(self._svv, self._sv, self._sv, mean_v, n)
        top = suv
        bottom = suu
        while bottom > 16383:
            top >>= 1
            bottom >>= 1
        slope = 0  # mm of v a unit of u, Q12
        if bottom > 0:
            if top > bottom << 4:
                top = bottom << 4
            elif top < -(bottom << 4):
                top = -(bottom << 4)
            slope = (top << 12) // bottom
        # Direction: (2**shift, slope / 4096) turned back by the frame, normalised.
        du = 1 << (self._shift + 10)
        dv = slope >> 2
        while du > 8191 or dv > 8191 or dv < -8191:
            du >>= 1
            dv >>= 1
        length = isqrt(du * du + dv * dv)
        cu = (du << 14) // length
        sv = (dv << 14) // length
        self.cos_q14 = (cu * self._c - sv * self._s) >> 14
        self.sin_q14 = (cu * self._s + sv * self._c) >> 14
        along = mean_u << self._shift
        self.point_x = self.first_x + ((along * self._c - mean_v * self._s) >> 14)
        self.point_y = self.first_y + ((along * self._s + mean_v * self._c) >> 14)
        # sigma^2 is the small eigenvalue over n (Paper eq. 6), here the rest across the line.
        suv //= n
        bits = 12
        while suv > 16383 or suv < -16383:
            suv >>= 1
            bits -= 1
        while slope > 32767 or slope < -32767:
            slope >>= 1
            bits -= 1
        suv *= slope
        rest = svv // n - (suv >> bits if bits >= 0 else suv << -bits)
        self.sigma_mm = isqrt(rest) if rest > 0 else 0

    def residual(self, x, y):
        # Signed distance of (x, y) from the fitted line, left positive, mm, within +-32000.
        dx = x - self.point_x
        dy = y - self.point_y
        if dx > 32000 or dx < -32000 or dy > 32000 or dy < -32000:
            return 32000
        return (dy * self.cos_q14 - dx * self.sin_q14) >> 14

    def along(self, x, y):
        # Distance of (x, y) along the fitted line from its point, mm.
        dx = x - self.point_x
        dy = y - self.point_y
        if dx > 32000 or dx < -32000 or dy > 32000 or dy < -32000:
            return 32000
        return (dx * self.cos_q14 + dy * self.sin_q14) >> 14


def _centred(sum_ab, sum_a, sum_b, mean_a, n):
    # sum(ab) - sum(a) sum(b) / n without the product sum(a) sum(b).
    return sum_ab - mean_a * sum_b - (sum_a - mean_a * n) * sum_b // n
