# Combined localisation (Paper section 2): dead reckoning, replaced by UWB where they disagree, or both in one filter.

from ..fixed import isqrt, wrap
from .ekf import Ekf, X, Y, HEADING, DRIFT, TRACK, AXIS
from .manhattan import Manhattan
from .shadowing import Shadowing
from .two_fixes import TwoFixes
from .uwb import SLACK

_LEASH_MM = const(8000)        # the frame's anchor stays that near, fix or no fix
_WAY_MM = const(150)           # the filter moves on after so much way, or turn, or so many reports
_TURN_BAM = const(5000)
_REPORTS = const(10)
_APART_STATIC_MM = const(1500) # one fix each so much, where the ranges' errors are a field of the place
_SIDE_MIN = const(1229)        # a transmitter so steep overhead tells nothing of the place, Q12
_FAR_MM = const(30000)
_UNIT = const(10240000)        # half mm squared times information of uwb.py
_CHORD_VARIANCE = const(12000) # of the direction of a chord of wall, BAM^2
_GATE = const(40)              # 2.5 deviations
_SLACK_MAX_MM = const(2000)
_WALL = const(80)              # half mm: what a wall of the map is known to, in its own frame
_GATE_WALL = const(48)
_MISLED_MAX = const(8)
_LAP = const(3600)             # (30 mm)^2: where a lap's end meets its beginning


