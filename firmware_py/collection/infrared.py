# Eight infrared range sensors: raw counts to ranges, ranges to remembered hits.

from array import array
from ..fixed import sine, cosine
from .infrared_curve import RANGE_MM8

_HIT_MAX_MM = const(230)     # from the sensor; beyond it a count is over 5 mm
_NOTHING_MM = const(999)
_GHOST_TICKS = const(150)    # 3 s: younger points are never erased
_GHOST_ARC = const(31290)    # 3 mm beside a ray, as mm * BAM (65536 / 2 pi * 3)


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
        ranges = self.ranges_mm
        for j in range(8):
            count = values[first + j] & 1023
            i = (count >> 3) << 1
            near = RANGE_MM8[i] | RANGE_MM8[i + 1] << 8
            far = RANGE_MM8[i + 2] | RANGE_MM8[i + 3] << 8
            d = (near * 8 + (far - near) * (count & 7) + 32) >> 6
            if d > _HIT_MAX_MM:
                ranges[j] = _NOTHING_MM
                continue
            ranges[j] = d
            b = heading_bam + self._bearings[j]
            d += self._radius_mm
            x = x_mm + (d * cosine(b) + 16384 >> 15)
            y = y_mm + (d * sine(b) + 16384 >> 15)
            self.hit_x[j] = x
            self.hit_y[j] = y
            self._hits.add(x, y, tick)

    def erase(self, j, follower, tick):
        # Points of the follower's near list that beam j sees through.
        bearing = self._bearings[j]
        end = self.ranges_mm[j]
        if end == _NOTHING_MM:
            end = _HIT_MAX_MM
        end += self._radius_mm - 20
        bearings = follower.near_bearing
        distances = follower.near_mm
        slots = follower.near_slot
        for i in range(follower.near):
            d = distances[i]
            if d < end and d > self._radius_mm:
                arc = ((bearings[i] - bearing + 32768) & 0xFFFF) - 32768
                if -2000 < arc < 2000 and -_GHOST_ARC < arc * d < _GHOST_ARC:
                    slot = slots[i]
                    if ((tick - self._hits.stamps[slot]) & 0xFFFF) > _GHOST_TICKS:
                        self._hits.remove(slot)
