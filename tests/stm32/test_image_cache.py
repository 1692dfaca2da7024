# Where images are kept, for how long, and when one is made anew; nothing is built here.

import hashlib
import os
import shutil

from host_tools import made_once, stm32_build, stm32_core, stm32_image, stm32_source
from tests.house.tree import PROJECT

KIB = 1024


def test_the_key_of_an_image_goes_by_what_links_it_too(monkeypatch, tmp_path):
    files = stm32_core.core_files(PROJECT)
    base = stm32_core.image_key("vm", files, 27 * KIB)
    monkeypatch.setattr(stm32_core.sys, "version_info", (3, 99, 0))  # another Python may write the linked module down otherwise
    assert stm32_core.image_key("vm", files, 27 * KIB) != base
    monkeypatch.undo()
    for name in ("stm32_core.py", "stm32_check.py"):
        shutil.copy(PROJECT / "host_tools" / name, tmp_path)
    monkeypatch.setattr(stm32_core, "__file__", str(tmp_path / "stm32_core.py"))
    assert stm32_core.image_key("vm", files, 27 * KIB) == base
    (tmp_path / "stm32_core.py").write_text("# changed")
    assert stm32_core.image_key("vm", files, 27 * KIB) != base


def test_the_images_that_were_asked_for_last_are_kept(monkeypatch, tmp_path):
    monkeypatch.setattr(stm32_source, "find", lambda *_: tmp_path)
    monkeypatch.setattr(stm32_source, "tree_hash", lambda _: "tree")
    monkeypatch.setattr(stm32_build, "vm_key", lambda _: "vm")
    elves = []
    for heap in (27, 28, 29):  # made in this order
        key = stm32_core.image_key("vm", stm32_core.core_files(PROJECT), heap * KIB)
        elves.append(tmp_path / ("image-" + key) / "firmware.elf")
        elves[-1].parent.mkdir()
        elves[-1].write_bytes(b"elf")
        elves[-1].with_name("image.json").write_text('{"sha256": "%s"}' % hashlib.sha256(b"elf").hexdigest())
        os.utime(elves[-1].parent, (heap, heap))
    assert stm32_image._image(tmp_path, 27 * KIB, None, lambda _: None, "") == elves[0]
    made_once.prune(tmp_path, "image-*", 2)
    assert [elf.exists() for elf in elves] == [True, False, True]


def test_the_cache_is_where_the_user_has_his(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    for named, folder in ((str(tmp_path / "there"), tmp_path / "there"), ("", tmp_path / ".cache"), ("not/absolute", tmp_path / ".cache")):
        monkeypatch.setenv("XDG_CACHE_HOME", named)
        assert stm32_image.cache_folder() == folder / "tvslam"
