# Viewers on the tap: early ones, late ones, slow ones, and ones that ask.

import os
import threading
import time
import tty
import zlib

import pytest

from protocol import schema, schema_hash
from protocol.dialect import dialect_of
from protocol.frame_reader import BOTH
from protocol.host_link import HostLink
from protocol.link import Link
from protocol.messages import BY_NAME
from sim_device.links.tap import Taps, wire
from tests.protocol.edited_schema import told

M = BY_NAME


def raw(message, up=True):
    body = message.pack()
    frame = bytes((schema.VERSION | (4 if up else 0), 0, 0, message.ID, len(body) + 9)) + body
    return frame + zlib.crc32(frame).to_bytes(4, "little")


def hello(boot_id=5):
    return M["HELLO"](1, 1, *schema_hash.halves(), 4, 5, boot_id, 0, 96, 4, 2, 0, 9, 26, 1000, 900, 100)


def vector(index, x):
    return M["VECTOR"](index, 0, 0, x, 0, x, 1, 5)


def answer(step):
    return M["STEP_RSP"](step, 1, 2, 4, 0, 0)


class Viewer:
    def __init__(self, path):
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.fd)
        self.link = HostLink(listen=BOTH, any_epoch=True)

    def read(self):
        found = []
        while True:
            try:
                data = os.read(self.fd, 65536)
            except OSError:
                data = b""
            if not data:
                return found
            found += self.link.feed(data)
            time.sleep(0.002)  # the other half of a long write

    def ask(self, message):
        os.write(self.fd, HostLink().encode(message))

    def close(self):
        os.close(self.fd)


@pytest.fixture
def taps(tmp_path):
    taps = Taps([str(tmp_path / "a"), str(tmp_path / "b")])
    yield taps
    taps.close()
    assert os.listdir(tmp_path) == []


@pytest.fixture
def viewer(tmp_path, taps):
    viewer = Viewer(tmp_path / "a")
    yield viewer
    viewer.close()


def test_a_wire_frame_is_what_the_core_sends():
    link = Link(boot_id=5)
    link.send_hello(4, 5, 0, 9, 26, 1000, 900, 100)
    sent = bytes(link.tx[:link.tx_len])
    found = HostLink().feed(sent)
    assert found[0].NAME == "HELLO"
    seen = []
    HostLink(sink=lambda direction, frame: seen.append(frame)).feed(sent)
    assert bytes(wire(seen[0])) == sent


def test_both_directions_pass_in_order(taps, viewer):
    taps.service(1.0)
    sent = [M["PARAM_GET"](3, 0), M["PARAM_VALUE"](3, 0, 0, 72000), answer(1), vector(0, 7)]
    for message in sent:
        taps.frame(raw(message, up=message.DIRECTION == schema.UP))
    taps.service(2.0)
    assert viewer.read() == sent and taps.dropped == 0


def test_several_viewers_get_the_same(taps, viewer, tmp_path):
    other = Viewer(tmp_path / "b")
    taps.service(1.0)
    taps.frame(raw(answer(1)))
    taps.service(2.0)
    assert viewer.read() == other.read() == [answer(1)]
    other.close()


def test_a_late_viewer_is_told_hello_and_the_map_so_far(taps, tmp_path):
    for message in [hello(), vector(0, 1), answer(1), vector(1, 2), vector(0, 3), answer(2)]:
        taps.frame(raw(message))
    taps.service(1.0)
    late = Viewer(tmp_path / "a")
    taps.service(2.0)
    assert late.read() == [hello(), vector(0, 3), vector(1, 2)]
    late.close()
    taps.service(3.0)
    again = Viewer(tmp_path / "a")
    taps.service(4.0)
    assert again.read()[0] == hello(), "whoever comes next is told anew"
    again.close()


def test_hello_is_repeated_once_a_second(taps, viewer):
    taps.frame(raw(hello()))
    for tenth in range(10, 41):
        taps.service(tenth / 10)
    assert viewer.read() == [hello()] * 4


