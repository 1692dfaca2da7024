"""MicroPython's source tree for the stm32 image: the user's own, else Debian's source package, kept in the cache.

The package comes through the machine's own apt configuration, in folders of our own: the
machine's lists and caches stay as they are, and no right of root is needed.
"""

import hashlib
import os
import re
import subprocess
import tempfile
from pathlib import Path

from host_tools import stm32_tools
from host_tools.stm32_tools import ImageError

PORT = Path("ports", "qemu")
BOARD = "NETDUINO2"
SUITE = "trixie"  # the first Debian whose MicroPython has this board in its QEMU port
DEBIAN_SUITE = re.compile(r"^(bookworm|trixie|forky|duke|testing|stable|oldstable|unstable|sid)$")
OWN_TREE = "name a checkout of MicroPython with --micropython DIR"

# Of these the image is made (of lib only what is no submodule: the others are not compiled for this board).
PARTS = ("py", "shared", "extmod", "ports/qemu", "mpy-cross", "tools", "lib/libm", "lib/libm_dbl", "lib/re1.5", "lib/uzlib",
         "lib/crypto-algorithms")
SOURCE = {".c", ".h", ".s", ".S", ".py", ".mk", ".ld", ".csv", ""}


def find(micropython, cache, progress):
    """-> the folder of the source tree. May take half a minute, the first time."""
    if micropython is not None:
        return _checked(Path(micropython).expanduser().absolute())
    kept = cache / ("micropython-debian-" + SUITE)
    if not kept.is_dir():
        stm32_tools.need(stm32_tools.TO_FETCH)
        progress("Fetching MicroPython's source (Debian %s) through apt, once ..." % SUITE)
        with tempfile.TemporaryDirectory(prefix=".fetch-", dir=cache) as work:
            _fetch(Path(work)).rename(kept)
    return kept


def _checked(tree):
    if not tree.is_dir():
        raise ImageError("--micropython %s is no folder: %s." % (tree, OWN_TREE))
    if not (tree / "py" / "mpconfig.h").is_file() or not (tree / "mpy-cross" / "Makefile").is_file():
        raise ImageError("%s is no source tree of MicroPython (no py/mpconfig.h, mpy-cross/Makefile): %s." % (tree, OWN_TREE))
    if not (tree / PORT / "boards" / BOARD).is_dir():
        raise ImageError("The MicroPython in %s has no ports/qemu/boards/%s: take version 1.25 or newer." % (tree, BOARD))
    return tree


def tree_hash(tree):
    """Of every file that can reach the image. What earlier builds left in a tree does not count."""
    digest = hashlib.sha256()
    for part in PARTS:
        for folder, folders, files in os.walk(tree / part):
            folders[:] = sorted(f for f in folders if not f.startswith(("build", "__pycache__", ".")))
            for name in sorted(files):
                if os.path.splitext(name)[1] in SOURCE:
                    path = os.path.join(folder, name)
                    with open(path, "rb") as file:
                        content = hashlib.sha256(file.read()).hexdigest()
                    digest.update(("%s %s\n" % (os.path.relpath(path, tree), content)).encode())
    return digest.hexdigest()


# --- Debian's source package ---

def _fetch(work):
    parts = {name: work / name for name in ("sources", "lists/partial", "cache/archives/partial", "package")}
    for folder in parts.values():
        folder.mkdir(parents=True)
    for name, text in debian_sources(_apt_files()).items():
        (parts["sources"] / name).write_text(text, encoding="utf-8")
    apt = ["apt-get", "-o", "Dir::Etc::sourcelist=/dev/null", "-o", "Dir::Etc::sourceparts=%s" % parts["sources"],
           "-o", "Dir::State::lists=%s" % (work / "lists"), "-o", "Dir::Cache=%s" % (work / "cache")]
    if os.getuid() == 0:
        apt += ["-o", "APT::Sandbox::User=root"]  # its usual user may not enter our folder
    _run("apt-get update", apt + ["update", "--error-on=any"], work)
    _run("apt-get source", apt + ["source", "--download-only", "micropython"], parts["package"])
    packages = list(parts["package"].glob("*.dsc"))
    if len(packages) != 1:
        raise ImageError("apt brought no source package of MicroPython: %s." % OWN_TREE, code=3)
    tree = work / "tree"
    _run("dpkg-source", ["dpkg-source", "-x", str(packages[0]), str(tree)], work)
    return _checked(tree)


def _run(name, argv, folder):
    code, said = stm32_tools.run(argv, cwd=folder, env=dict(os.environ, LC_ALL="C"))
    if code:
        raise ImageError("MicroPython's source could not be had, %s failed: try again when the network is there, or %s." % (name, OWN_TREE),
                         code=3, lines=stm32_tools.last_lines(said, 5))


def _apt_files():
    """(name, text) of the machine's lists of package sources."""
    try:
        said = subprocess.run(["apt-config", "shell", "LIST", "Dir::Etc::sourcelist/f", "PARTS", "Dir::Etc::sourceparts/d"],
                              capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        said = ""
    where = dict(re.findall(r"^(\w+)='(.*)'$", said, re.M))
    paths = [Path(where.get("LIST", "/etc/apt/sources.list"))]
    folder = Path(where.get("PARTS", "/etc/apt/sources.list.d"))
    paths += sorted(folder.glob("*.sources")) + sorted(folder.glob("*.list")) if folder.is_dir() else []
    return [(p.name, p.read_text(encoding="utf-8", errors="replace")) for p in paths if p.is_file()]


def debian_sources(files):
    """{file name: text} that asks Debian's own archive for the source packages of SUITE, from where this machine gets its packages."""
    stanzas, lines = [], []
    for name, text in files:
        if name.endswith(".sources"):
            stanzas += filter(None, map(_stanza, re.split(r"\n\s*\n", text)))
        else:
            lines += filter(None, map(_line, text.splitlines()))
    if stanzas:  # one is enough: each names the whole archive
        return {"debian.sources": stanzas[0]}
    if lines:
        return {"debian.list": lines[0]}
    raise ImageError("This machine's apt names no Debian archive from which MicroPython's source could come: %s." % OWN_TREE)


def _stanza(text):
    text = "\n".join(line for line in text.splitlines() if line.strip() and not line.startswith("#"))
    fields = dict(re.findall(r"^([\w-]+):[ \t]*(.*)$", text, re.M))
    if fields.get("Enabled", "yes").lower() in ("no", "false", "0") or "main" not in fields.get("Components", "").split():
        return None
    if not any(DEBIAN_SUITE.match(suite) for suite in fields.get("Suites", "").split()):
        return None
    text = re.sub(r"^Types:.*$", "Types: deb-src", text, flags=re.M)
    text = re.sub(r"^Components:.*$", "Components: main", text, flags=re.M)
    return re.sub(r"^Suites:.*$", "Suites: " + SUITE, text, flags=re.M) + "\n"


def _line(text):
    match = re.match(r"^deb(?:-src)?\s+(\[[^\]]*\]\s+)?(\S+)\s+(\S+)\s+(.*)$", text)
    if not match or not DEBIAN_SUITE.match(match[3]) or "main" not in match[4].split():
        return None
    return "deb-src %s%s %s main\n" % (match[1] or "", match[2], SUITE)
