# After a kidnapping: where the robot is by UWB alone, and by a short drive which way it looks.

from ..fixed import isqrt, polar
from ..limits import ANCHORS_MAX
from .follower import BOXED_IN, LINEAR
from .uwb import PRIOR, SLACK

_FAR_MM = const(8000)          # while it is sought, no range that differs by less is an outlier
_NEAR_MM = const(300)          # when it is found, most are within that
_STEP_MM = const(2000)
_MOST_MM = const(500000)       # as the parameters have it
_SETTLED_MM = const(150)       # an iteration that moves less has come to its end
_ROUNDS_MIN = const(8)         # the robot has come to rest by then, too
_ROUNDS_MAX = const(40)
_REPORTS = const(16)           # averaged for a fix
_DOUBTS = const(8)             # that many of them against it: it is none
_WAY_MM = const(500)           # between the two fixes that tell the heading
_STRETCH_MM = const(250)       # the two must be as far apart, give or take so much
_BESIDE_MM = const(20)
_ROUND_BAM = const(20000)
_LEG_TICKS = const(400)        # 8 s without having got so far: another way
_PATIENCE_TICKS = const(3000)  # 60 s
_VARIANCE_MAX = const(4000)    # (63 mm)^2
_FLOOR = const(10000)          # (50 mm)^2 in half mm: what walls may do to all reports alike
_TURN_UNIT = const(217571800)  # 2 (65536 / 2 pi)^2: two fixes
_TURN_FLOOR = const(10000)     # 0.5 degrees

# what step() says
SEEKING = 0
FOUND = 1
GIVEN_UP = 2

# phases
_FIRST = const(0)              # no place is known
_SECOND = const(1)             # the second fix
_DRIVE = const(2)


