# COBS without moving a byte. Below 254 bytes every code byte but the first
# stands where the data has a zero, so that the frame keeps its place:
#
#   [start]           the one byte of overhead (on encoding: free for us to write)
#   [start+1 .. end)  the data
#
# Both directions work in place in the caller's bytearray and allocate nothing.

_ZERO = b"\0"


def encoded_size_max(size):
    return size + 1  # holds below 254 bytes; a frame has at most 105


def encode(buf, start, end):
    # After this [start .. end) holds no zero. Needs end - start < 255.
    at = start
    while True:
        zero = buf.find(_ZERO, at + 1, end)
        if zero < 0:
            buf[at] = end - at
            return
        buf[at] = zero - at
        at = zero


def decode(buf, start, end):
    # True: the data is in [start+1 .. end). False: no COBS, and [start .. end) is spoilt.
    at = start
    while at < end:
        code = buf[at]
        if code == 0:
            return False
        buf[at] = 0
        at += code
    return at == end
