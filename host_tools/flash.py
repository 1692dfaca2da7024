"""`host_tools flash --target stm32`: the firmware image with the core in its flash, built, checked and kept.

The image runs on QEMU's netduino2 (`host_tools hil --target stm32`); it has not run on silicon.
`--target mpremote:DEVICE` is a board with MicroPython on it already: board_flash.py.
"""

import argparse
import shlex
import sys

from host_tools import board_flash, stm32_image
from host_tools.core_process import heap_size
from host_tools.budget import grouped
from host_tools.progress import say
from host_tools.qemu import MACHINE
from host_tools.stm32_tools import ImageError

TARGETS = ("stm32", "mpremote:DEVICE")
BOARD = "mpremote:"
HEAP = "27k"


def add_arguments(parser):
    parser.add_argument("--target", required=True, metavar="TARGET", help="stm32: an image for the emulated STM32F205 (QEMU netduino2); "
                        "mpremote:DEVICE: a board with MicroPython at that serial port")
    parser.add_argument("--micropython", metavar="DIR", default=None,
                        help="source tree of MicroPython 1.25 or newer, left as it is (default: Debian's source package, fetched once)")
    parser.add_argument("--heap", type=heap_bytes, default=HEAP, metavar="SIZE", help="heap of the MicroPython VM (default %s)" % HEAP)
    parser.add_argument("--main", metavar="FILE", default=None,
                        help="on a board: a main.py of yours (default: one that serves the link on its USB)")
    parser.add_argument("--no-start", action="store_true", help="on a board: only copy, leave its main.py as it is, start nothing")


def heap_bytes(text):
    try:
        heap_size(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(str(error).replace("192k", HEAP)) from None
    return int(text.rstrip("kKmM")) * {"k": 1 << 10, "m": 1 << 20}.get(text[-1].lower(), 1)


def run(args):
    if args.target.startswith(BOARD) and args.target != BOARD:
        return board_flash.run(args.target[len(BOARD):], args.main, not args.no_start)
    if args.main or args.no_start:
        print("flash: --main and --no-start are for a board; give --target mpremote:DEVICE.", file=sys.stderr)
        return 2
    if args.target not in TARGETS:
        print("flash: '%s' is no target: give %s." % (args.target, " or ".join(TARGETS)), file=sys.stderr)
        return 2
    try:
        elf = stm32_image.image(args.heap, args.micropython, progress=say)
    except ImageError as error:
        print("flash: %s" % error, file=sys.stderr)
        for line in error.lines:
            print("  " + line, file=sys.stderr)
        return error.code
    say("\n".join(report(elf, stm32_image.facts(elf))))
    return 0


def report(elf, facts):
    width = max(len(name) for name in facts["modules"])
    lines = ["", "Frozen in flash, bytes a module:"]
    lines += ["  %-*s %6s" % (width, name, grouped(size)) for name, size in facts["modules"].items()]
    frozen = sum(facts["modules"].values())
    lines += ["  %-*s %6s" % (width, "%d files" % len(facts["modules"]), grouped(frozen)),
              "  %-*s %6s" % (width, "the VM, and the names it shares with them", grouped(facts["text_bytes"] - frozen)), ""]
    lines.append("text %s B, data %s B, bss %s B" % tuple(grouped(facts[name]) for name in ("text_bytes", "data_bytes", "bss_bytes")))
    lines.append("flash  %s of %s B (%.0f %%)" % (
        grouped(facts["flash_bytes"]), grouped(facts["flash_of_bytes"]), 100 * facts["flash_bytes"] / facts["flash_of_bytes"]))
    lines.append("RAM    heap %s B + the VM's own %s B of %s B; %s B are left for the stack" % (
        grouped(facts["ram_heap_bytes"]), grouped(facts["ram_static_bytes"]), grouped(facts["ram_of_bytes"]),
        grouped(facts["ram_left_for_stack_bytes"])))
    lines.append("built from MicroPython %s with %s" % (facts["micropython"], facts["compiler"]))
    lines.append("SHA-256 %s" % facts["sha256"])
    lines.append("image   %s" % elf)
    lines.append("run     %s" % shlex.join(["qemu-system-arm", *MACHINE, "-serial", "pty", "-serial", "pty", "-kernel", str(elf)]))
    return lines
