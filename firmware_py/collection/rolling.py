# The loops over the hits: which are near, which heading none of them blocks, and which a beam sees through.
#
# They would be more than half of a step, so a port may put machine code in their place
# (ports/rolling_viper.py); these are what that must agree with, to the last bit.

from ..fixed import polar

REACH_MM = 350        # points farther than this block nothing
BOXED_IN = 1 << 21    # every heading is blocked

_REACH = const(350)
_BOXED = const(1 << 21)
_SLOTS = const(64)
_FREE = const(255)
_INSIDE = const(131)          # BAM a millimetre inside the disc: 7 degrees a cm
_DEEPEST_MM = const(-90)      # deeper inside makes no difference: the block is half a turn wide by then
_FRONT = const(7300)          # 40 degrees: what counts as in front
_GHOST_ARC = const(31290)     # 3 mm beside a ray, as mm * BAM (65536 / 2 pi * 3)
_BEHIND = const(29127)        # 160 degrees left is -200 degrees: still on the right

# Places in `scope`, an array "i":
#   in   0, 1 x, y in mm   2 heading BAM   3 the window's end: the reference's bearing is -200 degrees to this
#   out  4 nearest   5 reference   6 its bearing   7 front: distances in mm, _REACH (front: + body) = none
#   in   8 the body's radius


def collect(xs, ys, buckets, scope, bearings, distances, slots):
    # The hits within reach, by slot: relative bearing, distance, slot. -> how many
    x_mm = scope[0]
    y_mm = scope[1]
    heading = scope[2] - 32768
    window = scope[3]
    nearest = _REACH
    reference = _REACH
    front = _REACH + scope[8]
    n = 0
    for i in range(_SLOTS):
        if buckets[i] != _FREE:
            dx = xs[i] - x_mm
            if -_REACH < dx < _REACH:
                dy = ys[i] - y_mm
                if -_REACH < dy < _REACH and dx * dx + dy * dy < _REACH * _REACH:
                    b = polar(dx, dy)
                    d = b >> 16
                    b = ((b - heading) & 0xFFFF) - 32768
                    bearings[n] = b
                    distances[n] = d
                    slots[n] = i
                    n += 1
                    if d < nearest:
                        nearest = d
                    if d < reference and (b <= window or b >= _BEHIND):
                        reference = d
                        scope[6] = b if b < _BEHIND else b - 65536
                    if d < front and -_FRONT < b < _FRONT:
                        front = d
    scope[4] = nearest
    scope[5] = reference
    scope[7] = front
    return n


def first_free(bearings, distances, blocks, n, disc_mm, slope, start, heading):
    # Counter-clockwise from `heading`, the first that no hit blocks; BOXED_IN after a turn from `start`.
    # A hit at distance d blocks 90 degrees to both sides of its bearing, less slope BAM a mm outside the disc.
    for i in range(n):
        d = distances[i] - disc_mm
        if d > 0:
            d = 16384 - d * slope
            blocks[i] = d if d > 0 else 0
        else:
            blocks[i] = 16384 - (d if d > _DEEPEST_MM else _DEEPEST_MM) * _INSIDE
    moved = True
    while moved:
        moved = False
        for i in range(n):
            a = blocks[i]
            d = (heading - bearings[i] + a) & 0xFFFF  # from the blocked sector's beginning
            if 0 < d < 2 * a:
                heading += 2 * a - d
                moved = True
        if heading - start > 65536:
            return _BOXED
    return heading


def seen_through(bearings, distances, n, bearing, begin_mm, end_mm):
    # Of the first n hits the last that lies on a ray, between begin and end of it: its place, or -1.
    while n > 0:
        n -= 1
        d = distances[n]
        if begin_mm < d < end_mm:
            arc = ((bearings[n] - bearing + 32768) & 0xFFFF) - 32768
            if -2000 < arc < 2000 and -_GHOST_ARC < arc * d < _GHOST_ARC:
                return n
    return -1
