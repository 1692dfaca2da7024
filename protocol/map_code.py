# The map as the device stores and sends it: every vector by how it goes on from the one before, coded as it is likely.

from array import array

from protocol.range_code import close_range, code_bit, code_number, forget, open_range

try:
    from micropython import const
except ImportError:
    def const(value):
        return value

MAGIC = b"TVM2"
HEADER_BYTES = 10      # magic, vectors u16, chains u8, regions u8, nodes u8, edges u8
MODEL_PLACES = 128
STEP_BYTES_MAX = 64    # what a step() writes stays below

# where things begin in the graph's `shared`: x, y of node n at 2 n; first edge | how many << 8; to | region << 8
ABOUT = 192
EDGES = 288

_BARRIER = const(1)
_LONG = const(200)     # map units: as long a vector is a long one
_NEAR = const(2)       # that near to where another vector ended
_ENDS = const(8)       # so many such places of the last vectors, for each axis
_AHEAD = const(4)      # what is nearer than that is behind

# places of the model, for vectors and chains ...
_TURN = const(0)       # 27: by the two turns before
_OFF = const(29)       # 1 + 2
_LENGTH = const(32)    # 12
_ASIDE = const(44)     # 4 times 1 + 6
_SIGMA = const(72)     # 1 + 5
_FLAGS = const(78)     # 4 + 3 + 1 + 2 + 1
_COUNT = const(89)     # 8
_KIND = const(97)      # 4
_START = const(101)    # 1 + 13
_WHICH = const(115)    # 4
_KNOWN = const(119)    # 3 times 2
# ... and, when all is forgotten, for regions, nodes and edges
_FAR = const(0)        # 1 + 13
_GATE = const(14)      # 1 + 9
_MANY = const(24)      # 11
_AREA = const(35)      # 13
_LINES = const(48)     # 6
_FEW = const(54)       # 4
_NEXT = const(58)      # 6
_PARENT = const(64)    # 5
_EDGES = const(69)     # 5
_FLAG = const(74)      # 1


