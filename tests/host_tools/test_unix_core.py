# The core for the target unix, made once: what was left half-made is made anew, and old ones go.

import os
import subprocess

import pytest

from host_tools import unix_core
from host_tools.core_process import TargetError, micropython_command

VM = micropython_command()


@pytest.fixture
def cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "tvslam"


def core(monkeypatch, number):
    monkeypatch.setattr(unix_core, "_linked", lambda entry: "def main(path):\n    return %d\n" % number)
    return unix_core.boot_file(VM)


def runs(boot):
    return subprocess.run([VM, str(boot), "link"], timeout=30).returncode


@pytest.mark.parametrize("missing", ["boot.py", "tvslam.mpy"])
def test_a_folder_without_its_files_is_made_anew(monkeypatch, cache, missing):
    boot = core(monkeypatch, 7)
    assert runs(boot) == 7
    boot.with_name(missing).unlink()
    assert core(monkeypatch, 7) == boot and runs(boot) == 7
    assert [folder.name for folder in cache.iterdir()] == [boot.parent.name]


def test_the_ones_that_were_asked_for_last_are_kept(monkeypatch, cache):
    monkeypatch.setattr(unix_core, "KEPT", 2)
    boots = [core(monkeypatch, 0), core(monkeypatch, 1)]
    for age, boot in enumerate(boots):
        os.utime(boot.parent, (1000 + age, 1000 + age))
    other = cache / "image-0"
    other.mkdir()
    assert core(monkeypatch, 0) == boots[0]  # asked for: the other one is the oldest by now
    boots.append(core(monkeypatch, 2))
    assert [boot.exists() for boot in boots] == [True, False, True] and other.is_dir()


def test_a_cache_that_cannot_be_written_is_named(monkeypatch, tmp_path):
    (tmp_path / "tvslam").write_text("a file")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(TargetError, match="XDG_CACHE_HOME names another place"):
        core(monkeypatch, 3)
