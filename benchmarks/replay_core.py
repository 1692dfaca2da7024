# Times the core over a recorded stream, on CPython or MicroPython (tests/upy/replay.py
# describes the file). Prints the mean in tenths of a us, and the slowest step in us.

import gc
import sys
import time
from array import array

sys.path.insert(0, ".")

from firmware_py.pipeline import Tvslam  # noqa: E402

try:
    from micropython import heap_lock, heap_unlock
    from time import ticks_us
except ImportError:

    def ticks_us():
        return time.perf_counter_ns() // 1000

    def heap_lock():
        pass

    heap_unlock = heap_lock


def main(path):
    core = Tvslam()
    stream = open(path, "rb")
    head = array("i", bytes(12))
    stream.readinto(head)
    triple = array("i", bytes(12))
    for _ in range(head[0]):
        stream.readinto(triple)
        core.set_parameter(triple[0], triple[1], triple[2])
    core.begin()
    values = array("i", bytes(4 * head[2]))
    total = worst = 0
    gc.collect()
    heap_lock()
    try:
        for _ in range(head[1]):
            stream.readinto(values)
            begun = ticks_us()
            core.step(values)
            took = ticks_us() - begun
            total += took
            if took > worst:
                worst = took
    finally:
        heap_unlock()
    print(total * 10 // head[1], worst)


main(sys.argv[1])
