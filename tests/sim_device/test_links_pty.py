# The pty with a name: nobody there, somebody there, gone again; names that are in the way.

import contextlib
import os
import threading
import time
import tty

import pytest

from sim_device.links.pty import LinkError, Pty


@pytest.fixture
def pty(tmp_path):
    pty = Pty(str(tmp_path / "deep" / "link"), backlog_bytes=1000)
    yield pty
    pty.close()


def far_end(pty):
    fd = os.open(pty.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    tty.setraw(fd)
    return fd


def test_nobody_there_yet_is_no_error(pty):
    assert not pty.present
    assert pty.read() is None
    assert pty.write(b"early")


def test_bytes_go_both_ways_and_arrive_as_they_are(pty):
    every = bytes(range(256))
    fd = far_end(pty)
    assert pty.present and pty.read() == b""
    os.write(fd, every)
    assert pty.read(100) == every
    assert pty.write(every) and os.read(fd, 4096) == every
    os.close(fd)
    assert pty.read() is None and not pty.present


def test_what_was_said_before_hanging_up_is_heard(pty):
    fd = far_end(pty)
    os.write(fd, b"last words")
    os.close(fd)
    assert pty.read() == b"last words"
    assert pty.read() is None


def test_a_far_end_that_does_not_read_loses_whole_writes_only(pty):
    fd = far_end(pty)
    sent = [b"<%06d>" % i * 10 for i in range(2000)]
    kept = [data for data in sent if pty.write(data)]
    assert 0 < pty.dropped == len(sent) - len(kept) and pty.waiting <= 1000
    got = b""
    while True:
        try:
            got += os.read(fd, 65536)
        except BlockingIOError:
            if not pty.waiting:
                break
            pty.flush()
    assert got == b"".join(kept)
    os.close(fd)


def test_drain_waits_for_a_reader(pty):
    fd = far_end(pty)
    pty.write(b"x" * 100)
    assert os.read(fd, 4096) == b"x" * 100
    pty.drain(5.0)  # returns at once, or the test's own time-out speaks
    os.close(fd)


def test_what_is_on_its_way_when_we_close_is_read_first(tmp_path):
    data = bytes(range(256)) * 12
    for _ in range(300):
        pty = Pty(str(tmp_path / "link"))
        fd = far_end(pty)
        heard = bytearray()
        reader = threading.Thread(target=_read_late, args=(fd, heard))
        reader.start()
        assert pty.write(data)
        pty.drain(5.0)
        pty.close()
        reader.join()
        os.close(fd)
        assert heard == data


def _read_late(fd, heard):
    time.sleep(0.003)
    os.set_blocking(fd, True)
    with contextlib.suppress(OSError):  # hung up
        while data := os.read(fd, 65536):
            heard += data


def test_the_name_is_taken_away_at_the_end(tmp_path):
    pty = Pty(str(tmp_path / "link"))
    assert os.path.exists(tmp_path / "link")
    pty.close()
    pty.close()
    assert os.listdir(tmp_path) == []


def test_a_stale_link_is_replaced(tmp_path):
    os.symlink("/dev/pts/999999", tmp_path / "link")
    pty = Pty(str(tmp_path / "link"))
    assert os.readlink(tmp_path / "link") == pty.name
    pty.close()


def test_a_name_that_another_has_taken_over_is_left_alone(tmp_path):
    first, second = Pty(str(tmp_path / "link")), Pty(str(tmp_path / "link"))
    first.close()
    assert os.readlink(tmp_path / "link") == second.name
    second.close()


@pytest.mark.parametrize("make", [lambda p: p.write_text("precious"), lambda p: p.mkdir()])
def test_what_is_no_link_is_never_replaced(tmp_path, make):
    make(tmp_path / "link")
    before = os.stat(tmp_path / "link")
    with pytest.raises(LinkError, match="exists and is not a symbolic link"):
        Pty(str(tmp_path / "link"))
    assert os.stat(tmp_path / "link") == before


def test_no_descriptor_is_left_open_by_a_name_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else None
    with pytest.raises(LinkError):
        Pty(str(tmp_path / "file" / "link"))
    if before is not None:
        assert len(os.listdir("/proc/self/fd")) == before
