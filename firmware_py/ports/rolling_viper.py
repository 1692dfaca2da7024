# collection/rolling.py as machine code, for ports whose MicroPython has the emitter: about 25 times as
# fast, the same results to the last bit (tests/upy/rolling_same.py). accelerate() puts it in place.

# ruff: noqa: F821  (ptr8, ptr16, ptr32 are viper's)

import micropython

from ..collection import rolling
from ..tables import ATAN_BAM, HYPOT_Q16


def accelerate():
    rolling.collect = collect
    rolling.first_free = first_free


@micropython.viper
def collect(xs, ys, buckets, scope, bearings, distances, slots) -> int:
    px = ptr32(xs)
    py = ptr32(ys)
    taken = ptr8(buckets)
    s = ptr32(scope)
    out_b = ptr16(bearings)
    out_d = ptr16(distances)
    out_i = ptr8(slots)
    atan = ptr8(ATAN_BAM)  # by bytes: a literal in flash may lie at an odd address
    hypot = ptr8(HYPOT_Q16)
    sign = 1
    sign = sign << 31  # a 64-bit machine reads 32 bits without their sign: (v ^ sign) - sign gives it back
    x_mm = (s[0] ^ sign) - sign
    y_mm = (s[1] ^ sign) - sign
    heading = s[2] - 32768
    window = s[3]
    nearest = 350
    reference = 350
    front = 350 + s[8]
    n = 0
    i = 0
    while i < 64:
        if taken[i] != 255:
            dx = (px[i] ^ sign) - sign - x_mm
            dy = (py[i] ^ sign) - sign - y_mm
            if -350 < dx and dx < 350 and -350 < dy and dy < 350 and dx * dx + dy * dy < 122500:
                ax = dx if dx >= 0 else 0 - dx
                ay = dy if dy >= 0 else 0 - dy
                if ax >= ay:
                    if ax == 0:
                        b = 0
                        d = 0
                    else:
                        k = ((ay << 8) + (ax >> 1)) // ax << 1
                        b = atan[k] | atan[k + 1] << 8
                        d = ax + ((ax * (hypot[k] | hypot[k + 1] << 8)) >> 16)
                else:
                    k = ((ax << 8) + (ay >> 1)) // ay << 1
                    b = 16384 - (atan[k] | atan[k + 1] << 8)
                    d = ay + ((ay * (hypot[k] | hypot[k + 1] << 8)) >> 16)
                if dx < 0:
                    b = 32768 - b
                if dy < 0:
                    b = 0 - b
                b = (((b & 0xFFFF) - heading) & 0xFFFF) - 32768
                out_b[n] = b
                out_d[n] = d
                out_i[n] = i
                n += 1
                if d < nearest:
                    nearest = d
                if d < reference and (b <= window or b >= 29127):
                    reference = d
                    s[6] = b if b < 29127 else b - 65536
                if d < front and -7300 < b and b < 7300:
                    front = d
        i += 1
    s[4] = nearest
    s[5] = reference
    s[7] = front
    return n


@micropython.viper
def first_free(bearings, distances, blocks, n: int, disc_mm: int, slope: int, start: int, heading: int) -> int:
    of_b = ptr16(bearings)
    of_d = ptr16(distances)
    wide = ptr16(blocks)
    i = 0
    while i < n:
        d = of_d[i] - disc_mm
        if d > 0:
            d = 16384 - d * slope
            if d < 0:
                d = 0
        else:
            if d < -90:
                d = -90
            d = 16384 - d * 131
        wide[i] = d
        i += 1
    moved = 1
    while moved:
        moved = 0
        i = 0
        while i < n:
            a = wide[i]
            if a > 0:
                d = ((heading - of_b[i] + 32768) & 0xFFFF) - 32768
                if 0 - a < d and d < a:
                    heading += a - d
                    moved = 1
            i += 1
        if heading - start > 65536:
            return 2097152
    return heading
