# Numbers as bits whose likelihood is learned on the way, packed by a range coder (a carryless one, 24 bits wide: G. Subbotin, 1999).
#
#   code(s, model, buf, i, bit) -> the bit: place i of the model tells how likely it is, and learns; i < 0: as likely as not
#   number(s, model, buf, first, size, value) -> the value, 0..65535: the length of value + 1, then its bits. A model has `size` places
#       for the lengths, and the same number for the bit behind the first.
#
# Both write or read, by s[READS]: who reads gives any bit or value and gets the true one. A place of the model is 16 * probability
# of a 0 in 2048ths + how often it was asked (up to 15), FRESH at the beginning: 15 bits. Every int stays below 2**30.

LOW = 0        # places in s, an array "i"
RANGE = 1
CODE = 2
AT = 3         # bytes put, or read, so far
READS = 4
MASK = 5       # of the place in buf: who writes may do so round a short one, and is read in time

FRESH = 1024 << 4
PUT_MAX = 5    # bytes that one bit can cost at most

_WIDTH = const(0xFFFFFF)
_TOP = const(0x10000)
_BOTTOM = const(0x1000)


def begin(s, model, buf, reads, mask):
    for i in range(len(model)):
        model[i] = FRESH
    s[LOW] = 0
    s[RANGE] = _WIDTH
    s[CODE] = 0
    s[AT] = 0
    s[READS] = reads
    s[MASK] = mask
    if reads:
        s[CODE] = buf[0] << 16 | buf[1] << 8 | buf[2]
        s[AT] = 3


def end(s, buf):
    # The last bytes: the shortest that lead into what is left. Who reads takes what follows for zeros.
    low = s[LOW] + _BOTTOM - 1 >> 12
    buf[s[AT] & s[MASK]] = low >> 4
    buf[s[AT] + 1 & s[MASK]] = low << 4 & 255
    s[AT] += 2


def code(s, model, buf, i, bit):
    p = 1024
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
        if i >= 0:
            p -= p // (n + 2)
    else:
        size = bound
        if i >= 0:
            p += (2048 - p) // (n + 2)
    if i >= 0:
        model[i] = (p if p else 1) << 4 | (n + 1 if n < 15 else n)
    while low ^ low + size < _TOP or size < _BOTTOM:
        pass
    return bit
