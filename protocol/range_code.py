# Numbers as bits whose likelihood is learned on the way, packed by a range coder (a carryless one, 24 bits wide).
#
#   code_bit(s, model, buf, i, bit)               -> the bit: place i of the model tells how likely it is, and learns; i < 0: not so
#   code_number(s, model, buf, first, size, value) -> the value, 0..65535: how many bits value + 1 has, as so many ones and a zero, by the
#                                                   model's `size` places from `first` on; then those bits
#
# The same calls write and read, by s[READS]: who reads gives any value and gets the true one. A place of the model is 16 times the
# probability of a 0 in 2048ths, plus how often it was asked (up to 15). Every int stays below 2**30. A port with the emitter has
# code_bit() and code_number() as machine code (range_code_viper.py).

import sys

try:
    from micropython import const
except ImportError:
    def const(value):
        return value

LOW = 0        # places in s, an array "i"
RANGE = 1
CODE = 2
AT = 3         # bytes written, or read
READS = 4
MASK = 5       # of the place in buf: who writes goes round in a short one

_WIDTH = const(0xFFFFFF)
_TOP = const(0x10000)
_BOTTOM = const(0x1000)
_FRESH = const(0x4000)


def open_range(s, buf, reads, mask):
    s[LOW] = 0
    s[RANGE] = _WIDTH
    s[CODE] = 0
    s[AT] = 0
    s[READS] = reads
    s[MASK] = mask
    if reads:
        s[CODE] = buf[0] << 16 | buf[1] << 8 | buf[2]
        s[AT] = 3


def forget(model, places):
    for i in range(places):
        model[i] = _FRESH


def close_range(s, buf):
    # The shortest that leads into what is left of the range. Who reads takes what follows for zeros; AT is a byte more for him.
    if s[READS]:
        return
    low = s[LOW] + _BOTTOM - 1 >> 12
    buf[s[AT] & s[MASK]] = low >> 4
    buf[s[AT] + 1 & s[MASK]] = low << 4 & 255
    s[AT] += 2


def code_bit(s, model, buf, i, bit):
    p = 1024
    n = 0
    if i >= 0:
        n = model[i] & 15
        p = model[i] >> 4
    low = s[LOW]
    size = s[RANGE]
    bound = (size >> 6) * p >> 5
    if s[READS]:
        bit = 1 if s[CODE] - low >= bound else 0
    if bit:
        low += bound
        size -= bound
        p -= p // (n + 2)
    else:
        size = bound
        p += (2048 - p) // (n + 2)
    if i >= 0:
        model[i] = p << 4 | (n + 1 if n < 15 else n)
    while True:
        if low ^ low + size >= _TOP:
            if size >= _BOTTOM:
                break
            size = -low & _BOTTOM - 1
        if s[READS]:
            s[CODE] = (s[CODE] & 0xFFFF) << 8 | buf[s[AT]]
        else:
            buf[s[AT] & s[MASK]] = low >> 16
        s[AT] += 1
        low = (low & 0xFFFF) << 8
        size <<= 8
    s[LOW] = low
    s[RANGE] = size
    return bit


def code_number(s, model, buf, first, size, value):
    k = 0
    rest = value + 1
    while rest > 1:
        rest >>= 1
        k += 1
    n = 0
    while n < 16 and code_bit(s, model, buf, first + min(n, size - 1), 1 if n < k else 0):
        n += 1
    rest = 1
    for j in range(n):
        rest = rest << 1 | code_bit(s, model, buf, -1, value + 1 >> n - 1 - j & 1)
    return rest - 1


if sys.implementation.name == "micropython":
    try:
        from protocol.range_code_viper import code_bit, code_number  # noqa: F401, F811  (the same, faster)
    except (ImportError, SyntaxError, ValueError):  # a port without the emitter, or .mpy of another machine
        pass
