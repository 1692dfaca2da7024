# Each thing that keeps the link honest is taken away in a copy of the sources, and the suite must notice: a test that cannot
# fail proves nothing.

import os
import shutil
import subprocess
import sys

import pytest

COPIED = ("protocol", "firmware_py", "sim_device", "tests", "pyproject.toml")
READER, LINK, WINDOW = "protocol/frame_reader.py", "protocol/link.py", "protocol/host_window.py"
FRAMES, RELIABLE, HANDSHAKE = (
    "tests/protocol/test_frame_reader.py", "tests/protocol/test_reliable.py", "tests/protocol/test_link.py")
DEVICE = "tests/firmware_py/test_device.py"

MUTANTS = {
    "CRC: half of it": (READER, " or crc[1] != buf[end + 2] | buf[end + 3] << 8", "", FRAMES),
    "CRC: one bit less": (READER, "if crc[0] != buf[end]", "if crc[0] & 0xFFFE != buf[end] & 0xFE", FRAMES),
    "LEN: less is enough": (READER, "if buf[start + 4] != size:", "if buf[start + 4] > size:", FRAMES),
    "LEN: nobody looks": (READER, "if buf[start + 4] != size:", "if False:", FRAMES),
    "echo: nobody looks": (READER, "or (self._listen != BOTH and ctl >> 2 & 1 != self._listen)", "", FRAMES),
    "ACK: an old one counts": (LINK, "if acked <= kept:", "if True:", RELIABLE),
    "ACK: no room is room": (LINK, "if kept == _WINDOW_UP:", "if False:", RELIABLE),
    "ACK: the host forgets it": (WINDOW, "return self._last - self.ack & 255 >= SIZE", "return len(self.out) >= SIZE", RELIABLE),
    "SEQ: any is the next": (LINK, "if behind == 255:", "if behind >= 128:", RELIABLE),
    "SEQ: twice is new": (LINK, "if behind == 255:", "if behind == 255 or behind == 0:", RELIABLE),
    "NAK: at every frame": (LINK, "elif not self._gap:", "else:", RELIABLE),
    "cache: not retained": (LINK, "if behind >= kept:", "if True:", RELIABLE),
    "cache: the other one": (LINK, "place = reader.seq & 1", "place = reader.seq + 1 & 1", RELIABLE),
    "cache: a step runs twice": ("firmware_py/device.py", "if self.begun and step == self.step_number:", "if False:", DEVICE),
    "epoch: nobody looks": (LINK, "elif epoch == 0 or epoch != self.epoch:", "elif epoch == 0:", HANDSHAKE),
    "epoch: numbers go on": (LINK, "self._ack = 0\n            self._acked = 0     # an", "self._acked = 0     # an", RELIABLE),
    "epoch: any boot is meant": (LINK, "self.values[1] != self.boot_id or ", "", HANDSHAKE),
}


QUICK = ("CRC: half of it", "LEN: nobody looks", "ACK: no room is room", "ACK: the host forgets it", "cache: not retained",
         "cache: a step runs twice", "epoch: nobody looks")


@pytest.fixture(scope="module")
def copy(tmp_path_factory, project):
    folder = tmp_path_factory.mktemp("mutant")
    for name in COPIED:
        if os.path.isdir(project / name):
            shutil.copytree(project / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.json.gz"))
        else:
            shutil.copy(project / name, folder / name)
    return folder


def suite(copy, tests):
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1", "HYPOTHESIS_PROFILE": "test"}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "not soak", tests]
    return subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, timeout=110)


@pytest.mark.parametrize("mutant", [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.soak) for name in MUTANTS])
def test_the_suite_notices(copy, mutant, record_count):
    path, old, new, tests = MUTANTS[mutant]
    text = (copy / path).read_text()
    assert text.count(old) == 1, "the branch is not there any more: name the new one"
    try:
        (copy / path).write_text(text.replace(old, new))
        done = suite(copy, tests)
    finally:
        (copy / path).write_text(text)
    noticed = done.returncode == 1 and "failed" in done.stdout
    record_count("link weakened on purpose (not noticed)", 1, not noticed)
    assert noticed, "%s\n%s" % (mutant, done.stdout[-2000:] + done.stderr[-500:])


def test_the_copy_as_it_is_passes(copy):
    done = suite(copy, RELIABLE)
    assert done.returncode == 0, done.stdout[-2000:]
