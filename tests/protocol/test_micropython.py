# The same code inside the MicroPython VM, with the heap locked: it allocates
# nothing, raises nothing, and does what CPython does.

import os
import threading

import pytest

from protocol import schema
from protocol.host_link import RELIABLE
from protocol.messages import BY_NAME
from tests.protocol.messages import CHUNK, corrupted, random_chunks, raw_frame, seeded, some_frame, wire
from tests.upy import run

BOOT_ID = 4711


def test_the_lock_holds():
    with pytest.raises(AssertionError, match="MemoryError"):
        run.script("tests.upy.allocates")


def test_round_trips_and_crc_with_the_heap_locked():
    here, there = (run.script("tests.upy.codec_crc", python=python) for python in (True, False))
    assert here == there and int(there.split()[1]) > 5000


@pytest.mark.timeout(900)
@pytest.mark.parametrize("megabytes", [10, pytest.param(1000, marks=pytest.mark.soak)])
def test_random_bytes_raise_nothing_and_allocate_nothing(tmp_path, megabytes, record_count):
    pipe, size = tmp_path / "bytes", -(-megabytes * 1_000_000 // CHUNK) * CHUNK
    os.mkfifo(pipe)

    def script(python):
        writer = threading.Thread(target=pour, args=(pipe, size), daemon=True)
        writer.start()
        said = run.script("tests.upy.random_bytes", pipe, size, python=python, timeout_s=60 + megabytes)
        writer.join(10)
        return said

    here, there = script(python=True), script(python=False)
    record_count("random bytes, core in the VM, heap locked (other than on CPython)", size, here != there)
    assert here == there


def pour(pipe, size):
    with open(pipe, "wb") as file:
        for chunk in random_chunks(6, size // CHUNK):
            file.write(chunk)


def stream_of(rng, count):
    # Good frames, hit frames, noise, unknown ids, other epochs, bodies out of bounds, a second welcome; questions
    # in their turn, too early, again, with this or that acknowledged.
    parts = [wire(raw_frame(0x02, BY_NAME["WELCOME"](1, BOOT_ID, 0, 0).pack(), schema.VERSION))]
    asked = acked = 0
    for seq in range(count):
        good = wire(some_frame(rng, seq=seq & 255))
        what = rng.randrange(12)
        if what == 0:
            good = corrupted(rng, good)
        elif what == 1:
            good = rng.randbytes(rng.randrange(300)) + good
        elif what == 2:
            good = wire(raw_frame(rng.randrange(256), rng.randbytes(rng.randrange(97)), schema.VERSION | 1 << 5))
        elif what == 3:
            good = wire(some_frame(rng, epoch=rng.randrange(4)))
        elif what == 4:
            good = wire(raw_frame(0x50, rng.randbytes(6), schema.VERSION | 1 << 5))
        elif what == 5 and rng.random() < 0.1:
            good = wire(raw_frame(0x02, BY_NAME["WELCOME"](1, BOOT_ID, 3, 4).pack(), schema.VERSION))
        elif what >= 8:
            turn = rng.choice((0, 0, 0, 1, 1, 1, 1, 2))
            asked += turn == 1 and asked - acked < 2
            good = wire(raw_frame(0x51, bytes((asked & 31, 0)), schema.VERSION | RELIABLE | 1 << 5,
                                  seq=asked + turn * (turn == 2) & 255, ack=acked & 255))
            acked = max(acked, asked - rng.choice((0, 1, 1, 2)))
        parts.append(good)
    return b"".join(parts)


@pytest.mark.parametrize("seed", range(1, 5))
def test_one_stream_one_trace_on_both_runtimes(tmp_path, seed):
    path = tmp_path / "stream.bin"
    path.write_bytes(stream_of(seeded(seed), 700))
    here, there = (run.script("tests.upy.link_stream", path, BOOT_ID, python=python) for python in (True, False))
    assert here == there
    words = there.split()
    assert int(words[3]) > 300 and int(words[5]) > 100 and words[7] == "1" and int(words[9]) > 20
