# Combined localisation (Paper section 2): dead reckoning, replaced by UWB where they disagree.

from ..fixed import isqrt

_BASELINE_MM = const(2500)     # between the two fixes that a heading is taken from (the paper: 0.5 m)
_BASELINE_MAX_MM = const(12000)
_LEASH_MM = const(8000)        # the frame's anchor stays that near, fix or no fix
_APART_MM = const(20000)       # more between two fixes is no turn
_DRIFT = const(9000)           # 1 / (0.6 degrees in radians) squared: how far dead reckoning's heading is off by then


class Localization:
    # The estimate is the odometry's pose seen through `frame` (odometry -> map), which alone is corrected:
    # what steers by odometry never sees a jump.
    #   update(values, first): each step, after the odometry
    #   fix(): at a turning point: the replacement rule. Position: where the deviation exceeds fix_mm.
    #   Heading: the direction between two fixes against that of dead reckoning, beyond fix_bam.
    # x_mm, y_mm, heading_bam: the estimate after the last step.

    def __init__(self, odometry, uwb, frame):
        self.x_mm = 0
        self.y_mm = 0
        self.heading_bam = 0
        self.fixes = 0
        self.replaced = 0
        self._odometry = odometry
        self._uwb = uwb
        self._frame = frame
        self._weighted = True
        self._fix_mm = 20
        self._fix_bam = 182
        self._marked = False
        self._mark_x = 0        # estimate, and what was left of the deviation, at the older fix
        self._mark_y = 0
        self._mark_dx = 0
        self._mark_dy = 0

    def begin(self, fix_mm, fix_bam, weighted):
        self._weighted = weighted
        self._fix_mm = fix_mm
        self._fix_bam = fix_bam
        o = self._odometry
        f = self._frame
        f.from_x = f.to_x = o.x_um // 1000
        f.from_y = f.to_y = o.y_um // 1000
        f.rotate(0)
        self._follow()

    def update(self, values, first):
        self._follow()
        if values[first] > 0:
            self._uwb.add(values, first, self.x_mm, self.y_mm)
        elif self._uwb.waiting:
            self._uwb.work()

    def _follow(self):
        o = self._odometry
        f = self._frame
        x = o.x_um // 1000
        y = o.y_um // 1000
        f.put(x, y)
        x -= f.from_x
        y -= f.from_y
        if x > _LEASH_MM or x < -_LEASH_MM or y > _LEASH_MM or y < -_LEASH_MM:
            f.move(x + f.from_x, y + f.from_y)
        self.x_mm = f.x
        self.y_mm = f.y
        self.heading_bam = (o.heading_bam + f.turn_bam) & 0xFFFF

    def fix(self):
        uwb = self._uwb
        if not uwb.solve():
            return
        self.fixes = (self.fixes + 1) & 0xFFFF
        o = self._odometry
        f = self._frame
        f.move(o.x_um // 1000, o.y_um // 1000)
        dx = uwb.dx_mm
        dy = uwb.dy_mm
        self._turn(dx, dy)
        if dx * dx + dy * dy > self._fix_mm * self._fix_mm:
            self.replaced = (self.replaced + 1) & 0xFFFF
            f.to_x += dx
            f.to_y += dy
            uwb.shift(dx, dy)
            self._mark_x += dx   # the older fix in the same frame, so that only the turn is left between
            self._mark_y += dy
            self._mark_dx -= dx
            self._mark_dy -= dy
        self._follow()

    def _turn(self, dx, dy):
        # Angle between (mark -> here) by dead reckoning and by the fixes.
        if not self._marked:
            self._mark(dx, dy)
            return
        x = self.x_mm - self._mark_x
        y = self.y_mm - self._mark_y
        if not (-_BASELINE_MAX_MM < x < _BASELINE_MAX_MM and -_BASELINE_MAX_MM < y < _BASELINE_MAX_MM):
            self._mark(dx, dy)
            return
        length = isqrt(x * x + y * y)
        if length < _BASELINE_MM:
            return
        ex = dx - self._mark_dx
        ey = dy - self._mark_dy
        if not (-_APART_MM < ex < _APART_MM and -_APART_MM < ey < _APART_MM):
            self._mark(dx, dy)
            return
        turn = ((x * ey - y * ex) // length) * 10430 // length
        if self._weighted:
            # Each by its own accuracy: the direction's variance is that of two fixes over the length squared.
            drift = length * length // _DRIFT + 1
            turn = turn * drift // (drift + 2 * self._uwb.variance_mm2)
        if turn > self._fix_bam or turn < -self._fix_bam:
            self._frame.rotate(self._frame.turn_bam + turn)
        self._mark(dx, dy)

    def _mark(self, dx, dy):
        self._marked = True
        self._mark_x = self.x_mm
        self._mark_y = self.y_mm
        self._mark_dx = dx
        self._mark_dy = dy
