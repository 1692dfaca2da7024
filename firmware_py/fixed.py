# Fixed-point geometry. Angles are BAM: 65536 = one turn, wrapped by mask; sines Q15.
# Every argument and result, and all in between, stays below 2**30 in magnitude.

from .tables import SINE_Q15, ATAN_BAM, HYPOT_Q16, POWER2_Q16

TURN = 65536
HALF_TURN = 32768
QUARTER_TURN = 16384


def sine(bam):
    # Q15 sine, |error| <= 2: quarter table of 128 steps, linear between.
    q = bam & 0x7FFF
    if q > 16384:
        q = 32768 - q
    i = (q >> 7) << 1
    a = SINE_Q15[i] | SINE_Q15[i + 1] << 8
    f = q & 127
    if f:
        a += ((SINE_Q15[i + 2] | SINE_Q15[i + 3] << 8) - a) * f >> 7
    return -a if bam & 0x8000 else a


def cosine(bam):
    return sine(bam + 16384)


def wrap(bam):
    # The same angle in -32768..32767.
    return ((bam + 32768) & 0xFFFF) - 32768


def int16(value):
    # What an array "h" holds that is nearest to it: MicroPython's takes the lower bits of more, CPython's refuses it.
    return -32768 if value < -32768 else 32767 if value > 32767 else value


def polar(dx, dy):
    # Distance << 16 | bearing (0..65535) of (dx, dy), packed so that one small int
    # comes back and nothing is allocated. Distance below 16384; bearing within 0.12 degrees.
    ax = dx if dx >= 0 else -dx
    ay = dy if dy >= 0 else -dy
    if ax >= ay:
        if ax == 0:
            return 0
        i = ((ay << 8) + (ax >> 1)) // ax << 1
        b = ATAN_BAM[i] | ATAN_BAM[i + 1] << 8
        d = ax
    else:
        i = ((ax << 8) + (ay >> 1)) // ay << 1
        b = 16384 - (ATAN_BAM[i] | ATAN_BAM[i + 1] << 8)
        d = ay
    d += d * (HYPOT_Q16[i] | HYPOT_Q16[i + 1] << 8) >> 16
    if dx < 0:
        b = 32768 - b
    if dy < 0:
        b = -b
    return d << 16 | (b & 0xFFFF)


def isqrt(n):
    # Floor of the square root of 0 <= n < 2**30: Newton from above, about five rounds.
    if n < 4096:
        if n < 2:
            return n
        root = 64
    elif n < 262144:
        root = 512
    elif n < 16777216:
        root = 4096
    else:
        root = 32768
    better = (root + n // root) >> 1
    while better < root:
        root = better
        better = (root + n // root) >> 1
    return root


def power2(exponent_q12):
    # 1000 * 2**(exponent / 4096), for exponents from -12 to +12; outside clamped there.
    if exponent_q12 < -49152:
        exponent_q12 = -49152
    elif exponent_q12 > 49152:
        exponent_q12 = 49152
    i = (exponent_q12 >> 6 & 63) << 1
    a = POWER2_Q16[i] | POWER2_Q16[i + 1] << 8
    a += ((POWER2_Q16[i + 2] | POWER2_Q16[i + 3] << 8) - a) * (exponent_q12 & 63) >> 6
    a = 16000 + (a * 1000 >> 12)  # 1000 * 2**fraction, 4 bits more
    exponent_q12 >>= 12
    if exponent_q12 >= 4:
        return a << exponent_q12 - 4
    return a >> 4 - exponent_q12


def ratio(numerator, denominator, divisor, bits):
    # floor(numerator / denominator / divisor * 2**bits) by long division, two
    # dividers in a row, so that no product is ever formed.
    quotient = numerator // denominator
    rest = numerator - quotient * denominator
    result = quotient // divisor
    rest2 = quotient - result * divisor
    while bits:
        bits -= 1
        rest <<= 1
        rest2 <<= 1
        result <<= 1
        if rest >= denominator:
            rest -= denominator
            rest2 += 1
        if rest2 >= divisor:
            rest2 -= divisor
            result += 1
    return result
