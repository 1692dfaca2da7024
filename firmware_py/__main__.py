# micropython -X heapsize=288k -m firmware_py PATH        or        python -m firmware_py PATH
# PATH: a serial port or a pty; slcan:PATH or slcan-fd:PATH where an SLCAN adapter is there

import sys


def run():
    path = sys.argv[1] if len(sys.argv) == 2 else ""
    if path in ("", "slcan:", "slcan-fd:"):
        print("usage: firmware_py PATH    (the serial port or pty on which the core speaks, slcan:PATH for a CAN adapter on it)")
        return 2
    from firmware_py.limits import UNIX_HEAP_BYTES
    try:
        if path.startswith("slcan:") or path.startswith("slcan-fd:"):
            from firmware_py.main_can import main_can as main
        else:
            from firmware_py.main import main
        return main(path)
    except MemoryError:
        print("tvslam: the heap is too small to boot: give at least", UNIX_HEAP_BYTES // 1024, "KiB, as in -X heapsize=288k")
        return 4
    except KeyboardInterrupt:
        return 130


sys.exit(run())
