# code_bit() and code_number() of range_code.py as machine code, the same to the last bit, for ports whose MicroPython has the
# emitter. MicroPython only.

# ruff: noqa: F821  (ptr8, ptr16, ptr32 are viper's)

import micropython


@micropython.viper
def code_bit(state, places, data, i: int, bit: int) -> int:
    s = ptr32(state)
    model = ptr16(places)
    buf = ptr8(data)
    p = 1024
    n = 0
    if i >= 0:
        n = model[i] & 15
        p = model[i] >> 4
    low = s[0]
    size = s[1]
    at = s[3]
    bound = (size >> 6) * p >> 5
    if s[4]:
        bit = 1 if s[2] - low >= bound else 0
    if bit:
        low += bound
        size -= bound
        p -= p // (n + 2)
    else:
        size = bound
        p += (2048 - p) // (n + 2)
    if i >= 0:
        model[i] = p << 4 | (n + 1 if n < 15 else n)
    again = True
    while again:
        if low ^ (low + size) >= 65536:
            again = size < 4096
            size = (0 - low) & 4095 if again else size
        if again:
            if s[4]:
                s[2] = (s[2] & 65535) << 8 | buf[at]
            else:
                buf[at & s[5]] = low >> 16
            at += 1
            low = (low & 65535) << 8
            size <<= 8
    s[0] = low
    s[1] = size
    s[3] = at
    return bit


@micropython.viper
def code_number(s, model, buf, first: int, size: int, value: int) -> int:
    k = 0
    rest = value + 1
    while rest > 1:
        rest >>= 1
        k += 1
    n = 0
    more = True
    while more:
        i = n if n < size else size - 1
        more = n < 16 and int(code_bit(s, model, buf, first + i, 1 if n < k else 0)) != 0
        n = n + 1 if more else n
    rest = 1
    while n > 0:
        n -= 1
        rest = rest << 1 | int(code_bit(s, model, buf, -1, (value + 1) >> n & 1))
    return rest - 1
