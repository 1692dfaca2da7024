# Turning nodes and the ways between them (Paper 4.4): the middle of each gate, and corners from which other nodes are seen.

from ..fixed import isqrt, sine, cosine
from ..storage.region_graph import X, Y

_REFLEX = const(-4551)       # 25 degrees to the right
_PUSH = const(60)            # map units of 5 mm: a node stands 0.3 m off its corner, in a narrow passage in the middle
_NEAR = const(38)            # at least 0.19 m
_ROOM = const(26)            # half a square that must be free around it
_FAR = const(16383)
_LOOKS = const(4000)         # at vectors, a tick
_PASSES = const(2)           # more of them over the corners, if not all nodes are joined

# phases
_GATES = const(0)
_CORNERS = const(1)
_PAIRS = const(2)
_DONE = const(3)


class Topology:
    # begin(margin); step() once a tick until True, when Partition is done. Fills the graph's nodes and edges.
    #
    # Node r - 1 is the gate of region r. Then the reflex corners are gone through: a node stands off each one that sees no node yet, or
    # nodes that were not joined. Where some are still not joined, those and the other corners once or twice more. An edge joins nodes
    # that see each other: the straight way is free by `margin` on either side. First come those that join, then others while there is room.
    # Full: what does not fit is refused; in the graph's `lost` count nodes, and edges that would have joined.
    # Allocates in __init__ only.

    def __init__(self, vectors, sight, graph, partition):
        self._v = vectors
        self._sight = sight
        self._g = graph
        self._rings = partition.rings
        self._partition = partition
        self._labels = bytearray(64)   # nodes with the same one are joined
        self._phase = _DONE
        self._margin = 0
        self._i = 0       # gate, corner, or node of a pair
        self._n = -1      # node that is looked at from there
        self._x = 0       # place of a node to be
        self._y = 0
        self._new = 0     # its number, once it is one
        self._sees = 0    # how many parts of the graph
        self._last = 0    # a node that it sees
        self._passes = 0
        self._guards = True  # a place that sees no node becomes one

    def begin(self, margin):
        self._margin = margin
        self._phase = _GATES if self._g.region_count else _DONE
        self._i = 0
        self._n = -1
        self._passes = 0

    def step(self):
        # -> True when the work is done
        g = self._g
        if g.ready:
            return True
        n = _LOOKS // (self._v.used + 1) + 2
        while n and self._phase < _DONE:
            n -= 1
            if self._phase == _PAIRS:
                self._pair()
            elif self._n < 0:
                self._next_place()
            else:
                self._look()
        if self._phase < _DONE:
            return False
        g.ready = True
        self._v.generation = (self._v.generation + 1) & 0xFFFF
        return True

    def _next_place(self):
        # The next place that may become a node.
        g = self._g
        self._i += 1
        self._sees = 0
        self._last = -1
        self._new = -1
        if self._phase == _GATES:
            if self._i < g.region_count:
                self._x = g.at(g.regions, 8 * self._i + X)
                self._y = g.at(g.regions, 8 * self._i + Y)
                self._stand()
                self._n = 0
                return
            self._phase = _CORNERS
            self._i = -1
        elif self._i < self._v.used:
            if self._off_corner():
                self._n = 0
        elif self._passes < _PASSES and not self._is_whole():
            self._passes += 1
            self._i = -1
        else:
            self._phase = _PAIRS
            self._i = 0
            self._n = 1

    def _is_whole(self):
        for n in range(1, self._g.node_count):
            if self._labels[n] != self._labels[0]:
                return False
        return True

    def _off_corner(self):
        # Whether there is room for a node off record i: along the line that halves its free angle.
        v = self._v
        i = self._i
        turn = self._rings.turn(i)
        self._guards = turn < 0
        if turn > _REFLEX and not (self._passes and turn > -_REFLEX):
            return False
        bearing = self._rings.polar(i, 1) - turn // 2 + 16384
        c = cosine(bearing & 0xFFFF)
        s = sine(bearing & 0xFFFF)
        self._sight.met(v.xs[i] + (c >> 13), v.ys[i] + (s >> 13), c >> 8, s >> 8, 0, 0)
        far = min(_PUSH, self._sight.scope[7] + 4 >> 1)
        self._x = v.xs[i] + (far * c + 16384 >> 15)
        self._y = v.ys[i] + (far * s + 16384 >> 15)
        return far >= _NEAR and self._sight.met(self._x - _ROOM, self._y, 2 * _ROOM, 0, _ROOM, 1) == 0

    def _look(self):
        # From there at one node that it is not joined with yet.
        g = self._g
        n = self._n
        while n < g.node_count and (n == self._new or self._known(n)):
            n += 1
        self._n = n + 1
        if n >= g.node_count:
            if self._sees == 0 and self._new < 0 and self._guards:
                self._stand()
            self._n = -1
        elif self._sight.met(self._x, self._y, g.at(g.nodes, 3 * n) - self._x, g.at(g.nodes, 3 * n + 1) - self._y, self._margin, 1) == 0:
            self._sees += 1
            if self._new >= 0:
                self._join(n)
            elif self._last < 0:
                self._last = n
            else:
                self._stand()
                if self._new >= 0:
                    self._join(self._last)
                    self._join(n)

    def _known(self, n):
        seen = self._new if self._new >= 0 else self._last
        return seen >= 0 and self._labels[n] == self._labels[seen]

    def _stand(self):
        # A node here.
        g = self._g
        n = g.node_count
        if 3 * n == len(g.nodes):
            g.lost = (g.lost + 1) & 0xFFFF
            return
        g.nodes[3 * n] = self._x & 0xFFFF
        g.nodes[3 * n + 1] = self._y & 0xFFFF
        g.nodes[3 * n + 2] = g.edge_count  # none yet
        g.node_count = n + 1
        self._labels[n] = n
        self._new = n

    def _join(self, n):
        old = self._labels[self._new]
        label = self._labels[n]
        if not self._link(n, self._new):
            self._g.lost = (self._g.lost + 1) & 0xFFFF
        for k in range(self._g.node_count):
            if self._labels[k] == old:
                self._labels[k] = label

    def _pair(self):
        # An edge between two nodes that see each other.
        g = self._g
        a = self._i
        b = self._n
        if b >= g.node_count:
            self._i = a + 1
            self._n = a + 2
            if a + 2 >= g.node_count or 2 * g.edge_count == len(g.edges):
                self._phase = _DONE
            return
        self._n = b + 1
        x = g.at(g.nodes, 3 * a)
        y = g.at(g.nodes, 3 * a + 1)
        if self._sight.met(x, y, g.at(g.nodes, 3 * b) - x, g.at(g.nodes, 3 * b + 1) - y, self._margin, 1) == 0:
            self._link(a, b)

    def _link(self, a, b):
        # An edge at node a, the lower one, if there is none; the others make room.
        g = self._g
        first = g.nodes[3 * a + 2] & 255
        for k in range(first, first + (g.nodes[3 * a + 2] >> 8)):
            if g.edges[2 * k] & 255 == b:
                return True
        if 2 * g.edge_count == len(g.edges):
            return False
        k = 2 * g.edge_count + 1
        while k > 2 * first + 1:
            g.edges[k] = g.edges[k - 2]
            k -= 1
        g.edge_count += 1
        for k in range(g.node_count):
            if k == a:
                g.nodes[3 * k + 2] += 256
            elif g.nodes[3 * k + 2] & 255 > first or k > a and g.nodes[3 * k + 2] & 255 == first:
                g.nodes[3 * k + 2] += 1
        x = g.at(g.nodes, 3 * a)
        y = g.at(g.nodes, 3 * a + 1)
        dx = g.at(g.nodes, 3 * b) - x
        dy = g.at(g.nodes, 3 * b + 1) - y
        g.edges[2 * first] = b | self._partition.region_of(x + dx // 2, y + dy // 2) << 8
        g.edges[2 * first + 1] = isqrt(dx * dx + dy * dy) + 2 >> 1  # cm, never less than it is
        return True
