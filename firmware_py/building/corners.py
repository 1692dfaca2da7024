# The corners that free space bends round: over them ways lead while the map has no turning nodes yet.

from ..fixed import polar, sine, cosine
from ..limits import CORNERS_MAX
from ..storage.vector_store import BARRIER, CHAIN_END

_OFF_MM = const(270)           # from the corner into free space; half the passage where it is narrow
_OFF_LEAST_MM = const(190)
_TIGHT = const(34)             # map units: the body itself
_MERGE = const(60)             # 30 cm: two corners that near share a node
_SMALL = const(100)            # 50 cm: round a smaller barrier nobody plans a way

# what a tick does, at least: so many times 16 vectors of a look; what is about that, and a vertex cost as much as
_WORK = const(90)
_LOOK = const(6)
_VERTEX = const(6)


class Corners:
    # build() in slices until True, whenever the map has changed. x, y of `used` corners in the graph's shared places, where the nodes
    # come later. Full: later ones are left out and counted in `lost`. Allocates nothing.

    def __init__(self, vectors, sight, graph):
        self.used = 0
        self.lost = 0
        self._vectors = vectors
        self._sight = sight
        self._g = graph
        self._built = -1        # generation of the map that they are of; of that which build() is about
        self._of = -1
        self._chain = 0
        self._record = 0        # of that chain
        self._work = 0          # left of this tick's

    def build(self):
        # Some corners a call. -> True when the nodes are those of the present map
        v = self._vectors
        if self._built == v.generation:
            return True
        if self._of != v.generation:
            self._of = v.generation
            self._chain = 0
            self._record = 0
            self.used = 0
        c = self._chain
        if c >= v.chains:
            self._built = self._of
            self._of = -1
            return True
        first = v.firsts[c]
        last = first + v.counts[c] - 1
        i = first + self._record
        self._work = _WORK
        if i == first and v.kinds[c] & BARRIER and not self._large(first, last):
            i = last + 1
        while i <= last and self._work > 0:
            self._work -= _VERTEX
            if first < i < last or not v.flags[last] & CHAIN_END:
                self._corner(i - 1 if i > first else last, i, i + 1 if i < last else first)
            i += 1
        self._record = i - first
        if i > last:
            self._record = 0
            self._chain = c + 1
        return False

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
                break

    def _place(self, x, y):
        # A node at x, y, unless there is one near. -> False: the robot does not fit in there
        if not self._free(x - _TIGHT, y, x + _TIGHT, y):
            return False
        s = self._g.shared
        k = self.used
        self._work -= k >> 3
        while k:
            k -= 1
            if (s[2 * k] - x + _MERGE & 0xFFFF) < 2 * _MERGE and (s[2 * k + 1] - y + _MERGE & 0xFFFF) < 2 * _MERGE:
                if self._free(self._g.at(2 * k), self._g.at(2 * k + 1), x, y):
                    return True
        if self.used == CORNERS_MAX or not (-32768 <= x <= 32767 and -32768 <= y <= 32767):
            self.lost = self.lost + 1 & 0xFFFF
        else:
            self._g.shared[2 * self.used] = x & 0xFFFF
            self._g.shared[2 * self.used + 1] = y & 0xFFFF
            self.used += 1
        return True

    def _free(self, x0, y0, x1, y1):
        free = self._sight.free(x0, y0, x1, y1, _TIGHT)
        self._work -= _LOOK + ((self._vectors.used if free else self._sight.scope[8]) >> 4)
        return free


def _short(d):
    return 8000 if d > 8000 else -8000 if d < -8000 else d
