# The loops of codec.py as machine code, for ports whose MicroPython has the
# emitter; codec.py falls back to bytecode without it. MicroPython only.

# ruff: noqa: F821  (ptr8 and ptr32 are viper's)

import micropython


@micropython.viper
def take(plan: ptr8, fields: int, repeats: int, buf: ptr8, at: int, values: ptr32, k: int) -> int:
    while repeats > 0:
        repeats -= 1
        i = 0
        while i < fields:
            kind = plan[i]
            i += 1
            if kind == 7:
                bit = 0
                while bit < 80:
                    j = at + (bit >> 3)
                    values[k] = (buf[j] | buf[j + 1] << 8) >> (bit & 7) & 1023
                    k += 1
                    bit += 10
                at += 10
            else:
                value = buf[at]
                if kind < 3:
                    value |= buf[at + 1] << 8
                    if kind == 2 and value > 32767:
                        value -= 65536
                    at += 2
                elif kind < 5:
                    if kind == 4 and value > 127:
                        value -= 256
                    at += 1
                else:
                    value |= buf[at + 1] << 8 | buf[at + 2] << 16
                    high = buf[at + 3]
                    if high < 64:
                        value |= high << 24
                    elif kind == 5 or high < 192 or (high == 192 and value == 0):
                        return 0
                    else:
                        value = value - 16777216 + (high - 255 << 24)
                    at += 4
                values[k] = value
                k += 1
    return 1


@micropython.viper
def put(plan: ptr8, fields: int, repeats: int, buf: ptr8, at: int, values: ptr32, k: int):
    while repeats > 0:
        repeats -= 1
        i = 0
        while i < fields:
            kind = plan[i]
            i += 1
            value = values[k]
            if kind == 7:
                bits = 0
                j = 0
                value = 0
                while j < 8:
                    value |= (values[k + j] & 1023) << bits
                    bits += 10
                    while bits > 7:
                        buf[at] = value
                        at += 1
                        value >>= 8
                        bits -= 8
                    j += 1
                k += 8
            else:
                k += 1
                buf[at] = value
                at += 1
                if kind < 3 or kind > 4:
                    buf[at] = value >> 8
                    at += 1
                    if kind > 4:
                        buf[at] = value >> 16
                        buf[at + 1] = value >> 24
                        at += 2
