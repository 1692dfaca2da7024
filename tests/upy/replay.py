# Replays a stream of STEP values through the core, on MicroPython or CPython alike:
#
#   micropython -X heapsize=512k tests/upy/replay.py STREAM HASHES
#
# STREAM (int32, little-endian): number of parameters, number of ticks, ints a tick;
# then (id, index, value) of each parameter; then the ticks. HASHES: (lo, hi) u16 after
# each tick. On MicroPython the heap is locked from the first tick to the last, so an
# allocation anywhere in the core ends this script with a MemoryError.
# The last line printed: ticks and bytes allocated while locked.

import gc
import sys
from array import array

sys.path.insert(0, ".")

from firmware_py.pipeline import Tvslam  # noqa: E402

try:
    import micropython
except ImportError:
    micropython = None


def main(stream_path, hashes_path):
    core = Tvslam()
    head = array("i", bytes(12))
    stream = open(stream_path, "rb")
    stream.readinto(head)
    parameters = head[0]
    ticks = head[1]
    triple = array("i", bytes(12))
    for _ in range(parameters):
        stream.readinto(triple)
        core.set_parameter(triple[0], triple[1], triple[2])
    core.begin()
    values = array("i", bytes(4 * head[2]))
    hashes = array("H", bytes(4 * ticks))
    gc.collect()
    allocated = gc.mem_alloc() if micropython else 0
    if micropython:
        micropython.heap_lock()
    try:
        for i in range(ticks):
            stream.readinto(values)
            core.step(values)
            hashes[2 * i] = core.hash_lo
            hashes[2 * i + 1] = core.hash_hi
        if micropython:
            allocated = gc.mem_alloc() - allocated
    finally:
        if micropython:
            micropython.heap_unlock()
    out = open(hashes_path, "wb")
    out.write(hashes)
    out.close()
    print("ticks", ticks, "allocated", allocated)


main(sys.argv[1], sys.argv[2])
