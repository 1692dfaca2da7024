# The core's CAN port: SLCAN text in, frames out, and the way back; in the VM with the heap locked, too.

from hypothesis import given
from hypothesis import strategies as st
import pytest

from firmware_py.limits import RX_BYTES
from firmware_py.ports.slcan import SlcanPort
from protocol.can_joiner import FRAME_MAX
from tests.protocol.messages import seeded, some_frame, wire
from tests.protocol.test_can_frames import DOWN, UP, WAYS, cut, joined
from tests.upy import run

SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)


# A port whose far end is the test: `comes` is read in pieces of `piece` bytes, `went` is what was written.
class Line:
    heap_bytes, heap_code_bytes, heap_boot_bytes, locked = 1000, 100, 0, 0

    def __init__(self, comes=b"", piece=7):
        self.comes, self.piece, self.went = comes, piece, b""

    def open(self, path, buf):
        self.path, self.buf = path, buf

    def read(self, timeout_ms):
        data, self.comes = self.comes[:self.piece], self.comes[self.piece:]
        self.buf[:len(data)] = data
        return len(data)

    def write(self, buf, size):
        self.went += bytes(buf[:size])


def opened(comes=b"", fd=0, piece=7):
    line = Line(comes, piece)
    port = SlcanPort(line, fd)
    buf = bytearray(RX_BYTES)
    port.open("/dev/adapter", buf)
    return port, line, buf


def read_all(port, line, buf):
    found = []
    while line.comes or port._at < port._end:
        size = port.read(0)
        if size:
            found.append(bytes(buf[:size]))
    return found


def text(frames, letter="t", stamp="", case=str.upper):
    """SLCAN text of CAN frames, by LAWICEL's description of it."""
    return "".join("%s%s%s\r" % (letter, case("%03x%x%s" % (can_id, SIZES.index(len(data)), data.hex())), stamp)
                   for can_id, data in frames).encode()


def lines_of(data):
    """(letter, id, data) of each line of SLCAN text."""
    found = []
    for line in data.decode().split("\r")[:-1]:
        assert len(line) == 5 + 2 * SIZES[int(line[4], 16)]
        found.append((line[0], int(line[1:4], 16), bytes.fromhex(line[5:])))
    return found


@WAYS
@pytest.mark.parametrize("piece", [1, 5, 256])
def test_what_the_adapter_hears_for_us_is_what_read_gives(fd, piece):
    rng = seeded(1)
    frames = [wire(some_frame(rng, DOWN, seq=i)) for i in range(60)]
    said = b"".join(text(cut(frame, DOWN, fd), "b" if fd else "t") for frame in frames)
    assert read_all(*opened(said, fd, piece)) == frames


@WAYS
def test_what_write_takes_goes_out_as_text(fd):
    rng = seeded(2)
    frames = [wire(some_frame(rng, UP, seq=i)) for i in range(60)]
    port, line, _ = opened(fd=fd)
    assert line.went == (b"\rC\rS6\rY2\rO\r" if fd else b"\rC\rS6\rO\r")
    line.went = b""
    for frame in frames:
        port.write(bytearray(frame), len(frame))
    said = lines_of(line.went)
    assert {letter for letter, _, _ in said} == {"b" if fd else "t"}
    assert joined([(can_id, data) for _, can_id, data in said], UP) == frames


def test_answers_stamps_small_letters_others_frames_and_noise_are_passed_over():
    rng = seeded(3)
    frames = [wire(some_frame(rng, DOWN, seq=i)) for i in range(40)]
    said = b"t24112\rz\r"       # half a line before us
    for i, frame in enumerate(frames):
        noise = (b"", b"\r", b"\a", b"z\r", b"V1013\r", b"T000000FF0\r", b"r2410\r", b"t7FF8" + b"00" * 8 + b"\r", b"\xff\x00junk\r",
                 b"t2419" + b"00" * 9 + b"\r", b"t" + b"0" * 500 + b"\r", b"F00\r\a")[i % 12]
        ours = [text([one], stamp=("", "1A2B")[i & 1], case=(str.upper, str.lower)[i >> 1 & 1]) for one in cut(frame, DOWN, 0)]
        said += noise + noise.join(ours)
    assert read_all(*opened(said)) == frames


@given(said=st.one_of(st.binary(max_size=400), st.text("tdb0123456789ABCDEFabcdef\r\a", max_size=400).map(str.encode)))
def test_whatever_the_line_says_nothing_is_raised_and_no_buffer_grows(said):
    port, line, buf = opened(said)
    buffers = [len(port._data), len(port._lines), len(port._text), len(buf)]
    read_all(port, line, buf)
    assert buffers == [len(port._data), len(port._lines), len(port._text), len(buf)] and -1 <= port._place < 140
    good = wire(some_frame(seeded(4), DOWN))
    line.comes = b"\r" + text(cut(good, DOWN, 0))
    assert read_all(port, line, buf)[-1:] == [good], "the next good frame comes through"


def test_an_adapter_that_goes_ends_the_core():
    port, line, _ = opened()
    line.read = lambda timeout_ms: -1
    assert port.read(50) == -1


@WAYS
@pytest.mark.parametrize("count", [300, pytest.param(5000, marks=pytest.mark.soak)])
def test_in_the_vm_it_allocates_nothing_and_finds_the_same(fd, count, tmp_path, micropython, record_count):
    rng = seeded(7)
    said, unhurt = b"", []
    for i in range(count):
        frame = wire(some_frame(rng, DOWN, seq=i & 255))
        good = text(cut(frame, DOWN, fd), "b" if fd else "t")
        if i % 3 != 2:
            unhurt.append(frame)
        if i % 3 == 1:
            good = rng.randbytes(rng.randrange(200)) + b"\r" + good
        elif i % 3 == 2:
            at = rng.randrange(len(good) - 1)   # not the end of its last line: that would hurt the next frame, too
            good = good[:at] + rng.choice((b"", b"\r", b"\a", b"g", b"\xc3")) + good[at + 1:]
        said += good
    path = tmp_path / "stream"
    path.write_bytes(said)
    here, there = (run.script("tests.upy.slcan_text", path, fd, python=python, heap="4m", timeout_s=600) for python in (True, False))
    record_count("frames as SLCAN text in the MicroPython VM (other than on CPython)", count, here != there)
    assert here == there
    found = read_all(*opened(said, fd))
    assert int(here.strip("[").split(",")[0]) == len(found)
    assert not set(unhurt) - set(found), "what was not hit comes through"


def test_a_whole_frame_fits_the_buffer_that_the_core_lends():
    assert RX_BYTES >= FRAME_MAX