def test_a_question_is_answered_here(taps, viewer):
    taps.frame(raw(hello()))
    taps.frame(raw(M["IDENTITY"](1, 64, 200, b"half a schema")))
    taps.service(1.0)
    viewer.read()
    viewer.ask(M["IDENTIFY"](1, 64))
    taps.service(1.1)
    assert viewer.read() == [M["IDENTITY"](1, 64, 200, b"half a schema")]
    viewer.ask(M["IDENTIFY"](1, 0))
    os.write(viewer.fd, b"\0noise\0" * 100)
    viewer.ask(M["WELCOME"](1, 5, 2, 3))
    viewer.ask(M["STEP"](1, 0, 0, (0,) * 8, 0, 0, ()))
    taps.service(1.2)
    assert viewer.read() == [hello(), hello()], "what the device never said is answered by what it did say; the rest by nothing"


def test_a_new_core_makes_the_old_map_void(taps, tmp_path):
    taps.frame(raw(hello(5)))
    taps.frame(raw(vector(0, 1)))
    taps.frame(raw(hello(6)))
    taps.service(1.0)
    late = Viewer(tmp_path / "a")
    taps.service(2.0)
    assert late.read() == [hello(6)]
    late.close()


def test_a_slow_viewer_loses_whole_frames_steps_first_and_holds_nobody_up(taps, viewer):
    taps.service(1.0)
    now_s, sent_vectors = 1.0, 0
    start_s = time.monotonic()
    for step in range(20000):
        taps.frame(raw(answer(step)))
        if step % 100 == 0:
            taps.frame(raw(vector(step // 100, 1)))
            sent_vectors += 1
        if step % 50 == 0:
            now_s += 0.1
            taps.service(now_s)
    assert time.monotonic() - start_s < 5.0
    taps.service(now_s + 1)
    assert taps.dropped > 10000
    found = []
    for _ in range(100):
        now_s += 1
        taps.service(now_s)
        found += viewer.read()
    assert not any(count for name, count in viewer.link.counts().items() if name.startswith("bad") or name == "overrun")
    assert len([m for m in found if m.NAME == "VECTOR"]) == sent_vectors, "telemetry waits, steps do not"
    assert len([m for m in found if m.NAME == "STEP_RSP"]) + sent_vectors + taps.dropped == 20000 + sent_vectors


def test_the_end_is_not_lost_when_the_tap_closes(tmp_path):
    taps = Taps([str(tmp_path / "a")])
    viewer = Viewer(tmp_path / "a")
    taps.service(1.0)
    for i in range(100):
        taps.frame(raw(vector(i, 1)))
    closing = threading.Thread(target=taps.close)
    closing.start()
    found, end_s = [], time.monotonic() + 5
    while len(found) < 100 and time.monotonic() < end_s:
        found += viewer.read()
    closing.join()
    assert found == [vector(i, 1) for i in range(100)]
    viewer.close()


@pytest.mark.parametrize("body", [b"", b"\4", b"\4\0", b"\4\0\0\1"])
def test_a_question_of_another_length_is_none(tmp_path, body):
    taps = Taps([str(tmp_path / "tap")])
    taps.frame(raw(hello()))
    viewer = Viewer(tmp_path / "tap")
    taps.service(1.0)
    viewer.read()
    frame = bytes((schema.VERSION, 0, 0, M["IDENTIFY"].ID, len(body) + 9)) + body
    os.write(viewer.fd, wire(frame + zlib.crc32(frame).to_bytes(4, "little")))
    viewer.ask(M["IDENTIFY"](0, 0))
    taps.service(1.1)
    taps.service(1.2)
    assert viewer.read() == [hello()], "the one that is whole is answered"
    viewer.close()
    taps.close()


def test_without_taps_nothing_is_kept():
    taps = Taps([])
    taps.frame(raw(hello()))
    taps.service(1.0)
    taps.close()
    assert taps._passing == [] and taps._hello is None


def test_items_that_a_core_of_another_schema_counts_without_end_do_not_gather(tmp_path):
    new = told()
    index = next(field for row in new["messages"] if row[1] == "VECTOR" for field in row[4] if field[0] == "index")
    index[1] = "u32"
    theirs = dialect_of(new)
    kind = theirs.by_name["VECTOR"]
    taps = Taps([str(tmp_path / "tap")])
    taps.speaks(theirs)
    for item in range(10):
        taps.frame(raw(kind(item << 16 | 7, *[0] * (len(kind.FIELDS) - 1))))
    assert len(taps._introduction()) == 1
    taps.frame(raw(kind(8, *[0] * (len(kind.FIELDS) - 1))))
    assert len(taps._introduction()) == 2
    taps.close()
