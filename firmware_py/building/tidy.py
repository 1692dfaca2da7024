# The map without vertices that say nothing: on the line of their neighbours, or where the mapping went on and back again.

from ..fixed import isqrt
from ..storage.vector_store import LONG

_ASIDE = const(2)        # map units of 5 mm: so far from the line of its neighbours a vertex may lie,
_BEYOND = const(32)      # and so far along it before the first or behind the second
_POINT = const(4)        # neighbours nearer to one another have no line: then so far from them
_FAR = const(8000)       # 40 m: what is longer is left as it is
_LONG = const(200)
_LOOKS = const(12)       # a tick; to drop one is as much work, and comes in the next
_CORNERS = const(3)      # a chain keeps as many vertices


class Tidy:
    # step() in slices until True, when nothing more is mapped. What stays keeps its place; the vector over the gap takes the larger
    # deviation. Allocates in __init__ only.

    def __init__(self, vectors):
        self._v = vectors
        self._at = 1

    def step(self):
        v = self._v
        i = self._at
        c = v.chain_of(i)
        looks = _LOOKS
        while looks and i + 1 < v.used:
            looks -= 1
            while c + 1 < v.chains and i >= v.firsts[c] + v.counts[c]:
                c += 1
            n = v.counts[c]
            if n > _CORNERS and v.firsts[c] < i < v.firsts[c] + n - 1 and self._says_nothing(i):
                if looks < _LOOKS - 1:
                    break
                v.sigmas[i - 1] = max(v.sigmas[i - 1], v.sigmas[i])
                v.drop(i, i + 1)
                looks = 0
                i -= 2  # the one before has other neighbours now
            i += 1
        self._at = max(i, 1)
        return i + 1 >= v.used

    def _says_nothing(self, i):
        xs = self._v.xs
        ys = self._v.ys
        ex = xs[i] - xs[i - 1]
        ey = ys[i] - ys[i - 1]
        dx = xs[i + 1] - xs[i - 1]
        dy = ys[i + 1] - ys[i - 1]
        if max(abs(ex), abs(ey), abs(dx), abs(dy)) > _FAR:
            return False
        far = isqrt(dx * dx + dy * dy)
        if far < _POINT:
            return max(abs(ex), abs(ey)) < _POINT
        along = ex * dx + ey * dy
        if abs(ex * dy - ey * dx) > _ASIDE * far or not -_BEYOND * far <= along <= (far + _BEYOND) * far:
            return False
        if far >= _LONG:
            self._v.flags[i - 1] |= LONG
        return True
