# Eight infrared range sensors: raw ADC counts of a Sharp GP2Y0A41SK0F (4-30 cm).
#
# Curve: output voltage over distance for white paper, read off the data sheet's
# example of output (0.40 V at 30 cm, a change of 2.25 V from 30 to 4 cm typical).
# Between knots the voltage is linear in 1 / (distance + 4.2 mm), the abscissa in
# which the data sheet draws the curve almost straight. Below 35 mm the output
# folds back: nearer means LESS voltage; mount the part so that it never gets there.
#
#   counts = round(1023 * voltage / 3.3 V), clamped to 0..1023
#
# Errors: each part's voltage is off by a factor N(1, 0.02); each reading by
# N(0, 3) counts. With nothing within 40 cm the output is that of 40 cm.

import math

from sim_device.sensors.noise import Noise, generator

ADC_COUNTS = 1023
ADC_VOLT = 3.3
REACH_MM = 400
FOLD_MM = 35  # the voltage peaks here
NOISE_COUNTS = 3.0
SPREAD = 0.02
OFFSET_MM = 4.2
# (distance in mm, output in V)
CURVE = (
    (0, 0.00), (10, 1.10), (20, 2.10), (30, 2.72), (35, 2.85), (40, 2.68), (50, 2.31), (60, 2.00), (70, 1.75),
    (80, 1.55), (90, 1.39), (100, 1.26), (120, 1.06), (140, 0.91), (160, 0.80), (180, 0.71), (200, 0.64),
    (250, 0.50), (300, 0.40), (350, 0.34), (400, 0.29),
)
_STEP_PER_M = 10000  # the table's grid: 0.1 mm, under one count everywhere


def nominal_volt(distance_mm):
    """Output voltage of a part exactly on the data sheet's curve."""
    distance_mm = min(max(distance_mm, 0), REACH_MM)
    for (near_mm, near_volt), (far_mm, far_volt) in zip(CURVE, CURVE[1:]):
        if distance_mm <= far_mm:
            near, far = 1 / (near_mm + OFFSET_MM), 1 / (far_mm + OFFSET_MM)
            share = (1 / (distance_mm + OFFSET_MM) - far) / (near - far)
            return far_volt + share * (near_volt - far_volt)
    raise AssertionError("REACH_MM is the curve's last knot")


def nominal_counts(distance_mm):
    """ADC reading of a part exactly on the data sheet's curve, without noise."""
    return round(nominal_volt(distance_mm) / ADC_VOLT * ADC_COUNTS)


_COUNTS = [nominal_volt(i * 1000 / _STEP_PER_M) / ADC_VOLT * ADC_COUNTS
           for i in range(REACH_MM * _STEP_PER_M // 1000 + 1)]
_LAST = len(_COUNTS) - 1


# All eight sensors at once. They look outwards along their own bearing, so
# their rays start at the body's centre, which no wall comes near: one pass over
# the nearby segments serves all of them.
class Infrared:
    def __init__(self, bearings_rad, radius_m, seed):
        self._radius_m = radius_m
        self.reach_m = radius_m + REACH_MM / 1000
        self._rays = [(i, math.cos(b), math.sin(b)) for i, b in enumerate(bearings_rad)]
        self._gain = (1 + SPREAD * generator(seed, "infrared spread").standard_normal(len(bearings_rad))).tolist()
        self._noise = Noise(seed, "infrared", len(bearings_rad))

    def distances_m(self, segments, x, y, cos, sin):
        """Distance from the body's centre to the first wall on each bearing, at most reach_m."""
        reach = self.reach_m
        reach2 = reach * reach
        rays = self._rays
        best = [reach] * len(rays)
        for x1, y1, ex, ey, inverse, _ in segments:
            ax = x1 - x
            ay = y1 - y
            n = ax * ey - ay * ex
            if n <= 0 or n * n * inverse > reach2:
                continue  # seen from behind, or its line passes out of reach
            px = cos * ax + sin * ay  # the segment in the body's frame
            py = cos * ay - sin * ax
            fx = cos * ex + sin * ey
            fy = cos * ey - sin * ex
            for i, ux, uy in rays:
                d = ux * fy - uy * fx
                if d > 1e-12 and n < best[i] * d and -1e-9 <= px * uy - py * ux <= d + 1e-9:
                    best[i] = n / d
        return best

    def read(self, values, start, segments, x, y, cos, sin):
        """Eight raw readings into values[start:start + 8]."""
        radius = self._radius_m
        distances = self.distances_m(segments, x, y, cos, sin)
        i = 0
        for error, gain in zip(self._noise.group(), self._gain):
            k = int((distances[i] - radius) * _STEP_PER_M + 0.5)
            counts = int(_COUNTS[0 if k < 0 else k if k < _LAST else _LAST] * gain + NOISE_COUNTS * error + 0.5)
            values[start + i] = 0 if counts < 0 else ADC_COUNTS if counts > ADC_COUNTS else counts
            i += 1
