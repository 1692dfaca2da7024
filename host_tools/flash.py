"""`host_tools flash --target stm32`: the firmware image with the core in its flash, built, checked and kept.

The image runs on QEMU's netduino2 (`host_tools hil --target stm32`); it has not run on silicon.
"""

import argparse
import sys

from host_tools import stm32_image
from host_tools.core_process import heap_size
from host_tools.budget import grouped
from host_tools.stm32_tools import ImageError

TARGETS = ("stm32",)
HEAP = "27k"


def add_arguments(parser):
    parser.add_argument("--target", required=True, metavar="TARGET", help="stm32: an image for the emulated STM32F205 (QEMU netduino2)")
    parser.add_argument("--micropython", metavar="DIR", default=None,
                        help="source tree of MicroPython 1.25 or newer, left as it is (default: Debian's source package, fetched once)")
    parser.add_argument("--heap", type=heap_bytes, default=HEAP, metavar="SIZE", help="heap of the MicroPython VM (default %s)" % HEAP)


def heap_bytes(text):
    try:
        heap_size(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(str(error).replace("192k", HEAP)) from None
    return int(text.rstrip("kKmM")) * {"k": 1 << 10, "m": 1 << 20}.get(text[-1].lower(), 1)


def run(args):
    if args.target not in TARGETS:
        print("flash: '%s' is no target: give %s." % (args.target, " or ".join(TARGETS)), file=sys.stderr)
        return 2
    try:
        elf = stm32_image.image(args.heap, args.micropython, progress=lambda text: print(text, flush=True))
    except ImageError as error:
        print("flash: %s" % error, file=sys.stderr)
        for line in error.lines:
            print("  " + line, file=sys.stderr)
        return error.code
    print("\n".join(report(elf, stm32_image.facts(elf))))
    return 0


def report(elf, facts):
    width = max(len(name) for name in facts["modules"])
    lines = ["", "Frozen in flash, bytes a module:"]
    lines += ["  %-*s %6s" % (width, name, grouped(size)) for name, size in facts["modules"].items()]
    lines += ["  %-*s %6s" % (width, "%d modules" % len(facts["modules"]), grouped(sum(facts["modules"].values()))), ""]
    lines.append("text %s B, data %s B, bss %s B" % tuple(grouped(facts[name]) for name in ("text_bytes", "data_bytes", "bss_bytes")))
    lines.append("flash  %s of %s B (%.0f %%)" % (
        grouped(facts["flash_bytes"]), grouped(facts["flash_of_bytes"]), 100 * facts["flash_bytes"] / facts["flash_of_bytes"]))
    lines.append("RAM    heap %s B + the VM's own %s B of %s B; %s B are left for the stack" % (
        grouped(facts["ram_heap_bytes"]), grouped(facts["ram_static_bytes"]), grouped(facts["ram_of_bytes"]),
        grouped(facts["ram_left_for_stack_bytes"])))
    lines.append("built from MicroPython %s with %s" % (facts["micropython"], facts["compiler"]))
    lines.append("SHA-256 %s" % facts["sha256"])
    lines.append("image   %s" % elf)
    return lines
