# The shortest way on the map: over the corners that free space bends round, as far as they see one another.

from array import array
from ..fixed import isqrt, polar, sine, cosine
from ..limits import NODES_MAX

_CHAIN_END = const(8)          # storage/vector_store.py
_BARRIER = const(1)
_OFF_MM = const(270)           # from the corner into free space; half the passage where it is narrow
_OFF_LEAST_MM = const(190)
_BODY_MM = const(190)          # to the next wall, along a way
_TIGHT_MM = const(172)         # where there is no other
_MERGE = const(60)             # 30 cm: two corners that near share a node
_SMALL = const(100)            # 50 cm: round a smaller barrier nobody plans a way
_SIGHTS = const(12)            # looks from node to node, a tick
_UNREACHED = const(65535)

# what step() says
BUSY = 0
FOUND = 1
NONE = 2


class Way:
    # build() in slices until True, whenever the map has changed; begin(from, to), step() until it does not say BUSY;
    # then next() leaves the places to pass one by one in x_mm, y_mm until False: the goal itself comes last.
    # Nodes: x, y int16 in map units; cost u16 in cm to the goal, parent u8. Node 0 is the goal, node 1 the start.
    # Full: later corners are left out and counted in `lost`. Allocates in __init__ only.

    CAPACITY = NODES_MAX
    RECORD_BYTES = 7

    def __init__(self, vectors, sight):
        self.xs = array("h", bytes(2 * NODES_MAX))
        self.ys = array("h", bytes(2 * NODES_MAX))
        self.costs = array("H", bytes(2 * NODES_MAX))
        self.parents = bytearray(NODES_MAX)
        self.used = 2
        self.lost = 0
        self.x_mm = 0
        self.y_mm = 0
        self._vectors = vectors
        self._sight = sight
        self._built = -1        # generation of the map that the nodes are of
        self._chain = 0
        self._here = 0          # node that the robot goes to
        self._body_mm = _BODY_MM
        self._at = 0            # node being settled, and the one it looks at
        self._to = 0

    def build(self):
        # The corners of one chain a call. -> True when the nodes are those of the present map
        v = self._vectors
        if self._built == v.generation:
            return True
        if self._chain == 0:
            self.used = 2
        c = self._chain
        if c >= v.chains:
            self._built = v.generation
            self._chain = 0
            return True
        self._chain = c + 1
        first = v.firsts[c]
        last = first + v.counts[c] - 1
        if not v.kinds[c] & _BARRIER or self._large(first, last):
            closed = not v.flags[last] & _CHAIN_END
            for i in range(first, last + 1):
                if first < i < last or closed:
                    self._corner(i - 1 if i > first else last, i, i + 1 if i < last else first)
        return False

    def begin(self, x0_mm, y0_mm, x1_mm, y1_mm):
        self._body_mm = _BODY_MM
        self.xs[0] = x1_mm // 5
        self.ys[0] = y1_mm // 5
        self.xs[1] = x0_mm // 5
        self.ys[1] = y0_mm // 5
        self._restart()

    def _restart(self):
        for i in range(self.used):
            self.costs[i] = _UNREACHED
            self.parents[i] = 0
        self.costs[0] = 0
        self._at = 0
        self._to = 1

    def step(self):
        # Dijkstra from the goal on; a settled node has bit 7 in its parent.
        sights = _SIGHTS
        while sights:
            a = self._at
            b = self._to
            if b == self.used:
                self.parents[a] |= 128
                a = self._nearest()
                if a < 0:
                    if self._body_mm == _TIGHT_MM:
                        return NONE
                    self._body_mm = _TIGHT_MM
                    self._restart()
                    return BUSY
                if a == 1:
                    self._here = 1
                    return FOUND
                self._at = a
                self._to = 1
                continue
            self._to = b + 1
            if self.parents[b] & 128 or b == a:
                continue
            dx = self.xs[b] - self.xs[a]
            dy = self.ys[b] - self.ys[a]
            if not (-11000 < dx < 11000 and -11000 < dy < 11000):
                continue
            cost = self.costs[a] + (isqrt(dx * dx + dy * dy) >> 1) + 8  # a stop and a turn cost some way
            if cost < self.costs[b]:
                sights -= 1
                x = self.xs[a] * 5
                y = self.ys[a] * 5
                if self._sight.clear(x, y, x + dx * 5, y + dy * 5, self._body_mm):
                    self.costs[b] = cost
                    self.parents[b] = a
        return BUSY

    def next(self):
        # -> whether there is one more place to go to
        if self._here == 0:
            return False
        self._here = self.parents[self._here] & 127
        self.x_mm = self.xs[self._here] * 5
        self.y_mm = self.ys[self._here] * 5
        return True

    def last(self):
        # Whether the place is the goal.
        return self._here == 0

    def _nearest(self):
        best = -1
        least = _UNREACHED
        for i in range(1, self.used):
            if self.costs[i] < least and not self.parents[i] & 128:
                least = self.costs[i]
                best = i
        return best

    def _large(self, first, last):
        v = self._vectors
        for i in range(first + 1, last + 1):
            if abs(v.xs[i] - v.xs[first]) > _SMALL or abs(v.ys[i] - v.ys[first]) > _SMALL:
                return True
        return False

    def _corner(self, before, i, after):
        # Free space lies to the left of a vector: where the wall turns right, it goes round the corner.
        v = self._vectors
        x = v.xs[i]
        y = v.ys[i]
        p = polar(_short(x - v.xs[before]), _short(y - v.ys[before])) & 0xFFFF
        q = polar(_short(v.xs[after] - x), _short(v.ys[after] - y)) & 0xFFFF
        turn = (q - p + 32768 & 0xFFFF) - 32768
        if turn > -3640:
            return
        bam = p + (turn >> 1) + 16384
        off = _OFF_MM
        while not self._place(x + off * cosine(bam) // 163840, y + off * sine(bam) // 163840):
            off -= 40
            if off < _OFF_LEAST_MM:
                return

    def _place(self, x, y):
        # A node at x, y, unless there is one near. -> False: the robot does not fit in there
        if not self._sight.clear(x * 5 - _TIGHT_MM, y * 5, x * 5 + _TIGHT_MM, y * 5, _TIGHT_MM):
            return False
        for k in range(2, self.used):
            if abs(self.xs[k] - x) < _MERGE and abs(self.ys[k] - y) < _MERGE:
                return True
        if self.used == NODES_MAX:
            self.lost = self.lost + 1 & 0xFFFF
        else:
            self.xs[self.used] = x
            self.ys[self.used] = y
            self.used += 1
        return True


def _short(d):
    return 8000 if d > 8000 else -8000 if d < -8000 else d
