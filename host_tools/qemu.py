"""The core on an emulated STM32F205: QEMU's machine netduino2, started, spoken to over its REPL, watched and ended.

USART1 carries the REPL, USART2 the robot link; over semihosting the core opens the link's path itself. The ptys of both USARTs
are made before the emulator, which opens them: of a pty that it made itself it sees only once a second whether anybody has opened it.
"""

import itertools
import os
import random
import re
import shutil
import signal
import threading
import time

from host_tools.core_process import MasterPort, private_pty
from host_tools.hil_options import STM32_HEAP_ENOUGH, UsageError
from host_tools.qemu_monitor import Monitor
from host_tools.terminal_port import PortError

COMMAND = "qemu-system-arm"
MACHINE = ("-M", "netduino2", "-display", "none", "-monitor", "none", "-semihosting")
# The part's clock counts instructions, so that costs are measured; without it, it follows the host's, for a core in real time.
BY_INSTRUCTIONS = ("-icount", "shift=3")
BOOT_S = 3.0            # each: the REPL answers, the core is up
USART = "usart2"        # the link's name in firmware_py/ports/stm32.py
ON_USART = (USART, "slcan", "slcan-fd")
BOOT = "BOOT"           # in a script: a number that no other boot has, as the emulator's own clock tells none
SCRIPT = "import tvslam\ntvslam.main(%r, " + BOOT + ")\n"     # which starts the core on a link
RAW_REPL = "raw REPL; CTRL-B to exit\n>"
ASK_S = 0.25
CTRL_A, CTRL_C, CTRL_D = b"\x01", b"\x03", b"\x04"
FAULT = " exception caught:"
FAULT_END = "xPSR:"
SAID_MAX = 1200         # characters of what it printed, in a sentence
TEXT_MAX = 1 << 16
FAILED = 3
# An instruction takes 8 ns of the emulator's time (shift=3), a count of SysTick 1/120 MHz: 25 instructions are 24 counts.
INSTRUCTIONS, COUNTS = 25, 24


class EmulatorError(Exception):
    """One sentence: why there is no core on the emulator, with what it printed."""


def qemu_command():
    found = shutil.which(COMMAND)
    if found is None:
        raise UsageError("--target stm32 needs the command %s, which is not here; install it (Debian, Ubuntu: apt-get install "
                         "qemu-system-arm), or use --target unix." % COMMAND)
    return found


