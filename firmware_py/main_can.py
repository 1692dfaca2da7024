# The firmware on a CAN bus: as main.py, the link being an SLCAN adapter on a serial port or a pty.

from .main import Port, run
from .ports.slcan import SlcanPort


def main_can(path):
    # slcan:PORT (CAN 2.0A) or slcan-fd:PORT (CAN FD)
    return run(SlcanPort(Port(), path.startswith("slcan-fd:")), path[path.find(":") + 1:])
