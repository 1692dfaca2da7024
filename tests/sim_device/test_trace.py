# The log's head, told anew when the core's schema is known, on a disk that does not play along.

import errno

import pytest

from protocol.dialect import dialect_of
from protocol.log import LogReader
from sim_device.links.trace import FrameLog, TraceError
from tests.protocol.edited_schema import edited


class FullDisk:
    def __init__(self, file):
        self._file = file

    def write(self, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    def __getattr__(self, name):
        return getattr(self._file, name)


@pytest.fixture
def log(tmp_path):
    log = FrameLog(str(tmp_path / "log"), home="one")
    yield log
    log.close()


OTHER = dialect_of(edited(3, 2))


def test_the_head_is_told_anew_and_what_follows_stays(log, tmp_path):
    log.frame(log._start_ns, 1, b"hello")
    log.speaks(OTHER)
    log.close()
    reader = LogReader()
    assert [record.frame for record in reader.feed((tmp_path / "log").read_bytes())] == [b"hello"]
    assert reader.told["home"] == "one" and dialect_of(reader.told).hash == OTHER.hash and reader.damage == ""


def test_on_a_disk_that_is_full_already_what_is_there_stays(log, tmp_path):
    before = (tmp_path / "log").read_bytes()
    log._file = FullDisk(log._file)
    log.frame(log._start_ns, 1, b"hello")
    log.speaks(OTHER)
    assert "No space left" in log.failure and (tmp_path / "log").read_bytes() == before


def test_a_log_that_is_gone_is_one_sentence(log, tmp_path):
    (tmp_path / "log").unlink()
    with pytest.raises(TraceError, match="log cannot be read, .*: No such file"):
        log.speaks(OTHER)
