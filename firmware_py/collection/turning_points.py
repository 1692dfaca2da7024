# Where the direction changes: a point of the path (Paper eq. 5), and with it a fix.

from ..storage.point_ring import CONVEX, CONCAVE, SHORT
from .states import CORNER_IN, CORNER_OUT, FOLLOW, SELECT

_FIX_MM = const(100)         # two fixes are at least that far apart
_FIX_EVERY_MM = const(1500)
_NONE = const(-1)
_STOP = const(-2)            # the end of a way: it turns there, and no wall has a corner


class TurningPoints:
    # visit(state, path_mm): each step while the robot drives. `between`: a fix each 1.5 m besides.
    # Writes the ring of points. Allocates nothing after __init__.

    def __init__(self, points, walls, here):
        self.between = 0
        self._points = points
        self._walls = walls
        self._here = here
        self._fix_mm = 0
        self._corners = 0
        self._state = 0

    def visit(self, state, path_mm):
        here = self._here
        far = path_mm - self._fix_mm
        kind = _NONE
        if state != self._state:
            if state == CORNER_IN:
                kind = CONVEX
            elif state == CORNER_OUT:
                kind = CONCAVE
            elif state == SELECT:
                kind = _STOP
            self._state = state
        if self._walls.corners != self._corners:
            self._corners = self._walls.corners
            if kind == _NONE and state == FOLLOW:
                kind = SHORT
        if kind >= 0:
            self._points.add(here.x_mm // 5, here.y_mm // 5, here.heading_bam, kind)
        if (kind != _NONE and far > _FIX_MM) or (far > _FIX_EVERY_MM and self.between):
            self._fix_mm = path_mm
            here.fix()
