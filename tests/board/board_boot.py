# Runs in the Unix port of MicroPython, for tests: makes of it what a board is. A real littlefs in a file
# of the computer takes the place of the computer's own files, then main.py runs, and the REPL comes (-i).

import os
import sys
import vfs

BLOCK_BYTES = 512


class Flash:
    def __init__(self, path):
        self.blocks = os.stat(path)[6] // BLOCK_BYTES
        self.file = open(path, "r+b")

    def readblocks(self, block, buf, offset=0):
        self.file.seek(block * BLOCK_BYTES + offset)
        self.file.readinto(buf)

    def writeblocks(self, block, buf, offset=0):
        self.file.seek(block * BLOCK_BYTES + offset)
        self.file.write(buf)

    def ioctl(self, op, _):
        if op == 4:
            return self.blocks
        if op == 5:
            return BLOCK_BYTES
        return 0


def boot(path, without=()):
    flash = Flash(path)
    try:
        filesystem = vfs.VfsLfs2(flash)
    except OSError:
        vfs.VfsLfs2.mkfs(flash)
        filesystem = vfs.VfsLfs2(flash)
    vfs.umount("/")
    vfs.mount(filesystem, "/")
    os.chdir("/")
    sys.path[:] = ["", ".frozen", "/lib"]
    for name in without:
        sys.modules[name] = object()    # an import of it finds nothing in it
    if "lib" not in os.listdir("/"):
        os.mkdir("/lib")


def put(path, content):
    with open(path, "w" if isinstance(content, str) else "wb") as file:
        file.write(content)


boot(sys.argv[1], sys.argv[2:])
if "main.py" in os.listdir("/"):
    exec(open("/main.py").read())
