# What is still to be looked at when the outline is known: barriers seen in passing, then places that no sensor has seen.

from ..fixed import polar
from ..limits import CELLS_MAX, CORNERS_MAX
from .states import GOTO, SWEEP
from .traveller import ARRIVED, LOST

_CELL_MM = const(370)          # the beams see 36 cm to the left of the centre and 42 cm to the right
_OFF_MM = const(90)
_NEAR_MM = const(270)          # who rolled along a wall has seen 56 cm from it
_WALL_MM = const(220)          # from the second cell beside a course: so far the two of them see all between
_BODY_MM = const(190)          # to the next wall, straight to a target
_KNOWN_MM = const(130)         # nearer to a vector nothing is new
_TURN_MM = const(300)          # a quarter turn costs as much as that way
_BESIDE_MM = const(120)
_LOOKS = const(40)             # at cells, a tick
_TESTS = const(2)              # of places against the map, a tick
_VISITS_MAX = const(96)        # barriers gone to in one mission
_COARSE_MM = const(550)        # cells from here on hold places that a robot in them does not see

# kind of a target
NOTHING = 0        # all is seen
WAIT = 1           # still looking for one
BARRIER = 2        # something stands there
PLACE = 3          # nobody has been there

# what a way.step() says (building/way.py)
_BUSY = const(0)
_FOUND = const(1)


