# A million hit frames: none is accepted as another than it was, and none takes the intact one behind it along.
#
# numpy hits whole batches of one frame at a time, so that the time goes to the decoder that is tried and not to the making of faults.

import time
import tracemalloc
from array import array

import numpy as np
import pytest

from protocol import frame_reader as fr
from protocol.frame_reader import COUNTERS, DOWN, FrameReader
from protocol.host_link import HostLink
from protocol.link import Link
from tests.protocol.messages import CHUNK, random_chunks, seeded, some_frame, wire

BATCH = 2000
KINDS = ("one bit", "some bits", "burst", "lost bytes", "more bytes", "splice", "zeroed", "swapped", "aimed")


def hit_rows(kind, frame, other, draw):
    """BATCH copies of this frame's bytes, each hit in its own way. `draw` is numpy's generator."""
    size = len(frame)
    rows = np.tile(np.frombuffer(frame, np.uint8), (BATCH, 1))
    row, place = np.arange(BATCH), draw.integers(0, size, BATCH)
    columns = np.arange(size)
    if kind == "one bit":
        rows[row, place] ^= (1 << draw.integers(0, 8, BATCH)).astype(np.uint8)
    elif kind == "some bits":
        for _ in range(int(draw.integers(2, 9))):
            rows[row, draw.integers(0, size, BATCH)] ^= (1 << draw.integers(0, 8, BATCH)).astype(np.uint8)
    elif kind == "burst":
        inside = (columns >= place[:, None]) & (columns < (place + draw.integers(1, 9, BATCH))[:, None])
        rows[inside] = draw.integers(0, 256, inside.sum(), np.uint8)
    elif kind in ("lost bytes", "more bytes"):
        shift = draw.integers(1, 5, BATCH)[:, None] * (1 if kind == "lost bytes" else -1)
        source = columns + np.where(columns >= place[:, None], shift, 0)
        rows = np.where((source >= 0) & (source < size), rows[row[:, None], source.clip(0, size - 1)], 0).astype(np.uint8)
    elif kind == "splice":
        tail = np.resize(np.frombuffer(other, np.uint8), size)
        rows = np.where(columns >= place[:, None], tail, rows)
    elif kind == "zeroed":
        rows[row, place] = 0
    elif kind == "swapped":
        second = draw.integers(0, size, BATCH)
        rows[row, place], rows[row, second] = rows[row, second], rows[row, place]
    else:  # only where a frame has its code, header, length and sum
        at = draw.choice(np.r_[1:7, size - 6:size - 1], (BATCH, 2))
        for k in range(2):
            rows[row, at[:, k]] ^= draw.integers(0, 256, BATCH, np.uint8)
    return rows


def campaign(frames, seed):
    """-> counts. AssertionError at the first frame that is accepted wrongly or lost without need."""
    rng, draw = seeded(seed), np.random.default_rng(seed)
    reader = FrameReader(DOWN, array("i", bytes(4 * COUNTERS)))
    counts = {"hit": 0, "accepted wrong": 0, "intact ones lost": 0, "unharmed": 0}
    while counts["hit"] < frames:
        good, other, witness = (some_frame(rng, seq=k) for k in range(3))
        rows = hit_rows(KINDS[counts["hit"] // BATCH % len(KINDS)], wire(good), wire(other), draw)
        stream = np.hstack([rows, np.tile(np.frombuffer(wire(witness), np.uint8), (BATCH, 1))]).tobytes()
        buf, end, at, seen, same = bytearray(stream), len(stream), 0, 0, 0
        good_body, witness_body = good[:-4], witness[:-4]
        while at < end:
            at = reader.feed_from(buf, at, end)
            if reader.ready:
                body = buf[reader.body_start - 5:reader.body_end]
                if body == witness_body:
                    seen += 1
                elif body == good_body or body == other[:-4]:
                    same += 1  # it was hit outside of its bytes, or what was put there was there before; or spliced at its beginning
                else:
                    counts["accepted wrong"] += 1
        counts["hit"] += BATCH
        counts["intact ones lost"] += BATCH - seen if seen < BATCH else 0
        counts["unharmed"] += same
    return counts, reader.counters


@pytest.mark.timeout(600)
@pytest.mark.parametrize("frames", [1_000_000, pytest.param(10_000_000, marks=pytest.mark.soak)])
def test_no_hit_frame_is_accepted_as_another(frames, record_count):
    start_s = time.monotonic()
    counts, causes = campaign(frames, 5)
    by_cause = {cause: causes[cause] for cause in (fr.BAD_COBS, fr.BAD_CRC, fr.BAD_LENGTH, fr.OVERRUN)}
    print(counts, by_cause, round(time.monotonic() - start_s, 1), "s")
    record_count("hit frames (accepted wrong, or an intact one lost)", counts["hit"], counts["accepted wrong"] + counts["intact ones lost"])
    assert counts["accepted wrong"] == 0 and counts["intact ones lost"] == 0
    assert counts["hit"] >= frames and counts["unharmed"] < 0.2 * frames
    assert all(causes[cause] == 65535 for cause in (fr.BAD_COBS, fr.BAD_CRC))


def feed_reader(reader):
    def feed(chunk):
        at = 0
        while at < len(chunk):
            at = reader.feed_from(chunk, at, len(chunk))
            assert not reader.ready
    return feed, reader.counters


def feed_core(link):
    def feed(chunk):
        at = 0
        while at < len(chunk):
            at = link.feed(chunk, at, len(chunk))
            assert not link.message_id and not link.tx_len
    return feed, link.counters


def feed_host(link):
    def feed(chunk):
        assert link.feed(chunk) == []
    return feed, link.counters


SIDES = {
    "reader": lambda: feed_reader(FrameReader(DOWN, array("i", bytes(4 * COUNTERS)))),
    "core": lambda: feed_core(Link(1)), "host": lambda: feed_host(HostLink())}


# The core inside the MicroPython VM, with its heap locked, is in test_micropython.py.
@pytest.mark.timeout(900)
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("megabytes", [10, pytest.param(1000, marks=pytest.mark.soak)])
def test_random_bytes_are_no_frames_and_take_no_memory(side, megabytes, record_count):
    feed, counters = SIDES[side]()
    largest = taken = 0
    tracemalloc.start()
    try:
        for number, chunk in enumerate(random_chunks(6, -(-megabytes * 1_000_000 // CHUNK))):
            before = tracemalloc.get_traced_memory()[0]
            feed(chunk)
            taken += len(chunk)
            if number > 10:
                largest = max(largest, tracemalloc.get_traced_memory()[0] - before)
    finally:
        tracemalloc.stop()
    record_count("random bytes, %s (taken for a frame)" % side, taken, counters[fr.FRAMES_IN])
    assert counters[fr.FRAMES_IN] == 0 and counters[fr.BAD_COBS] == 65535
    assert largest < 2000, "bytes that stayed"
