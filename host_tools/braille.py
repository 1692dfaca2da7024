"""A picture of lines drawn with braille characters, for any terminal.

Contract: a Braille of C columns and R rows holds 2C x 4R dots; dot (0, 0) is the
lower left, x right, y up, as in the home's frame. Dots and lines outside are
clipped, never an error. Nothing here knows of robots or of a terminal's codes.
"""

import math

_DOT_BITS = ((0x40, 0x80), (0x04, 0x20), (0x02, 0x10), (0x01, 0x08))  # [y % 4 from below][x % 2]
_BLANK = 0x2800


class Braille:
    def __init__(self, columns, rows):
        self.columns = max(1, columns)
        self.rows = max(1, rows)
        self.width = 2 * self.columns
        self.height = 4 * self.rows
        self._cells = bytearray(self.columns * self.rows)

    def dot(self, x, y):
        if 0 <= x < self.width and 0 <= y < self.height:
            self._cells[(y >> 2) * self.columns + (x >> 1)] |= _DOT_BITS[y & 3][x & 1]

    def line(self, x0, y0, x1, y1):
        """All dots from one end to the other; ends may lie outside, as floats."""
        clipped = _clip(x0, y0, x1, y1, self.width - 0.5, self.height - 0.5)
        if clipped is None:
            return
        x0, y0, x1, y1 = clipped
        steps = max(1, int(max(abs(x1 - x0), abs(y1 - y0)) + 0.5))
        dx, dy = (x1 - x0) / steps, (y1 - y0) / steps
        x0, y0 = x0 + 0.5, y0 + 0.5     # clipped to -0.5 and more: int() rounds from here
        for i in range(steps + 1):
            self.dot(int(x0 + dx * i), int(y0 + dy * i))

    def cells(self):
        """The dots of each line as bytes, one a character (added to U+2800), the top line first."""
        return [bytes(self._cells[row * self.columns:(row + 1) * self.columns]) for row in range(self.rows - 1, -1, -1)]

    def lines(self):
        """The picture as strings of equal length, the top one first."""
        return ["".join([chr(_BLANK + cell) for cell in line]) for line in self.cells()]


class View:
    """Where a piece of the world, in metres, lies on a Braille: one scale for both axes."""

    def __init__(self, raster, centre_x_m, centre_y_m, dots_per_m):
        self.raster = raster
        self.dots_per_m = dots_per_m
        self._left = raster.width / 2 - 0.5 - centre_x_m * dots_per_m
        self._bottom = raster.height / 2 - 0.5 - centre_y_m * dots_per_m

    @classmethod
    def fit(cls, raster, bounds, zoom=1.0, centre=None):
        """The view that shows bounds (x_min, y_min, x_max, y_max) whole, enlarged by zoom about centre."""
        x_min, y_min, x_max, y_max = bounds
        scale = min((raster.width - 3) / max(x_max - x_min, 0.1), (raster.height - 3) / max(y_max - y_min, 0.1))
        x_m, y_m = centre or ((x_min + x_max) / 2, (y_min + y_max) / 2)
        return cls(raster, x_m, y_m, max(scale, 0.01) * zoom)

    def dots(self, x_m, y_m):
        return self._left + x_m * self.dots_per_m, self._bottom + y_m * self.dots_per_m

    def cell(self, x_m, y_m):
        """(column, row counted from the top) of a point, or None outside the picture."""
        x, y = self.dots(x_m, y_m)
        column, row = math.floor(x + 0.5) >> 1, self.raster.rows - 1 - (math.floor(y + 0.5) >> 2)
        return (column, row) if 0 <= column < self.raster.columns and 0 <= row < self.raster.rows else None

    def dot(self, x_m, y_m):
        x, y = self.dots(x_m, y_m)
        self.raster.dot(math.floor(x + 0.5), math.floor(y + 0.5))

    def line(self, x0_m, y0_m, x1_m, y1_m):
        self.raster.line(*self.dots(x0_m, y0_m), *self.dots(x1_m, y1_m))

    def polygon(self, vertices):
        for (x0, y0), (x1, y1) in zip(vertices, list(vertices[1:]) + [vertices[0]]):
            self.line(x0, y0, x1, y1)


def _clip(x0, y0, x1, y1, x_max, y_max):
    """Liang-Barsky against (-0.5, -0.5, x_max, y_max): a far end costs no far dots."""
    t0, t1 = 0.0, 1.0
    dx, dy = x1 - x0, y1 - y0
    for p, q in ((-dx, x0 + 0.5), (dx, x_max - x0), (-dy, y0 + 0.5), (dy, y_max - y0)):
        if p == 0:
            if q < 0:
                return None
            continue
        t = q / p
        if p < 0:
            t0 = max(t0, t)
        else:
            t1 = min(t1, t)
        if t0 > t1:
            return None
    return x0 + t0 * dx, y0 + t0 * dy, x0 + t1 * dx, y0 + t1 * dy
