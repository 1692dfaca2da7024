# The frame reader under a hostile line: it loses the frames that were hit, never
# another, never accepts a wrong one, never raises.

from array import array

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from protocol import schema
from protocol import frame_reader as fr
from protocol.frame_reader import BOTH, COUNTERS, DOWN, UP, FrameReader
from tests.protocol.messages import cobs_by_definition, corrupted, raw_frame, seeded, some_frame, wire

DOWN_CTL = schema.VERSION
CAUSES = (fr.BAD_COBS, fr.BAD_CRC, fr.BAD_LENGTH, fr.BAD_HEADER, fr.OVERRUN)


def reader(listen=DOWN):
    return FrameReader(listen, array("i", bytes(4 * COUNTERS)))


def frame_of(r):
    body = bytes(r.body[r.body_start:r.body_end])
    return raw_frame(r.message_id, body, r.ctl, r.seq, r.ack)


def read_bulk(r, stream, pieces=(1 << 20,)):
    # In pieces of these sizes, over and over. The buffer is scratch, and dirty beyond the piece.
    frames, at, turn = [], 0, 0
    while at < len(stream):
        piece = stream[at:at + pieces[turn % len(pieces)]]
        at += len(piece)
        turn += 1
        buf = bytearray(b"\x5a" + piece + b"\0\x5a")
        start, end = 1, 1 + len(piece)
        while start < end:
            after = r.feed_from(buf, start, end)
            assert start < after <= end
            start = after
            if r.ready:
                frames.append(frame_of(r))
        assert buf[0] == 0x5a and bytes(buf[end:]) == b"\0\x5a"
    return frames


def read_bytes(r, stream):
    return [frame_of(r) for byte in stream if r.feed(byte)]


frames = st.builds(
    raw_frame, st.integers(0, 255), st.binary(max_size=schema.BODY_MAX),
    st.integers(0, 3).map(lambda epoch: DOWN_CTL | epoch << 5), st.integers(0, 255), st.integers(0, 255))
noises = st.binary(max_size=300)  # good frames of 32 bits by chance: none


@given(items=st.lists(st.tuples(noises, frames), max_size=8), last=noises, pieces=st.lists(st.integers(1, 130), min_size=1, max_size=5))
@example(items=[(b"", raw_frame(1, b"", DOWN_CTL))] * 3, last=b"", pieces=[1])
@example(items=[(b"\x01" * 300, raw_frame(1, b"\0" * 96, DOWN_CTL))], last=b"", pieces=[7])
def test_noise_between_frames_costs_no_frame(items, last, pieces):
    sent = [raw for _, raw in items]
    stream = b"".join(noise + wire(raw) for noise, raw in items) + last
    for read in (lambda r: read_bulk(r, stream), lambda r: read_bulk(r, stream, pieces), lambda r: read_bytes(r, stream)):
        r = reader()
        assert read(r) == sent
        assert r.counters[fr.BYTES_IN] == len(stream) and r.counters[fr.FRAMES_IN] == len(sent)


@given(stream=st.binary(max_size=600), pieces=st.lists(st.integers(1, 130), min_size=1, max_size=5))
def test_the_counters_do_not_depend_on_how_the_bytes_come(stream, pieces):
    whole, apart, single = reader(), reader(), reader()
    assert read_bulk(whole, stream) == read_bulk(apart, stream, pieces) == read_bytes(single, stream)
    assert whole.counters == apart.counters == single.counters


def test_a_hit_frame_takes_no_other_along():
    # Any one frame of a row is damaged: the others all arrive, in order.
    rng = seeded(20)
    for _ in range(2000):
        sent = [some_frame(rng, seq=k) for k in range(3)]
        hit = corrupted(rng, cobs_by_definition(sent[1]))
        stream = wire(sent[0]) + b"\0" + hit + b"\0" + wire(sent[2])
        got = read_bulk(reader(), stream)
        assert got in ([sent[0], sent[2]], sent), (sent, hit)


def test_a_lost_delimiter_costs_at_most_its_own_frame():
    rng = seeded(21)
    for _ in range(500):
        sent = [some_frame(rng, seq=k) for k in range(3)]
        parts = [wire(raw) for raw in sent]
        for missing in range(4):  # one of the delimiters around the frame in the middle, or both
            middle = parts[1][missing & 1:len(parts[1]) - (missing >> 1)]
            got = read_bulk(reader(), parts[0] + middle + parts[2])
            assert got == sent  # the neighbours' delimiters do as well


@pytest.mark.parametrize("frames_of_250", [400, pytest.param(40000, marks=pytest.mark.soak)])
def test_corrupted_frames_and_no_wrong_accept(frames_of_250, record_count):
    rng = seeded(22)
    r = reader()
    hits = accepted = wrong = 0
    for _ in range(frames_of_250):
        good = some_frame(rng)
        clean = wire(good)
        for _ in range(250):
            stream = corrupted(rng, clean)
            hits += stream != clean
            buf = bytearray(stream + b"\0")
            at = 0
            while at < len(buf):
                at = r.feed_from(buf, at, len(buf))
                if r.ready:
                    accepted += 1
                    wrong += frame_of(r) != good
    record_count("frames corrupted one by one (accepted wrong)", hits, wrong)
    assert wrong == 0
    assert hits > 0.9 * 250 * frames_of_250
    causes = {cause: r.counters[cause] for cause in CAUSES}
    assert all(causes[cause] > 0 for cause in (fr.BAD_COBS, fr.BAD_CRC, fr.BAD_LENGTH)), causes
    assert accepted == r.counters[fr.FRAMES_IN]


