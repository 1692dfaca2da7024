"""The core's files that go into an image, as firmware_py/manifest.py lists them, read once: what is hashed is what is built."""

import hashlib
import sys
from pathlib import Path

from host_tools import linker
from host_tools.stm32_tools import ImageError

MANIFEST = "firmware_py/manifest.py"
ENTRY = "firmware_py/main_stm32.py"
LINKED = "tvslam.py"  # the one module that the image has: `import tvslam` on its REPL


def core_files(root):
    """{path from the project's folder: content}, the manifest among them. A file of the core that it forgets is an error."""
    manifest = (root / MANIFEST).read_bytes()
    frozen, left_out = listed(manifest)
    there = {"firmware_py/" + str(p.relative_to(root / "firmware_py")) for p in (root / "firmware_py").rglob("*.py")}
    forgotten = sorted(there - frozen - left_out)
    if forgotten:
        raise ImageError("%s does not name %s: list it there, to be frozen or to be left out." % (MANIFEST, ", ".join(forgotten)))
    gone = sorted(name for name in frozen if not (root / name).is_file())
    if gone:
        raise ImageError("%s names files that are not there: %s." % (MANIFEST, ", ".join(gone)))
    files = {name: (root / name).read_bytes() for name in sorted(frozen)}
    files[MANIFEST] = manifest
    return files


def modules(files):
    return [name for name in files if name != MANIFEST]


def listed(manifest):
    """(frozen, left out): the manifest is run as MicroPython's build runs it, with a `package` that only takes notes."""
    frozen = set()

    def package(path, files=None, base_path=".", opt=None):
        frozen.update("%s/%s" % (path, name) for name in files)

    names = {"package": package}
    exec(compile(manifest, MANIFEST, "exec"), names)
    return frozen, {"firmware_py/" + name for name in names["LEFT_OUT"]}


def image_key(vm_key, files, heap_bytes, mark=""):
    # The Python, too: each writes the linked module down in its own way (ast.unparse).
    digest = hashlib.sha256(("%s\n%d\n%s\n%d.%d\n" % (vm_key, heap_bytes, mark, *sys.version_info[:2])).encode())
    # What makes the image of them, and what tells its figures.
    for path in (*sorted(Path(linker.__file__).parent.glob("*.py")), Path(__file__), Path(__file__).with_name("stm32_check.py")):
        digest.update(path.read_bytes())
    for name, content in sorted(files.items()):
        digest.update(("%s %s\n" % (name, hashlib.sha256(content).hexdigest())).encode())
    return digest.hexdigest()[:16]


def linked(files, mark=""):
    """The files as one module (linker.Linked)."""
    try:
        return linker.link({name: files[name].decode() for name in modules(files)}, ENTRY, mark)
    except (linker.LinkError, SyntaxError, UnicodeDecodeError) as error:
        raise ImageError("The core cannot be linked: %s" % error) from None


def write(core, folder):
    """Leaves the linked core in `folder` for the build. -> path of a manifest that freezes it."""
    folder.mkdir()
    (folder / LINKED).write_text(core.source, encoding="utf-8")
    manifest = folder / "manifest.py"
    manifest.write_text('module("%s", base_path=".", opt=3)\n' % LINKED, encoding="utf-8")
    return manifest
