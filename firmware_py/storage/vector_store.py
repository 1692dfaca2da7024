# The compact vector store: the map itself (Paper eq. 6), 6 bytes a vector.

from array import array
from ..fixed import int16
from ..limits import VECTORS_MAX, CHAINS_MAX

# flags
CONCAVE = 1        # the vector begins at a concave point (a reflex corner of free space)
LONG = 2           # at least 1 m
SNAPPED = 4        # direction snapped to a dominant axis
CHAIN_END = 8      # last vertex of an open chain: no vector begins here
VISIT = 16         # bits 4-7 count the passes

_MEET = const(40)         # 20 cm

# kind of a chain
OUTLINE = 0
BARRIER = 1
SEARCHED = 4


def move_down(xs, ys, sigmas, flags, begin, i, end):
    # The records i .. end - 1 to `begin` and the places behind it. A port may put machine code in its place (ports/sight_viper.py).
    while i < end:
        xs[begin] = xs[i]
        ys[begin] = ys[i]
        sigmas[begin] = sigmas[i]
        flags[begin] = flags[i]
        begin += 1
        i += 1


class VectorStore:
    # Vertices in map units of 5 mm; a vector runs from its record to the next one of its
    # chain, and the last one of a closed chain back to the first. Length and direction are derived.
    #   vector  x int16, y int16, sigma u8 (mm), flags u8                 6 B
    #   chain   first u16, count u8, kind | searched | region u8          4 B
    # A chain of over 255 records goes on in the next one. Records are appended to the open
    # chain only. Full: the record is refused and counted in `lost`; what stands stays.
    # A vertex beyond int16 (163 m) is clamped there. Allocates in __init__ only. Written by WallMapper,
    # Outline, Closure, Tidy and Partition (its gates stand behind `used`); `generation` changes with every write to the map.

    RECORD_BYTES = 6
    CAPACITY = VECTORS_MAX

    def __init__(self):
        self.xs = array("h", bytes(2 * VECTORS_MAX))
        self.ys = array("h", bytes(2 * VECTORS_MAX))
        self.sigmas = bytearray(VECTORS_MAX)
        self.flags = bytearray(VECTORS_MAX)
        self.firsts = array("H", bytes(2 * CHAINS_MAX))
        self.counts = bytearray(CHAINS_MAX)
        self.kinds = bytearray(CHAINS_MAX)
        self.used = 0
        self.chains = 0
        self.lost = 0
        self.chains_lost = 0
        self.generation = 0

    def open_chain(self, kind):
        if self.chains == CHAINS_MAX:
            self.chains_lost = (self.chains_lost + 1) & 0xFFFF
            return False
        c = self.chains
        self.firsts[c] = self.used
        self.counts[c] = 0
        self.kinds[c] = kind
        self.chains = c + 1
        self.generation = (self.generation + 1) & 0xFFFF
        return True

    def cancel_chain(self):
        # The open chain, if nothing stands in it, was none.
        if self.chains and self.counts[self.chains - 1] == 0:
            self.chains -= 1
            self.generation = (self.generation + 1) & 0xFFFF

    def append(self, x, y, sigma_mm, flags):
        # x, y in map units. False when a store is full or no chain is open.
        c = self.chains - 1
        if c >= 0 and self.counts[c] == 255:
            if self.used == VECTORS_MAX or not self.open_chain(self.kinds[c]):
                self.lost = (self.lost + 1) & 0xFFFF
                return False
            c += 1
        i = self.used
        if c < 0 or i == VECTORS_MAX:
            self.lost = (self.lost + 1) & 0xFFFF
            return False
        self.xs[i] = int16(x)
        self.ys[i] = int16(y)
        self.sigmas[i] = sigma_mm if sigma_mm < 255 else 255
        self.flags[i] = flags
        self.counts[c] += 1
        self.used = i + 1
        self.generation = (self.generation + 1) & 0xFFFF
        return True

    def chain_of(self, i):
        c = self.chains - 1
        while c > 0 and self.firsts[c] > i:
            c -= 1
        return c

    def next_of(self, i):
        # Where the vector that begins at record i ends; -1: none begins there.
        if self.flags[i] & CHAIN_END:
            return -1
        c = self.chain_of(i)
        if i + 1 < self.firsts[c] + self.counts[c]:
            return i + 1
        if self._goes_on(c):
            return i + 1
        if c + 1 == self.chains and not self.kinds[c] & SEARCHED:
            return -1  # still being mapped
        while c and self._goes_on(c - 1):
            c -= 1
        return self.firsts[c]

    def _goes_on(self, c):
        # Whether chain c is a full one that goes on in the next.
        return c + 1 < self.chains and self.counts[c] == 255 and not self.flags[self.firsts[c] + 254] & CHAIN_END

    def split(self, at, kind):
        # The records from `at` on become chains of their own, of this kind; what was before ends there.
        if at >= self.used or at == 0:
            return
        c = self.chain_of(at)
        n = self.firsts[c] + self.counts[c] - at
        if n < self.counts[c]:
            if self.chains == CHAINS_MAX:
                self.chains_lost = (self.chains_lost + 1) & 0xFFFF
                return
            i = self.chains
            while i > c + 1:
                self.firsts[i] = self.firsts[i - 1]
                self.counts[i] = self.counts[i - 1]
                self.kinds[i] = self.kinds[i - 1]
                i -= 1
            self.chains += 1
            self.counts[c] -= n
            c += 1
            self.firsts[c] = at
            self.counts[c] = n
            self.flags[at - 1] |= CHAIN_END
        while c < self.chains:
            self.kinds[c] = kind
            c += 1
        self.generation = (self.generation + 1) & 0xFFFF

    def seal(self, first, chain, kind):
        # The records from `first` on are a whole barrier of this kind. If they are one chain whose ends
        # meet, it closes: its last vertex leads back to the first.
        for c in range(chain, self.chains):
            if not self.kinds[c] & SEARCHED:  # one cut off on the way has its kind
                self.kinds[c] = kind
        last = self.used - 1
        while self._goes_on(chain):
            chain += 1
        if chain + 1 == self.chains and last > first + 1:
            dx = self.xs[last] - self.xs[first]
            dy = self.ys[last] - self.ys[first]
            if -_MEET < dx < _MEET and -_MEET < dy < _MEET:
                self.flags[last] &= ~CHAIN_END & 255
        self.generation = (self.generation + 1) & 0xFFFF

    def drop(self, begin, end):
        # Forget the records begin..end-1; those behind move down, empty chains go. A chain that goes on
        # in the next one is filled from there: only by its 255 records is it known to go on.
        n = end - begin
        if n <= 0 or begin < 0 or end > self.used:
            return
        kept = 0
        goes_on = False
        for c in range(self.chains):
            first = self.firsts[c]
            last = first + self.counts[c]
            full = self.counts[c] == 255 and not self.flags[last - 1] & CHAIN_END
            first -= 0 if first <= begin else n if first >= end else first - begin
            last -= 0 if last <= begin else n if last >= end else last - begin
            if goes_on:
                moved = min(255 - self.counts[kept - 1], last - first)
                self.counts[kept - 1] += moved
                first += moved
            goes_on = full and (goes_on or last > first)
            if last > first:
                self.firsts[kept] = first
                self.counts[kept] = last - first
                self.kinds[kept] = self.kinds[c]
                kept += 1
        self.chains = kept
        move_down(self.xs, self.ys, self.sigmas, self.flags, begin, end, self.used)
        self.used -= n
        self.generation = (self.generation + 1) & 0xFFFF
