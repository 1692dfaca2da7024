# A 32-bit board for tests: MicroPython on QEMU's mps2-an385, a Cortex-M3 with 4 MB of RAM, with a real littlefs on a RAM
# disk. It is the qemu port of the same source tree as the stm32 image, built with littlefs, which that port leaves out.

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
import time
from pathlib import Path

from host_tools import stm32_build, stm32_source, stm32_tools
from host_tools.board import Board
from host_tools.processes import Children
from host_tools.qemu import qemu_command
from host_tools.stm32_image import cache_folder
from host_tools.stm32_source import PORT

HEAP_BYTES = 1 << 20
MODULE = {"micropython.mk": "SRC_USERMOD_C += $(USERMOD_DIR)/clock.c\n",     # littlefs wants the time of a file's change
          "clock.c": '#include "py/mphal.h"\nuint64_t mp_hal_time_ns(void) { return 0; }\n'}
NO_UNWINDING = "SECTIONS\n{\n    /DISCARD/ : { *(.ARM.exidx*) }\n"              # the port's script has no place for it
RAM_DISK = """
import os, sys, vfs
class Disk:
 def __init__(self, size):
  self.data = bytearray(size)
 def readblocks(self, block, buf, at=0):
  at += block * 512
  buf[:] = memoryview(self.data)[at:at + len(buf)]
 def writeblocks(self, block, buf, at=0):
  at += block * 512
  self.data[at:at + len(buf)] = buf
 def ioctl(self, op, _):
  return len(self.data) // 512 if op == 4 else 512 if op == 5 else 0
disk = Disk(%d)
vfs.VfsLfs2.mkfs(disk)
vfs.mount(vfs.VfsLfs2(disk), "/")
os.mkdir("/lib")
sys.path[:] = ["", ".frozen", "/lib"]
"""


def elf():
    """The board's firmware, kept beside the images; the first build takes half a minute."""
    tree = stm32_source.find(None, cache_folder(), print)
    script = (tree / PORT / "mcu/arm/mps2.ld").read_text().replace("SECTIONS\n{\n", NO_UNWINDING, 1)
    parts = (stm32_source.tree_hash(tree), stm32_build.compiler(), script, repr(MODULE), str(HEAP_BYTES))
    kept = cache_folder() / ("board-" + hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16] + ".elf")
    if kept.exists():
        return kept
    with tempfile.TemporaryDirectory(prefix="board-") as work:     # not in the cache: what is half-made there is swept away
        folder = Path(work)
        (folder / "modules/clock").mkdir(parents=True)
        for name, text in MODULE.items():
            (folder / "modules/clock" / name).write_text(text)
        (folder / "board.ld").write_text(script)
        code, said = stm32_tools.run(
            ["make", "-j2", "-C", str(tree / PORT), "BOARD=MPS2_AN385", "BUILD=%s" % (folder / "build"), "FROZEN_MANIFEST=",
             "MICROPY_VFS_LFS2=1", "USER_C_MODULES=%s" % (folder / "modules"), "LDSCRIPT=%s" % (folder / "board.ld"),
             "MICROPY_HEAP_SIZE=%d" % HEAP_BYTES], env=stm32_build.environment())
        assert code == 0, "\n".join(stm32_tools.last_lines(said))
        new = shutil.copy2(folder / "build/firmware.elf", kept.with_suffix(".%d" % os.getpid()))
        Path(new).rename(kept)
    return kept


@contextlib.contextmanager
def emulated_board(firmware, disk_bytes):
    """The port's name of a board that is up, its RAM disk mounted."""
    with Children() as children:
        child = children.start("the board", [qemu_command(), "-M", "mps2-an385", "-display", "none", "-monitor", "none",
                                             "-semihosting", "-serial", "pty", "-kernel", str(firmware)])
        limit = time.monotonic() + 20
        while not (found := re.search(r"redirected to (\S+)", child.text())):
            assert time.monotonic() < limit and child.poll() is None, child.text()
            time.sleep(0.02)
        run_on(found[1], RAM_DISK % disk_bytes)
        yield found[1]


def run_on(device, code):
    """What the board prints."""
    with Board(device) as board, board._asking():
        return board._transport.exec(code).decode()
