# The closure error of a lap: measured on the wall walked twice, spread along the outline.

from array import array
from ..fixed import int16, polar, isqrt, sine, cosine, wrap
from ..storage.vector_store import CHAIN_END

_FIRST = const(16)           # vectors at the outline's start that the overlap is compared with
_NEAR_MM = const(200)
_FAR_MM = const(400)         # the same where dead reckoning was alone, or nearly so
_OUT_MM = const(50)          # what polar() may be out in 11 m
_SAME = const(3640)          # a wall is followed along it, within 20 degrees
_SAMPLES_MAX = const(1000)
_UNLIKE_MM = const(70)       # the two passes were of different walls
_PRIOR = const(3)            # weight of "no error" in directions that no wall was seen across
_SLICE = const(24)           # vertices a tick, so that a tick stays short
_SMALL_MM = const(8)         # not worth moving a map for


class Closure:
    # After the lap the robot goes on along the wall that the outline began with:
    #   begin(first, drifted); add(x, y, heading_bam) each sample of the second pass, mm in the map frame; crossed(): walls in more
    #   than one direction were walked twice (one wall alone tells nothing of the error along it)
    #   solve(last): before_mm, after_mm; then step() until True spreads the error over the vertices
    #   first..last-1 of the store, in proportion to the length walked (by axis, both the same share).
    # before_mm: length of the error; after_mm: what is left of it, root mean square over the samples.
    # Sums: A and b of the normal equations, unit normals in Q5. Allocates in __init__ only.

    def __init__(self, store):
        self.before_mm = 0
        self.after_mm = 0
        self.samples = 0
        self.x_mm = 0          # the error: what the end of the lap is moved by
        self.y_mm = 0
        self.near_mm = _NEAR_MM
        self._store = store
        self._sums = array("i", bytes(24))  # a11, a12, a22, b1, b2, sum r^2
        self._first = 0
        self._last = 0
        self._at = 0
        self._length = 0
        self._total = 0

    def begin(self, first, drifted=False):
        self.near_mm = _FAR_MM if drifted else _NEAR_MM
        for i in range(6):
            self._sums[i] = 0
        self.samples = 0
        self._first = first

    def add(self, x, y, heading_bam):
        # The nearest of the outline's first vectors that has (x, y) beside it.
        s = self._store
        xs = s.xs
        ys = s.ys
        near = self.near_mm
        best = near
        box = near + _OUT_MM
        nx = ny = 0
        i = self._first
        end = i + _FIRST if i + _FIRST < s.used else s.used - 1
        while i < end:
            dx = x - xs[i] * 5
            dy = y - ys[i] * 5
            bx = _near((xs[i + 1] - xs[i]) * 5)
            by = _near((ys[i + 1] - ys[i]) * 5)
            i += 1
            # Far from the vector's box: that spares most of them the rest.
            if dx < -box and dx < bx - box or dx > box and dx > bx + box:
                continue
            if dy < -box and dy < by - box or dy > box and dy > by + box:
                continue
            if s.flags[i - 1] & CHAIN_END or not (-9000 < dx < 9000 and -9000 < dy < 9000):
                continue
            p = polar(bx, by)
            length = p >> 16
            if length > 50 and -_SAME < wrap(p - heading_bam) < _SAME:
                c = cosine(p & 0xFFFF) >> 3
                d = sine(p & 0xFFFF) >> 3
                along = (dx * c + dy * d) >> 12
                across = (dy * c - dx * d) >> 12
                size = across if across >= 0 else -across
                if 0 <= along <= length and size < (best if best >= 0 else -best):
                    best = across
                    nx = -d >> 7
                    ny = c >> 7
        if best == near or self.samples >= _SAMPLES_MAX:
            return
        # The first pass lies -best from here along the normal: error = b of n . e = -r
        sums = self._sums
        sums[0] += nx * nx
        sums[1] += nx * ny
        sums[2] += ny * ny
        sums[3] -= nx * best * 32
        sums[4] -= ny * best * 32
        sums[5] += best * best
        self.samples += 1

    def crossed(self):
        a = self._sums[0] >> 6
        b = self._sums[1] >> 6
        c = self._sums[2] >> 6
        return a > 640 and c > 640 and a * c > 2 * b * b

    def solve(self, last):
        self._last = last
        self._at = self._first
        self._length = 0
        self._total = 0
        self.x_mm = self.y_mm = 0
        if self.samples < 5:
            return
        sums = self._sums
        a = sums[0] + _PRIOR * 1024
        b = sums[1]
        c = sums[2] + _PRIOR * 1024
        p = sums[3]
        q = sums[4]
        while a > 8191 or c > 8191:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
        shift = 0
        while p > 30000 or p < -30000 or q > 30000 or q < -30000:
            p >>= 1
            q >>= 1
            shift += 1
        det = a * c - b * b >> shift
        if det < 16:
            return
        self.x_mm = (c * p - b * q) // det
        self.y_mm = (a * q - b * p) // det
        self.before_mm = isqrt(self.x_mm * self.x_mm + self.y_mm * self.y_mm)
        rest = sums[5] // self.samples - ((self.x_mm * (sums[3] // self.samples) + self.y_mm * (sums[4] // self.samples)) >> 10)
        self.after_mm = isqrt(rest) if rest > 0 else 0
        if self.before_mm < _SMALL_MM or self.after_mm * 2 > self.before_mm or self.after_mm > _UNLIKE_MM:
            self.x_mm = self.y_mm = 0  # nothing to spread, or the two passes do not tell of one shift

    def cancel(self):
        self.x_mm = self.y_mm = 0

    def step(self):
        # -> True when the work is done
        if self.x_mm == 0 and self.y_mm == 0:
            return True
        s = self._store
        n = _SLICE
        while n:
            n -= 1
            if self._at + 1 >= self._last:
                if self._total:
                    return True
                self._total = self._length if self._length > 0 else 1
                self._length = 0
                self._at = self._first
                return False
            i = self._at
            self._length += polar(_near(s.xs[i + 1] - s.xs[i]), _near(s.ys[i + 1] - s.ys[i])) >> 16
            self._at = i + 1
            if self._total:
                share = (self._length << 10) // self._total
                s.xs[i + 1] = int16(s.xs[i + 1] + ((self.x_mm * share // 5 + 512) >> 10))
                s.ys[i + 1] = int16(s.ys[i + 1] + ((self.y_mm * share // 5 + 512) >> 10))
                s.generation = (s.generation + 1) & 0xFFFF
        return False


def _near(v):
    # polar() takes distances below 16384.
    return 11000 if v > 11000 else -11000 if v < -11000 else v
