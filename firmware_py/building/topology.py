# Turning nodes and the ways between them (Paper 4.4): the middle of each gate, and corners from which other nodes are seen.

from ..fixed import isqrt, sine, cosine
from ..limits import EDGES_MAX, NODES_MAX
from ..storage.region_graph import ABOUT, COUNT, FIRST, GATE_FIRST, PARENT

_REFLEX = const(-4551)       # 25 degrees to the right
_PUSH = const(60)            # map units of 5 mm: a node stands 0.3 m off its corner, in a narrow passage in the middle
_NEAR = const(38)            # at least 0.19 m
_ROOM = const(26)            # half a square that must be free around it
_FAR = const(32700)          # the border of the map
_SPARE = const(12)           # nodes that those before walls leave to those that join
_BEFORE = const(70)          # 0.35 m before a gate
_WORK = const(1550)          # a tick, of rings.work
_TURN = const(190)           # a corner's shape costs as much,
_NODE = const(7)             # a node that is joined already
_WALL = const(100)           # 0.5 m: the place before a wall as long is to be seen by a node
_DETOUR = const(10)          # eighths: an edge is spared where another way is no longer than that
_PASSES = const(2)           # over the records: off the corners, off the walls; then off all corners if not all nodes are joined

# phases
_GATES = const(0)
_CORNERS = const(1)
_PAIRS = const(2)
_DONE = const(3)
_TO_ASK = const(1)           # whether the edge of a pair that sees each other is spared
_TO_JOIN = const(2)


