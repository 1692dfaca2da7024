# The firmware: boot, allocate, lock the heap, poll for ever.

import sys

from .limits import RX_BYTES
from .collection.states import DONE
from .device import Device

EXIT_CLOSED = 3
EXIT_BUG = 5

if sys.implementation.name == "micropython":
    from .ports.unix import Port, PortError
else:
    from .ports.host import Port, PortError


def main(path):
    return run(Port(), path)


def run(port, path):
    # Opens the link at `path`, waiting for it to appear, and serves it until the other end closes.
    # -> exit code: 0 if the mission had ended by then, 2 for a path that is no terminal, 3 if it had not,
    # 5 for a bug of ours.
    device = Device(port, port.random())
    buf = bytearray(RX_BYTES)
    try:
        port.open(path, buf)
    except PortError as error:
        print("tvslam: " + str(error))
        return 2
    port.lock()
    allocated = False
    try:
        serve(device, port, buf)
    except MemoryError:
        allocated = True
    finally:
        port.unlock()
    if allocated:
        print("tvslam: the core asked for memory after boot, which it must never do: please report what you did")
        return EXIT_BUG
    if device.core.state == DONE:
        return 0
    print("tvslam: " + path + " was closed by its other end before the mission was done: start both again")
    return EXIT_CLOSED


def serve(device, port, buf):
    # Until the other end closes. Nothing from here on allocates.
    while True:
        device.greet()
        size = port.read(50)
        if size < 0:
            return
        if size:
            device.receive(buf, size)
