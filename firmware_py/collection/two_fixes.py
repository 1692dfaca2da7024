# The heading from the direction between two fixes (Paper section 2: theta_g), for the replacement rule.

from ..fixed import isqrt

_BASELINE_MM = const(2500)     # between the two fixes that a heading is taken from (the paper: 0.5 m)
_PAPER_BASELINE_MM = const(500)
_BASELINE_MAX_MM = const(12000)
_APART_MM = const(20000)       # more between two fixes is no turn
_DRIFT = const(9000)           # 1 / (0.6 degrees in radians) squared: how far dead reckoning's heading is off by then


class TwoFixes:
    # turn(x, y, dx, dy, variance_mm2): at (x, y) of the estimate a fix lies (dx, dy) from it -> by how much (BAM) the fixes' direction
    #   since the older one differs from that of dead reckoning; 0 when the way between is too short, or too long.
    # shift(dx, dy): the estimate was replaced. weighted: the turn counts by the accuracy of fixes and of dead reckoning.

    def __init__(self):
        self.weighted = True
        self._marked = False
        self._mark_x = 0        # estimate, and what was left of the deviation, at the older fix
        self._mark_y = 0
        self._mark_dx = 0
        self._mark_dy = 0

    def turn(self, at_x, at_y, dx, dy, variance_mm2):
        x = at_x - self._mark_x
        y = at_y - self._mark_y
        ex = dx - self._mark_dx
        ey = dy - self._mark_dy
        turn = 0
        if self._marked and -_BASELINE_MAX_MM < x < _BASELINE_MAX_MM and -_BASELINE_MAX_MM < y < _BASELINE_MAX_MM:
            length = isqrt(x * x + y * y)
            if length < (_BASELINE_MM if self.weighted else _PAPER_BASELINE_MM):
                return 0
            if -_APART_MM < ex < _APART_MM and -_APART_MM < ey < _APART_MM:
                turn = ((x * ey - y * ex) // length) * 10430 // length
                if self.weighted:
                    # Each by its own accuracy: the direction's variance is that of two fixes over the length squared.
                    drift = length * length // _DRIFT + 1
                    turn = turn * drift // (drift + 2 * variance_mm2)
        self._marked = True
        self._mark_x = at_x
        self._mark_y = at_y
        self._mark_dx = dx
        self._mark_dy = dy
        return turn

    def shift(self, dx, dy):
        # The older fix in the same frame, so that only the turn is left between.
        self._mark_x += dx
        self._mark_y += dy
        self._mark_dx -= dx
        self._mark_dy -= dy
