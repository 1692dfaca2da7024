"""Builds the stm32 image out of MicroPython's tree, never inside it: what make writes goes into a folder of our own.

Most of a build is the VM, which neither the core nor the heap's size changes. Its
objects are kept, so that only the first image costs a minute, another heap or another core seconds.
"""

import hashlib
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

from host_tools import stm32_tools
from host_tools.linker import LinkError, rom
from host_tools.stm32_source import BOARD, PORT
from host_tools.stm32_tools import ImageError

FLAGS = "-DMICROPY_OPT_COMPUTED_GOTO=1 -DMICROPY_OPT_MAP_LOOKUP_CACHE_SIZE=512"  # a tick costs a fifth less than with the stock port's
OPTIMIZE = "-O2 -DNDEBUG"                # the stock port's -Os saves 40 KB of a megabyte of flash, and costs a tenth of the speed
EMIT = "-march=armv7m -X emit=native"    # the core becomes machine code in flash, a third faster: its sources stay the same
RAM_BYTES = 128 << 10                    # STM32F205
FLASH_BYTES = 1 << 20
STACK_BYTES = 12 << 10                   # the VM's own limit is 10 KiB (ports/qemu/main.c); C below it needs some more
OF_THIS_IMAGE = ("firmware.elf", "firmware.map", "frozen_content.c", "frozen_content.o", "frozen_content.P", "main.o", "main.P")
# Tells the VM that there is a module of its own more: rom.c_source writes it behind the frozen content.
MODULE = {
    "micropython.mk": "SRC_USERMOD_C += $(USERMOD_DIR)/module.c\n",
    "module.c": '#include "py/obj.h"\nMP_REGISTER_MODULE(MP_QSTR_%s, %s_module);\n' % (rom.MODULE, rom.MODULE),
}


def environment():
    """Nothing of the caller's make flags or options reaches the build; the same sources give the same bytes on any day."""
    env = {name: os.environ[name] for name in ("PATH", "HOME", "TMPDIR", "LANG") if name in os.environ}
    env.update(LC_ALL="C", SOURCE_DATE_EPOCH="1700000000", PYTHONDONTWRITEBYTECODE="1", GIT_OPTIONAL_LOCKS="0", PYTHONHASHSEED="0")
    return env


def compiler():
    return stm32_tools.output([stm32_tools.COMPILER, "--version"]).partition("\n")[0]


def vm_key(tree_hash):
    """Names what the VM's objects depend on: anything but the core and the heap."""
    return hashlib.sha256("\n".join((tree_hash, compiler(), BOARD, FLAGS, OPTIMIZE, EMIT, *MODULE.values())).encode()).hexdigest()[:16]


def build(tree, core, manifest, heap_bytes, objects, folder, progress):
    """Leaves firmware.elf and frozen_content.c in the empty `folder`; fills or uses `objects`, the cache of the VM's own."""
    fresh = not objects.is_dir()
    if fresh:
        progress("Building MicroPython for the STM32F205, once: about a minute ...")
        code, said = _make(tree, "mpy-cross", "BUILD=%s" % (folder / "mpy-cross"))
        if code:
            raise ImageError("MicroPython's compiler mpy-cross did not build; the last lines of make are these.", code=3,
                             lines=stm32_tools.last_lines(said))
    else:
        progress("Building the image with the core ...")
        shutil.copytree(objects, folder, dirs_exist_ok=True)  # times of change are kept: make builds only what is missing
    variables = ["BUILD=%s" % folder, "BOARD=" + BOARD, "FROZEN_MANIFEST=%s" % manifest, "CFLAGS_EXTRA=" + FLAGS,
                 "COPT=" + OPTIMIZE, "MPY_CROSS_FLAGS=" + EMIT, "USER_C_MODULES=%s" % _module(objects.parent),
                 "MICROPY_HEAP_SIZE=%d" % heap_bytes, "MICROPY_MPYCROSS=%s" % (folder / "mpy-cross" / "mpy-cross")]
    frozen = folder / "frozen_content.c"
    code, said = _make(tree, PORT, frozen, *variables)
    if code == 0:
        _put_into_flash(core, frozen)
        code, said = _make(tree, PORT, *variables)
    if code:
        _complain(said, heap_bytes)
    if fresh:
        _keep(folder, objects)


def _make(tree, where, *variables):
    return stm32_tools.run(["make", "-j2", "-C", str(tree / where), "PYTHON=" + sys.executable, *variables],
                           env=dict(environment(), GIT_CEILING_DIRECTORIES=str(tree.parent)))


def _module(cache):
    folder = cache / "module" / rom.MODULE
    for name, text in MODULE.items():
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / name).is_file() or (folder / name).read_text(encoding="utf-8") != text:
            (folder / name).write_text(text, encoding="utf-8")
    return folder.parent


def _put_into_flash(core, frozen):
    try:
        text = frozen.read_text(encoding="utf-8")
        frozen.write_text(text + rom.c_source(core.source, text), encoding="utf-8")
    except LinkError as error:
        raise ImageError("The core cannot be put into flash: %s" % error) from None


def _complain(said, heap_bytes):
    over = re.search(r"region `?(RAM|ROM)'? overflowed by (\d+) bytes", said)
    if over and over[1] == "RAM":
        raise ImageError(too_large(heap_bytes, heap_bytes - int(over[2]) - STACK_BYTES))
    if over:
        raise ImageError("The image is %s bytes larger than the part's flash (1 MB): freeze less in firmware_py/manifest.py." % over[2])
    raise ImageError("The image did not build; the last lines of make are these.", code=3, lines=stm32_tools.last_lines(said))


def too_large(heap_bytes, largest):
    return ("A heap of %d bytes does not fit into the part's 128 KB of RAM beside the VM's own data and %d KB of stack: "
            "the largest is --heap %dk." % (heap_bytes, STACK_BYTES >> 10, largest >> 10))


def _keep(folder, objects):
    # Moved into place when whole: a build that is interrupted leaves nothing that looks finished.
    with tempfile.TemporaryDirectory(prefix=".objects-", dir=objects.parent) as work:
        kept = Path(work) / "kept"
        shutil.copytree(folder, kept, ignore=lambda where, names: [
            n for n in names if Path(where) == folder and (n in OF_THIS_IMAGE or n == "frozen_mpy")])
        kept.rename(objects)
