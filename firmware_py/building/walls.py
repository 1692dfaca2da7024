# From hits of the mapping beam to vectors: one sample every 2 cm, split, corner, store.

from .line_fit import LineFit
from ..storage.frame import Frame
from ..storage.vector_store import CONCAVE, LONG, CHAIN_END

_SPACING_MM = const(20)
_TOLERANCE_MM = const(20)     # a sample farther from the line is a misfit; two in a row split it
_JUMP_MM = const(200)         # farther apart: the chain breaks
_BACK_MM = const(25)          # a sample that far back along the line belongs to another face
_CORNER_MM = const(60)        # neighbours are intersected if the corner is that near to both
_PARALLEL_Q14 = const(2845)   # sin 10 degrees


class WallMapper:
    # Samples are in mm of the odometry frame, where no correction jumps; vertices enter
    # the store through the frame that held when their line began.
    #   add(x, y): a hit of the mapping beam;  finish(): the chain ends here.
    # `corners` counts the corners and bends stored so far.

    def __init__(self, store, frame):
        self.line = LineFit()
        self.kind = 0
        self.active = False
        self.corners = 0
        self._store = store
        self._frame = frame
        self._here = Frame()      # frame when the present line began
        self._intersect = 1
        self._misfits = 0
        self._miss_x = 0
        self._miss_y = 0
        self._seen_x = 0          # last sample, fitting or not
        self._seen_y = 0
        self._has_before = False  # the line before the present one, in the same chain
        self._end_x = 0
        self._end_y = 0
        self._cos = 0
        self._sin = 0
        self._sigma = 0

    def begin(self, intersect):
        self._intersect = intersect

    def add(self, x, y):
        line = self.line
        if not self.active:
            self._begin_chain(x, y)
            return
        dx = x - self._seen_x
        dy = y - self._seen_y
        if dx > _JUMP_MM or dx < -_JUMP_MM or dy > _JUMP_MM or dy < -_JUMP_MM:
            self.finish()
            self._begin_chain(x, y)
            return
        spacing = _SPACING_MM if line.n < 200 else 2 * _SPACING_MM
        if dx * dx + dy * dy < spacing * spacing:
            return
        self._seen_x = x
        self._seen_y = y
        if self._fits(x, y) and line.add(x, y):
            self._misfits = 0
            line.solve()
        elif self._misfits == 0:
            self._misfits = 1
            self._miss_x = x
            self._miss_y = y
        else:
            self._misfits = 0
            self._close_line()
            line.begin(self._miss_x, self._miss_y)
            line.add(x, y)
            line.solve()
            self._here.copy(self._frame)

    def finish(self):
        # End of the chain: the last line's end is its last vertex.
        if not self.active:
            return
        self.active = False
        if not self._has_before and self.line.n < 2:
            self._store.cancel_chain()  # one hit is no wall
            return
        self._close_line()
        self._emit(self._end_x, self._end_y, 0, CHAIN_END)
        self._has_before = False
        self._store.cancel_chain()  # a full store took none of it

    def _begin_chain(self, x, y):
        self._store.open_chain(self.kind)
        self.active = True
        self._has_before = False
        self._misfits = 0
        self._seen_x = x
        self._seen_y = y
        self.line.begin(x, y)
        self._here.copy(self._frame)

    def _fits(self, x, y):
        line = self.line
        if line.n < 3:
            return True
        r = line.residual(x, y)
        if r > _TOLERANCE_MM or r < -_TOLERANCE_MM:
            return False
        return line.along(x, y) > line.along(line.last_x, line.last_y) - _BACK_MM

    def _close_line(self):
        # Store the vertex where the present line begins, and remember its end.
        line = self.line
        a = line.along(line.first_x, line.first_y)
        start_x = line.point_x + (a * line.cos_q14 >> 14)
        start_y = line.point_y + (a * line.sin_q14 >> 14)
        if self._has_before:
            self._corner(start_x, start_y)
        else:
            self._emit(start_x, start_y, line.sigma_mm, 0)
        a = line.along(line.last_x, line.last_y)
        self._end_x = line.point_x + (a * line.cos_q14 >> 14)
        self._end_y = line.point_y + (a * line.sin_q14 >> 14)
        self._cos = line.cos_q14
        self._sin = line.sin_q14
        self._sigma = line.sigma_mm
        self._has_before = True

    def _corner(self, start_x, start_y):
        line = self.line
        cross = (self._cos * line.sin_q14 - self._sin * line.cos_q14) >> 14
        flags = CONCAVE if cross < 0 else 0
        dx = start_x - self._end_x
        dy = start_y - self._end_y
        self.corners = self.corners + 1 & 0xFFFF
        if (cross > _PARALLEL_Q14 or cross < -_PARALLEL_Q14) and line.n > 2 and self._intersect:
            t = (dx * line.sin_q14 - dy * line.cos_q14) // cross
            u = (dx * self._sin - dy * self._cos) // cross
            if -_CORNER_MM <= t <= _CORNER_MM and -_CORNER_MM <= u <= _CORNER_MM:
                self._emit(self._end_x + (t * self._cos >> 14), self._end_y + (t * self._sin >> 14),
                           line.sigma_mm, flags)
                return
        elif -_CORNER_MM < dx < _CORNER_MM and -_CORNER_MM < dy < _CORNER_MM:
            self._emit(self._end_x + dx // 2, self._end_y + dy // 2, line.sigma_mm, flags)
            return
        self._emit(self._end_x, self._end_y, self._sigma, flags)
        self._emit(start_x, start_y, line.sigma_mm, flags)

    def _emit(self, x, y, sigma_mm, flags):
        here = self._here
        here.put(x, y)
        x = (here.x + 2) // 5
        y = (here.y + 2) // 5
        store = self._store
        i = store.used - 1
        if i >= 0 and not store.flags[i] & CHAIN_END:
            dx = x - store.xs[i]
            dy = y - store.ys[i]
            if dx > 200 or dx < -200 or dy > 200 or dy < -200 or dx * dx + dy * dy >= 40000:
                store.flags[i] |= LONG
        store.append(x, y, sigma_mm, flags)