def test_the_front_of_one_frame_and_the_back_of_another_are_no_frame():
    rng = seeded(23)
    for _ in range(200):
        first, second = some_frame(rng), some_frame(rng)
        one, other = cobs_by_definition(first), cobs_by_definition(second)
        for cut in range(1, len(one)):
            for back in (cut, rng.randint(0, len(other))):
                got = read_bulk(reader(), one[:cut] + other[back:] + b"\0")
                assert got in ([], [first], [second]), (first, second, cut, back)


def well_formed(**changes):
    fields = dict(message_id=0x12, body=b"\x07", ctl=DOWN_CTL)
    fields.update(changes)
    return wire(raw_frame(**fields))


@pytest.mark.parametrize("cause, stream", [
    (fr.BAD_LENGTH, well_formed(length=9)),                 # LEN says less, the CRC is right
    (fr.BAD_LENGTH, well_formed(length=11)),
    (fr.BAD_LENGTH, well_formed(length=0)),
    (fr.BAD_LENGTH, wire(b"\1\2\3\4\x08\5\6\7")),           # shorter than a header and a CRC
    (fr.BAD_CRC, well_formed(crc=0)),
    (fr.BAD_CRC, well_formed(crc=0xFFFFFFFF)),
    (fr.BAD_HEADER, well_formed(ctl=DOWN_CTL | 4)),         # our own direction: an echo
    (fr.BAD_HEADER, well_formed(ctl=DOWN_CTL | 128)),       # the reserved bit
    (fr.BAD_HEADER, well_formed(ctl=0)),                    # another version
    (fr.BAD_HEADER, well_formed(ctl=2)),
    (fr.BAD_HEADER, well_formed(ctl=3)),
    (fr.BAD_COBS, b"\0" + b"\x0b" * 10 + b"\0"),            # the code leads past the delimiter
    (fr.OVERRUN, b"\0" + b"\x01" * 107 + b"\0"),
    (fr.OVERRUN, b"\0" + b"\x01" * 5000 + b"\0"),
])  # fmt: skip
def test_each_fault_is_counted_once_under_its_own_cause(cause, stream):
    for read in (read_bulk, read_bytes, lambda r, s: read_bulk(r, s, (50,))):
        r = reader()
        assert read(r, stream) == []
        assert {c: r.counters[c] for c in CAUSES if r.counters[c]} == {cause: 1}
        assert read(r, well_formed()) != []  # and the link goes on


def test_every_bit_of_the_crc_counts():
    good = raw_frame(0x12, b"\x07", DOWN_CTL)
    for bit in range(32):
        raw = good[:-4] + (int.from_bytes(good[-4:], "little") ^ 1 << bit).to_bytes(4, "little")
        r = reader()
        assert read_bulk(r, wire(raw)) == [] and r.counters[fr.BAD_CRC] == 1


def test_who_listens_to_whom():
    down, up = raw_frame(0x12, b"\1", DOWN_CTL), raw_frame(0x13, b"\1", DOWN_CTL | 4)
    for listen, heard in ((DOWN, [down]), (UP, [up]), (BOTH, [down, up])):
        assert read_bulk(reader(listen), wire(down) + wire(up)) == heard


def test_the_largest_frame_fits_and_one_more_byte_does_not():
    for size in (0, schema.BODY_MAX):
        raw = raw_frame(0x33, b"\0" * size, DOWN_CTL)
        for pieces in ((1 << 20,), (1,), (60,)):
            assert read_bulk(reader(), wire(raw), pieces) == [raw]
    big = raw_frame(0x33, b"\0" * (schema.BODY_MAX + 1), DOWN_CTL)
    r = reader()
    assert read_bulk(r, wire(big)) == [] and r.counters[fr.OVERRUN] == 1


def test_reset_forgets_half_a_frame():
    r = reader()
    whole = well_formed()
    read_bulk(r, whole[:6])
    r.reset()
    assert len(read_bulk(r, whole[1:])) == 1
    read_bulk(r, whole[:6])  # without the reset the half would have spoilt what comes without a delimiter
    assert read_bulk(r, whole[1:]) == []


def test_counters_stay_below_2_to_the_30():
    r = reader()
    r.counters[fr.BYTES_IN] = r.counters[fr.FRAMES_IN] = 2**29
    r.counters[fr.BAD_CRC] = 65535
    read_bulk(r, well_formed() + well_formed(crc=1))
    assert (r.counters[fr.BYTES_IN], r.counters[fr.FRAMES_IN], r.counters[fr.BAD_CRC]) == (2**29, 2**29, 65535)


def test_the_counters_stand_as_the_link_message_has_them():
    names = [field[0] for row in schema.MESSAGES if row[1] == "LINK" for field in row[4]]
    assert [getattr(fr, name.upper()) for name in names] == list(range(len(names)))