# Contract: `boot` raises EmulatorError, and nothing else does; the process is one of `children` and ends with them.
# `usart` is the path of a pty or port that is there: the emulator opens it as USART2's.
# From `start_core` on it is watched as a Child is: poll() gives None while it serves, else its code, 3 for every
# failure, of which sentence() tells the cause. `boot_s` is the time from power-on until the core said that it is up. Once it has
# ended by wait(), `tick` holds the cost of the steps, but for a core in real time, and memory() tells how deep the stack has been.
class Emulator:
    def __init__(self, children, image, realtime=False, usart=None):
        self.image = image
        self.usart = usart
        self.realtime = realtime
        self.tick = {}
        self.boot_s = None
        self._monitor = Monitor()
        self._children = children
        self._child = self._repl = None
        self._text = ""
        self._link = ""
        self._silent = False  # it ran until we ended it
        self.power_on_s = self._started_s = None
        self._stop = threading.Event()
        self._thread = None

    def boot(self):
        # No session of its own: the link, opened by semihosting, must not become its controlling terminal, as the
        # hang-up at the mission's end would kill it before it has told what the steps cost.
        clock = () if self.realtime else BY_INSTRUCTIONS
        master, slave = private_pty()
        self._repl = MasterPort(master, slave)
        usarts = [os.ttyname(slave)] + ([self.usart] if self.usart else [])
        argv = [qemu_command(), *MACHINE, *_serial(usarts), *clock, *self._monitor.arguments, "-kernel", os.fspath(self.image)]
        self.power_on_s = time.monotonic()
        self._child = self._children.start("the emulator", argv, session=False, pass_fds=self._monitor.fds)
        self._monitor.started()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        asked_s = 0.0

        def answered():
            nonlocal asked_s
            if time.monotonic() - asked_s > ASK_S:  # again: before the part has set up its port, a byte is lost
                asked_s = time.monotonic()
                self._send(CTRL_A)
            return RAW_REPL in self._text
        self._await(answered, "has no REPL")

    def run(self, script):
        """What a script prints that runs to its end on the REPL, before a core is started."""
        self._send_script(script)
        self._await(self._over, "has not run a script to its end")
        self._started_s = None
        return self._printed()

    def start_core(self, link, script=SCRIPT):
        """Serve the host's path `link` by semihosting; or USART2, as itself or as a CAN adapter."""
        self._link = link
        self._send_script((script % link).replace(BOOT, str(random.getrandbits(16))))

    def _send_script(self, script):
        self._text = ""
        self._started_s = time.monotonic()
        self._send(script.encode() + CTRL_D)

    def await_core(self):
        self._await(lambda: self._up() or self._over(), "has not started the core")
        self.boot_s = time.monotonic() - self.power_on_s
        if not self._up():
            raise EmulatorError(self.sentence())

    # As a Child.

    @property
    def popen(self):
        return self

    @property
    def returncode(self):
        return self.poll()

    def poll(self):
        if self._child.poll() is not None or self._faulted():
            return FAILED
        if self._over():
            ended = re.search(r"tvslam: ended (\d+)", self._text)
            return int(ended[1]) if ended else FAILED
        return None

    def wait(self, timeout_s):
        """The mission is over: let the core tell its costs. Over semihosting it sees the link close; over USART2 it is told."""
        if self.poll() is None and self._link in ON_USART:
            self._send(CTRL_C)
        limit = time.monotonic() + timeout_s
        while self.poll() is None and time.monotonic() < limit:
            time.sleep(0.02)
        self.tick = {} if self.realtime else tick_costs(self._text)
        return self.poll()

    def memory(self):
        """Figures of the result's `memory` that the core does not know; the stack's is the deepest since power-on."""
        from host_tools.stm32_image import facts  # here: the other targets need none of it
        of = facts(self.image)
        return {"flash_bytes": of["flash_bytes"], "static_ram_bytes": of["ram_static_bytes"], "boot_s": self.boot_s,
                "stack_peak_bytes": self._monitor.high_water(of["stack_bottom"], of["stack_top"])}

    def stop(self, _patience_s=0):
        """A core that waits in a semihosting call heeds no request: it is ended at once."""
        self._stop.set()
        if self._child is not None:
            self._silent = self._silent or self.poll() is None
            self._child.kill()
        if self._thread is not None:
            self._thread.join(1.0)
        self._monitor.close()
        if self._repl is not None:
            self._repl.close()
            self._repl = None

    def text(self):
        return "\n".join(part for part in (self._child.text().strip(), self._printed()) if part)

    def sentence(self):
        """Why it ended before the mission did, and what it printed."""
        code, printed = self._child.poll(), self._printed()
        if self._faulted():
            why = "the emulated STM32 stopped with a hardware fault"
        elif self._silent or code is None and not self._over():
            why = "the emulator still ran, but the core on it was silent"
        elif code is not None:
            why = "the emulator %s" % ("was ended by signal %s" % _signal_name(-code) if code < 0 else "ended with code %d" % code)
            printed = self.text()
        elif "MemoryError" in printed:
            why = ("the core ran out of heap on the emulated STM32 after boot, when it must ask for none: a bug of the core, please report "
                   "what you did" if self._up() else
                   "the core ran out of heap on the emulated STM32; give --heap %dk or more" % (STM32_HEAP_ENOUGH >> 10))
            printed = "\n".join(line for line in printed.splitlines() if not line.startswith(("Traceback ", "File ")))
        else:
            why = "the core on the emulated STM32 ended before the mission did"
        return "%s. %s" % (why, ("It printed: %s" % _shortened(printed)) if printed else "It printed nothing")

    def _await(self, condition, what):
        limit = time.monotonic() + BOOT_S
        while not condition():
            if self._child.poll() is not None or self._faulted():
                raise EmulatorError(self.sentence())
            if time.monotonic() > limit:
                raise EmulatorError("the emulator %s within %g s. It printed: %s" % (what, BOOT_S, _shortened(self.text()) or "nothing"))
            time.sleep(0.01)

    def _send(self, data):
        try:
            self._repl.write(data)
        except PortError:
            pass  # gone: poll says so

    def _read(self):
        while not self._stop.is_set():
            try:
                data = self._repl.read(0.1)
            except PortError:
                return
            if data:
                self._text = (self._text + data.decode("utf-8", "replace").replace("\r", ""))[-TEXT_MAX:]

    def _up(self):
        return "tvslam: up" in self._text

    def _faulted(self):
        at = self._text.find(FAULT)
        return at >= 0 and FAULT_END in self._text[at:] and self._text.rstrip(" ").endswith("\n")

    def _over(self):
        """The raw REPL frames a script's output and its traceback with Ctrl-D each, and prompts."""
        return self._started_s is not None and self._text.count("\x04") >= 2

    def _printed(self):
        text = self._text.replace("\x04", "\n").removeprefix("OK")
        lines = [line.strip() for line in text.splitlines()]
        return "\n".join(line for line in lines if line not in ("", ">", "tvslam: up"))


def _serial(paths):
    for number, path in enumerate(paths, 1):
        yield from ("-chardev", "serial,id=usart%d,path=%s" % (number, path.replace(",", ",,")), "-serial", "chardev:usart%d" % number)


def tick_costs(text):
    """Figures of the result's `tick` from the core's line of costs; {} without one. p99 is the upper edge of its bin."""
    said = re.search(r"tvslam: costs ((?:\d+ ?)+)", text)
    if not said:
        return {}
    largest, fine, fine_bins, coarse, *bins = (int(word) for word in said[1].split())
    if not sum(bins):
        return {}
    reached = [100 * seen >= 99 * sum(bins) for seen in itertools.accumulate(bins)]
    edge = reached.index(True) + 1
    p99 = min(edge, fine_bins) * fine + max(edge - fine_bins, 0) * coarse
    p99 = largest if edge == len(bins) else min(p99, largest)
    return {"instructions_p99": p99 * INSTRUCTIONS // COUNTS, "instructions_max": largest * INSTRUCTIONS // COUNTS}


def _shortened(text):
    line = " | ".join(text.splitlines())
    return line if len(line) <= SAID_MAX else "... " + line[-SAID_MAX:]


def _signal_name(number):
    try:
        return signal.Signals(number).name
    except ValueError:
        return str(number)
