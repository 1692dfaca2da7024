"""A core on the emulated STM32 for a tool: booted, joined by semihosting or its USART, and ended.

`with emulated_core("27k", "semihost") as port:` yields the TerminalPort on which it speaks; `port.child` is the Emulator.
"""

import contextlib
import os
import sys
import tempfile

from host_tools.core_process import CoreError, MasterPort, TargetError, private_pty
from host_tools.hil_options import STM32_HEAP_MAX, UsageError, heap_bytes
from host_tools.launch import stm32_image
from host_tools.processes import Children
from host_tools.qemu import SCRIPT, USART, Emulator, EmulatorError, qemu_command
from host_tools.terminal_port import PortError


@contextlib.contextmanager
def emulated_core(heap, link):
    with Children() as children:
        emulator = None
        try:
            with contextlib.ExitStack() as stack:
                with core_errors():
                    master, slave = private_pty()
                    port = stack.enter_context(EmulatedPort(master, slave))
                    emulator = _emulator(children, heap, os.ttyname(slave) if link == "pty" else None)
                    emulator.boot()
                    port.start_core(emulator)
                yield port
        finally:
            if emulator is not None:
                emulator.stop()  # at once: one that waits in a semihosting call heeds no request


def _emulator(children, heap, usart):
    if heap_bytes(heap) > STM32_HEAP_MAX:
        raise TargetError("--heap %s does not fit the STM32F205's 128 KB of RAM; give at most %dk." % (heap, STM32_HEAP_MAX >> 10))
    qemu_command()
    # Its clock follows the computer's: nothing is measured here, and counting instructions costs it a third of its speed.
    return Emulator(children, stm32_image(heap, _say), realtime=True, usart=usart)


# Our end of a pty whose other end the emulated part opens: as its USART2, or by semihosting when a core is started.
# There, when this is closed, the core ends, and another one may be started on the same emulator.
class EmulatedPort(MasterPort):
    def start_core(self, emulator, script=SCRIPT):
        with tempfile.TemporaryDirectory(prefix="tvslam-") as folder:
            link = os.path.join(folder, "link")     # as long as a mission's, since it lies in the core's heap
            os.symlink(os.ttyname(self._slave), link)
            emulator.start_core(USART if emulator.usart else link, script)
            emulator.await_core()
        self.child = emulator

    def how_it_ended(self):
        return _sentence(self.child.sentence())


def _say(text):
    print(text, file=sys.stderr, flush=True)


@contextlib.contextmanager
def core_errors():
    try:
        yield
    except UsageError as error:
        raise TargetError(str(error)) from None
    except (EmulatorError, PortError) as error:
        raise CoreError(_sentence(error)) from None


def _sentence(error):
    text = str(error)
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
