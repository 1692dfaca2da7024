# The shortest way from place to place (Paper 4.4), by A* within fixed memory: over the turning nodes once the map is built; before
# that over the corners that free space bends round, as far as they see one another.

from array import array
from ..limits import CORNERS_MAX
from . import frontier
from .corners import Corners
from .frontier import CLOSED, NOBODY, STOP_CM, UNREACHED, leg_cm

_BODY = const(38)              # map units of 5 mm: to the next wall, along a way
_TIGHT = const(34)             # where there is no other: the body itself
_TIGHTEST = const(30)          # nor such a one: the map may be 2 cm off, and the robot has been everywhere

# what a tick does, at least: so many times 16 vectors of a look; what is about that, a comparison of two turning nodes, and the choice of
# a node with what follows from it cost as much as
_WORK = const(90)
_LOOK = const(6)
_COMPARISON = const(2)
_CHOICE = const(28)

# the two ends, beside the nodes
GOAL = CORNERS_MAX
START = CORNERS_MAX + 1

# what step() says
BUSY = 0
FOUND = 1
NONE = 2


class Way:
    # build() in slices until True, whenever the map has changed; begin(from, to in mm), step() until it does not say BUSY; then
    # length_cm is known, and next() leaves the places to pass one by one in x_mm, y_mm until False: the goal itself comes last.
    #
    # A*, from the goal to the start, so that each node knows the next one of its way.
    # Over corners a leg costs 8 cm more than its length, and if there is no way with 19 cm beside it, one with 17 or 15 cm will do.
    # A look along a leg is what costs time: it is put off until its node comes next. Is the leg not free, the node falls back on the
    # best of the settled ones that it has not tried. All it has tried were better ones, as costs never fall: none is passed over.
    # Over turning nodes the edges tell who sees whom, and only the legs of both ends are looked along.
    # A gate's counts as seen from a place that sees the point before the gate, Topology.aside(): that is passed, too.
    #
    # A node has a mark u8, the graph's, and here its cost u16 in cm to the goal. Allocates in __init__ only.

    def __init__(self, vectors, sight, graph, topology):
        self._costs = array("H", bytes(2 * CORNERS_MAX + 4))
        self._marks = array("H", bytes(2 * CORNERS_MAX + 4))
        self.corners = Corners(vectors, sight, graph)
        self.used = 0
        self.length_cm = 0
        self.x_mm = 0
        self.y_mm = 0
        self._vectors = vectors
        self._sight = sight
        self._g = graph
        self._topology = topology
        self._here = GOAL       # node that the robot goes to
        self._beside = False    # it goes to the point before that one, or before the one it came from
        self._margin = 0
        self._at = 0            # node being settled, and the turning node it is compared with: -1 after the last
        self._to = 0
        self._x0 = 0            # the ends
        self._y0 = 0
        self._x1 = 0
        self._y1 = 0

    def build(self):
        # -> True when the nodes are those of the present map
        done = self._g.ready or self.corners.build()
        self.used = self._g.node_count if self._g.ready else self.corners.used
        return done

    def begin(self, x0_mm, y0_mm, x1_mm, y1_mm):
        self._x0 = x0_mm // 5
        self._y0 = y0_mm // 5
        self._x1 = x1_mm // 5
        self._y1 = y1_mm // 5
        self._restart(self._topology.margin if self._g.ready else _BODY)

    def _restart(self, margin):
        self._margin = margin
        self.length_cm = UNREACHED
        costs = self._costs
        marks = self._marks
        for n in range(CORNERS_MAX + 2):
            costs[n] = UNREACHED
            marks[n] = 0
        self._here = GOAL
        self._beside = False
        costs[GOAL] = 0
        self._to = -1

    def step(self):
        work = _WORK
        while work > 0:
            if self._to >= 0:
                work -= self._compare()
                continue
            work -= _CHOICE
            a = self._at = self._hopeful()
            if a < 0:
                if self._g.ready or self._margin == _TIGHTEST:
                    return NONE
                self._restart(_TIGHT if self._margin == _BODY else _TIGHTEST)
                return BUSY
            if a != GOAL and not self._g.ready:
                free = self._free(self._marks[a], a)
                work -= self._look_cost()
                if not free:
                    self._fall_back(a)
                    continue
            if a == START:
                self.length_cm = self._costs[START]
                self._here = START
                return FOUND
            self._marks[a] |= CLOSED
            if self._g.ready:
                self._to = START
            else:
                self._offer(a)
                if a == GOAL:
                    work -= self.used >> 2  # it is better than nothing for each of them
        return BUSY

    def _hopeful(self):
        # The node that the shortest way may lead over: the goal is the first that is taken, the start the last. -1: none
        marks = self._marks
        if marks[GOAL] < CLOSED:
            return GOAL
        c = frontier.choose(self._costs, marks, self._g.shared, self.used, self._x0, self._y0)
        if self._costs[START] <= c >> 8 and self._costs[START] < UNREACHED:
            return START
        return c & 255 if c < NOBODY else -1

    def _offer(self, a):
        # The settled node a, to all the others.
        x = self._x(a)
        y = self._y(a)
        costs = self._costs
        frontier.offer(costs, self._marks, self._g.shared, self.used, x, y, a)
        cost = costs[a] + STOP_CM + leg_cm(x - self._x0, y - self._y0)
        if cost < costs[START] or cost == costs[START] and a < self._marks[START]:
            costs[START] = cost
            self._marks[START] = a

    def _fall_back(self, b):
        # Node b does not see the one that it was to go to.
        x = self._x(b)
        y = self._y(b)
        tried = self._costs[b] << 8 | self._marks[b]
        c = frontier.next_best(self._costs, self._marks, self._g.shared, self.used, x, y, tried)
        goal = STOP_CM + leg_cm(x - self._x1, y - self._y1) << 8 | GOAL
        if tried < goal < c:
            c = goal
        self._costs[b] = c >> 8
        self._marks[b] = c & 255

    def _compare(self):
        # Is it shorter to the goal from the next turning node, or from the start, over the settled one? -> how much work it was to see that
        a = self._at
        b = self._to
        self._to = b - 1 if b < GOAL else self.used - 1  # the start first, then the nodes from the last one on
        if self._marks[b] & CLOSED or self._passes(a, b) and self._g.edge(a, b) < 0:
            return _COMPARISON
        cost = leg_cm(self._x(a) - self._x(b), self._y(a) - self._y(b))
        if self._costs[a] + cost >= self._costs[b]:
            return _COMPARISON
        work = _COMPARISON
        if not self._passes(a, b):
            free = self._free(a, b)
            work += self._look_cost()
            if not free:
                cost = self._around(a, b)
                work += 2 * self._look_cost()
        if self._costs[a] + cost < self._costs[b]:
            self._costs[b] = self._costs[a] + cost
            self._marks[b] = a
        return work

    def _look_cost(self):
        # Of the last one: it ends at the first vector that is in the way.
        k = self._sight.scope[8]
        return _LOOK + ((self._vectors.used if k < 0 else k) >> 4)

    def _passes(self, a, b):
        # Of two turning nodes the edges tell; else one has to look: _free().
        return self._g.ready and a < GOAL and b < GOAL

    def _free(self, a, b):
        return self._sight.free(self._x(a), self._y(a), self._x(b), self._y(b), self._margin)

    def _around(self, a, b):
        # cm past the point before a gate, of which a or b is the node and the other an end.
        t = self._topology
        if a < GOAL:
            return self._around(b, a) if b >= GOAL else UNREACHED
        x = self._x(a)
        y = self._y(a)
        cost = UNREACHED
        if self._g.ready and b < GOAL and t.aside(b, x, y):
            if self._sight.free(x, y, t.aside_x, t.aside_y, self._margin):
                if self._sight.free(t.aside_x, t.aside_y, self._x(b), self._y(b), self._margin):
                    cost = leg_cm(x - t.aside_x, y - t.aside_y) + leg_cm(t.aside_x - self._x(b), t.aside_y - self._y(b))
        return cost

    def next(self):
        # -> whether there is one more place to go to
        n = self._here
        if n == GOAL:
            return False
        to = self._marks[n] & ~CLOSED
        self._beside = not self._beside and not self._passes(n, to) and not self._free(n, to)
        if self._beside:
            end = n if n == START else to
            self._topology.aside(n + to - end, self._x(end), self._y(end))
            self.x_mm = self._topology.aside_x * 5
            self.y_mm = self._topology.aside_y * 5
        else:
            self._here = to
            self.x_mm = self._x(to) * 5
            self.y_mm = self._y(to) * 5
        return True

    def last(self):
        # Whether the place is the goal.
        return self._here == GOAL

    def _x(self, n):
        return self._g.at(2 * n) if n < GOAL else self._x1 if n == GOAL else self._x0

    def _y(self, n):
        return self._g.at(2 * n + 1) if n < GOAL else self._y1 if n == GOAL else self._y0
