# Random bytes into the parser, in bulk and one by one: no exception, no allocation. arguments: MEGABYTES SEED

from array import array

from protocol.frame_reader import BAD_COBS, BAD_CRC, BAD_HEADER, BAD_LENGTH, BYTES_IN, COUNTERS, FRAMES_IN, OVERRUN
from protocol.link import Link

_CHUNK = 256
generator = array("i", [1])


def boot(arguments):
    global link, rx, chunks
    chunks = int(float(arguments[0]) * 1000000) // _CHUNK
    generator[0] = int(arguments[1])
    link = Link(1)
    rx = bytearray(_CHUNK)


def locked():
    seed = generator[0]
    for chunk in range(chunks):
        mask = 31 if chunk & 2 else 255  # small numbers: more delimiters, and COBS that holds
        for k in range(_CHUNK):
            seed = (seed * 4093 + 12345) & 0x3FFFF  # 18 bits: the product stays below 2**30
            rx[k] = seed >> 7 & mask
        if chunk & 1:
            at = 0
            while at < _CHUNK:
                at = link.feed(rx, at, _CHUNK)
        else:
            for k in range(_CHUNK):
                link.feed_byte(rx[k])


def report():
    counters = link.counters
    assert counters[BYTES_IN] == chunks * _CHUNK
    assert counters[FRAMES_IN] == 0
    dropped = 0
    for cause in (BAD_COBS, BAD_LENGTH, BAD_CRC, BAD_HEADER, OVERRUN):
        dropped += counters[cause]
    assert dropped > chunks // 2, "the bytes did not reach the checks"
    print([counters[k] for k in range(COUNTERS)])
