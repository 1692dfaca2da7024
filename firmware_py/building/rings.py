# The map's rings: the outline, in however many chains it came, and each barrier's chain.

from array import array
from ..fixed import polar, wrap
from ..storage.vector_store import BARRIER
from . import passage

_LONGEST = const(11000)      # polar() takes distances below 16384
_TRACE = const(100)          # to begin a trace costs as much as so many of its records,
_LOOK = const(290)           # a look this and a record a vector


class Rings:
    # Reads the vector store; only its chains before `chains` count. Allocates in __init__ only.

    def __init__(self, vectors):
        self.chains = 0
        self.chain = 0        # of the record that was asked for last; 0 whenever the map has changed
        self.far = 0          # since it was set to 0: places too far from one another for areas to be true
        self._v = vectors
        self.work = 0         # left of this tick's, in records of a trace: about 110 instructions each
        self.scope = array("i", bytes(24))

    def beside(self, i, way):
        # The record after (1) or before (-1) record i of its ring.
        v = self._v
        c = self.chain
        if not v.firsts[c] <= i < v.firsts[c] + v.counts[c]:
            c = self.chain = v.chain_of(i)
        i += way
        if v.firsts[c] <= i < v.firsts[c] + v.counts[c]:
            return i
        if not v.kinds[c] & BARRIER:
            c += way
            while c < 0 or c >= self.chains or v.kinds[c] & BARRIER:
                c += way
                if c < 0:
                    c = self.chains - 1
                elif c >= self.chains:
                    c = 0
        return v.firsts[c] if way > 0 else v.firsts[c] + v.counts[c] - 1

    def ahead(self, i, n):
        # The n-th record after record i.
        v = self._v
        while True:
            c = v.chain_of(i)
            i += n
            n = i - v.firsts[c] - v.counts[c]
            if n < 0:
                return i
            i = self.beside(i - n - 1, 1)

    def count(self, i, k):
        # How many records there are from i on to k.
        v = self._v
        c = v.chain_of(i)
        n = k - i
        size = v.counts[c]
        if not v.kinds[c] & BARRIER:
            size = 0
            n = 0
            for c in range(self.chains):
                if not v.kinds[c] & BARRIER:
                    size += v.counts[c]
                    n += min(max(k - v.firsts[c], 0), v.counts[c]) - min(max(i - v.firsts[c], 0), v.counts[c])
        return n % size + 1

    def turn(self, i):
        # How far the ring turns left at record i; not at all where two records are one place.
        on = self.polar(i, 1)
        back = self.polar(i, -1)
        return wrap(on - 32768 - back) if on > 65535 and back > 65535 else 0

    def polar(self, i, way):
        # From record i to the one beside it: distance << 16 | bearing.
        v = self._v
        k = self.beside(i, way)
        return polar(max(-_LONGEST, min(v.xs[k] - v.xs[i], _LONGEST)), max(-_LONGEST, min(v.ys[k] - v.ys[i], _LONGEST)))

    def enclosed(self, first, count, gate, x, y):
        # The area, in 200 mm2, within the records from `first` on and the record `gate`; scope[1] is odd if (x, y) lies within.
        v = self._v
        s = self.scope
        s[0] = x
        s[1] = y
        s[2] = gate
        s[3] = first
        s[4] = count
        s[5] = self.chains
        passage.trace(v.xs, v.ys, v.firsts, v.counts, v.kinds, s)
        self.work -= count + _TRACE
        self.far |= s[1] & passage.FAR
        return s[0]

    def looked(self, sight):
        # A look of this sight's costs as much as these records.
        n = sight.scope[8]
        self.work -= _LOOK + (n if n >= 0 else self._v.used)
