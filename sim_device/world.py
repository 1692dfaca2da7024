# The walls of a home as the virtual robot feels them: rays, clearance, walls
# crossed. A uniform grid holds, per cell, a flat tuple of the segments in it.
#
# A segment is (x1, y1, ex, ey, 1/len^2, index), e = end - start, free space on
# its left: rays start in the free space, so back faces are never the first hit
# and are skipped. Pure Python for rays (9 short ones cost less than one numpy
# call per ray), numpy where all segments are looked at (walls_crossed).

import math

import numpy as np

CELL_M = 0.5


class World:
    def __init__(self, home):
        rows = home.segments
        self.home = home
        self.segments = tuple(
            (x1, y1, x2 - x1, y2 - y1, 1.0 / ((x2 - x1) ** 2 + (y2 - y1) ** 2), i)
            for i, (x1, y1, x2, y2) in enumerate(rows.tolist()))
        self.hit = -1  # index of the segment that the last ray() ended on, -1 none
        self._x0 = float(min(rows[:, 0])) - CELL_M
        self._y0 = float(min(rows[:, 1])) - CELL_M
        self._nx = int((float(max(rows[:, 0])) - self._x0) / CELL_M) + 2
        self._ny = int((float(max(rows[:, 1])) - self._y0) / CELL_M) + 2
        self._cells = self._rasterise()

    def _rasterise(self):
        cells = [[] for _ in range(self._nx * self._ny)]
        half = CELL_M / 2
        for segment in self.segments:
            x1, y1, ex, ey = segment[:4]
            i_from, i_to = self._span(x1 - self._x0, ex)
            j_from, j_to = self._span(y1 - self._y0, ey)
            reach = (abs(ex) + abs(ey)) * half + 1e-6
            for j in range(j_from, j_to + 1):
                for i in range(i_from, i_to + 1):
                    cx = self._x0 + i * CELL_M + half - x1
                    cy = self._y0 + j * CELL_M + half - y1
                    if abs(cx * ey - cy * ex) <= reach:  # the line passes through the box
                        cells[j * self._nx + i].append(segment)
        return [tuple(cell) for cell in cells]

    @staticmethod
    def _span(start, extent):
        a, b = (start, start + extent) if extent > 0 else (start + extent, start)
        return int((a - 1e-6) / CELL_M), int((b + 1e-6) / CELL_M)

    def ray(self, x, y, cos, sin, max_m):
        """Distance from the free point (x, y) to the first wall along (cos, sin), at most max_m."""
        gx = (x - self._x0) / CELL_M
        gy = (y - self._y0) / CELL_M
        nx = self._nx
        ny = self._ny
        self.hit = -1
        if not (0 <= gx < nx and 0 <= gy < ny):
            return max_m  # no free space out there
        i = int(gx)
        j = int(gy)
        step_x, t_x, dt_x = _stride(gx - i, cos)
        step_y, t_y, dt_y = _stride(gy - j, sin)
        cells = self._cells
        best = max_m
        while True:
            for x1, y1, ex, ey, _, n in cells[j * nx + i]:
                d = cos * ey - sin * ex
                if d > 1e-12:
                    px = x1 - x
                    py = y1 - y
                    t = px * ey - py * ex
                    if 0 <= t < best * d and -1e-9 <= px * sin - py * cos <= d + 1e-9:
                        best = t / d
                        self.hit = n
            if t_x < t_y:
                if best <= t_x:
                    return best
                i += step_x
                t_x += dt_x
                if not 0 <= i < nx:
                    return best
            else:
                if best <= t_y:
                    return best
                j += step_y
                t_y += dt_y
                if not 0 <= j < ny:
                    return best

    def within(self, x, y, reach_m):
        """The segments whose distance to (x, y) is at most reach_m, in order of index."""
        x0 = self._x0
        y0 = self._y0
        i_from = max(0, int((x - reach_m - x0) / CELL_M))
        i_to = min(self._nx - 1, int((x + reach_m - x0) / CELL_M))
        found = {}
        reach2 = reach_m * reach_m
        for j in range(max(0, int((y - reach_m - y0) / CELL_M)), min(self._ny - 1, int((y + reach_m - y0) / CELL_M)) + 1):
            for cell in self._cells[j * self._nx + i_from:j * self._nx + i_to + 1]:
                for segment in cell:
                    n = segment[5]
                    if n not in found:
                        found[n] = segment if distance2(segment, x, y) <= reach2 else None
        return [found[n] for n in sorted(found) if found[n]]

    def clearance(self, x, y, limit):
        """Distance from (x, y) to the nearest wall, at most limit."""
        best = limit * limit
        for segment in self.within(x, y, limit):
            best = min(best, distance2(segment, x, y))
        return math.sqrt(best)


