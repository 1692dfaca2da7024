# Random bytes from a file or a pipe into the core's link, in bulk and one by one: no exception, no allocation.
# arguments: FILE BYTES

from array import array

from protocol.frame_reader import BAD_COBS, BAD_CRC, BAD_HEADER, BAD_LENGTH, BYTES_IN, COUNTERS, FRAMES_IN, OVERRUN
from protocol.link import Link

_CHUNK = 4096
_SINGLY = 16            # of so many chunks one goes in byte by byte
_SUM_MAX = 0x20000000   # where the counter of bytes stays
taken = array("i", [0, 0])  # bytes, chunks


def boot(arguments):
    global link, rx, file, due
    file = open(arguments[0], "rb")
    due = int(arguments[1])
    link = Link(1)
    rx = bytearray(_CHUNK)


def locked():
    size = file.readinto(rx)
    while size:
        if taken[1] % _SINGLY == 3:
            for k in range(size):
                link.feed_byte(rx[k])
        else:
            at = 0
            while at < size:
                at = link.feed(rx, at, size)
        taken[0] += size
        taken[1] += 1
        size = file.readinto(rx)


def report():
    counters = link.counters
    assert taken[0] == due, "%d bytes of %d came" % (taken[0], due)
    assert counters[BYTES_IN] == min(due, _SUM_MAX)
    assert counters[FRAMES_IN] == 0
    dropped = 0
    for cause in (BAD_COBS, BAD_LENGTH, BAD_CRC, BAD_HEADER, OVERRUN):
        dropped += counters[cause]
    assert dropped > min(due // 1000, 65535), "the bytes did not reach the checks"
    print([counters[k] for k in range(COUNTERS)])
