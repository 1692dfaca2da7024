# The loop of crc32.py as machine code, for ports whose MicroPython has the
# emitter; crc32.py falls back to bytecode without it. MicroPython only.

# ruff: noqa: F821  (ptr8 and ptr16 are viper's)

import micropython

from protocol.crc32_tables import T0, T1, T2, T3


@micropython.viper
def crc32_into(buf, start: int, end: int, out):
    bytes_in = ptr8(buf)
    t0 = ptr8(T0)
    t1 = ptr8(T1)
    t2 = ptr8(T2)
    t3 = ptr8(T3)
    a = 255
    b = 255
    c = 255
    d = 255
    while start < end:
        i = a ^ bytes_in[start]
        a = b ^ t0[i]
        b = c ^ t1[i]
        c = d ^ t2[i]
        d = t3[i]
        start += 1
    halves = ptr16(out)
    halves[0] = (a | b << 8) ^ 65535
    halves[1] = (c | d << 8) ^ 65535
