# Where the robot has been along the wall that it follows: how a loop is recognised.

from array import array
from ..fixed import int16, sine, cosine
from ..limits import CRUMBS_MAX

_SPACING_MM = const(250)
_LOOK = const(4)               # crumbs compared a tick: each of 128 comes round in 0.64 s = 19 cm
_HEADING_BAM = const(3641)     # 20 degrees
_TURN_BAM = const(7282)        # 40 degrees of a whole turn
_REACH_MM = const(400)         # less than a door is wide: a room off a corridor winds +360 degrees from jamb to jamb
_OUTLINE_MM = const(4000)
_ISLAND_MM = const(1200)       # a chair leg is 1.6 m round

OPEN = 0
OUTLINE_CLOSED = 1      # winding +360: the wall encloses the robot
ISLAND_CLOSED = 2       # winding -360: the robot went round it


class Breadcrumbs:
    # One crumb every 25 cm: x, y int16 in 5 mm of the MAP frame, heading u8 (turn / 256), winding
    # int16 (turn / 256), vector u16 (records stored when it was dropped). Crumb i lies i spacings along the
    # way, islands that were cut out left aside. Full: every second crumb goes and the spacing doubles; `lost`
    # counts them. Cleared at the start of each barrier. Allocates in __init__ only. Written by Outline.

    RECORD_BYTES = 9
    CAPACITY = CRUMBS_MAX

    def __init__(self):
        self._xs = array("h", bytes(2 * CRUMBS_MAX))
        self._ys = array("h", bytes(2 * CRUMBS_MAX))
        self.turns = array("h", bytes(2 * CRUMBS_MAX))
        self.vectors = array("H", bytes(2 * CRUMBS_MAX))
        self._headings = bytearray(CRUMBS_MAX)
        self.used = 0
        self.lost = 0
        self.closed_at = 0
        self.reach_mm = 0       # how far along the way the crumb that closed may be off
        self.start_mm = 0
        self._spacing_mm = _SPACING_MM
        self._origin_mm = 0     # path of crumb 0, had no island been cut out
        self._along_mm = 0      # of the robot, from there
        self._start_turn = 0
        self._cursor = 0

    def clear(self, path_mm, turn_bam):
        self.used = 0
        self._spacing_mm = _SPACING_MM
        self.start_mm = path_mm
        self._origin_mm = path_mm
        self._start_turn = turn_bam
        self._cursor = 0

    def visit(self, x_mm, y_mm, heading_bam, turn_bam, path_mm, vectors, tolerance_mm):
        # Called each tick: drops a crumb when due, and looks at a few old ones.
        # -> OPEN, OUTLINE_CLOSED or ISLAND_CLOSED with the crumb in closed_at.
        turn = (turn_bam - self._start_turn) >> 8
        far_mm = path_mm - self._origin_mm
        self._along_mm = far_mm
        if far_mm >= self.used * self._spacing_mm:
            self._drop(x_mm, y_mm, heading_bam, turn, vectors)
        reach_mm = self._spacing_mm * 6 // 10  # along the way a crumb may be half a spacing off
        if reach_mm > _REACH_MM:
            reach_mm = _REACH_MM
        if reach_mm < tolerance_mm:
            reach_mm = tolerance_mm
        self.reach_mm = reach_mm
        n = self.used if self.used < _LOOK else _LOOK
        while n:
            n -= 1
            i = self._cursor
            self._cursor = i + 1 if i + 1 < self.used else 0
            wound = turn - self.turns[i]
            if 228 < wound < 284:
                length = _OUTLINE_MM
            elif -284 < wound < -228:
                length = _ISLAND_MM
            else:
                continue
            if far_mm - i * self._spacing_mm < length:
                continue
            d = ((heading_bam >> 8) - self._headings[i] + 128 & 255) - 128
            if d > 14 or d < -14:
                continue
            dx = x_mm - self._xs[i] * 5
            dy = y_mm - self._ys[i] * 5
            if dx > 4000 or dx < -4000 or dy > 4000 or dy < -4000:
                continue
            c = cosine(heading_bam)
            s = sine(heading_bam)
            along = dx * c + dy * s >> 15
            across = dy * c - dx * s >> 15
            if -reach_mm <= along <= reach_mm and -tolerance_mm <= across <= tolerance_mm:
                self.closed_at = i
                return OUTLINE_CLOSED if wound > 0 else ISLAND_CLOSED
        return OPEN

    def loop_mm(self):
        # Length of the loop that closed.
        return self._along_mm - self.closed_at * self._spacing_mm

    def excise(self):
        # Forget the loop that closed (-360 degrees of winding): the robot stands where it began.
        self._origin_mm += self.loop_mm()
        self.used = self.closed_at + 1
        self._cursor = 0
        self._start_turn -= 65536

    def _drop(self, x_mm, y_mm, heading_bam, turn, vectors):
        if self.used == CRUMBS_MAX:
            for i in range(CRUMBS_MAX // 2):
                self._xs[i] = self._xs[2 * i]
                self._ys[i] = self._ys[2 * i]
                self.turns[i] = self.turns[2 * i]
                self.vectors[i] = self.vectors[2 * i]
                self._headings[i] = self._headings[2 * i]
            self.used = CRUMBS_MAX // 2
            self.lost = (self.lost + CRUMBS_MAX // 2) & 0xFFFF
            self._spacing_mm *= 2
            self._cursor = 0
        i = self.used
        self._xs[i] = int16(x_mm // 5)
        self._ys[i] = int16(y_mm // 5)
        self.turns[i] = int16(turn)
        self.vectors[i] = vectors
        self._headings[i] = heading_bam >> 8
        self.used = i + 1