class MapCode:
    # begin(model, buf, reads, mask), then step() until True. The same steps write and read, here and on the host, by `store` (xs, ys,
    # sigmas, flags, firsts, counts, kinds, used, chains) and `graph` (regions, shared, region_count, node_count, edge_count, ready),
    # as firmware_py/storage has them. Who reads sets the counts first: the header has them. Without `ready` the graph is left out.
    # What can be told from the rest is not coded: where a chain or a node's edges begin. Allocates in __init__ only.

    def __init__(self, store, graph):
        self.s = array("i", bytes(24))
        self._v = store
        self._g = graph
        self._model = None
        self._buf = None
        self._chain = 0        # then the region, node, edge
        self._k = 0            # record of the chain; -1: the chain itself comes
        self._half = False     # the place of record k is coded, what record k - 1 is like comes
        self._part = 0
        self._x = 0
        self._y = 0
        self._turns = 0        # left 1, right 2, else 0: of the last two, 3 times the one before + the last
        self._way = 0          # east, north, west, south: nearly so lies the last vector
        self._turn = 0         # by so many quarters it turned
        self._length = 0
        self._ends = array("h", bytes(4 * _ENDS))   # x, and y, where vectors ended that led along that axis, the last one first
        self._sigma = 0

    def begin(self, model, buf, reads, mask):
        self._model = model
        self._buf = buf
        open_range(self.s, buf, reads, mask)
        forget(model, MODEL_PLACES)
        self._chain = -1
        self._next_chain()
        self._part = self._x = self._y = self._sigma = 0
        for i in range(2 * _ENDS):
            self._ends[i] = 0

    def step(self):
        # One chain's head, one vector, half of it, or one thing of the graph. -> True when all is coded
        if self._part == 0:
            if self._chain < self._v.chains:
                if self._k < 0:
                    self._head()
                elif self._half:
                    self._attributes()
                else:
                    self._place()
                return False
            self._x = self._y = 0
            forget(self._model, MODEL_PLACES)
        elif self._part == 1 and self._chain < self._g.region_count:
            self._region()
        elif self._part == 2 and self._chain < self._g.node_count:
            self._node()
        elif self._part == 3 and self._chain < self._g.node_count:
            self._edges()
            return False
        else:
            self._chain = -1
        self._chain += 1
        if self._chain == 0 or self._part == 0:
            self._chain = self._k = 0
            self._part += 1
            if not self._g.ready or self._part == 4:
                close_range(self.s, self._buf)
                return True
        return False

    def _bit(self, i, bit):
        return code_bit(self.s, self._model, self._buf, i, bit)

    def _number(self, first, size, value):
        return code_number(self.s, self._model, self._buf, first, size, value)

    def _signed(self, first, size, value):
        n = self._number(first + 1, size, abs(value))
        return -n if n and self._bit(first, 1 if value < 0 else 0) else n

    def _bits(self, n, value):
        # n bits of which nothing is known.
        got = 0
        while n:
            n -= 1
            got = got << 1 | self._bit(-1, value >> n & 1)
        return got

    def _head(self):
        v = self._v
        c = self._chain
        v.firsts[c] = v.firsts[c - 1] + v.counts[c - 1] if c else 0
        v.counts[c] = self._number(_COUNT, 8, v.counts[c])
        kind = 0
        for i in range(3):
            kind |= self._bit(_KIND + i, v.kinds[c] >> i & 1) << i
        region = v.kinds[c] >> 3
        if self._bit(_KIND + 3, 1 if region else 0):
            kind |= self._bits(5, region) << 3
        v.kinds[c] = kind
        self._k = self._way = self._turns = 0
        if v.counts[c] == 0:
            self._next_chain()

    def _next_chain(self):
        self._chain += 1
        self._k = -1
        self._half = False

    def _place(self):
        # Of record k, as seen from the one before; behind the last one comes the first, which is known.
        v = self._v
        first = v.firsts[self._chain]
        k = self._k
        n = v.counts[self._chain]
        i = first + k if k < n else first
        dx = _wrapped(v.xs[i] - self._x)
        dy = _wrapped(v.ys[i] - self._y)
        if k == 0:
            dx = self._signed(_START, 13, dx)
            dy = self._signed(_START, 13, dy)
        else:
            self._half = True
            way = (0 if dx >= 0 else 2) if abs(dx) >= abs(dy) else 1 if dy > 0 else 3
            length = abs(dx) if way & 1 == 0 else abs(dy)
            aside = dy if way == 0 else -dx if way == 1 else -dy if way == 2 else dx
            turn = way - self._way & 3
            if k < n:
                turn = self._turned(turn)
                way = self._way + turn & 3
                length = self._long(length, way, turn)
                aside = self._signed(_ASIDE + 7 * ((length >= 8) + (length >= 32) + (length >= 128)), 6, aside)
                dx = length if way == 0 else -aside if way == 1 else -length if way == 2 else aside
                dy = aside if way == 0 else length if way == 1 else -aside if way == 2 else -length
            self._turns = self._turns % 3 * 3 + (turn & 1) + (turn == 3)
            self._turn = turn
            self._way = way
            self._length = length
        self._k = k + 1
        if k < n:
            self._x = v.xs[i] = _wrapped(self._x + dx)
            self._y = v.ys[i] = _wrapped(self._y + dy)

    def _turned(self, turn):
        i = _TURN + 3 * self._turns
        odd = self._bit(i, turn & 1)
        return odd | self._bit(i + 1 + odd, turn >> 1) << 1

    def _long(self, length, way, turn):
        # A vector often ends where others along its axis ended lately: which of those ahead is it, and how far off?
        odd = way & 1
        here = self._y if odd else self._x
        sign = 1 if way < 2 else -1
        which = -1
        ahead = 0
        for k in range(odd * _ENDS, odd * _ENDS + _ENDS):
            far = (self._ends[k] - here) * sign
            if far >= _AHEAD:
                if which < 0 and -_NEAR <= far - length <= _NEAR:
                    which = ahead
                ahead += 1
        k = odd * _ENDS + _ENDS - 1
        if ahead and self._bit(_KNOWN + 2 * min(ahead - 1, 2) + ((turn & 1) + (turn == 3) == self._turns % 3), 1 if which >= 0 else 0):
            which = self._number(_WHICH, 4, which)
            k = odd * _ENDS
            far = (self._ends[k] - here) * sign
            while k < odd * _ENDS + _ENDS - 1 and (which or far < _AHEAD):
                which -= far >= _AHEAD
                k += 1
                far = (self._ends[k] - here) * sign
            length = far + self._signed(_OFF, 2, length - far)
        else:
            length = self._number(_LENGTH, 12, length)
        while k > odd * _ENDS:
            self._ends[k] = self._ends[k - 1]
            k -= 1
        self._ends[k] = _wrapped(here + sign * length)
        return length

    def _attributes(self):
        v = self._v
        i = v.firsts[self._chain] + self._k - 2
        self._half = False
        if not self._bit(_SIGMA, 1 if v.sigmas[i] == self._sigma else 0):
            self._sigma = self._number(_SIGMA + 1, 5, v.sigmas[i])
        v.sigmas[i] = self._sigma
        was = v.flags[i]
        last = self._k > v.counts[self._chain]
        flags = self._bit(_FLAGS + self._turn, was & 1)
        flags |= self._bit(_FLAGS + 4 + (self._length >= _LONG) + (self._length > _LONG - 10), was >> 1 & 1) << 1
        flags |= self._bit(_FLAGS + 7, was >> 2 & 1) << 2
        flags |= self._bit(_FLAGS + 8 + last, was >> 3 & 1) << 3
        if self._bit(_FLAGS + 10, 1 if was >> 4 else 0):
            flags |= self._bits(4, was >> 4) << 4
        v.flags[i] = flags
        if last:
            self._next_chain()

    def _region(self):
        g = self._g.regions
        i = 6 * self._chain
        g[i] = self._number(_MANY, 11, g[i])
        g[i + 1] = self._number(_MANY, 11, g[i + 1])
        g[i + 2] = self._number(_AREA, 13, g[i + 2])
        lines = self._number(_LINES, 6, g[i + 3] & 255)
        g[i + 3] = lines | self._number(_LINES, 6, g[i + 3] >> 8) << 8
        parent = self._number(_PARENT, 5, g[i + 4] & 255)
        g[i + 4] = parent | self._number(_FEW, 4, g[i + 4] >> 8) << 8
        g[i + 5] = self._number(_FEW, 4, g[i + 5])

    def _node(self):
        # A gate's from where its region's range begins, the others from the one before.
        v = self._v
        s = self._g.shared
        n = self._chain
        first = _FAR
        size = 13
        if n + 1 < self._g.region_count:
            i = self._g.regions[6 * n + 6]
            first = _GATE
            size = 9
            self._x = v.xs[i]
            self._y = v.ys[i]
        self._x = _wrapped(self._x + self._signed(first, size, _wrapped(s[2 * n] - self._x)))
        self._y = _wrapped(self._y + self._signed(first, size, _wrapped(s[2 * n + 1] - self._y)))
        s[2 * n] = self._x & 0xFFFF
        s[2 * n + 1] = self._y & 0xFFFF
        many = self._number(_EDGES, 5, s[ABOUT + n] >> 8)
        s[ABOUT + n] = many << 8 | self._k
        self._k += many

    def _edges(self):
        # One edge of the node: they lead to ever higher ones.
        s = self._g.shared
        n = self._chain
        if self._k == (s[ABOUT + n] & 255) + (s[ABOUT + n] >> 8):
            self._chain += 1
            return
        k = EDGES + self._k
        low = s[k - 1] & 255 if self._k > s[ABOUT + n] & 255 else n
        to = low + 1 + self._number(_NEXT, 6, (s[k] & 255) - low - 1)
        region = s[k - 1] >> 8 if self._k else 0
        if not self._bit(_FLAG, 1 if s[k] >> 8 == region else 0):
            region = self._bits(5, s[k] >> 8)
        s[k] = to | region << 8
        self._k += 1


def _wrapped(d):
    return (d + 32768 & 0xFFFF) - 32768
