# The firmware on the emulated STM32: as main.py, and it counts what each step costs.

import gc

from .limits import RX_BYTES
from .collection.states import DONE
from .device import Device
from .ports.slcan import SlcanPort
from .ports.stm32 import USART, Port

_CR = const(13)


def main(path, boot=0):
    # `path`: of the host's, by semihosting; usart2; slcan or slcan-fd, where USART2 leads to a CAN adapter.
    # Serves the link until its other end closes or Ctrl-C comes on the REPL, then prints what the steps cost.
    # host_tools/qemu.py reads its lines: "tvslam: up", "tvslam: costs LARGEST FINE BINS COARSE COUNT ...", "tvslam: ended CODE".
    gc.threshold(256)  # without it garbage is collected only when the heap has run out, and what lives stands between what died
    clock = Port()
    port = clock
    if path == "slcan" or path == "slcan-fd":
        clock.end_byte = _CR    # of a line of the adapter's text
        port = SlcanPort(clock, path == "slcan-fd")
        path = USART
    device = Device(port, clock.random() ^ boot)    # an emulated clock is the same at each boot: `boot` is not
    buf = bytearray(RX_BYTES)
    try:
        port.open(path, buf)
    except OSError as error:
        print("tvslam: " + str(error))
        return
    print("tvslam: up")
    port.lock()
    try:
        serve(device, port, clock, buf)
    finally:
        port.unlock()
        clock.close()
    clock.print_ticks()
    print("tvslam: ended", 0 if device.core.state == DONE else 3)


def serve(device, port, clock, buf):
    # Until the other end closes. Nothing from here on allocates.
    while True:
        device.greet()
        size = port.read(50)
        if size < 0:
            return
        if size:
            step = device.step_number
            clock.begin_tick()
            device.receive(buf, size)
            if device.step_number != step:
                clock.end_tick()
