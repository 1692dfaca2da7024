# The UWB receiver: signal strength or time of flight from fixed transmitters.
#
# Transmitters (the paper's section 2): at the ceiling's centre of each room and
# at the 4 outline vertices farthest out along the diagonals, 2.4 m high; the
# receiver is 0.1 m high. A signal ends after 20 m or more than 4 walls (walls =
# stretches of the line of sight outside the free space). Reports at 10 Hz, the
# 15 strongest. d is the slant distance in m, level in dB.
#
# preset     what a report holds
# paper      level -47 - 17 lg d + N(0, 0.1), independent between reports; through 3-4 walls N(0, 1)
# rssi_real  level -P0 - 10 gamma lg d + sigma * field + N(0, 0.3); per transmitter and kind of path
#            LOS (no wall): P0 47, gamma N(1.7, 0.3), sigma N(1.6, 0.5)
#            NLOS:          P0 51, gamma N(3.5, 0.97), sigma N(2.7, 0.98)
# tof        range d + N(0, 0.1 m), independent; through 3-4 walls N(0, 0.3 m)
# tof_nlos   as tof, plus a bias of walls * 0.25 m * exp(0.5 field - 0.125), never negative
# none       no reports
#
# `field`: a fixed Gaussian random field of the place, one per transmitter, unit
# variance, correlation exp(-r^2 / (2 L^2)) with L = 1.5 m: standing still or
# averaging does not help against it. In the tof presets the level is -47 - 17 lg d
# - 3 per wall: good for choosing among transmitters.

import math

import numpy as np

from sim_device.sensors.noise import Noise, generator
from sim_device.world import WallCounter

PRESETS = ("paper", "rssi_real", "tof", "tof_nlos", "none")
ANCHOR_M = 2.4
RECEIVER_M = 0.1
PERIOD_TICKS = 5
RECORDS_MAX = 15
RANGE_MAX_M = 20.0
WALLS_MAX = 4
WALLS_ACCURATE = 2
LEVEL_1M_DB = -47.0
GAMMA = 1.7
PAPER_DB = 0.1
TOF_M = 0.10
FIELD_M = 1.5
FIELD_WAVES = 32
# (P0 in dB, gamma mean, gamma sigma, shadowing mean, shadowing sigma)
LOS = (47.0, 1.7, 0.3, 1.6, 0.5)
NLOS = (51.0, 3.5, 0.97, 2.7, 0.98)


def anchor_places(home, count_max=32):
    """Transmitters of a home: [(x, y, z)], corners first; each on the millimetre or on its vertex."""
    corners = []
    for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        vertex = max(home.outline, key=lambda p: sx * p[0] + sy * p[1])
        if vertex not in corners:
            corners.append(vertex)
    chosen = list(corners)
    left = [(round(room.centre[0], 3), round(room.centre[1], 3)) for room in home.rooms]
    while left and len(chosen) < count_max:
        best = left[0]
        if len(corners) + len(home.rooms) > count_max:  # too many rooms: those farthest apart
            best = max(left, key=lambda p: min(math.dist(p, q) for q in chosen))
        left.remove(best)
        chosen.append(best)
    return [(x, y, ANCHOR_M) for x, y in chosen], len(corners)


# A smooth random function of the place per transmitter: a sum of plane waves
# whose wave numbers are drawn from the spectrum of the wanted correlation.
class Field:
    def __init__(self, source, count):
        self._k = source.standard_normal((count, FIELD_WAVES, 2)) / FIELD_M
        self._phase = source.uniform(0, 2 * math.pi, (count, FIELD_WAVES))

    def at(self, x, y):
        """One value per transmitter, about N(0, 1)."""
        waves = np.cos(self._k[:, :, 0] * x + self._k[:, :, 1] * y + self._phase)
        return waves.sum(axis=1) * math.sqrt(2 / FIELD_WAVES)


