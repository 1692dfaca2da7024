# The shortest way from place to place: over the turning nodes, by A* within fixed memory.

from array import array
from ..fixed import isqrt

NOWHERE = 65535      # length_cm: no way
GOAL = 255           # after(): from there straight to the goal

_NODES = const(64)
_OPEN = const(0)     # states of a node
_CLOSED = const(1)
_ASIDE = const(2)    # the goal is seen from the point before its gate
_UNITS = const(2)    # nodes that look at the goal, a tick


class Path:
    # begin(from x, y, to x, y), in map units of 5 mm; step() once a tick until True: length_cm, NOWHERE if there is no way, and
    # `first`, the node to go to first, GOAL for straight on; after(node) is the one behind it.
    #
    # The search runs from the goal to the start, so that each node knows the next one of its way. What may be left is taken to be the
    # longer side of the box between: never more than it is, and it never falls by more than a way is long.
    # Ways are straight lines, free as the topology's are. A gate's node also counts as seen from a place that sees the point
    # before the gate, topology.aside(): `first_aside`, and last_aside(node) of the way's last node, tell that this is to be passed, too.
    # Allocates in __init__ only.

    def __init__(self, sight, graph, topology):
        self.length_cm = NOWHERE
        self.first = GOAL
        self.first_aside = False
        self._sight = sight
        self._topology = topology
        self._g = graph
        self._costs = array("H", bytes(2 * _NODES))
        self._next = bytearray(_NODES)
        self._states = bytearray(_NODES)
        self._x0 = 0
        self._y0 = 0
        self._x1 = 0
        self._y1 = 0
        self._n = 0
        self._went_aside = False

    def begin(self, x0, y0, x1, y1):
        self._x0 = x0
        self._y0 = y0
        self._x1 = x1
        self._y1 = y1
        self._n = 0
        self.first = GOAL
        self.first_aside = False
        self.length_cm = self._way(x0, y0, x1, y1)

    def after(self, n):
        return self._next[n]

    def last_aside(self, n):
        return self._states[n] & _ASIDE != 0

    def step(self):
        # -> True when the way is known
        g = self._g
        if self._n < g.node_count:
            for _ in range(_UNITS):  # which nodes see the goal
                n = self._n
                if n < g.node_count:
                    self._n = n + 1
                    self._states[n] = _OPEN
                    self._costs[n] = self._way_from(n, self._x1, self._y1)
                    if self._went_aside:
                        self._states[n] = _ASIDE
                    self._next[n] = GOAL
            return False
        return self._expand()

    def _expand(self):
        # The most hopeful node: does it see the start? Then its neighbours.
        g = self._g
        best = -1
        least = self.length_cm
        for n in range(g.node_count):
            if not self._states[n] & _CLOSED and self._costs[n] < least:
                hope = self._costs[n] + (max(abs(g.at(g.nodes, 3 * n) - self._x0), abs(g.at(g.nodes, 3 * n + 1) - self._y0)) >> 1)
                if hope < least:
                    least = hope
                    best = n
        if best < 0:
            return True
        self._states[best] |= _CLOSED
        cost = self._costs[best]
        rest = self._way_from(best, self._x0, self._y0)
        if rest < NOWHERE and cost + rest < self.length_cm:
            self.length_cm = cost + rest
            self.first = best
            self.first_aside = self._went_aside
        for n in range(g.node_count):
            k = g.nodes[3 * n + 2] & 255
            end = k + (g.nodes[3 * n + 2] >> 8)
            while k < end:
                to = g.edges[2 * k] & 255
                if n == best or to == best:
                    other = to if n == best else n
                    far = cost + g.edges[2 * k + 1]
                    if far < self._costs[other]:
                        self._costs[other] = far
                        self._next[other] = best
                        self._states[other] &= ~_ASIDE & 255
                k += 1
        return False

    def _way_from(self, n, x, y):
        # cm from node n to a place, past the point before its gate if there is no other way.
        g = self._g
        nx = g.at(g.nodes, 3 * n)
        ny = g.at(g.nodes, 3 * n + 1)
        far = self._way(nx, ny, x, y)
        self._went_aside = False
        t = self._topology
        if far == NOWHERE and t.aside(n, x, y):
            far = self._way(nx, ny, t.aside_x, t.aside_y)
            if far < NOWHERE:
                rest = self._way(t.aside_x, t.aside_y, x, y)
                self._went_aside = rest < NOWHERE
                far = far + rest if self._went_aside else NOWHERE
        return far

    def _way(self, x0, y0, x1, y1):
        # cm straight on, never less than it is; NOWHERE if something stands in the way.
        dx = x1 - x0
        dy = y1 - y0
        if self._sight.met(x0, y0, dx, dy, self._topology.margin, 1):
            return NOWHERE
        return isqrt(dx * dx + dy * dy) + 2 >> 1
