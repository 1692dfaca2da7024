# The firmware on the emulated STM32: as main.py, and it counts what each step costs.

import gc

from .limits import RX_BYTES
from .collection.states import DONE
from .device import Device
from .ports.stm32 import Port


def main(path):
    # Serves the link until its other end closes or Ctrl-C comes on the REPL, then prints what the steps cost.
    # host_tools/qemu.py reads its lines: "tvslam: up", "tvslam: costs LARGEST FINE BINS COARSE COUNT ...", "tvslam: ended CODE".
    gc.threshold(256)  # without it garbage is collected only when the heap has run out, and what lives stands between what died
    port = Port()
    device = Device(port, port.random())
    buf = bytearray(RX_BYTES)
    try:
        port.open(path, buf)
    except OSError as error:
        print("tvslam: " + str(error))
        return
    print("tvslam: up")
    port.lock()
    try:
        serve(device, port, buf)
    finally:
        port.unlock()
        port.close()
    port.print_ticks()
    print("tvslam: ended", 0 if device.core.state == DONE else 3)


def serve(device, port, buf):
    # Until the other end closes. Nothing from here on allocates.
    while True:
        device.greet()
        size = port.read(50)
        if size < 0:
            return
        if size:
            step = device.step_number
            port.begin_tick()
            device.receive(buf, size)
            if device.step_number != step:
                port.end_tick()
