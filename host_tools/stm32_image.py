"""The firmware image for the target stm32, built when it must be: `image(heap_bytes) -> firmware.elf`.

It is kept by a hash of everything that it is made of (MicroPython's sources, the core's
files, the manifest, compiler and options), so that an unchanged image is only looked up.
"""

import contextlib
import fcntl
import hashlib
import json
import re
import shutil
import tempfile
from pathlib import Path

from host_tools import stm32_build, stm32_check, stm32_core, stm32_source, stm32_tools
from host_tools.core_process import CoreError, packages_folder
from host_tools.made_once import asked_for, cache_folder, prune
from host_tools.stm32_tools import ImageError

BLOCK_BYTES = 16    # of MicroPython's heap on a 32-bit part: less cannot be used
HEAP_MIN_BYTES = 2 << 10
IMAGES_KEPT = 40    # of half a megabyte each


def image(heap_bytes, micropython=None, progress=print, mark=""):
    """-> path of firmware.elf. Raises ImageError. The first call takes a minute or two, one with nothing changed a second.
    `mark` as for linker.link: for measuring."""
    heap_bytes -= heap_bytes % BLOCK_BYTES
    if not HEAP_MIN_BYTES <= heap_bytes < stm32_build.RAM_BYTES:
        raise ImageError("A heap of %d bytes is none for this part: it has 128 KB of RAM, and the core is at home in 27k." % heap_bytes)
    stm32_tools.need(stm32_tools.TO_BUILD)
    try:
        with _locked(cache_folder(), progress) as cache:
            return _image(cache, heap_bytes, micropython, progress, mark)
    except OSError as error:
        raise ImageError("The image cannot be made, %s: %s. It is kept in %s; XDG_CACHE_HOME names another place." % (
            error.filename or "a file", (error.strerror or str(error)).lower(), cache_folder())) from None


def facts(elf):
    """What the checks found when the image was built (stm32_check.examine)."""
    return json.loads(Path(elf).with_name("image.json").read_text(encoding="utf-8"))


def _image(cache, heap_bytes, micropython, progress, mark):
    try:
        root = Path(packages_folder())
    except CoreError as error:
        raise ImageError(str(error)) from None
    files = stm32_core.core_files(root)
    _without_spaces(cache, "name another with XDG_CACHE_HOME")
    tree = stm32_source.find(micropython, cache, progress)
    _without_spaces(tree, "move it, or name it by a link without any")
    vm_key = stm32_build.vm_key(stm32_source.tree_hash(tree))
    kept = cache / ("image-" + stm32_core.image_key(vm_key, files, heap_bytes, mark))
    elf = kept / "firmware.elf"
    if _whole(elf):
        asked_for(kept)
        progress("Nothing has changed: the image is in the cache.")
        return elf
    shutil.rmtree(kept, ignore_errors=True)  # half of an image, or a damaged one
    with tempfile.TemporaryDirectory(prefix=".build-", dir=cache) as work:
        folder, image_folder = Path(work) / "build", Path(work) / "image"
        folder.mkdir()
        image_folder.mkdir()
        core = stm32_core.linked(files, mark)
        manifest = stm32_core.write(core, Path(work) / "core")
        stm32_build.build(tree, core, manifest, heap_bytes, cache / ("vm-" + vm_key), folder, progress)
        found = stm32_check.examine(folder / "firmware.elf", folder / "frozen_content.c", core, heap_bytes)
        found.update(heap_bytes=heap_bytes, micropython=_version(tree), compiler=stm32_build.compiler())
        shutil.copy2(folder / "firmware.elf", image_folder)
        (image_folder / "image.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        image_folder.rename(kept)
    prune(cache, "image-*", IMAGES_KEPT)
    return elf


def _whole(elf):
    try:
        return hashlib.sha256(elf.read_bytes()).hexdigest() == facts(elf)["sha256"]
    except (OSError, ValueError, KeyError):
        return False


def _without_spaces(folder, way_out):
    if any(c.isspace() for c in str(folder)):
        raise ImageError("make cannot work in a folder with a space in its name (%s): %s." % (folder, way_out))


def _version(tree):
    text = (tree / "py" / "mpconfig.h").read_text(encoding="utf-8", errors="replace")
    return ".".join(re.findall(r"^#define MICROPY_VERSION_(?:MAJOR|MINOR|MICRO)\s+\(?(\d+)", text, re.M))


@contextlib.contextmanager
def _locked(cache, progress):
    """Two builds at once would do the same work twice: the second waits, then finds it done."""
    cache.mkdir(parents=True, exist_ok=True)
    with open(cache / "lock", "w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            progress("Waiting for another build of the image ...")
            fcntl.flock(file, fcntl.LOCK_EX)
        for left in cache.glob(".*-*"):  # by a build that was killed: under the lock there is no other
            shutil.rmtree(left, ignore_errors=True)
        yield cache