class Search:
    # Once the outline is closed, select() is called each tick in which the robot stands and waits for something to do: it
    # deals with the target that it came from, chooses the next and sends the explorer there, along the way's corners where
    # there is no straight one. note() takes hits on the way, passing() where the robot is. The cells, squares of 37 cm or
    # more, so that CELLS_MAX bits cover the outline's bounding box; a bit is set when the cell is seen, known to be no
    # free space, or unreachable; `shared`: the bits stand in there behind the way's corners. Allocates in __init__ only.

    def __init__(self, vectors, sight, barriers, way, shared):
        self.barriers = barriers
        self.seen = shared
        self.x_mm = 0
        self.y_mm = 0
        self.sweep = True
        self.kind = WAIT        # of the target
        self._vectors = vectors
        self._sight = sight
        self._way = way
        self._planning = False
        self._on_way = False
        self.cell_mm = 0       # 0: not begun
        self.left_mm = 0
        self.low_mm = 0
        self.columns = 0
        self.rows = 0
        self._target = -1       # barrier or cell that the robot goes to
        self._ring = 0          # how far _place() has searched around the robot
        self._at = 0
        self._best = -1         # cell, what it costs, and the ring after which no more are looked at
        self._least = 0
        self._last_ring = 0
        self.visits = 0
        self._listed = 0        # barrier that _forget() looks at next

    def select(self, explorer, here):
        # -> True when nothing is left
        w = self._way
        if not w.build():
            return False
        if self.cell_mm == 0:
            self.begin()
        if self._planning:
            said = w.step()
            if said != _BUSY:
                self._planning = False
                self._on_way = said == _FOUND
                self._leg(explorer)
            return False
        if self._on_way and explorer.outcome == ARRIVED and self.kind > WAIT and not w.last():
            self._leg(explorer)
            return False
        self._on_way = False
        self.finish(explorer.outcome != LOST)
        explorer.outcome = ARRIVED
        kind = self.next(here.x_mm, here.y_mm, here.heading_bam)
        if kind > WAIT:
            if self._sight.clear(here.x_mm, here.y_mm, self.x_mm, self.y_mm, _BODY_MM):
                self._leg(explorer)
            else:
                w.begin(here.x_mm, here.y_mm, self.x_mm, self.y_mm)
                self._planning = True
        return kind == NOTHING

    def _leg(self, explorer):
        # To the next corner of the way, or to the target itself.
        wall = self.kind == BARRIER
        state = GOTO if wall else SWEEP
        if self._on_way:
            w = self._way
            w.next()
            explorer.go_to(w.x_mm, w.y_mm, wall and w.last(), state)
        else:
            explorer.go_to(self.x_mm, self.y_mm, wall, state)

    def begin(self):
        v = self._vectors
        x0 = y0 = 32767
        x1 = y1 = -32768
        for i in range(v.used):
            x = v.xs[i]
            y = v.ys[i]
            if x < x0:
                x0 = x
            if x > x1:
                x1 = x
            if y < y0:
                y0 = y
            if y > y1:
                y1 = y
        cell = _CELL_MM
        while (5 * (x1 - x0) // cell + 1) * (5 * (y1 - y0) // cell + 1) > CELLS_MAX:
            cell += 10
        self.cell_mm = cell
        self.left_mm = 5 * x0
        self.low_mm = 5 * y0
        self.columns = 5 * (x1 - x0) // cell + 1
        self.rows = 5 * (y1 - y0) // cell + 1

    def note(self, x_mm, y_mm, explorer):
        # A hit that may be of something unknown: who is only on his way to a place looks at it first.
        if self._known(x_mm, y_mm, _KNOWN_MM) or not self._sight.inside(x_mm, y_mm):
            return
        if explorer.mapping:
            self._forget()
        if self.barriers.add(x_mm // 5, y_mm // 5) and self.kind == PLACE and not explorer.mapping:
            self.kind = WAIT
            explorer.halt()

    def _forget(self):
        # Who follows a barrier sees it far ahead, place by place: one of the list a call that is on the map by now makes room. Dropped, not
        # searched: should the barrier be given up, it is seen anew.
        b = self.barriers
        i = self._listed = self._listed + 1 if self._listed + 1 < b.used else 0
        if i < b.used and i != b.going and b.marks[i] == 0 and self._known(b.xs[i] * 5, b.ys[i] * 5, _KNOWN_MM - 30):
            b.drop(i)

    def passing(self, here):
        # The cell that the robot is in, and from its middle the two beside its course.
        cell = self.cell_mm
        i = (here.x_mm - self.left_mm) // cell
        j = (here.y_mm - self.low_mm) // cell
        self._mark(i, j)
        if (here.heading_bam + 8192) & 0x4000:  # nearer to the y axis
            off = here.x_mm - self.left_mm - i * cell - cell // 2
            if -_OFF_MM < off < _OFF_MM:
                self._mark_half(i, j, 1, 0)
                self._mark_half(i, j, -1, 0)
        else:
            off = here.y_mm - self.low_mm - j * cell - cell // 2
            if -_OFF_MM < off < _OFF_MM:
                self._mark_half(i, j, 0, 1)
                self._mark_half(i, j, 0, -1)

    def _mark_half(self, i, j, di, dj):
        # Of the cell beside the course the near half is seen. The next lane, behind it, will see the other, or a wall there
        # was rolled along; if all is seen behind it without a wall, there may be no such lane.
        if self._is_seen(i + di, j + dj):
            return
        i += 2 * di
        j += 2 * dj
        if self._is_seen(i, j):
            cell = self.cell_mm
            if not self._known(self.left_mm + i * cell + cell // 2, self.low_mm + j * cell + cell // 2, _WALL_MM):
                return
        self._mark(i - di, j - dj)

    def next(self, x_mm, y_mm, heading_bam):
        # -> WAIT, BARRIER, PLACE or NOTHING
        b = self.barriers
        i = b.nearest(x_mm // 5, y_mm // 5)
        if i >= 0 and self.visits < _VISITS_MAX:
            self.x_mm = b.xs[i] * 5
            self.y_mm = b.ys[i] * 5
            if self._known(self.x_mm, self.y_mm, _KNOWN_MM - 30):
                b.marks[i] = 2  # on the map by now
                return WAIT
            self.visits += 1
            b.going = i
            return self._go(BARRIER, i)
        if not self.sweep:
            return NOTHING
        return self._place(x_mm, y_mm, heading_bam)

    def _place(self, x_mm, y_mm, heading_bam):
        # The unseen free cells, ring by ring around the robot; of the first ring that has any, and the next, the one that
        # costs least: near, ahead, and beside what is seen, so that no strip is left.
        cell = self.cell_mm
        column = (x_mm - self.left_mm) // cell
        row = (y_mm - self.low_mm) // cell
        tests = _TESTS
        looks = _LOOKS
        while looks and tests:
            looks -= 1
            n = self._at
            r = self._ring
            if n >= 8 * r and (r or n):  # the ring is done
                self._ring = r + 1
                self._at = 0
                if self._best >= 0 and r > self._last_ring:
                    self.x_mm = self.left_mm + self._best % self.columns * cell + cell // 2
                    self.y_mm = self.low_mm + self._best // self.columns * cell + cell // 2
                    return self._go(PLACE, self._best)
                if r > self.columns and r > self.rows:
                    return NOTHING
                continue
            self._at = n + 1
            side = n // (2 * r) if r else 0
            k = n - side * 2 * r - r
            i = column + (k if side == 0 else r if side == 1 else -k if side == 2 else -r)
            j = row + (-r if side == 0 else k if side == 1 else r if side == 2 else -k)
            if self._is_seen(i, j):
                continue
            tests -= 1
            x = self.left_mm + i * cell + cell // 2
            y = self.low_mm + j * cell + cell // 2
            if not self._sight.inside(x, y) or self._known(x, y, _NEAR_MM):
                self._mark(i, j)
                continue
            cost = self._cost(i, j, x - x_mm, y - y_mm, heading_bam)
            if self._best < 0 or cost < self._least:
                if self._best < 0:
                    self._last_ring = r
                self._best = j * self.columns + i
                self._least = cost
        return WAIT

    def _cost(self, i, j, dx, dy, heading_bam):
        scale = 0
        while not (-8000 < dx < 8000 and -8000 < dy < 8000):
            dx >>= 1
            dy >>= 1
            scale += 1
        p = polar(dx, dy)
        turn = ((p & 0xFFFF) - heading_bam + 32768 & 0xFFFF) - 32768
        seen = self._is_seen(i - 1, j) + self._is_seen(i + 1, j) + self._is_seen(i, j - 1) + self._is_seen(i, j + 1)
        return (p >> 16 << scale) + (turn if turn >= 0 else -turn) * _TURN_MM // 16384 - seen * _BESIDE_MM

    def complete(self):
        # Whether nothing was left out for want of room.
        b = self.barriers
        return self.cell_mm < _COARSE_MM and b.lost == 0 and b.nearest(0, 0) < 0

    def finish(self, good):
        # The target is reached and dealt with, or cannot be reached.
        if self.kind == PLACE:
            self._see(self._target)
        elif self.kind == BARRIER:
            b = self.barriers
            b.marks[b.going] += 2 if good else 1
            b.going = -1
        self.kind = WAIT

    def forget(self):
        # Where the robot was going, it is not going any more: neither reached nor out of reach.
        self.kind = WAIT
        self._planning = False
        self._on_way = False

    def _known(self, x_mm, y_mm, mm):
        # Whether a vector passes within mm.
        return not self._sight.clear(x_mm - mm, y_mm, x_mm + mm, y_mm, mm)

    def _go(self, kind, target):
        self.kind = kind
        self._target = target
        self._ring = 0
        self._at = 0
        self._best = -1
        return kind

    def _is_seen(self, i, j):
        if 0 <= i < self.columns and 0 <= j < self.rows:
            n = j * self.columns + i
            return self.seen[2 * CORNERS_MAX + (n >> 4)] >> (n & 15) & 1
        return 1

    def _mark(self, i, j):
        if 0 <= i < self.columns and 0 <= j < self.rows:
            self._see(j * self.columns + i)

    def _see(self, n):
        self.seen[2 * CORNERS_MAX + (n >> 4)] |= 1 << (n & 15)