class Topology:
    # begin(margin); step() once a tick until True, when Partition is done. Fills the graph's nodes and edges.
    #
    # Node r - 1 is the gate of region r. Then a node stands off each reflex corner that sees no node yet, or nodes that were not
    # joined; and before the middle of each wall that sees none. Where some are still not joined, all corners are asked again, for that
    # alone. Who sees the point 0.35 m before a gate, aside(gate's node, from x, y), is taken to see the gate.
    # An edge joins nodes that see each other: the straight way is free by `margin` on either side. First come those that join, then
    # others while there is room, but none beside two that are hardly longer. Full: what does not fit is refused; those that would
    # have joined count in the graph's `lost`.
    # Allocates in __init__ only.

    def __init__(self, vectors, sight, graph, partition):
        self.margin = 0
        self.aside_x = 0
        self.aside_y = 0
        self._v = vectors
        self._sight = sight
        self._g = graph
        self._rings = partition.rings
        self._partition = partition
        self._labels = bytearray(NODES_MAX)  # nodes with the same one are joined
        self._phase = _DONE
        self._i = 0       # gate, corner, or node of a pair
        self._n = -1      # node that is looked at from there
        self._x = 0       # place of a node to be
        self._y = 0
        self._new = 0     # its number, once it is one
        self._sees = 0    # how many nodes
        self._parts = 0   # of the graph, that are not joined
        self._last = 0    # a node that it sees
        self._likely = 0  # one that was seen from the place before
        self._passes = 0
        self._due = 0     # nodes that it is to be joined with, + 1, 8 bits each; of a pair, the above: in a tick of their own

    def begin(self, margin):
        self.margin = margin
        self._phase = _GATES if self._g.region_count else _DONE
        self._i = self._likely = self._parts = self._due = self._passes = 0
        self._n = -1

    def step(self):
        # -> True when the work is done
        g = self._g
        if g.ready:
            return True
        if self._due:
            self._settle()
            return False
        self._rings.work = _WORK
        while self._rings.work > 0 and self._phase < _DONE and not self._due:
            if self._phase == _PAIRS:
                self._pair()
            elif self._n < 0:
                self._next_place()
            else:
                self._look()
        if self._phase < _DONE or self._due:
            return False
        g.ready = True
        self._v.generation = (self._v.generation + 1) & 0xFFFF
        return True

    def _settle(self):
        if self._phase < _PAIRS:
            self._join((self._due & 255) - 1)
            self._due >>= 8
        elif self._due == _TO_ASK:
            self._due = 0 if self._spared(self._i, self._n - 1) else _TO_JOIN
        else:
            self._due = 0
            self._link(self._i, self._n - 1)

    def _next_place(self):
        # The next place that may become a node.
        g = self._g
        self._rings.work -= _TURN
        self._i += 1
        self._sees = 0
        self._last = -1
        self._new = -1
        if self._phase == _GATES:
            if self._i < g.region_count:
                self._x = self._partition.middle(self._v.xs, self._i)
                self._y = self._partition.middle(self._v.ys, self._i)
                self._stand()
                self._n = 0
                return
            self._phase = _CORNERS
            self._i = -1
        elif self._i < self._v.used:
            if self._off_wall():
                self._n = 0
        elif self._passes == 0 or self._passes < _PASSES and self._parts > 1:
            self._passes += 1
            self._i = -1
        else:
            self._phase = _PAIRS
            self._i = 0
            self._n = 1

    def _off_wall(self):
        # Whether there is room for a node off corner i, on the line that halves its free angle; or off the middle of the wall from there.
        i = self._i
        x = self._v.xs[i]
        y = self._v.ys[i]
        bearing = self._rings.polar(i, 1)
        if self._passes == 1:
            if bearing >> 16 < _WALL:
                return False
            far = bearing >> 17
            x += far * cosine(bearing & 0xFFFF) >> 15
            y += far * sine(bearing & 0xFFFF) >> 15
        else:
            turn = self._rings.turn(i)
            if turn > _REFLEX and (self._passes == 0 or turn < -_REFLEX):
                return False
            bearing -= turn // 2
        c = cosine(bearing + 16384 & 0xFFFF)
        s = sine(bearing + 16384 & 0xFFFF)
        self._sight.met(x + (c >> 13), y + (s >> 13), c >> 8, s >> 8, 0, 0)
        self._rings.looked(self._sight)
        far = min(_PUSH, self._sight.scope[7] + 4 >> 1)
        self._x = x + (far * c + 16384 >> 15)
        self._y = y + (far * s + 16384 >> 15)
        if not (-_FAR <= self._x <= _FAR and -_FAR <= self._y <= _FAR):
            return False
        met = far < _NEAR or self._sight.met(self._x - _ROOM, self._y, 2 * _ROOM, 0, _ROOM, 1)
        self._rings.looked(self._sight)
        return not met

    def _look(self):
        # From there at one node that it is not joined with yet.
        g = self._g
        labels = self._labels
        known = self._new if self._new >= 0 else self._last
        known = labels[known] if known >= 0 else 255 if self._passes < 2 else labels[0]
        k = n = self._n
        if self._parts == 1 and known < 255:
            k = g.node_count
        while k < g.node_count:
            n = self._likely if k == 0 else 0 if k == self._likely else k  # first the one that the place before saw
            if labels[n] != known:
                break
            k += 1
        self._rings.work -= _NODE * (k + 1 - self._n) + _NODE
        self._n = k + 1
        if k >= g.node_count:
            if self._sees == 0 and self._new < 0 and self._passes < 2:
                if self._passes == 0 or g.node_count + _SPARE < NODES_MAX:
                    self._stand()
            self._n = -1
        elif self._is_free(g.at(2 * n), g.at(2 * n + 1)):
            self._sees += 1
            self._likely = n
            if self._new >= 0:
                self._due = n + 1
            elif self._last < 0:
                self._last = n
                if self._passes > 1:
                    self._n = 0  # first came those that are not joined with node 0
            else:
                self._stand()
                if self._new < 0:
                    self._n = -1
                    return
                self._due = n + 1 << 8 | self._last + 1
        elif self._passes == 1 and self.aside(n, self._x, self._y) and self._is_free(self.aside_x, self.aside_y):
            self._sees += 1

    def _is_free(self, x, y):
        free = self._sight.free(self._x, self._y, x, y, self.margin)
        self._rings.looked(self._sight)
        return free

    def aside(self, n, x, y):
        # -> whether node n is a gate's; the point before it on the side of (x, y)
        g = self._g
        if n + 1 >= g.region_count:
            return False
        r = 6 * n + 6
        i = g.regions[r + FIRST]
        if not g.regions[r + PARENT] & GATE_FIRST:
            i = self._rings.ahead(i, g.regions[r + COUNT] - 1)
        mx = g.at(2 * n)
        my = g.at(2 * n + 1)
        ux = mx - self._v.xs[i]
        uy = my - self._v.ys[i]
        far = isqrt(ux * ux + uy * uy) + 1
        if ux * (y - my) < uy * (x - mx):
            far = -far
        self.aside_x = mx - uy * _BEFORE // far
        self.aside_y = my + ux * _BEFORE // far
        return True

    def _stand(self):
        # A node here.
        g = self._g
        n = g.node_count
        if n == NODES_MAX:
            g.lost = (g.lost + 1) & 0xFFFF
            return
        g.shared[2 * n] = self._x & 0xFFFF
        g.shared[2 * n + 1] = self._y & 0xFFFF
        g.shared[ABOUT + n] = g.edge_count  # none yet
        g.node_count = n + 1
        self._labels[n] = n
        self._parts += 1
        self._new = n

    def _join(self, n):
        old = self._labels[self._new]
        label = self._labels[n]
        if not self._link(n, self._new):
            self._g.lost = (self._g.lost + 1) & 0xFFFF
        self._parts -= 1
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
            if a + 2 >= g.node_count or g.edge_count == EDGES_MAX:
                self._phase = _DONE
            return
        self._n = b + 1
        self._x = g.at(2 * a)
        self._y = g.at(2 * a + 1)
        if self._is_free(g.at(2 * b), g.at(2 * b + 1)):
            self._due = _TO_ASK

    def _spared(self, a, b):
        # Whether over a node that both are joined with it is hardly farther.
        g = self._g
        s = g.shared
        far = self._length(a, b) * _DETOUR >> 3
        x = g.at(2 * a) + g.at(2 * b) - far >> 1  # such a node lies in the box from there on
        y = g.at(2 * a + 1) + g.at(2 * b + 1) - far >> 1
        for n in range(g.node_count):
            if (s[2 * n] - x & 0xFFFF) <= far and (s[2 * n + 1] - y & 0xFFFF) <= far and g.edge(a, n) >= 0 and g.edge(n, b) >= 0:
                if self._length(a, n) + self._length(n, b) <= far:
                    return True
        return False

    def _length(self, a, b):
        g = self._g
        dx = g.at(2 * a) - g.at(2 * b)
        dy = g.at(2 * a + 1) - g.at(2 * b + 1)
        return isqrt(dx * dx + dy * dy)

    def _link(self, a, b):
        # An edge of nodes a and b, if there is none. -> whether there is one now
        g = self._g
        if g.edge(a, b) >= 0:
            return True
        if g.edge_count == EDGES_MAX:
            return False
        g.join(a, b, self._partition.region_of(g.at(2 * a) + g.at(2 * b) >> 1, g.at(2 * a + 1) + g.at(2 * b + 1) >> 1))
        return True
