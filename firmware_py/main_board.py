# The firmware on a board with a filesystem, started by its main.py: a host at the link gives the steps, or the
# robot's own sensors do. It has run on the Unix port and on a fake `machine` only, not on silicon.

from protocol.parameters import PARAMETERS

from .limits import RX_BYTES
from .collection.states import DONE, FAILED
from .device import Device
from .ports.machine import Port

_TICK_MS = const(20)


def main(stream=None, robot=None, can=None):
    # Serves the link on `stream` (None: the board's own USB) until it is told to end. `robot` (ports/pins.py), where
    # given, has its sensors asked and its wheels driven each 20 ms, from its start button to the mission's end.
    # `can`: "slcan" or "slcan-fd", where the stream leads to a CAN adapter.
    line = Port()
    port = line
    if can is not None:
        from .ports.slcan import SlcanPort  # here: on a board its code lies in the heap
        port = SlcanPort(line, can == "slcan-fd")
    device = Device(port, port.random())
    if robot is not None:
        tell(device.core, robot.parameters)
    buf = bytearray(RX_BYTES)
    port.open(stream, buf)
    allocated = False
    try:
        port.lock()
        serve(device, port, buf, robot)
    except MemoryError:
        allocated = True
    finally:
        if robot is not None:
            robot.stop()
        port.unlock()
        line.close()
    if allocated:
        print("tvslam: the core asked for memory after boot, which it must never do: please report what you did")
    else:
        line.restart()


def tell(core, told):
    # The robot's own parameters, as a host would send them.
    for i in range(len(PARAMETERS)):
        if PARAMETERS[i][0] in told:
            values = told[PARAMETERS[i][0]]
            for k in range(len(values)):
                if core.set_parameter(i, k, values[k]) != 0:
                    raise ValueError("parameter " + PARAMETERS[i][0] + " cannot be " + str(values[k]))


def serve(device, port, buf, robot):
    # Until the link says that it is over. Nothing from here on allocates.
    due_ms = port.ticks_ms()
    while True:
        device.greet()
        now_ms = port.ticks_ms()
        wait_ms = 50
        if robot is not None:
            wait_ms = (due_ms - now_ms + 0x2000000 & 0x3FFFFFF) - 0x2000000
            if wait_ms <= 0:
                # A tick that came too late is not made up for: the encoders count on.
                due_ms = (due_ms if wait_ms > -_TICK_MS else now_ms) + _TICK_MS
                own_step(device, robot)
                continue
        size = port.read(wait_ms)
        if size < 0:
            return
        if size:
            device.receive(buf, size)


def own_step(device, robot):
    core = device.core
    if not robot.started() or core.state == DONE or core.state == FAILED:
        robot.drive(0, 0)
        return
    values = device.link.values
    values[0] = device.step_number + 1
    robot.sense(values)
    device.step()
    robot.drive(core.left_mm_s, core.right_mm_s)
