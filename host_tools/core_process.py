"""A core of its own for a tool: started on a private pty, or found on a port, and stopped again.

`with running_core("unix", "192k") as port:` yields the TerminalPort on which it speaks; without a heap, the target's own.
"""

import argparse
import contextlib
import importlib.util
import os
import pty
import re
import shutil
import sys
import tty

from host_tools.processes import Children
from host_tools.terminal_port import PortClosed, PortError, TerminalPort

TARGETS = "cpython, unix, stm32 or port:DEVICE"
LINKS = ("semihost", "pty")     # of stm32: fast, or its USART
DEFAULT_HEAPS = {"stm32": "27k"}
DEFAULT_HEAP = "192k"
HEAP_MIN, HEAP_MAX = 2 << 10, 1024 << 20


class CoreError(Exception):
    """One sentence: the core could not be had, and what to do. `code` is the exit code that fits."""

    code = 3


class TargetError(CoreError):
    """The target asked for is none, or not to be had here: bad arguments, not a failing core."""

    code = 2


def add_arguments(parser, again=False):
    """`again`: on a parser below one that has them already, so that they may stand behind its words, too."""
    target, heap, link = [argparse.SUPPRESS] * 3 if again else ("unix", None, None)
    parser.add_argument("--target", default=target, metavar="TARGET",
                        help="unix (default): the MicroPython VM; cpython; stm32: the emulated part; or port:DEVICE, a core that already "
                             "runs there")
    add_machine_arguments(parser, heap, link)


def add_machine_arguments(parser, heap=None, link=None):
    parser.add_argument("--heap", type=heap_size, default=heap, metavar="SIZE",
                        help="heap of the MicroPython VM (default 192k on unix, 27k on stm32)")
    parser.add_argument("--link", choices=LINKS, default=link, help="how stm32 is spoken to: semihost (default, fast), or pty, its USART")


def heap_size(text):
    """The text of a size that the VM takes; of others it says nothing that helps, or crashes."""
    if not re.fullmatch(r"[1-9][0-9]{0,9}[kKmM]?", text):
        raise argparse.ArgumentTypeError("%s is no size: give bytes, or a number with k or m, like 192k" % (text or "(empty)"))
    size = int(text.rstrip("kKmM")) * {"k": 1 << 10, "m": 1 << 20}.get(text[-1].lower(), 1)
    if not HEAP_MIN <= size <= HEAP_MAX:
        raise argparse.ArgumentTypeError("%s is %s the VM can have (%dk to %dm): the core is at home in 192k" % (
            text, "less than" if size < HEAP_MIN else "more than", HEAP_MIN >> 10, HEAP_MAX >> 20))
    return text


def packages_folder():
    """The folder that holds firmware_py and protocol, from which the core is started."""
    spec = importlib.util.find_spec("firmware_py")
    if spec is None or not spec.submodule_search_locations:
        raise CoreError("The package firmware_py is not installed beside host_tools: install the whole of tvslam.")
    return os.path.dirname(os.path.abspath(list(spec.submodule_search_locations)[0]))


def micropython_command():
    """The VM that was installed beside this Python, else the one on PATH."""
    beside = os.path.join(os.path.dirname(sys.executable), "micropython")
    found = beside if os.access(beside, os.X_OK) else shutil.which("micropython")
    if found is None:
        raise TargetError("The target unix needs the command micropython, which is not here: pip install 'tvslam[unix]', or use "
                        "--target cpython.")
    return found


def command(target, heap, path):
    """The argument vector that runs the core on the pty `path`, or on the SLCAN adapter slcan:PATH."""
    if target == "cpython":
        return [sys.executable, "-m", "firmware_py", path]
    if target == "unix":
        from host_tools.unix_core import CAN_ENTRY, ENTRY, boot_file  # here: it needs this module
        entry = CAN_ENTRY if path.startswith(("slcan:", "slcan-fd:")) else ENTRY
        return [micropython_command(), "-X", "heapsize=" + heap, str(boot_file(micropython_command(), entry)), path]
    raise TargetError("'%s' is no target: give %s." % (target, TARGETS))


@contextlib.contextmanager
def running_core(target, heap=None, link=None, anew=False):
    """`anew`: for a mission, of which a core has one in a life; one on a board is started once more."""
    if link == "semihost" and target != "stm32":
        raise TargetError("--link semihost is the emulator's: it goes with --target stm32; leave it out.")
    heap = heap or DEFAULT_HEAPS.get(target, DEFAULT_HEAP)
    if target == "stm32":
        from host_tools.emulated_core import emulated_core  # here: the other targets need none of it
        with emulated_core(heap, link or LINKS[0]) as port:
            yield port
        return
    if target.startswith("port:"):
        try:
            port = TerminalPort(target[len("port:"):])
        except PortError as error:
            raise TargetError(str(error)) from None
        with port:
            if anew:
                try:
                    port.start_anew()
                except PortError as error:
                    raise CoreError(str(error)) from None
            yield port
        return
    master, slave = private_pty()
    with Children() as children, MasterPort(master, slave) as port:
        argv = command(target, heap, os.ttyname(slave))
        port.child = children.start("core", argv, cwd=packages_folder())
        yield port


def private_pty():
    master, slave = pty.openpty()
    tty.setraw(slave)
    return master, slave


# Our end of the core's pty: as a TerminalPort, and it knows when the core has died. The other end
# is held open by us as well, so that no hang-up is seen before the core has opened it.
class MasterPort(TerminalPort):

    def __init__(self, master, slave):
        self.child = None
        self._slave = slave
        os.set_blocking(master, False)
        self._adopt(master, "the core's pty")

    def read(self, timeout_s=0.0):
        data = super().read(min(timeout_s, 0.1))
        if not data and self.child is not None and self.child.poll() is not None:
            raise PortClosed(self.how_it_ended())
        return data

    def how_it_ended(self):
        said = self.child.text().strip().splitlines()
        return "The core ended with exit code %d: %s" % (self.child.poll(), said[-1] if said else "it said nothing.")

    def close(self):
        super().close()
        if self._slave >= 0:
            os.close(self._slave)
            self._slave = -1
