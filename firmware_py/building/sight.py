# Is the straight way free, where does a ray end, is a place inside: asked of all vectors of the map.
#
#   sight = Sight(vectors)
#   sight.clear(x0_mm, y0_mm, x1_mm, y1_mm, margin_mm)   True: no vector comes within margin_mm beside the straight way
#   sight.inside(x_mm, y_mm)                             True: within the outline and in no barrier
#
# Each question is one walk over the map, in `look`. A port may put machine code in its place
# (ports/sight_viper.py): a few ten instructions a vector in the place of some 1,500.

from array import array
from ..fixed import isqrt

_BARRIER = const(1)      # storage/vector_store.py
_SEARCHED = const(4)
_CHAIN_END = const(8)
_FAR = const(16383)      # map units: 82 m
_STEEP = const(11000)    # beyond it a product with the longest vector would pass 2**30

# Places in `scope`, an array "i", lengths in map units of 5 mm:
#   in       0, 1 where the strip begins   2, 3 its direction, Q12   4 half its width   5 chains in the map   6 any hit will do
#   in, out  7 its length; then where along it the first vector is met
#   out      8 the record at whose end that vector lies; -1: none


def look(xs, ys, flags, firsts, counts, kinds, scope):
    # -> how many vectors the strip meets. The outline is one ring, whatever chains it came in. A barrier that was not followed
    # to its end is open; but to a line (half width 0) it is closed, so that a line out of the map meets an odd number from inside.
    x = scope[0]
    y = scope[1]
    ux = scope[2]
    uy = scope[3]
    half = scope[4]
    chains = scope[5]
    reach = scope[7]
    met = 0
    scope[8] = -1
    c = chains - 1
    while c >= 0 and kinds[c] & _BARRIER:
        c -= 1
    tail = firsts[c] + counts[c] - 1 if c >= 0 and (half == 0 or kinds[c] & _SEARCHED) else -1
    c = 0
    while c < chains:
        k = firsts[c]
        end = k + counts[c]
        j = k - 1  # the record that comes before the chain's first one
        if not kinds[c] & _BARRIER:
            j = tail
            tail = end - 1
        elif c == 0 or counts[c - 1] != 255 or flags[j] & _CHAIN_END or not kinds[c - 1] & _BARRIER:
            i = c
            while counts[i] == 255 and i + 1 < chains and not flags[firsts[i] + 254] & _CHAIN_END:
                i += 1
            j = firsts[i] + counts[i] - 1
            if half and (flags[j] & _CHAIN_END or not kinds[i] & _SEARCHED):
                j = -1
        if j < 0:
            j = k
        was = (ys[j] - y) * ux - (xs[j] - x) * uy >> 12
        while k < end:
            across = (ys[k] - y) * ux - (xs[k] - x) * uy >> 12
            if not (across > half and was > half or across <= -half and was <= -half):
                # From (enter, low) up to (leave, high): cut to what lies within the strip.
                low = was if was < across else across
                high = was + across - low
                i = j if was < across else k
                enter = (xs[i] - x) * ux + (ys[i] - y) * uy >> 12
                i = j + k - i
                leave = (xs[i] - x) * ux + (ys[i] - y) * uy >> 12
                shift = 4 if high - low > _STEEP else 0
                run = leave - enter
                rise = high - low >> shift
                if high > half:
                    leave = enter + run * (half - low >> shift) // rise
                if low < -half:
                    enter += run * (-half - low >> shift) // rise
                if enter > leave:
                    i = enter
                    enter = leave
                    leave = i
                if leave >= 0 and enter <= reach:
                    met += 1
                    if enter < scope[7] or scope[8] < 0:
                        scope[7] = enter if enter > 0 else 0
                        scope[8] = k
                    if scope[6]:
                        return met
            was = across
            j = k
            k += 1
        c += 1
    return met


class Sight:
    # Reads the store as it stands; coordinates in mm of the map, kept within +-160 m. A way over 80 m is not clear: ask for
    # it in pieces. clear() looks at the strip between both ends, not beyond them. `scope` tells after met() what was met (see above).
    # Allocates in __init__ only.

    def __init__(self, vectors):
        self.scope = array("i", bytes(36))
        self.chains = -1         # only the first so many; -1: all
        self._vectors = vectors

    def clear(self, x0_mm, y0_mm, x1_mm, y1_mm, margin_mm):
        return self.free(x0_mm // 5, y0_mm // 5, x1_mm // 5, y1_mm // 5, margin_mm // 5)

    def free(self, x0, y0, x1, y1, half):
        # clear(), in map units. Both ends tell the same: the look begins at the lower one.
        if x1 < x0 or x1 == x0 and y1 < y0:
            return self.met(x1, y1, x0 - x1, y0 - y1, half, 1) == 0
        return self.met(x0, y0, x1 - x0, y1 - y0, half, 1) == 0

    def inside(self, x_mm, y_mm):
        return self.met(x_mm // 5, y_mm // 5, _FAR, 0, 0, 0) & 1 == 1

    def met(self, x, y, dx, dy, half, any_hit):
        # Vectors that come within `half` of the way (dx, dy) from (x, y), all in map units. 1 for a way that is too long;
        # one of just _FAR has no end.
        s = self.scope
        if not (-_FAR <= dx <= _FAR and -_FAR <= dy <= _FAR):
            s[8] = -1
            return 1
        length = dx * dx + dy * dy
        shift = 0 if length >= 262144 else 5  # a short one with 5 bits more
        length = isqrt(length << 2 * shift)
        s[0] = x
        s[1] = y
        s[2] = 4096
        s[3] = 0
        if length:
            s[2] = (dx << 12 + shift) // length
            s[3] = (dy << 12 + shift) // length
        s[4] = half
        s[6] = any_hit
        s[7] = 65535 if length == _FAR else length >> shift
        return self._look()

    def _look(self):
        v = self._vectors
        n = v.chains if self.chains < 0 else self.chains
        if n and v.counts[n - 1] == 0:
            n -= 1  # just opened, or the store was full
        self.scope[5] = n
        return look(v.xs, v.ys, v.flags, v.firsts, v.counts, v.kinds, self.scope)
