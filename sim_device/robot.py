# The robot's body: two wheels on motors, a disc that meets walls.
#
# Truth only: nothing here is measured. A tick is 20 ms.

import math

from sim_device.sensors.noise import Noise, generator
from sim_device.world import distance2

TICK_S = 0.02
FRICTION = 0.5          # share of the tangential motion that a touching disc keeps
TOUCH_M = 0.0002        # a wall nearer than this to the rim presses the bumper
SKIN_M = 2e-6           # a slide stands off by this much, so that rounding never lets the disc in
ONSET_TICKS = 10        # a touch after 0.2 s without one is a new contact


# Odometry presets: how the true wheels differ from the nominal ones.
#   mismatch  (right - left) / mean wheel radius
#   track     true / nominal track - 1
#   slip      random error of a wheel's travel, metres per square root of a metre
# calibrated draws mismatch and track from N(0, value); poor has exactly these
# magnitudes, with seeded signs, so that every seed is as hard as the next.
ODOMETRY = {
    "calibrated": {"mismatch": 0.0002, "track": 0.0015, "slip": 0.0005, "drawn": True},
    "poor": {"mismatch": 0.003, "track": 0.01, "slip": 0.0025, "drawn": False},
}


# Pose and contact of the disc. Invariant: after every move the centre is at
# least radius_m from every wall. Only drive() and put() write.
class Body:
    def __init__(self, config, nearby, start, odometry, seed):
        preset = ODOMETRY[odometry]
        draw = generator(seed, "odometry").standard_normal(2).tolist()
        if not preset["drawn"]:
            draw = [math.copysign(1, value) for value in draw]
        mismatch = preset["mismatch"] * draw[0]
        self.left_scale = 1 - mismatch / 2   # true / nominal wheel radius
        self.right_scale = 1 + mismatch / 2
        self.track_m = config.track_m * (1 + preset["track"] * draw[1])
        self._slip = preset["slip"]
        self._noise = Noise(seed, "slip", 2)
        self._radius_nominal_m = config.wheel_diameter_m / 2
        self._wheel_max = config.speed_m_s + config.turn_rad_s * config.track_m / 2
        lag = config.motor_time_constant_s
        self._decay = math.exp(-TICK_S / lag) if lag > 0 else 0.0
        self._lag_s = lag * (1 - self._decay)
        self._left_m_s = self._right_m_s = 0.0
        self.radius_m = config.radius_m
        self._nearby = nearby
        self.x_m, self.y_m = start
        self.theta_rad = 0.0
        self.cos, self.sin = 1.0, 0.0
        self.left_rad = self.right_rad = 0.0
        self.path_m = 0.0
        self.contacts = 0
        self.bump = 0
        self._untouched_ticks = ONSET_TICKS
        self._room_m = 0.0  # travel that is certainly free of contact

    def drive(self, left_mm_s, right_mm_s):
        """One tick of truth under these commanded wheel speeds."""
        left = self._motor(left_mm_s / 1000, self._left_m_s)
        right = self._motor(right_mm_s / 1000, self._right_m_s)
        self._left_m_s, left = left
        self._right_m_s, right = right
        self.left_rad += left / self._radius_nominal_m
        self.right_rad += right / self._radius_nominal_m
        slip_left, slip_right = self._noise.group()
        left = left * self.left_scale + self._slip * math.sqrt(abs(left)) * slip_left
        right = right * self.right_scale + self._slip * math.sqrt(abs(right)) * slip_right
        turn = (right - left) / self.track_m
        ahead = (left + right) / 2
        # Exact arc: its chord points along the mean heading.
        if abs(turn) > 1e-9:
            ahead *= 2 * math.sin(turn / 2) / turn
        mean = self.theta_rad + turn / 2
        self._move(ahead * math.cos(mean), ahead * math.sin(mean), abs(ahead))
        self.theta_rad = math.remainder(self.theta_rad + turn, 2 * math.pi)
        self.cos = math.cos(self.theta_rad)
        self.sin = math.sin(self.theta_rad)
        self._feel()

    def put(self, x_m, y_m, theta_rad):
        """Standing there, wherever it was before; the place must be legal."""
        self.x_m = x_m
        self.y_m = y_m
        self.theta_rad = math.remainder(theta_rad, 2 * math.pi)
        self.cos = math.cos(self.theta_rad)
        self.sin = math.sin(self.theta_rad)
        self._left_m_s = self._right_m_s = 0.0
        self._room_m = 0.0
        self._feel()

    def _motor(self, wanted, now):
        """First-order motor under a constant command: (speed at the end, distance) of the tick."""
        wanted = min(max(wanted, -self._wheel_max), self._wheel_max)
        return wanted + (now - wanted) * self._decay, wanted * TICK_S + (now - wanted) * self._lag_s

    def _clearance(self, x, y):
        """Distance from (x, y) to the nearest wall, at most what Nearby holds."""
        best = self._nearby.reach_m ** 2
        for segment in self._nearby.at(x, y):
            d2 = distance2(segment, x, y)
            if d2 < best:
                best = d2
        return math.sqrt(best)

    def _move(self, dx, dy, length):
        if length < self._room_m:
            self._room_m -= length
            self.x_m += dx
            self.y_m += dy
            self.path_m += length
            return
        gap = self._clearance(self.x_m + dx, self.y_m + dy) - self.radius_m
        if gap >= 0:
            self._room_m = gap - TOUCH_M
            self.x_m += dx
            self.y_m += dy
            self.path_m += length
            return
        self._push(dx, dy)

    def _push(self, dx, dy):
        """Go as far as the wall lets, then slide along it with what friction leaves."""
        self._room_m = 0.0
        share = self._advance(dx, dy)
        dx *= 1 - share
        dy *= 1 - share
        slide = self._slide(dx, dy, self._normals())
        if slide:
            self._advance(*slide)

    @staticmethod
    def _slide(dx, dy, normals):
        """What is left of (dx, dy) along a touched wall without pressing into another; None in a corner that holds."""
        pressed = [(nx, ny) for nx, ny in normals if dx * nx + dy * ny < 0]
        for nx, ny in pressed:
            into = dx * nx + dy * ny
            sx = (dx - into * nx) * FRICTION
            sy = (dy - into * ny) * FRICTION
            if all(sx * mx + sy * my >= -1e-12 for mx, my in normals):
                for mx, my in normals:
                    sx += SKIN_M * mx
                    sy += SKIN_M * my
                return sx, sy
        return None

    def _advance(self, dx, dy):
        """Move by the largest share of (dx, dy) found that stays legal; returns the share."""
        x = self.x_m
        y = self.y_m
        legal = 0.0
        blocked = 2.0  # so that the first try is the whole way
        for _ in range(12):
            share = (legal + blocked) / 2
            if self._clearance(x + share * dx, y + share * dy) < self.radius_m:
                blocked = share
            elif share == 1.0:
                legal = 1.0
                break
            else:
                legal = share
        self.x_m = x + legal * dx
        self.y_m = y + legal * dy
        self.path_m += legal * math.hypot(dx, dy)
        return legal

    def _normals(self):
        """Unit vectors from each touched wall to the centre."""
        limit2 = (self.radius_m + TOUCH_M) ** 2
        x = self.x_m
        y = self.y_m
        found = []
        for segment in self._nearby.at(x, y):
            if distance2(segment, x, y) < limit2:
                x1, y1, ex, ey, inverse, _ = segment
                u = min(max(((x - x1) * ex + (y - y1) * ey) * inverse, 0), 1)
                nx = x - x1 - u * ex
                ny = y - y1 - u * ey
                length = math.hypot(nx, ny)
                found.append((nx / length, ny / length))
        return found

    def _feel(self):
        """The bumper: one bit per 45-degree sector touched, bit 0 ahead, counter-clockwise."""
        bump = 0
        if self._room_m <= 0:
            for nx, ny in self._normals():
                bearing = math.atan2(-(self.cos * ny - self.sin * nx), -(self.cos * nx + self.sin * ny))
                bump |= 1 << (round(bearing / (math.pi / 4)) & 7)
        if bump:
            if self._untouched_ticks >= ONSET_TICKS:
                self.contacts += 1
            self._untouched_ticks = 0
        else:
            self._untouched_ticks += 1
        self.bump = bump