class Relocation:
    # begin(parameters) once; lose() when the robot has been set down elsewhere; then step() each tick, in the place of localization
    # and explorer, until FOUND: odometry and filter have begun again there, with what is uncertain of it. GIVEN_UP: not within 60 s.
    # A fix is the place that reports of a standing robot lead to by Gauss-Newton, a report a round, from the middle of the
    # strongest transmitters, 2 of them at first, then 3 ...; the next 16 reports are averaged there. The drive turns away from
    # what stands in its way. Writes: the hit ring, motion, and when found the odometry. Allocates in __init__ only.

    def __init__(self, odometry, uwb, localization, hits, infrared, follower, explorer):
        self._odometry = odometry
        self._uwb = uwb
        self._here = localization
        self._hits = hits
        self._infrared = infrared
        self._follower = follower
        self._motion = explorer.motion
        self._bumper = explorer.bumper
        self._phase = _FIRST
        self._ticks = 0
        self._leg_ticks = 0
        self._tries = 0
        self._rounds = -1         # -1: wants a place to begin at
        self._averaging = False
        self._doubts = 0
        self._x_mm = 0            # the place sought
        self._y_mm = 0
        self._from_x = 0          # the first fix, and the odometry there
        self._from_y = 0
        self._was_x = 0
        self._was_y = 0
        self._course_turn = 0
        self._looked_turn = 0
        self._backing = False
        self._prior = 0
        self._table = None
        self._anchors = 0
        self._anchor_x = 0

    def begin(self, parameters):
        self._table = parameters.values
        self._anchors = parameters.of("anchor_count")
        self._anchor_x = parameters.first("anchor_x")
        self._prior = self._uwb.scope[PRIOR]

    def lose(self):
        self._hits.clear()
        self._motion.stop()
        self._uwb.forget()
        self._uwb.scope[PRIOR] = 0
        self._ticks = 0
        self._tries = 0
        self._again()

    def _again(self):
        self._phase = _FIRST
        self._tries += 1
        self._seek(-1)

    def _seek(self, rounds):
        self._motion.stop()
        self._rounds = rounds
        self._averaging = False
        self._uwb.scope[SLACK] = _FAR_MM

    def step(self, values, first, tick, ultrasonic_mm, bump):
        self._ticks += 1
        if self._ticks > _PATIENCE_TICKS:
            self._motion.stop()
            return GIVEN_UP
        if self._phase == _DRIVE:
            self._drive(tick, ultrasonic_mm, bump)
            return SEEKING
        uwb = self._uwb
        if values[first] > 0:
            if self._rounds < 0:
                self._middle(values, first)
            if not self._averaging:
                uwb.clear()
            uwb.add(values, first, self._x_mm, self._y_mm)
        elif uwb.waiting:
            uwb.work()
            if uwb.waiting == 0:
                return self._average() if self._averaging else self._round()
        return SEEKING

    def _middle(self, values, first):
        # Of the strongest transmitters: they come first. Each try takes one more.
        wanted = 1 + self._tries
        n = 0
        x = 0
        y = 0
        for i in range(first + 1, first + 1 + 3 * min(values[first], 15), 3):
            anchor = values[i]
            if 0 <= anchor < self._anchors and n < wanted:
                x += self._table[self._anchor_x + anchor]
                y += self._table[self._anchor_x + ANCHORS_MAX + anchor]
                n += 1
        if n:
            self._x_mm = x // n
            self._y_mm = y // n
            self._rounds = 0

    def _round(self):
        # One report, one step of Gauss-Newton.
        s = self._uwb.scope
        a = s[0]
        b = s[1]
        c = s[2]
        p = s[3]
        q = s[4]
        while a > 4095 or c > 4095:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
        bits = 0
        while p > 100000 or p < -100000 or q > 100000 or q < -100000:
            p >>= 1
            q >>= 1
            bits += 1
        det = a * c - b * b
        x = self._x_mm
        y = self._y_mm
        if det > 64 and det > (a + c) * (a + c) >> 7:
            far = max(-_STEP_MM, min((c * p - b * q) // det, _STEP_MM)) << bits
            x += max(-_STEP_MM, min(far, _STEP_MM))
            far = max(-_STEP_MM, min((a * q - b * p) // det, _STEP_MM)) << bits
            y += max(-_STEP_MM, min(far, _STEP_MM))
            far = max(abs(x - self._x_mm), abs(y - self._y_mm))
        else:
            far = _STEP_MM  # all in one direction
        self._x_mm = max(-_MOST_MM, min(x, _MOST_MM))
        self._y_mm = max(-_MOST_MM, min(y, _MOST_MM))
        self._rounds += 1
        if self._rounds >= _ROUNDS_MIN and far < _SETTLED_MM:
            self._uwb.clear()
            self._uwb.scope[SLACK] = _NEAR_MM
            self._averaging = True
            self._rounds = 0
            self._doubts = 0
        elif self._rounds > _ROUNDS_MAX:
            self._again()
        return SEEKING

    def _average(self):
        uwb = self._uwb
        self._doubts += uwb.contradicted
        self._rounds += 1
        if self._rounds < _REPORTS:
            return SEEKING
        if self._doubts > _DOUBTS or not uwb.solve():
            self._again()  # a place that the ranges lead to, but not the one that they are true for
            return SEEKING
        self._x_mm += uwb.dx_mm
        self._y_mm += uwb.dy_mm
        o = self._odometry
        x = o.x_um // 1000
        y = o.y_um // 1000
        if self._phase == _SECOND:
            return self._settle(x - self._was_x, y - self._was_y)
        self._from_x = self._x_mm
        self._from_y = self._y_mm
        self._was_x = x
        self._was_y = y
        self._phase = _DRIVE
        self._leg_ticks = 0
        self._backing = False
        self._course_turn = self._looked_turn = o.turn_bam
        self._follower.near = 0
        return SEEKING

    def _settle(self, way_x, way_y):
        # Two fixes, and the odometry's way between: how much its frame is turned against the map.
        dx = self._x_mm - self._from_x
        dy = self._y_mm - self._from_y
        far = isqrt(way_x * way_x + way_y * way_y)
        o = self._odometry
        if abs(dx) > 2 * _WAY_MM or abs(dy) > 2 * _WAY_MM or abs(isqrt(dx * dx + dy * dy) - far) > _STRETCH_MM:
            self._again()
            return SEEKING
        o.place(self._x_mm * 1000, self._y_mm * 1000, o.heading_bam + (polar(dx, dy) & 0xFFFF) - (polar(way_x, way_y) & 0xFFFF) & 0xFFFF)
        self._hits.clear()
        self._follower.near = 0
        uwb = self._uwb
        uwb.scope[PRIOR] = self._prior
        uwb.forget()
        variance = min(uwb.variance_mm2 + 1, _VARIANCE_MAX)
        self._here.restart(4 * variance + _FLOOR, _TURN_UNIT // (far * far) * variance + _TURN_FLOOR)
        return FOUND

    def _drive(self, tick, ultrasonic_mm, bump):
        # Straight on, or beside what the beams see there.
        o = self._odometry
        f = self._follower
        motion = self._motion
        x = o.x_um // 1000
        y = o.y_um // 1000
        self._leg_ticks += 1
        if tick & 1:
            f.look(x, y, o.heading_bam, 0)
            self._looked_turn = o.turn_bam
        self._infrared.erase(tick & 7, f, tick)
        x -= self._was_x
        y -= self._was_y
        if x * x + y * y >= _WAY_MM * _WAY_MM:
            self._phase = _SECOND
            self._seek(0)
        elif self._backing:
            self._backing = not self._bumper.back_off()
            self._course_turn = o.turn_bam
        elif bump:
            self._bumper.touch(tick, bump)
            self._bumper.begin()
            self._backing = True
        elif self._leg_ticks % _LEG_TICKS == 0:
            self._hits.clear()
            self._course_turn += _ROUND_BAM
        elif not tick & 1:
            free = f.free(self._course_turn - self._looked_turn, f.body_mm + _BESIDE_MM, LINEAR)
            if free < BOXED_IN:
                self._course_turn = self._looked_turn + free
            motion.head(self._course_turn - o.turn_bam, f.gap_mm, ultrasonic_mm)
