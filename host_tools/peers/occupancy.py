"""An occupancy grid, 5 cm log-odds, from the same infrared readings and the same estimated poses; and what a robot that
explores for a grid has to drive: all of the floor, in lanes as wide as itself."""

import collections
import math

import numpy as np
import shapely
from shapely.geometry import LineString

from host_tools.lines import distances, share
from host_tools.mission import BAM_RAD

CELL_M = 0.05
CELL_BYTES = 1            # a log-odds as a signed byte
HIT, MISS, LIMIT = 6, -2, 100
NEAR_M = 0.05
LANE_M = 0.34             # the robot's own width
STEP_M = 0.10             # of the ways from lane to lane
REACH_MM = 250            # beyond, a reading says only that nothing is nearer
OFFSET_MM = 4.2
# The data sheet's curve of a Sharp GP2Y0A41SK0F: straight, or nearly, over 1 / (distance + 4.2 mm).
CURVE_MM = np.array((35, 40, 60, 80, 100, 120, 160, 200, 250, 300, 400))
CURVE_COUNTS = np.array((2.85, 2.68, 2.00, 1.55, 1.26, 1.06, 0.80, 0.64, 0.50, 0.40, 0.29)) / 3.3 * 1023


# A dense array over the floor; cells are counted from the corner (x0, y0).
class Grid:
    def __init__(self, bounds):
        self.x0, self.y0 = bounds[0], bounds[1]
        shape = [math.ceil((bounds[axis + 2] - bounds[axis]) / CELL_M) for axis in (0, 1)]
        self.log_odds = np.zeros(shape, np.int32)

    @property
    def bytes(self):
        return self.log_odds.size * CELL_BYTES

    def add(self, points, weight):
        i = np.floor((points - (self.x0, self.y0)) / CELL_M).astype(int)
        inside = ((i >= 0) & (i < self.log_odds.shape)).all(axis=1)
        np.add.at(self.log_odds, tuple(i[inside].T), weight)

    def occupied(self):
        """(n, 2) middles of the cells that are rather wall than not."""
        return (np.argwhere(self.log_odds > 0) + 0.5) * CELL_M + (self.x0, self.y0)


def built(mission, bounds):
    """The Grid after the mission."""
    grid = Grid(bounds)
    row = np.searchsorted(mission.step, mission.pose[:, 0])
    known = row < len(mission.step)
    pose, counts = mission.pose[known][:, 1:4], mission.ir[row[known]].astype(float)
    mm = 1 / np.interp(counts, CURVE_COUNTS[::-1], 1 / (CURVE_MM[::-1] + OFFSET_MM)) - OFFSET_MM
    mount_m = mission.parameter("ir_radius") / 1000
    for beam in range(counts.shape[1]):
        bearing = pose[:, 2] + mission.parameter("ir_bearing", beam) * BAM_RAD
        along = np.column_stack([np.cos(bearing), np.sin(bearing)])
        hit = mm[:, beam] < REACH_MM
        end_m = mount_m + np.minimum(mm[:, beam], REACH_MM) / 1000
        for far_m in np.arange(mount_m, mount_m + REACH_MM / 1000, CELL_M):
            passed = far_m < end_m - CELL_M
            grid.add(pose[passed, :2] + far_m * along[passed], MISS)
        grid.add(pose[hit, :2] + end_m[hit, None] * along[hit], HIT)
    grid.log_odds.clip(-LIMIT, LIMIT, out=grid.log_odds)
    return grid


def scores(grid, truth):
    """{bytes, precision_5cm, recall_5cm}, counted as for the vectors."""
    cells = grid.occupied()
    if not len(cells):
        return {"bytes": grid.bytes, "precision_5cm": None, "recall_5cm": None}
    points = np.vstack([truth.outer_points, truth.island_points])
    weights = np.concatenate([truth.outer_weights, truth.island_weights])
    near = np.zeros(len(points), bool)
    near[shapely.STRtree(shapely.points(cells)).query(shapely.points(points), "dwithin", NEAR_M)[0]] = True
    return {"bytes": grid.bytes, "precision_5cm": share(np.ones(len(cells)), distances(cells, truth.walls) <= NEAR_M),
            "recall_5cm": share(weights, near)}


def sweep_s(truth, speed_m_s, turn_rad_s):
    """Robot time of the full sweep: every lane over the floor that the disc reaches, always on to the nearest one, by the
    shortest way; nothing is lost to braking, nor to walls that have to be found first: no such robot is faster."""
    ways = _ways(truth.centres)
    lanes = _lanes(truth.centres)
    if not lanes or not ways:
        return None
    ends = {}
    for number, (a, b) in enumerate(lanes):
        for end in (a, b):
            ends.setdefault(_nearest(ways, end), []).append((number, end))
    at, length_m, turns, left = truth.start.coords[0], 0.0, 0, set(range(len(lanes)))
    while left:
        number, end, way_m = _next_lane(ways, ends, left, at)
        if number is None:
            break
        a, b = lanes[number]
        at = b if end == a else a
        length_m += way_m + math.dist(a, b)
        turns += 2
        left.discard(number)
    return length_m / speed_m_s + turns * math.pi / 2 / turn_rad_s


def _lanes(region):
    x0, y0, x1, y1 = region.bounds
    across = LineString(((x0 - 1, 0), (x1 + 1, 0)))
    found = []
    for y in np.arange(y0 + LANE_M / 2, y1, LANE_M):
        for part in shapely.get_parts(region.intersection(shapely.transform(across, lambda xy, y=y: xy + (0, y)))):
            if part.length > 0:
                found.append((part.coords[0], part.coords[-1]))
    return found


def _ways(region):
    """The places 10 cm apart in which the disc's centre may be, by column and row."""
    x0, y0, x1, y1 = region.bounds
    shapely.prepare(region)
    i, j = (each.ravel() for each in np.meshgrid(np.arange(int((x1 - x0) / STEP_M) + 2), np.arange(int((y1 - y0) / STEP_M) + 2)))
    free = shapely.intersects_xy(region, x0 + i * STEP_M, y0 + j * STEP_M)
    return {"origin": (x0, y0), "cells": set(zip(i[free].tolist(), j[free].tolist()))}


def _nearest(ways, place):
    i, j = (round((place[k] - ways["origin"][k]) / STEP_M) for k in (0, 1))
    around = [(i + a, j + b) for a in range(-3, 4) for b in range(-3, 4) if (i + a, j + b) in ways["cells"]]
    return min(around, key=lambda cell: math.dist(cell, (i, j)), default=None)


def _next_lane(ways, ends, left, at):
    """(lane, its nearer end, metres to there), by the shortest way over the free cells."""
    start = _nearest(ways, at)
    reached, todo = {start: 0.0}, collections.deque([start])
    while todo:
        cell = todo.popleft()
        for number, end in ends.get(cell, ()):
            if number in left:
                # Ways along cells are at most sqrt 2 too long: what is told is never longer than the shortest way.
                return number, end, max(math.dist(at, end), reached[cell] / math.sqrt(2))
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            beside = cell[0] + a, cell[1] + b
            if beside in ways["cells"] and beside not in reached:
                reached[beside] = reached[cell] + STEP_M
                todo.append(beside)
    return None, None, 0.0