def _stride(fraction, component):
    """Grid step, metres along the ray to the first cell border, metres from border to border."""
    if component > 1e-12:
        return 1, (1 - fraction) * CELL_M / component, CELL_M / component
    if component < -1e-12:
        return -1, -fraction * CELL_M / component, -CELL_M / component
    return 0, math.inf, math.inf


def distance2(segment, x, y):
    """Squared distance from (x, y) to the segment."""
    x1, y1, ex, ey, inverse, _ = segment
    px = x - x1
    py = y - y1
    u = (px * ex + py * ey) * inverse
    if u > 0:
        if u > 1:
            u = 1
        px -= u * ex
        py -= u * ey
    return px * px + py * py


# The segments round a moving body: all that lie within `reach_m` of it are in
# the list (some a little farther, too). Refreshed after MARGIN_M of travel.
class Nearby:
    MARGIN_M = 0.06

    def __init__(self, world, reach_m):
        self._world = world
        self.reach_m = reach_m
        self._x = self._y = math.inf
        self._segments = []

    def at(self, x, y):
        dx = x - self._x
        dy = y - self._y
        if not dx * dx + dy * dy <= self.MARGIN_M * self.MARGIN_M:
            self._x = x
            self._y = y
            self._segments = self._world.within(x, y, self.reach_m + self.MARGIN_M)
        return self._segments


# How many walls stand between a place in the free space and fixed points.
# All segments and points in one numpy pass: the side that every point has of
# every segment never changes and is computed once.
class WallCounter:
    def __init__(self, home, points):
        # Each ring ends with its first vertex once more: a segment's end is then the next vertex in the
        # array, and no index is needed. What would join two rings is no segment, and never counts.
        places = np.vstack([ring + ring[:1] for ring in home.rings])
        self._x = places[:, 0].copy()
        self._y = places[:, 1].copy()
        self._ex = np.diff(self._x)
        self._ey = np.diff(self._y)
        is_wall = np.ones(len(self._ex), bool)
        is_wall[np.cumsum([len(ring) + 1 for ring in home.rings])[:-1] - 1] = False
        self._points = np.array(points, float).reshape(-1, 2)
        side = self._ex * (self._points[:, 1:] - self._y[:-1]) - self._ey * (self._points[:, :1] - self._x[:-1])
        self._point_left = side > 0
        # A point on a wall (a transmitter in a corner) is not behind that wall.
        self._counts = np.array([
            [wall and distance2((x, y, ex, ey, 1 / (ex * ex + ey * ey), 0), px, py) > 1e-12
             for x, y, ex, ey, wall in zip(self._x, self._y, self._ex, self._ey, is_wall)]
            for px, py in self._points], bool).reshape(side.shape)

    def crossings(self, x, y):
        """Per point, how often the line of sight from (x, y) crosses the border of the free space."""
        dx = self._x - x
        dy = self._y - y
        here_left = self._ey * dx[:-1] > self._ex * dy[:-1]
        sight_x = self._points[:, :1] - x
        sight_y = self._points[:, 1:] - y
        vertex_left = sight_x * dy > sight_y * dx
        split = vertex_left[:, 1:] != vertex_left[:, :-1]
        split &= self._point_left != here_left
        split &= self._counts
        return split.sum(axis=1)
