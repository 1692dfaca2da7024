# The core's innermost loops (of rolling.py, infrared.py, uwb.py in collection/) as machine code, for ports whose
# MicroPython has the emitter: about 25 times as fast, the same results to the last bit (tests/upy/rolling_same.py).
# accelerate() puts them in place.

# ruff: noqa: F821  (ptr8, ptr16, ptr32 are viper's)

import micropython

from ..building import frontier, passage, sight
from ..collection import infrared, rolling, uwb
from ..collection.infrared_curve import RANGE_MM8
from ..storage import vector_store
from . import frontier_viper, sight_viper
from ..tables import ATAN_BAM, HYPOT_Q16, POWER2_Q16, SINE_Q15


def accelerate():
    rolling.collect = collect
    rolling.first_free = first_free
    rolling.seen_through = seen_through
    infrared.project = project
    uwb.weigh = weigh
    sight.look = sight_viper.look
    passage.narrow = sight_viper.narrow
    passage.trace = sight_viper.trace
    vector_store.move_down = sight_viper.move_down
    frontier.choose = frontier_viper.choose
    frontier.offer = frontier_viper.offer
    frontier.next_best = frontier_viper.next_best


@micropython.viper
def collect(px: ptr32, py: ptr32, taken: ptr8, s: ptr32, out_b: ptr16, out_d: ptr16, out_i: ptr8) -> int:
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
            if (dx + 512 | dy + 512) & -1024 == 0 and dx * dx + dy * dy < 122500:
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
                b = (b - heading & 0xFFFF) - 32768
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
def first_free(of_b: ptr16, of_d: ptr16, wide: ptr16, n: int, disc_mm: int, slope: int, start: int, heading: int) -> int:
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
            d = heading - of_b[i] + a & 65535
            a += a
            if d < a and d:
                heading += a - d
                moved = 1
            i += 1
        if heading - start > 65536:
            return 2097152
    return heading


@micropython.viper
def seen_through(of_b: ptr16, of_d: ptr16, n: int, bearing: int, begin_mm: int, end_mm: int) -> int:
    while n > 0:
        n -= 1
        d = of_d[n]
        if begin_mm < d and d < end_mm:
            arc = ((of_b[n] - bearing + 32768) & 0xFFFF) - 32768
            if -2000 < arc and arc < 2000 and -31290 < arc * d and arc * d < 31290:
                return n
    return -1


@micropython.viper
def project(counts: ptr32, first: int, x_mm: int, y_mm: int, heading: int, radius_mm: int,
            of_b: ptr16, out: ptr16, out_x: ptr32, out_y: ptr32) -> int:
    curve = ptr8(RANGE_MM8)
    table = ptr8(SINE_Q15)
    seen = 0
    j = 0
    while j < 8:
        d = counts[first + j] & 1023
        if d < 170:
            out[j] = 999
        else:
            seen |= 1 << j
            k = (d >> 3) << 1
            i = curve[k] | curve[k + 1] << 8
            d = (i * 8 + ((curve[k + 2] | curve[k + 3] << 8) - i) * (d & 7) + 32) >> 6
            out[j] = d
            d += radius_mm
            i = heading + of_b[j] + 16384  # first the cosine
            axis = 0
            while axis < 2:
                k = i & 32767
                if k > 16384:
                    k = 32768 - k
                f = k & 127
                k = (k >> 7) << 1
                a = table[k] | table[k + 1] << 8
                if f:
                    a += ((table[k + 2] | table[k + 3] << 8) - a) * f >> 7
                if i & 32768:
                    a = 0 - a
                a = d * a + 16384 >> 15
                if axis == 0:
                    out_x[j] = x_mm + a
                else:
                    out_y[j] = y_mm + a
                i -= 16384
                axis += 1
        j += 1
    return seen


@micropython.viper
def weigh(s: ptr32, records: ptr32, of: ptr32, lately: ptr16, begin: int, end: int) -> int:
    powers = ptr8(POWER2_Q16)
    sign = 1
    sign = sign << 31
    x_mm = (s[5] ^ sign) - sign
    y_mm = (s[6] ^ sign) - sign
    gamma = s[8]
    deviation = 100
    told = 0
    while begin < end:
        d = records[begin]
        begin += 1
        anchor = d >> 16
        d = d & 65535
        i = s[7] + anchor
        dx = (of[i] ^ sign) - sign - x_mm
        dy = (of[i + 32] ^ sign) - sign - y_mm
        dz = of[i + 64]
        good = -20000 < dx and dx < 20000 and -20000 < dy and dy < 20000
        if good and gamma:
            k = (d - 20000) * 13607 // gamma
            if k < -49152:
                k = -49152
            elif k > 49152:
                k = 49152
            i = (k >> 6 & 63) << 1
            d = powers[i] | powers[i + 1] << 8
            d += ((powers[i + 2] | powers[i + 3] << 8) - d) * (k & 63) >> 6
            d = 16000 + (d * 1000 >> 12)
            k >>= 12
            d = d << k - 4 if k >= 4 else d >> 4 - k
            good = 1 < d and d <= 40000
            if good:
                d = d * s[10] >> 12
                deviation = d * s[9] >> 12
        i = dx * dx + dy * dy + dz * dz if good else 0
        if d > 0 and i >= 10000:
            expected = d + i // d >> 1
            expected = expected + i // expected >> 1
            e = expected - d
            likely = deviation
            if s[11]:
                i = e if e >= 0 else 0 - e
                i = i if i < 2000 else 2000
                i = lately[anchor] + (i - lately[anchor] >> 3)
                lately[anchor] = i
                i = i * 5 >> 2
                if i > likely:
                    likely = i
            i = 120 + 4 * deviation
            i = (i if i < 900 else 900) + s[12]
            if e > i or e < 0 - i:
                told += 65792 if e > i + (0 if gamma else 1000) else 256
            elif likely <= s[14]:
                w = 1024
                if likely > 25:
                    w = s[13] // (likely * likely)
                    w = w if w < 1024 else 1024
                dx = (dx << 6) // expected
                dy = (dy << 6) // expected
                s[0] = s[0] + (w * dx * dx >> 10)
                s[1] = s[1] + (w * dx * dy >> 10)
                s[2] = s[2] + (w * dy * dy >> 10)
                s[3] = s[3] + (w * dx * e >> 4)
                s[4] = s[4] + (w * dy * e >> 4)
                told += 1
    return told
