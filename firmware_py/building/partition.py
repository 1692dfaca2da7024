# Rooms: the map is cut at its doorways (Paper 4.3).
from ..limits import REGIONS_MAX
from ..storage.region_graph import COUNT, FIRST, GATE_FIRST, LINES, PARENT
from ..storage.vector_store import BARRIER, LONG
from .gates import Gates
from .rings import Rings
from .room import ROOM_MIN, fits, square

_WORK = const(800)           # a tick, of rings.work; the last piece may take twice as much more
_STEP = const(60)            # along a region; and for each region, that its children are passed over
_REGION = const(8)
_LINE = const(25)
# phases
_COLLECT = const(0)
_CHOOSE = const(1)
_PLACE = const(2)
_CUT = const(3)
_HOLD = const(4)
_TRY = const(5)
_LINES = const(6)
_ISLANDS = const(7)
_DONE = const(8)


class Partition:
    # begin(); step() once a tick until True. Fills the graph's regions; a barrier's region is the upper five bits of its kind.
    #
    # The gates, shortest first, are taken if there is a room on either side (room.py).
    #
    # While it works, each gate stands in the vector store's free places behind the map, an open chain of two records, so that a look
    # stops at it. region_of() needs them there. Full: what does not fit is refused and counted in the graph's `lost`.
    # Allocates in __init__ only.

    def __init__(self, vectors, sight, graph):
        self._v = vectors
        self._sight = sight
        self._g = graph
        self.rings = Rings(vectors)
        self._gates = Gates(vectors, sight, graph, self.rings)
        self._phase = _DONE
        self._gate_chains = 0  # that stand behind the map
        self._square = 0      # what must fit beside the gate
        self._first = 0       # what it would cut off, and from what
        self._count = 0
        self._parent = 0
        self._inside = 0      # it leads into a barrier
        self._at = 0          # a walk along the records of a region, children left out
        self._left = 0
        self._skip = 0        # so many records on from there it goes
        self._side = 0        # region; then the barrier's chain that comes next

    def begin(self):
        v = self._v
        g = self._g
        g.clear()
        self.rings.chains = v.chains
        self.rings.chain = 0
        self._gate_chains = 0
        c = 0
        while c < v.chains and (v.kinds[c] & BARRIER or v.counts[c] == 0):
            c += 1
        if c == v.chains:
            self._phase = _DONE  # no outline
            return
        self._phase = _COLLECT
        i = v.firsts[c]
        for n in range(6):
            g.regions[n] = 0
        self.rings.far = 0
        n = self.rings.count(i, self.rings.beside(i, -1))
        g.regions[FIRST] = i
        g.regions[COUNT] = n
        g.set_floor(0, self.rings.enclosed(i, n, i, 0, 0) // 50)
        g.region_count = 1
        self._gates.begin(i)
        if not self._has_room():
            g.lost = (g.lost + 1) & 0xFFFF
            self._walk(0, _LINES)  # one region

    def _has_room(self):
        # For one more region, and its gate behind the map.
        v = self._v
        n = self._gate_chains
        self._gates.behind = v.used + 2 * n
        return v.used + 2 * n + 2 <= len(v.xs) and v.chains + n < len(v.kinds) and self._g.region_count < REGIONS_MAX

    def step(self):
        # -> True when the work is done
        self.rings.work = _WORK
        self._sight.chains = self._v.chains + self._gate_chains
        while self.rings.work > 0 and self._phase < _DONE:
            self._piece()
        self._sight.chains = -1
        return self._phase == _DONE

    def _piece(self):
        if self._phase == _COLLECT:
            if self._gates.step():
                self._phase = _CHOOSE
        elif self._phase == _CHOOSE:
            self._choose()
        elif self._phase == _PLACE:
            self._where()
        elif self._phase == _CUT:
            self._cut()
        elif self._phase == _HOLD:
            self._hold()
        elif self._phase == _ISLANDS:
            self._place_island()
        elif self._on():
            if self._phase == _TRY:
                self._try()
            else:
                self._count_lines()

    def _choose(self):
        if not self._gates.shortest(self._has_room()):
            for r in range(self._g.region_count):
                self._g.regions[6 * r + LINES] = 0
            self._walk(0, _LINES)
        elif self._gates.open:
            self._phase = _PLACE

    def _where(self):
        # Where the gate stands.
        v = self._v
        gate = self._gates
        self._parent = self.region_of(v.xs[gate.i] + gate.x >> 1, v.ys[gate.i] + gate.y >> 1)
        self._inside = v.kinds[v.chain_of(gate.i)] & BARRIER
        self._phase = _CUT

    def _cut(self):
        # What it would cut off, as the region after the last one.
        g = self._g
        gate = self._gates
        p = self._parent
        r = 6 * g.region_count
        area = gate.area
        if self._inside:
            other = area < 0
        elif p:  # within its parent's range
            other = self.rings.count(g.regions[6 * p + FIRST], gate.i) + gate.count - 1 > g.regions[6 * p + COUNT]
        else:
            other = area > gate.total - area
        flags = p if other else p | GATE_FIRST
        self._first = gate.i
        self._count = gate.count
        if other:
            area = gate.total - area
            self._first = gate.k
            self._count = self.rings.count(gate.k, gate.i)
        g.regions[r + FIRST] = self._first
        g.regions[r + COUNT] = self._count
        g.regions[r + LINES] = 0
        g.regions[r + PARENT] = flags
        g.set_floor(g.region_count, area // 50)
        self._at = 1
        self._square = square(gate)
        self._phase = _HOLD

    def _hold(self):
        # Which regions lie in what it would cut off, one by one: their floor is theirs. Then it is tried.
        v = self._v
        g = self._g
        q = self._at
        r = g.region_count
        if q < r:
            self._at = q + 1
            held = self._holds(r, self.middle(v.xs, q), self.middle(v.ys, q))
            g.regions[6 * q + LINES] = held
            if held:
                g.set_floor(r, g.floor(r) - g.floor(q))
            return
        self._phase = _CHOOSE
        if g.floor(r) < ROOM_MIN or g.floor(self._parent) - g.floor(r) < ROOM_MIN:
            return
        self._gates.stand(v.chains + self._gate_chains)
        self._gate_chains += 1
        self._sight.chains += 1
        self._walk(r, _TRY)

    def region_of(self, x, y):
        # The region that a place of the free floor lies in: down from region 0 to the child that holds it.
        g = self._g
        r = 0
        q = 1
        while q < g.region_count:
            if g.regions[6 * q + PARENT] & 255 == r and self._holds(q, x, y):
                r = q
                q = 0
            q += 1
        return r

    def middle(self, of, r):
        # x or y (of the vectors' xs or ys) of the middle of region r's gate, as it stands behind the map.
        n = self._v.used + 2 * r - 2
        return of[n] + of[n + 1] >> 1

    def _holds(self, r, x, y):
        g = self._g.regions
        self.rings.enclosed(g[6 * r + FIRST], g[6 * r + COUNT], self._v.used + 2 * r - 1, x, y)
        return self.rings.scope[1] & 1

    def _walk(self, r, phase):
        # Along the records of region r.
        self._phase = phase
        self._side = r
        self._at = self._g.regions[6 * r + FIRST]
        self._left = self._g.regions[6 * r + COUNT] + (r == 0)  # the ring's last vector leads to the first record
        self._skip = 0

    def _on(self):
        # To the next record, over a child's range to the last one of it. -> whether none begins there
        g = self._g
        n = 1
        size = g.regions[6 * self._side + COUNT]
        self._at = self.rings.ahead(self._at, self._skip)
        self._left -= self._skip
        for q in range(1, g.region_count + (self._phase == _TRY)):
            count = g.regions[6 * q + COUNT]
            if g.regions[6 * q + FIRST] == self._at and n < count <= self._left and count < size:
                n = count
        self._skip = n - 1
        self.rings.work -= _STEP + _REGION * g.region_count
        return n == 1

    def _try(self):
        # Does the square stand at the vector here?
        if self._left > 0:
            if not fits(self._v, self._sight, self.rings, self._at, self._square):
                self._skip = 1
                return
            if self._side == self._g.region_count and not self._inside:
                self._walk(self._parent, _TRY)
                return
            self._accept()
        else:
            self._gate_chains -= 1
            self._sight.chains -= 1
        self._phase = _CHOOSE

    def _accept(self):
        g = self._g
        r = g.region_count
        p = self._parent
        for q in range(1, r):
            if g.regions[6 * q + PARENT] & 255 == p and g.regions[6 * q + LINES]:
                g.regions[6 * q + PARENT] += r - p
        g.set_floor(p, g.floor(p) - g.floor(r))
        if p == 0 and not self._inside and self.rings.count(self._first, g.regions[FIRST]) < self._count:
            g.regions[FIRST] = self.rings.ahead(self._first, self._count - 1)  # outside of its children
        g.region_count = r + 1

    def _count_lines(self):
        g = self._g
        r = self._side
        if self._left > 1:
            g.add_line(r, self._v.flags[self._at] & LONG)
            self._skip = 1
        elif r + 1 < g.region_count:
            self._walk(r + 1, _LINES)
        else:
            self._side = self._left = 0
            self._phase = _ISLANDS
            self.rings.work = 0

    def _place_island(self):
        # A barrier's region: its area is no floor; its vectors, one by one, are lines of it.
        v = self._v
        g = self._g.regions
        c = self._side
        self.rings.work -= _LINE
        if self._left > 0:
            self._left -= 1
            self._g.add_line(v.kinds[c - 1] >> 3, v.flags[self._at + self._left] & LONG)
            if self._left == 0:
                self.rings.work = 0  # the next barrier's region takes most of a tick
            return
        if c == v.chains:
            self._g.settle_floors(self.rings.far)
            v.generation = (v.generation + 1) & 0xFFFF
            self._phase = _DONE
            return
        self._side = c + 1
        if v.kinds[c] & BARRIER and v.counts[c]:
            i = v.firsts[c]
            r = self.region_of(v.xs[i], v.ys[i])
            while r and v.chain_of(g[6 * r + FIRST]) == c:
                r = g[6 * r + PARENT] & 255
            v.kinds[c] = v.kinds[c] & 7 | r << 3
            self._g.set_floor(r, self._g.floor(r) + min(self.rings.enclosed(i, v.counts[c], i, 0, 0) // 50, 0))
            self._at = i
            self._left = v.counts[c]
