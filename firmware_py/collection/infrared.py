# Eight infrared range sensors: raw counts to ranges, ranges to remembered hits.

from array import array
from . import rolling
from ..fixed import sine
from .infrared_curve import RANGE_MM8

_HIT_MAX_MM = const(230)     # from the sensor; beyond it a count is over 5 mm
_HIT_COUNT = const(170)      # that range; fewer counts are farther off
_NOTHING_MM = const(999)
_GHOST_TICKS = const(150)    # 3 s: younger points are never erased


class Infrared:
    # ranges_mm[j]: distance from sensor I(j+1) to the barrier, 999 = nothing in range.
    # hit_x, hit_y: where beam j ends, mm in the odometry frame (valid where ranges_mm < 999).
    # Each hit goes into the ring; a remembered point that an open ray passes is erased.

    def __init__(self, hits):
        self._hits = hits
        self.ranges_mm = array("h", bytes(16))
        self.hit_x = array("i", bytes(32))
        self.hit_y = array("i", bytes(32))
        self._bearings = array("h", bytes(16))
        self._radius_mm = 120

    def begin(self, radius_mm, bearings, first):
        self._radius_mm = radius_mm
        for j in range(8):
            self._bearings[j] = bearings[first + j]
            self.ranges_mm[j] = _NOTHING_MM

    def update(self, values, first, x_mm, y_mm, heading_bam, tick):
        seen = project(values, first, x_mm, y_mm, heading_bam, self._radius_mm, self._bearings, self.ranges_mm, self.hit_x, self.hit_y)
        j = 0
        while seen:
            if seen & 1:
                self._hits.add(self.hit_x[j], self.hit_y[j], tick)
            seen >>= 1
            j += 1

    def erase(self, j, follower, tick):
        # Points of the follower's near list that beam j sees through.
        bearing = self._bearings[j]
        end = self.ranges_mm[j]
        if end == _NOTHING_MM:
            end = _HIT_MAX_MM
        end += self._radius_mm - 20
        i = follower.near
        while True:
            i = rolling.seen_through(follower.near_bearing, follower.near_mm, i, bearing, self._radius_mm, end)
            if i < 0:
                return
            slot = follower.near_slot[i]
            if ((tick - self._hits.stamps[slot]) & 0xFFFF) > _GHOST_TICKS:
                self._hits.remove(slot)


def project(values, first, x_mm, y_mm, heading_bam, radius_mm, bearings, ranges, hit_x, hit_y):
    # Counts to ranges, and where the beams end. -> the beams that see a barrier, a bit each
    # A port may put machine code in its place: ports/rolling_viper.py.
    seen = 0
    for j in range(8):
        count = values[first + j] & 1023
        if count < _HIT_COUNT:
            ranges[j] = _NOTHING_MM
            continue
        seen |= 1 << j
        i = (count >> 3) << 1
        near = RANGE_MM8[i] | RANGE_MM8[i + 1] << 8
        far = RANGE_MM8[i + 2] | RANGE_MM8[i + 3] << 8
        d = (near * 8 + (far - near) * (count & 7) + 32) >> 6
        ranges[j] = d
        d += radius_mm
        b = heading_bam + bearings[j]
        hit_x[j] = x_mm + (d * sine(b + 16384) + 16384 >> 15)
        hit_y[j] = y_mm + (d * sine(b) + 16384 >> 15)
    return seen
