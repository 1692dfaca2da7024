"""Where the heap of the emulated STM32 goes, byte by byte: measured on it while the core comes up, by gc.mem_alloc().

A second image is made for it, in which a function stands in the place of each constructor. A script
on the REPL gives the VM that function. Each reading is taken when what nobody holds has been
collected, so that the differences are what is kept.
"""

import contextlib
import re
from dataclasses import asdict, dataclass, field

from host_tools.core_process import CoreError, private_pty
from host_tools.core_session import CoreSession
from host_tools.emulated_core import EmulatedPort, core_errors
from host_tools.launch import stm32_image
from host_tools.processes import Children
from host_tools.qemu import Emulator
from protocol.messages import BY_NAME

HEAP = "96k"    # of the image that measures: what a byte is kept for does not depend on it
GRACE_S = 2.0   # for the core to see that its link was closed
MARK = "heap_mark"
BARE = "import gc\ngc.collect()\nprint('@', gc.mem_alloc(), 'vm')\n"
SCRIPT = """import gc, builtins
def reading(name, place=''):
 gc.collect()
 print('@', gc.mem_alloc(), name, place)
def made(name, cls, *args):
 reading('+', name)
 it = cls(*args)
 reading('-', name)
 return it
builtins.%s = made
reading('begin')
import tvslam
reading('imported')
tvslam.main(%%r)
""" % MARK


# The rows in bytes: `imports` what the core's names keep, `objects` by class, in the order in which the core came up, what
# an object kept beside other classes' objects, `others` the rest. Their sum is what gc.mem_alloc() said at the end;
# `apparatus` of that is the measurement's own.
@dataclass
class Ledger:
    vm: int = 0
    apparatus: int = 0
    imports: int = 0
    objects: dict = field(default_factory=dict)
    others: int = 0

    @property
    def sum(self):
        return self.vm + self.apparatus + self.imports + sum(self.objects.values()) + self.others


def read(bare, text, used_bytes):
    """The ledger, from what BARE and SCRIPT printed and what the core said that its heap holds. None if a reading is missing."""
    vm = re.search(r"@ (\d+) vm", bare)
    readings = [(int(used), name, place) for used, name, place in re.findall(r"^@ (\d+) (\S+) ?(\S*)$", text, re.M)]
    if not vm or [name for _, name, _ in readings if name in ("begin", "imported")] != ["begin", "imported"]:
        return None
    ledger = Ledger(vm=int(vm[1]))
    last, outer = ledger.vm, []
    begun = {}  # at each depth: used when the constructor began, and what those within it kept
    for used, name, place in readings:
        if name == "+":
            outer.append(place)
            begun[len(outer)] = [used, 0]
            if len(outer) == 1:
                ledger.others += used - last
        elif name == "-":
            before, within = begun.pop(len(outer))
            outer.pop()
            ledger.objects[place] = ledger.objects.get(place, 0) + used - before - within
            if outer:
                begun[len(outer)][1] += used - before
        elif name == "begin":
            ledger.apparatus += used - last
        else:
            ledger.imports += used - last
        if not outer:
            last = used
    ledger.others += used_bytes - last
    return ledger if not outer else None


def measure(say):
    """-> a Ledger. Raises CoreError."""
    with Children() as children, core_errors(), contextlib.closing(EmulatedPort(*private_pty())) as port:
        emulator = Emulator(children, stm32_image(HEAP, say, MARK))
        try:
            emulator.boot()
            bare = emulator.run(BARE)
            port.start_core(emulator, SCRIPT)
            core = CoreSession(port)
            core.handshake()
            status = core.ask(BY_NAME["STATUS"](flags=0), "STATUS_RSP")
            ledger = read(bare, emulator.text(), status.heap_used_bytes) if status else None
            if ledger is None:
                raise CoreError("The core did not come up as it was measured; it printed: %s" % emulator.text())
            return ledger
        finally:
            emulator.stop()


def figures(port, say):
    """For `budget`: the ledger, and flash and RAM of the core that `port` speaks to, which is ended."""
    from host_tools.stm32_image import facts  # here, as in launch: the other targets need none of it
    emulator = port.child
    port.close()
    emulator.wait(GRACE_S)  # while it waits in a semihosting call, nothing of it can be read
    of, ledger = facts(emulator.image), measure(say)
    return {"ledger": asdict(ledger) | {"sum": ledger.sum}, "memory": emulator.memory(),
            "flash": {"modules": of["modules"], "text_bytes": of["text_bytes"], "flash_bytes": of["flash_bytes"]}}


def report(figures):
    """The files with their flash, the objects with their heap, then the sums."""
    ledger, flash = figures["ledger"], figures["flash"]
    modules = flash["modules"]
    rows = [(path, size, None) for path, size in sorted(modules.items())]
    rows += [("the VM and its REPL", flash["text_bytes"] - sum(modules.values()), ledger["vm"])]
    rows += [("names of the core, imported", None, ledger["imports"])]
    rows += [("objects of %s" % name, None, used) for name, used in sorted(ledger["objects"].items(), key=lambda item: -item[1])]
    rows += [("buffers and calls of the start", None, ledger["others"]), ("(the measurement itself)", None, ledger["apparatus"]),
             ("sum", flash["text_bytes"], ledger["sum"])]
    width = max(len(row[0]) for row in rows)
    lines = ["", "%-*s  %9s  %9s" % (width, "bytes of", "flash", "heap")]
    lines += ["%-*s  %9s  %9s" % (width, name, *("" if size is None else format(size, ",") for size in sizes)) for name, *sizes in rows]
    memory, unmeasured = figures["memory"], ledger["sum"] - ledger["apparatus"]
    return lines + ["", "The heap's sum is what gc.mem_alloc() said in the run that measured. Without the measurement it is %s B, %d B "
                        "from the core's own figure above:" % (format(unmeasured, ","), abs(unmeasured - figures["heap_used_bytes"])),
                    "the VM holds the script that it runs, and the one that reads the bare VM is not the one that starts the core.",
                    "RAM beside the heap: static %s B, stack %s B at its deepest until the core was up (`hil` tells a mission's)." % (
                        format(memory["static_ram_bytes"], ","), format(memory["stack_peak_bytes"], ","))]