class Uwb:
    def __init__(self, home, preset, seed):
        self.preset = preset
        self.anchors, corners = anchor_places(home)
        places = np.array(self.anchors)
        count = len(places)
        self._x, self._y = places[:, 0].copy(), places[:, 1].copy()
        self._rise2 = (places[:, 2] - RECEIVER_M) ** 2
        self._walls = WallCounter(home, places[:, :2])
        # A line of sight that reaches a corner from behind ends in a wall; one that
        # ends over a table's outline does not: that transmitter hangs on the ceiling.
        self._half = np.array([1] * corners + [0] * (count - corners))
        self._noise = Noise(seed, "uwb", count)
        source = generator(seed, "uwb site")
        self._field = Field(source, count)
        draws = source.standard_normal((2, 2, count))
        self._site = [(p0, np.maximum(g + gs * draws[k, 0], 1.0), np.maximum(s + ss * draws[k, 1], 0.3))
                      for k, (p0, g, gs, s, ss) in enumerate((LOS, NLOS))]

    def parameters(self):
        """What the core is told of the transmitters and the model."""
        if self.preset == "none":
            return {"uwb_source": [0], "anchor_count": [0]}
        timed = self.preset in ("tof", "tof_nlos")
        # Of rssi_real the core may know the published LOS means, not what was drawn.
        sigma = round((LOS[3] if self.preset == "rssi_real" else PAPER_DB) * 100)
        return {
            "uwb_source": [2 if timed else 1],
            "uwb_level_1m": [round(LEVEL_1M_DB * 100)],
            "uwb_gamma": [round(GAMMA * 1000)],
            "uwb_sigma": [sigma],
            "anchor_count": [len(self.anchors)],
            "anchor_x": [round(x * 1000) for x, _, _ in self.anchors],
            "anchor_y": [round(y * 1000) for _, y, _ in self.anchors],
            "anchor_height": [round((z - RECEIVER_M) * 1000) for _, _, z in self.anchors],
        }

    def read(self, values, start, tick, x, y):
        """Count, then (anchor, strength in 0.01 dB, range in mm) each, into values[start:]."""
        values[start] = 0
        if tick % PERIOD_TICKS or self.preset == "none":
            return
        d = np.sqrt((self._x - x) ** 2 + (self._y - y) ** 2 + self._rise2)
        walls = (self._walls.crossings(x, y) + self._half) // 2
        heard = (d <= RANGE_MAX_M) & (walls <= WALLS_MAX)
        level, range_m = self._measure(d, walls, x, y)
        # A handful of numbers: rounded one by one they cost less than in three more numpy passes.
        level_cdb = (level * 100).tolist()
        range_mm = None if range_m is None else (range_m * 1000).tolist()
        order = np.argsort(-level, kind="stable").tolist()
        heard = heard.tolist()
        count = 0
        for anchor in order:
            if heard[anchor] and count < RECORDS_MAX:
                at = start + 1 + 3 * count
                values[at] = anchor
                values[at + 1] = round(level_cdb[anchor])
                values[at + 2] = 0 if range_mm is None else min(max(round(range_mm[anchor]), 0), 65534)
                count += 1
        values[start] = count

    def _measure(self, d, walls, x, y):
        """Level in dB and range in m (None where the preset measures none) of every transmitter."""
        noise = np.array(self._noise.group())
        inaccurate = walls > WALLS_ACCURATE
        path = LEVEL_1M_DB - 10 * GAMMA * np.log10(d)
        if self.preset == "paper":
            return path + noise * np.where(inaccurate, 10 * PAPER_DB, PAPER_DB), None
        field = self._field.at(x, y)
        if self.preset == "rssi_real":
            decades = 10 * np.log10(d)
            (p0, g, s), (q0, h, r) = self._site
            level = np.where(walls == 0, -p0 - g * decades + s * field, -q0 - h * decades + r * field)
            return level + 0.3 * noise, None
        range_m = d + noise * np.where(inaccurate, 3 * TOF_M, TOF_M)
        if self.preset == "tof_nlos":
            range_m = range_m + walls * 0.25 * np.exp(0.5 * field - 0.125)
        return path - 3.0 * walls, range_m
