# Inside the VM: `micropython -m tests.upy.locked MODULE [ARGUMENT ...]`, see run.py.
# boot() allocates what the script needs, locked() runs under heap_lock, report() asserts and prints.

import gc
import sys


def main():
    name = sys.argv[1]
    module = __import__(name, None, None, ["locked"])
    module.boot(sys.argv[2:])
    if sys.implementation.name != "micropython":
        module.locked()
        module.report()
        return
    import micropython
    locked = module.locked
    gc.collect()
    before = gc.mem_alloc()
    micropython.heap_lock()
    try:
        locked()
    finally:
        micropython.heap_unlock()
    after = gc.mem_alloc()
    module.report()
    if after > before:
        raise AssertionError("%d bytes were allocated with the heap locked" % (after - before))


main()
