"""The programs from outside that the stm32 target needs, each with the Debian package that has it."""

import os
import shutil
import subprocess

COMPILER = "arm-none-eabi-gcc"
PACKAGE_OF = {
    "make": "make",
    "gcc": "build-essential",
    COMPILER: "gcc-arm-none-eabi",
    "arm-none-eabi-size": "binutils-arm-none-eabi",
    "arm-none-eabi-nm": "binutils-arm-none-eabi",
    "apt-get": "apt",
    "dpkg-source": "dpkg-dev",
    "qemu-system-arm": "qemu-system-arm",
}
TO_BUILD = ("make", "gcc", COMPILER, "arm-none-eabi-size", "arm-none-eabi-nm")
TO_FETCH = ("apt-get", "dpkg-source")
TO_RUN = ("qemu-system-arm",)
LIBRARY = "libnewlib-arm-none-eabi"  # its headers; any C library for the bare part will do


class ImageError(Exception):
    """One sentence: why there is no image, and what to do. `code` is the exit code that fits; `lines` is what the tool said."""

    def __init__(self, sentence, code=2, lines=()):
        super().__init__(sentence)
        self.code = code
        self.lines = list(lines)


def missing(commands=TO_BUILD):
    """[(what, Debian package)] of what is not here."""
    found = [(command, PACKAGE_OF[command]) for command in commands if shutil.which(command) is None]
    if COMPILER in commands and shutil.which(COMPILER) is not None and not _has_library():
        found.append(("the C library's headers for " + COMPILER, LIBRARY))
    return found


def need(commands):
    gone = missing(commands)
    if gone:
        packages = list(dict.fromkeys(package for _, package in gone))
        raise ImageError("The target stm32 needs %s, which %s not here: apt install %s." % (
            " and ".join(what for what, _ in gone), "are" if len(gone) > 1 else "is", " ".join(packages)))


def _has_library():
    # The compiler answers a name that it does not find with the bare name.
    return any(os.path.isabs(output([COMPILER, "-print-file-name=" + specs])) for specs in ("nosys.specs", "picolibc.specs"))


def output(argv):
    return subprocess.run(argv, capture_output=True, text=True, stdin=subprocess.DEVNULL).stdout.strip()


def run(argv, env=None, cwd=None):
    """-> (exit code, everything it said)."""
    done = subprocess.run(argv, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=env, cwd=cwd)
    return done.returncode, done.stdout.decode("utf-8", "replace")


def last_lines(text, count=20):
    return text.strip().splitlines()[-count:]