class Localization:
    # The estimate is the odometry's pose seen through `frame` (odometry -> map), which alone is corrected: what steers never jumps.
    #   update(values, first): each step, after the odometry
    #   fix(): at a turning point: the replacement rule. Position: where the deviation exceeds fix_mm.
    #   Heading: the direction between two fixes against that of dead reckoning, beyond fix_bam.
    #   wall(x, y): a hit of the mapping beam, mm of the odometry frame; met(landmarks): a wall of the map again;
    #   closed(dx, dy): the beginning of the lap again; restart(...): after a kidnapping
    # With `filtered` the filter takes the rule's place: each 15 cm it weighs dead reckoning, ranges and the direction of
    # walls (`aligned`) against each other; what it learns of the wheels (`calibrate`) it tells the odometry.
    # adrift: fixes are too uncertain to bound the error. x_mm, y_mm, heading_bam: the estimate after the last step.

    def __init__(self, odometry, uwb, frame):
        self.x_mm = 0
        self.y_mm = 0
        self.heading_bam = 0
        self.turn_bam = 0       # the same, unwrapped
        self.fixes = 0
        self.replaced = 0
        self._odometry = odometry
        self._uwb = uwb
        self._frame = frame
        self._fix_mm = self._fix_bam = 0
        self._two = TwoFixes()
        self._ekf = Ekf()
        self._filtered = 0
        self.due = 0            # which piece of the filter's work is next: 1, the fix
        self._was_x = 0         # where it has last moved on
        self._was_y = 0
        self._was_turn = 0
        self._was_path = 0
        self._fixed_mm = 0
        self._drift = 0         # what the odometry is calibrated by
        self._track = 0
        self._aligned = 0
        self._manhattan = Manhattan()
        self._shadowing = Shadowing()
        self.adrift = 0
        self._misled = 0

    def begin(self, fix_mm, fix_bam, weighted, filtered=0, calibrate=0, aligned=0, learn=0):
        self._two.weighted = weighted
        self._fix_mm = fix_mm
        self._fix_bam = fix_bam
        self._filtered = filtered
        self._aligned = filtered and aligned
        self._ekf.begin(calibrate)
        self.adrift = self._uwb.static
        if self.adrift:
            self._shadowing.begin(self._uwb.gamma, self._uwb.sigma_cdb, learn)
        self._begin()

    def restart(self, place, askew):
        # Carried elsewhere, where the odometry has begun anew, known to these variances.
        self._ekf.restart(place, askew)
        self._manhattan.waiting = False
        self.due = 0
        self._misled = 0
        self._begin()

    def _begin(self):
        o = self._odometry
        f = self._frame
        f.from_x = f.to_x = o.x_um // 1000
        f.from_y = f.to_y = o.y_um // 1000
        f.rotate(0)
        self._was_turn = o.turn_bam
        self._was_path = o.path_mm
        self._follow()
        self._was_x = self.x_mm
        self._was_y = self.y_mm

    def update(self, values, first):
        self._follow()
        uwb = self._uwb
        if values[first] > 0 and not uwb.static:
            uwb.add(values, first, self.x_mm, self.y_mm)
        elif values[first] > 0 and self._odometry.path_mm - self._fixed_mm > _APART_STATIC_MM:
            self._fixed_mm = self._odometry.path_mm
            uwb.add(values, first, self.x_mm, self.y_mm)
        elif uwb.waiting and uwb.static:
            self._hear()
        elif uwb.waiting:
            uwb.work()
        elif self._filtered:
            self._filter()

    def _filter(self):
        # One piece of the filter's work a tick: first what dead reckoning did, then what was measured.
        o = self._odometry
        if self.due == 0:
            way = o.path_mm - self._was_path
            turn = o.turn_bam - self._was_turn
            if way < _WAY_MM and -_TURN_BAM < turn < _TURN_BAM and (way < 10 or self._uwb.reports < _REPORTS):
                return
            self._ekf.move(self.x_mm - self._was_x, self.y_mm - self._was_y, min(way, 1000), max(-32768, min(turn, 32767)))
            self._was_x = self.x_mm
            self._was_y = self.y_mm
            self._was_path = o.path_mm
            self._was_turn = o.turn_bam
            if not self._uwb.static:
                self.due = 1
            elif self._manhattan.waiting:
                self.due = 2
        elif self.due == 1:
            self.due = 2 if self._manhattan.waiting else 0
            self._position()
        else:
            self.due = 0
            self._align()

    def _position(self):
        # The sums of the reports as two numbers that err independently of each other, first what is known better.
        uwb = self._uwb
        s = uwb.scope
        a = s[0]
        b = s[1]
        c = s[2]
        p = s[3]
        q = s[4]
        unit = _UNIT
        uwb.clear()
        while a > 8191 or c > 8191 or p > 32767 or p < -32768 or q > 32767 or q < -32768:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
            unit >>= 1
        x = X
        y = Y
        if a < c:
            x = Y
            y = X
            n = a
            a = c
            c = n
            n = p
            p = q
            q = n
        if a < 1:
            return
        self.fixes = (self.fixes + 1) & 0xFFFF
        ekf = self._ekf
        rho = (b << 12) // a
        ekf.correct(x, y, rho, (p << 5) // a, unit // a, 0)
        c -= b * b // a
        if c > 0:
            q = (q - b * p // a << 5) // c - (ekf.rest[y] >> 6)
            ekf.correct(y, x, 0, q, unit // c, 0)
        self._apply()

    def _hear(self):
        # One transmitter of a report that was taken 1.5 m after the last one.
        uwb = self._uwb
        if not uwb.next(self.x_mm, self.y_mm):
            return
        i = X if abs(uwb.dx_mm) >= abs(uwb.dy_mm) else Y  # 0 or 1
        j = Y - i
        x = uwb.dy_mm if i else uwb.dx_mm
        y = uwb.dx_mm if i else uwb.dy_mm
        side = (x << 12) // uwb.far_mm  # of the way to the transmitter
        if -_SIDE_MIN < side < _SIDE_MIN:
            return
        rho = (y << 12) // x
        s = self._shadowing
        if s.look(uwb.anchor, uwb.loss_cdb, uwb.far_mm, self._ekf.unsure(i, j, rho) * abs(side) >> 13):
            sigma = min((s.sigma_mm << 13) // abs(side), 8191)
            self._ekf.correct(i, j, rho, (max(-_FAR_MM, min(s.z_mm, _FAR_MM)) << 14) // (side >> 3), sigma * sigma, 0)
            self.fixes = (self.fixes + 1) & 0xFFFF
            self._apply()

    def _apply(self):
        ekf = self._ekf
        o = self._odometry
        f = self._frame
        f.move(o.x_um // 1000, o.y_um // 1000)
        dx = ekf.taken(X, 11)
        dy = ekf.taken(Y, 11)
        f.to_x += dx
        f.to_y += dy
        f.rotate(f.turn_bam + ekf.taken(HEADING, 10))
        self._was_x += dx
        self._was_y += dy
        self._manhattan.axis_bam += ekf.taken(AXIS, 10)
        self._drift = max(-2000, min(self._drift + ekf.taken(DRIFT, 10), 2000))
        self._track = max(-2000, min(self._track + ekf.taken(TRACK, 10), 2000))
        o.calibrate(self._drift, self._track)
        p = ekf.p
        self._uwb.scope[SLACK] = min(isqrt(p[0] + p[7]) * 3 // 2, _SLACK_MAX_MM)
        self._follow()

    def unsure(self):
        # Whether a wall of the map may tell more than is known.
        p = self._ekf.p
        return self.adrift or p[0] > _WALL * _WALL or p[7] > _WALL * _WALL

    def met(self, wall):
        # A wall of the map was met again (landmarks.py). Who is contradicted again and again was misled himself.
        ekf = self._ekf
        i = X if abs(wall.nx) >= abs(wall.ny) else Y
        j = Y - i
        nx = wall.ny if i else wall.nx
        ny = wall.nx if i else wall.ny
        rho = (ny << 12) // nx
        if not self.adrift and self._ekf.unsure(i, j, rho) < _WALL:
            return
        noise = (_WALL << 12) // abs(nx)
        if ekf.correct(i, j, rho, (-wall.off_mm << 17) // nx, noise * noise, _GATE_WALL):
            self._misled = max(self._misled - 2, 0)
            self._apply()
        else:
            self._misled += 1
            if self._misled > _MISLED_MAX:
                self._misled = 0
                ekf.doubt()

    def closed(self, dx_mm, dy_mm):
        # The end of a lap met its beginning: here the map has just been moved by so much.
        if self._filtered and (dx_mm or dy_mm):
            self._ekf.correct(X, Y, 0, dx_mm << 5, _LAP, 0)
            self._ekf.correct(Y, X, 0, (dy_mm << 5) - (self._ekf.rest[Y] >> 6), _LAP, 0)
            self._apply()

    def wall(self, x, y):
        if self._aligned:
            self._manhattan.add(x, y)

    def _align(self):
        # The walls' axis is one more state of the filter: what it is off by and what the heading is are told apart by
        # all that is known of both. A new axis begins as uncertain as the heading that it was seen with.
        m = self._manhattan
        off = m.off(m.chord_bam + self._frame.turn_bam)
        if off < 32767 and self._ekf.correct(HEADING, AXIS, -4096, -off << 4, _CHORD_VARIANCE, _GATE):
            m.match()
            self._apply()
        elif m.miss():
            self._ekf.tie(AXIS, HEADING, 2 * _CHORD_VARIANCE)

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
        self.turn_bam = o.turn_bam + wrap(f.turn_bam)

    def fix(self):
        uwb = self._uwb
        if self._filtered or not uwb.solve():
            return
        self.fixes = (self.fixes + 1) & 0xFFFF
        o = self._odometry
        f = self._frame
        f.move(o.x_um // 1000, o.y_um // 1000)
        dx = uwb.dx_mm
        dy = uwb.dy_mm
        turn = self._two.turn(self.x_mm, self.y_mm, dx, dy, uwb.variance_mm2)
        if turn > self._fix_bam or turn < -self._fix_bam:
            f.rotate(f.turn_bam + turn)
        if dx * dx + dy * dy > self._fix_mm * self._fix_mm:
            self.replaced = (self.replaced + 1) & 0xFFFF
            f.to_x += dx
            f.to_y += dy
            uwb.shift(dx, dy)
            self._two.shift(dx, dy)
        self._follow()
