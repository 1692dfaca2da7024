# What of a mission outlives a loss of power, as bytes: all that the map and the search inside the outline need to go on.

from array import array

from .collection.states import BUILD, SELECT
from .limits import BARRIERS_MAX, CELLS_MAX, CHAINS_MAX, CORNERS_MAX, VECTORS_MAX

_PLACE = const(40000)       # where the robot stands when it goes on is known to 100 mm, 1 degree
_ASKEW = const(33000)

# fields, u16
_VECTORS = const(0)
_CHAINS = const(1)
_BARRIERS = const(2)
_CELL_BYTES = const(3)
_GENERATION = const(4)
_REASON = const(5)          # 0: it is still being explored
_ENDED = const(6)           # degraded | finished << 8
_INSIDE = const(7)
_VECTORS_LOST = const(8)
_CHAINS_LOST = const(9)
_BARRIERS_LOST = const(10)
_BEFORE_MM = const(11)
_AFTER_MM = const(12)
_CELL_MM = const(13)        # 0: not begun
_LEFT = const(14)           # map units of 5 mm
_LOW = const(15)
_COLUMNS = const(16)
_ROWS = const(17)
_VISITS = const(18)
_FIELDS = const(19)


class Record:
    # take(): what it is now; then `size`, and byte(i) makes any of its bytes, while nothing of it changes: the robot stands.
    # put(i, byte) from the first to the last is the way back, into the stores themselves, where nothing stands yet: False when it
    # does not fit them. apply() makes it count, drop() forgets it. resume(): the mission goes on from it. news: there are other
    # vectors than it had.
    #
    # Little-endian: the fields above; vectors x int16, y int16, sigma, flags; chains count, kind; barriers x, y, tries; the cells
    # seen, a bit each. Where a chain begins follows from the counts. Regions, nodes and edges are made of the vectors once more.
    # Allocates in __init__ only.

    LAYOUT = 1              # another number for any other order of bytes than this

    def __init__(self, core):
        self.size = 0
        self._core = core
        self._fields = array("H", bytes(2 * _FIELDS))

    def take(self):
        core = self._core
        v = core.vectors
        s = core.search
        f = self._fields
        f[_VECTORS] = v.used
        f[_CHAINS] = v.chains
        f[_BARRIERS] = s.barriers.used
        f[_CELL_BYTES] = (s.columns * s.rows + 15 >> 4) << 1 if s.cell_mm else 0
        f[_GENERATION] = v.generation
        f[_REASON] = core.reason
        f[_ENDED] = core.degraded & 255 | (256 if core.finished else 0)
        f[_INSIDE] = 1 if core.explorer.inside else 0
        f[_VECTORS_LOST] = v.lost
        f[_CHAINS_LOST] = v.chains_lost
        f[_BARRIERS_LOST] = s.barriers.lost
        f[_BEFORE_MM] = min(core.closure.before_mm, 65535)
        f[_AFTER_MM] = min(core.closure.after_mm, 65535)
        f[_CELL_MM] = s.cell_mm
        f[_LEFT] = s.left_mm // 5 & 0xFFFF
        f[_LOW] = s.low_mm // 5 & 0xFFFF
        f[_COLUMNS] = s.columns
        f[_ROWS] = s.rows
        f[_VISITS] = s.visits
        self.size = self._length()

    def _length(self):
        f = self._fields
        return 2 * _FIELDS + 6 * f[_VECTORS] + 2 * f[_CHAINS] + 5 * f[_BARRIERS] + f[_CELL_BYTES]

    def news(self):
        return self._core.vectors.used != self._fields[_VECTORS]

    def explored(self):
        return self._fields[_REASON] != 0

    def byte(self, i):
        f = self._fields
        if i < 2 * _FIELDS:
            return f[i >> 1] >> 8 * (i & 1) & 255
        i -= 2 * _FIELDS
        if i < 6 * f[_VECTORS]:
            v = self._core.vectors
            k = i // 6
            i -= 6 * k
            if i < 4:
                return (v.xs if i < 2 else v.ys)[k] >> 8 * (i & 1) & 255
            return v.sigmas[k] if i == 4 else v.flags[k]
        i -= 6 * f[_VECTORS]
        if i < 2 * f[_CHAINS]:
            v = self._core.vectors
            return v.kinds[i >> 1] if i & 1 else v.counts[i >> 1]
        i -= 2 * f[_CHAINS]
        if i < 5 * f[_BARRIERS]:
            b = self._core.search.barriers
            k = i // 5
            i -= 5 * k
            return (b.xs if i < 2 else b.ys)[k] >> 8 * (i & 1) & 255 if i < 4 else b.marks[k]
        i -= 5 * f[_BARRIERS]
        return self._core.search.seen[2 * CORNERS_MAX + (i >> 1)] >> 8 * (i & 1) & 255

    def put(self, i, byte):
        f = self._fields
        if i < 2 * _FIELDS:
            _half(f, i >> 1, i & 1, byte)
            return i + 1 < 2 * _FIELDS or self._fits()
        i -= 2 * _FIELDS
        if i < 6 * f[_VECTORS]:
            v = self._core.vectors
            k = i // 6
            i -= 6 * k
            if i < 4:
                _signed_half(v.xs if i < 2 else v.ys, k, i & 1, byte)
            else:
                (v.sigmas if i == 4 else v.flags)[k] = byte
            return True
        i -= 6 * f[_VECTORS]
        if i < 2 * f[_CHAINS]:
            v = self._core.vectors
            (v.kinds if i & 1 else v.counts)[i >> 1] = byte
            return True
        i -= 2 * f[_CHAINS]
        if i < 5 * f[_BARRIERS]:
            b = self._core.search.barriers
            k = i // 5
            i -= 5 * k
            if i < 4:
                _signed_half(b.xs if i < 2 else b.ys, k, i & 1, byte)
            else:
                b.marks[k] = byte
            return True
        i -= 5 * f[_BARRIERS]
        _half(self._core.search.seen, 2 * CORNERS_MAX + (i >> 1), i & 1, byte)
        return True

    def _fits(self):
        # Whether the stores of this firmware can hold what the fields tell.
        f = self._fields
        if f[_VECTORS] > VECTORS_MAX or f[_CHAINS] > CHAINS_MAX or f[_BARRIERS] > BARRIERS_MAX or self._length() != self.size:
            return False
        if f[_COLUMNS] > CELLS_MAX or f[_ROWS] > CELLS_MAX:
            return False  # their product would be no small number
        return f[_CELL_BYTES] == ((f[_COLUMNS] * f[_ROWS] + 15 >> 4) << 1 if f[_CELL_MM] else 0) and 8 * f[_CELL_BYTES] <= CELLS_MAX

    def drop(self):
        # Of what was put only the cells would count: all else stands behind what is used.
        for i in range(min(self._fields[_CELL_BYTES], CELLS_MAX // 8) >> 1):
            self._core.search.seen[2 * CORNERS_MAX + i] = 0
        for i in range(_FIELDS):
            self._fields[i] = 0

    def apply(self):
        core = self._core
        v = core.vectors
        s = core.search
        f = self._fields
        first = 0
        for c in range(f[_CHAINS]):
            v.firsts[c] = first
            first += v.counts[c]
        v.used = f[_VECTORS]
        v.chains = f[_CHAINS]
        v.lost = f[_VECTORS_LOST]
        v.chains_lost = f[_CHAINS_LOST]
        v.generation = f[_GENERATION]
        s.barriers.used = f[_BARRIERS]
        s.barriers.lost = f[_BARRIERS_LOST]
        s.cell_mm = f[_CELL_MM]
        s.left_mm = 5 * ((f[_LEFT] ^ 32768) - 32768)
        s.low_mm = 5 * ((f[_LOW] ^ 32768) - 32768)
        s.columns = f[_COLUMNS]
        s.rows = f[_ROWS]
        s.visits = f[_VISITS]
        core.closure.before_mm = f[_BEFORE_MM]
        core.closure.after_mm = f[_AFTER_MM]
        core.reason = f[_REASON]
        core.degraded = f[_ENDED] & 255
        core.finished = f[_ENDED] >> 8 != 0

    def resume(self):
        # In the place of the mission's beginning. What is explored is only built once more.
        core = self._core
        e = core.explorer
        e.inside = core.outline.whole = self._fields[_INSIDE] != 0
        core.localization.restart(_PLACE, _ASKEW)
        core.tally.mix(core.slots.crc[0])
        core.tally.mix(core.slots.crc[1])
        e.end(BUILD if core.reason else SELECT)


def _half(of, i, high, byte):
    of[i] = of[i] & 255 | byte << 8 if high else byte


def _signed_half(of, i, high, byte):
    of[i] = ((of[i] & 255 | byte << 8) ^ 32768) - 32768 if high else byte
