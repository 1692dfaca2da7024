# Doorways: the places where the way from wall to wall is shortest (Paper 4.3, its concave points and their lines).

from array import array
from ..fixed import polar, sine, cosine
from ..storage.vector_store import BARRIER, CHAIN_END, SEARCHED
from . import passage

_GATE_MIN = const(110)       # map units of 5 mm: a doorway is 0.55 to 1.15 m wide
_GATE_MAX = const(230)
_ROOM_MIN = const(8250)      # 1.65 m2, in 200 mm2
_REFLEX = const(-2731)       # 15 degrees to the right
_WALL_END = const(-27307)    # 150 degrees, within
_JAMB = const(90)            # 0.45 m: the end of a wall
_STICK = const(6)            # 3 cm: a neighbour may reach that far past the gate's end
_OFF = const(5)              # from both ends of a line of sight; and beside it nothing may be,
_BESIDE = const(2)           # not even the same gate, found once more
_CANDIDATES = const(128)     # three places each of what is shared
# what costs as much as so many records of a trace (rings.work)
_SHAPE = const(200)          # a record's shape; to ask whether neighbours pass a gate is twice as much
_WALL_END_WORK = const(700)
_CHOICE = const(450)         # of the shortest
_COUNT = const(100)          # of the records between two


class Gates:
    # begin(first record of the outline); step() until True; then each shortest(room) gives one more gate, until it says False.
    #
    # A gate leads from the reflex record i to the nearest place (x, y) of another vector of its ring, the one that ends at record k;
    # no way beside it is shorter. `foot`: that place lies before k. `open`: no gate that was taken since crosses it; `width`; what
    # it cuts off from record i on: `count` records, `area`; the whole ring: `total`. Its ends stand in the store's record `behind`
    # and the next, behind the map.
    #
    # The candidates stand in the graph's `shared`, where nodes and edges come later: width, i and k of each. Full: the shortest stay,
    # the others are counted in the graph's `lost`. Allocates in __init__ only.

    def __init__(self, vectors, sight, graph, rings):
        self.i = 0
        self.k = 0
        self.x = 0
        self.y = 0
        self.foot = 0
        self.open = False
        self.width = 0
        self.count = 0
        self.area = 0
        self.total = 0
        self.behind = 0
        self._v = vectors
        self._sight = sight
        self._g = graph
        self._rings = rings
        self._scope = array("i", bytes(28))
        self._outline = 0
        self._ring = -1       # that `total` is of: a barrier's chain, or this
        self._n = 0

    def begin(self, outline):
        self._outline = outline
        self.i = self.k = -1
        self._ring = -2
        self._n = 0

    def step(self):
        # One record's shape, or one place near it. -> True when all are seen
        v = self._v
        self.open = False
        self._rings.work -= _SHAPE
        if self.k < 0:
            self.i += 1
            if self.i == v.used:
                return True
            if self._rings.turn(self.i) >= _REFLEX:
                return False
            c = v.chain_of(self.i)
            self.k = v.firsts[c] if v.kinds[c] & BARRIER else self._outline
        c = v.chain_of(self.k)
        end = v.firsts[c] + v.counts[c]
        if self._find(end):
            rest = self.total - self.area
            if self.total < 0:  # of a barrier only what it holds within it
                rest = max(rest, self.area)
            if self.open and rest >= _ROOM_MIN and (self.area >= _ROOM_MIN or self.total < 0):
                self._keep()
            self.k += 1
            if self.k < end:
                return False
        self.k = -1
        if not v.kinds[c] & BARRIER:
            for n in range(c + 1, v.chains):
                if self.k < 0 and not v.kinds[n] & BARRIER:
                    self.k = v.firsts[n]  # the outline goes on there
        return False

    def _keep(self):
        g = self._g
        s = g.shared
        n = self._n
        if n < _CANDIDATES:
            self._n = n + 1
            s[n] = 65535
        else:
            g.lost = (g.lost + 1) & 0xFFFF
            n = 0
            for q in range(_CANDIDATES):
                if s[q] > s[n]:
                    n = q
        if s[n] > self.width:
            s[n] = self.width
            s[_CANDIDATES + n] = self.i
            s[2 * _CANDIDATES + n] = self.k

    def shortest(self, room):
        # -> False when none is left, or there is one and no room for it
        g = self._g
        s = g.shared
        n = -1
        self._rings.work -= _CHOICE
        for q in range(self._n):
            if s[q] and (n < 0 or s[q] < s[n]):
                n = q
        if n >= 0 and not room:
            g.lost = (g.lost + 1) & 0xFFFF
        if n < 0 or not room:
            return False
        s[n] = 0
        self.i = s[_CANDIDATES + n]
        self.k = s[2 * _CANDIDATES + n]
        self._find(self.k + 1)
        return True

    def stand(self, c):
        # Its two records behind the map are chain c.
        v = self._v
        n = self.behind
        v.firsts[c] = n
        v.counts[c] = 2
        v.kinds[c] = BARRIER | SEARCHED
        v.flags[n] = 0
        v.flags[n + 1] = CHAIN_END

    def wall_ends(self, i):
        # Whether record i is a corner at the end of a wall.
        rings = self._rings
        rings.work -= _WALL_END_WORK
        for way in range(-1, 2, 2):
            turned = rings.turn(i)
            far = 0
            k = i
            for _ in range(6):
                far += rings.polar(k, way) >> 16
                if far > _JAMB:
                    break
                k = rings.beside(k, way)
                turned += rings.turn(k)
                if turned < _WALL_END:
                    return True
        return False

    def _find(self, end):
        # From vector k on, before the one to record `end`, the next that record i has a gate to by its distance. -> whether there is one
        v = self._v
        rings = self._rings
        i = self.i
        s = self._scope
        s[0] = v.xs[i]
        s[1] = v.ys[i]
        s[2] = _GATE_MIN
        s[3] = _GATE_MAX
        self.open = False
        k = passage.narrow(v.xs, v.ys, rings.beside(self.k, -1), self.k, end, s)
        rings.work -= (end if k < 0 else k) - self.k >> 2
        if k < 0:
            return False
        rings.work -= 2 * _SHAPE
        self.k = k
        self.x = s[4]
        self.y = s[5]
        self.foot = s[6]
        ux = self.x - s[0]
        uy = self.y - s[1]
        self.width = polar(ux, uy) >> 16
        if self._passed(i, ux, uy):
            return True
        if not self.foot and (k <= i or rings.turn(k) >= _REFLEX or self._passed(k, -ux, -uy)):
            return True
        ox = ux * _OFF // self.width
        oy = uy * _OFF // self.width
        met = self._sight.met(s[0] + ox, s[1] + oy, ux - 2 * ox, uy - 2 * oy, _BESIDE, 1)
        rings.looked(self._sight)
        if met:
            return True
        self.open = True
        n = self.behind
        v.xs[n] = s[0]
        v.ys[n] = s[1]
        v.xs[n + 1] = self.x
        v.ys[n + 1] = self.y
        self.count = rings.count(i, rings.beside(k, -1) if self.foot else k)
        self.area = rings.enclosed(i, self.count, n + 1, self.x, self.y)
        rings.work -= _COUNT
        c = v.chain_of(i)
        c = c if v.kinds[c] & BARRIER else -1
        if c != self._ring:
            self._ring = c
            self.total = rings.enclosed(i, rings.count(i, rings.beside(i, -1)), i, 0, 0)
        return True

    def _passed(self, i, ux, uy):
        # Whether a neighbour of record i lies farther along (ux, uy), the gate as seen from there: another one is shorter.
        for way in range(-1, 2, 2):
            p = self._rings.polar(i, way)
            far = p >> 16
            along = (cosine(p & 0xFFFF) * ux + sine(p & 0xFFFF) * uy) // self.width * far >> 15
            if along > max(_STICK, far >> 2):
                return True
        return False
