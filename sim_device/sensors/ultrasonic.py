# One forward ultrasonic range sensor: the nearest echo in a cone.
#
# Every 60 ms five rays fan over the 15-degree half-cone. A wall hit at more
# than 60 degrees (+-5) from its normal reflects the pulse away and stays silent:
# the sensor then sees what lies behind in the cone, or nothing.

import math

from sim_device.sensors.noise import Noise

HALF_CONE_RAD = math.radians(15)
RAYS = 5
MAX_M = 3.0
MIN_MM = 20
PERIOD_TICKS = 3
SPECULAR_RAD = math.radians(60)
SPECULAR_SPREAD_RAD = math.radians(2.5)  # roughness of the wall: one sigma
NOISE_MM = 3.0
NO_READING = 0
NO_ECHO = 65535


class Ultrasonic:
    def __init__(self, world, bearing_rad, radius_m, seed):
        self._world = world
        self._normals = [(-ey * math.sqrt(inverse), ex * math.sqrt(inverse))
                         for _, _, ex, ey, inverse, _ in world.segments]
        self._mount = (radius_m * math.cos(bearing_rad), radius_m * math.sin(bearing_rad))
        # The centre first: its echo is mostly the nearest, and caps the others.
        angles = sorted((HALF_CONE_RAD * (2 * k / (RAYS - 1) - 1) for k in range(RAYS)), key=abs)
        self._rays = [(math.cos(bearing_rad + a), math.sin(bearing_rad + a)) for a in angles]
        self._noise = Noise(seed, "ultrasonic", 2)

    def read(self, tick, x, y, cos, sin):
        """Millimetres to the nearest echo; NO_READING between pulses, NO_ECHO without one."""
        if tick % PERIOD_TICKS:
            return NO_READING
        error, roughness = self._noise.group()
        limit = math.cos(SPECULAR_RAD + SPECULAR_SPREAD_RAD * roughness)
        mx, my = self._mount
        x += cos * mx - sin * my
        y += sin * mx + cos * my
        world = self._world
        nearest = MAX_M
        for rx, ry in self._rays:
            ux = cos * rx - sin * ry
            uy = sin * rx + cos * ry
            distance = world.ray(x, y, ux, uy, nearest)
            if distance < nearest:
                nx, ny = self._normals[world.hit]
                if -(ux * nx + uy * ny) >= limit:
                    nearest = distance
        if nearest >= MAX_M:
            return NO_ECHO
        return max(MIN_MM, round(nearest * 1000 + NOISE_MM * error))
