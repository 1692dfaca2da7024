# The inside barriers (Paper 3.2): places where something stands that is not on the map.

from array import array
from ..limits import BARRIERS_MAX

_APART = const(60)      # 30 cm: nearer is the same barrier

UNSEARCHED = 0
SEARCHED = 2            # or unreachable, twice tried


class BarrierList:
    # x, y int16 in map units of 5 mm, mark u8: tries, SEARCHED from 2 on. Newest at the end.
    # going: the one that the robot goes to, -1: none. It keeps its number while others make room.
    # Full: a searched one makes room; if there is none, the new one is refused and counted in `lost`.
    # Allocates in __init__ only. Written by Search.

    RECORD_BYTES = 5
    CAPACITY = BARRIERS_MAX

    def __init__(self):
        self.xs = array("h", bytes(2 * BARRIERS_MAX))
        self.ys = array("h", bytes(2 * BARRIERS_MAX))
        self.marks = bytearray(BARRIERS_MAX)
        self.used = 0
        self.lost = 0
        self.going = -1

    def add(self, x, y):
        # -> whether it is a new one
        spare = -1
        for i in range(self.used):
            dx = self.xs[i] - x
            dy = self.ys[i] - y
            if -_APART < dx < _APART and -_APART < dy < _APART:
                return False
            if self.marks[i] >= SEARCHED and spare < 0 and i != self.going:
                spare = i
        if not -32768 <= x <= 32767 or not -32768 <= y <= 32767:
            return False
        if self.used == BARRIERS_MAX:
            if spare < 0:
                self.lost = self.lost + 1 & 0xFFFF
                return False
            self.drop(spare)
        i = self.used
        self.used = i + 1
        self.xs[i] = x
        self.ys[i] = y
        self.marks[i] = UNSEARCHED
        return True

    def drop(self, i):
        # The others keep their order, that of finding.
        if i < self.going:
            self.going -= 1
        self.used -= 1
        while i < self.used:
            self.xs[i] = self.xs[i + 1]
            self.ys[i] = self.ys[i + 1]
            self.marks[i] = self.marks[i + 1]
            i += 1

    def nearest(self, x, y):
        # -> the nearest unsearched one, -1: none is left
        best = -1
        least = 1 << 29
        for i in range(self.used):
            if self.marks[i] < SEARCHED:
                dx = self.xs[i] - x >> 2
                dy = self.ys[i] - y >> 2
                far = dx * dx + dy * dy  # 80 m apart at most: what is farther is as good as any
                if far <= least:
                    least = far
                    best = i
        return best
