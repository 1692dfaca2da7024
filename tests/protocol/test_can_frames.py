# Frames of ours cut into CAN frames and joined again: whole, in order, and never a wrong one.

from array import array

from hypothesis import given
from hypothesis import strategies as st
import pytest

from protocol import dbc, schema, schema_hash
from protocol.can_cutter import CanCutter
from protocol.can_joiner import FRAME_MAX, CanJoiner
from protocol.frame_reader import COUNTERS, FRAMES_IN, FrameReader
from protocol.messages import BY_NAME
from tests.protocol.messages import raw_frame, seeded, some_frame, wire

DOWN, UP, BOTH = 0, 1, 2
FIELD_BYTES = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "p10": 10}
SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
WAYS = pytest.mark.parametrize("fd", [0, 1], ids=["2.0A", "FD"])

bodies = st.one_of(st.binary(max_size=96), st.integers(0, 96).map(bytes), st.lists(st.sampled_from((0, 1)), max_size=96).map(bytes))


def cut(frame, direction, fd, cutter=None):
    """The CAN frames of one frame: (id, data)."""
    cutter = cutter or CanCutter(direction, fd)
    cutter.begin(frame, len(frame))
    found = []
    while cutter.next():
        assert cutter.size == SIZES[cutter.dlc] and (fd or cutter.size <= 8)
        found.append((cutter.can_id, bytes(cutter.data[:cutter.size])))
    return found


def joined(frames, direction, joiner=None):
    joiner = joiner or CanJoiner(bytearray(FRAME_MAX), direction)
    sizes = ((joiner.join(can_id, data, len(data))) for can_id, data in frames)
    return [bytes(joiner.frame[:size]) for size in sizes if size]


def sound(frames):
    """What the reader above, which has the CRC, makes of them: raw frames."""
    reader = FrameReader(BOTH, array("i", bytes(4 * COUNTERS)))
    found = []
    for frame in frames:
        held = bytearray(frame)
        at = 0
        while at < len(held):
            at = reader.feed_from(held, at, len(held))
            if reader.ready:
                found.append(bytes(reader.body[reader.body_start - 5:reader.body_end + 4]))
    assert reader.counters[FRAMES_IN] == len(found)
    return found


@WAYS
@given(message_id=st.integers(0, 255), direction=st.sampled_from((DOWN, UP)), body=bodies, seq=st.integers(0, 255))
def test_any_frame_comes_out_as_it_went_in(fd, message_id, direction, body, seq):
    frame = wire(raw_frame(message_id, body, schema.VERSION | direction << 2, seq))
    assert joined(cut(frame, direction, fd), direction) == [frame]
    assert joined(cut(frame, direction, fd), 1 - direction) == [], "what we sent ourselves"


@WAYS
def test_an_id_tells_direction_and_kind_and_the_more_urgent_is_the_lower(fd):
    def first(name, direction):
        row = next(row for row in schema.MESSAGES if row[1] == name)
        size = sum(FIELD_BYTES[kind] if kind[0] != "c" else int(kind[1:]) for _, kind, _ in row[4] if kind != "*")
        frames = cut(wire(raw_frame(row[0], bytes(size), schema.VERSION | direction << 2)), direction, fd)
        assert len({can_id >> 5 for can_id, _ in frames} - {0x33}) <= 1     # 0x33: SCHEMA behind LINK
        return frames[0][0]

    step, answer, status, map_read, map_data = (first(*pair) for pair in (
        ("STEP", DOWN), ("STEP_RSP", UP), ("STATUS", DOWN), ("MAP_READ", DOWN), ("MAP_DATA", UP)))
    assert (step, answer, map_read, map_data) == (0x241, 0x261, 0x443, 0x463)
    assert step < answer < map_read < map_data < first("VECTOR", UP) and status == step


@WAYS
@pytest.mark.parametrize("what", ["lost", "twice", "swapped"])
def test_a_can_frame_that_goes_wrong_costs_its_own_frame_and_makes_no_wrong_one(fd, what):
    rng = seeded(5)
    cutter, joiner = CanCutter(UP, fd), CanJoiner(bytearray(FRAME_MAX), UP)
    came = hit = 0
    for n in range(1500):
        raws = [some_frame(rng, UP, seq=n & 255) for _ in range(3)]
        groups = [cut(wire(raw), UP, fd, cutter) for raw in raws]
        victim = rng.randrange(len(groups[1]))
        middle = list(groups[1])
        if what == "lost":
            del middle[victim]
        elif what == "twice":
            middle.insert(victim, middle[victim])
        else:
            other = rng.randrange(len(middle))
            middle[victim], middle[other] = middle[other], middle[victim]
        found = sound(joined(groups[0] + middle + groups[2], UP, joiner))
        assert found[0] == raws[0] and found[-1] == raws[2], "the frames beside it"
        assert all(raw in raws for raw in found)
        came += len(found)
        hit += middle != groups[1]
    assert hit > 10 and came >= 2 * 1500     # swapped: of CAN FD few frames have two
    if what == "lost" and not fd:
        # The last CAN frame of LINK is SCHEMA's, which no frame needs; else what lost one is gone.
        assert came < 2.1 * 1500


@given(frames=st.lists(st.tuples(
    st.one_of(st.integers(0, 0xFFF), st.sampled_from((0x261, 0x460, 0x463, 0x470, 0x474, 0x660, 0x661, 0x664, 0x665, 0x67E, 0x67F))),
    st.binary(max_size=64)), max_size=60))
def test_whatever_comes_off_the_bus_nothing_is_raised_and_no_buffer_grows(frames):
    joiner = CanJoiner(bytearray(FRAME_MAX), UP)
    for can_id, data in frames:
        size = joiner.join(can_id, data, len(data))
        assert 0 <= size <= 108 and len(joiner.frame) == FRAME_MAX


def test_two_hundred_thousand_random_can_frames_make_no_frame_of_ours():
    rng = seeded(6)
    joiner = CanJoiner(bytearray(FRAME_MAX), UP)
    ids = (0x261, 0x460, 0x463, 0x660, 0x661, 0x662, 0x663, 0x664, 0x67F)
    frames = ((rng.choice(ids), rng.randbytes(rng.choice((2, 6, 8, 8, 8)))) for _ in range(200_000))
    assert sound(joined(frames, UP, joiner)) == []
    assert joiner.broken > 1000


@WAYS
def test_behind_every_second_frame_of_link_counts_goes_the_schema_that_the_core_speaks(fd):
    body = bytes(next(sum(FIELD_BYTES[kind] for _, kind, _ in row[4]) for row in schema.MESSAGES if row[1] == "LINK"))
    said = (0x67E, schema_hash.schema_hash().to_bytes(4, "little") + bytes((schema.VERSION,)))
    cutter = CanCutter(UP, fd)
    ends = [cut(wire(raw_frame(BY_NAME["LINK"].ID, body, schema.VERSION | 4)), UP, fd, cutter)[-1] for _ in range(6)]
    assert [end == said for end in ends] == [True, False] * 3


OTHER = (
    (0x21, "STORE", 1, 0, (("index", "u8", ""), ("name", "c12", ""))),                             # ours has more behind
    (0x24, "LINK", 1, 0, tuple(("count_%d" % i, "u32", "") for i in range(7))),
    (0x2E, "NEW", 1, 0, (("a", "i32", ""), ("b", "u8", ""), ("c", "u32", ""))),                    # ours has no such message
)


@WAYS
def test_the_telemetry_of_another_schema_is_joined_by_its_own_tables(fd):
    joiner = CanJoiner(bytearray(FRAME_MAX), UP)
    joiner.speaks(*dbc.tables(OTHER))
    rng = seeded(8)
    frames, expected = [], []
    for message_id, _, fields in dbc.telemetry(OTHER) * 5:
        body = rng.randbytes(sum(dbc.SIZES[kind] for _, kind, _ in fields))
        raw = raw_frame(message_id, body, schema.VERSION | 4)
        head = raw[:4] + raw[-4:]
        if fd:
            frames.append((0x470 | message_id & 15, (head + body).ljust(next(n for n in SIZES if n >= 8 + len(body)), b"\0")))
        else:
            frames += [(0x660 | channel, body[start:start + sum(dbc.SIZES[field[1]] for field in held)])
                       for channel, (of, _, _, start, held) in enumerate(dbc.parts(OTHER)) if of == message_id]
            frames.append((0x67F, head))
        expected.append(wire(raw))
    assert joined(frames, UP, joiner) == expected
    assert joined(frames, UP) != expected


@WAYS
def test_an_empty_or_overlong_wire_is_no_frame(fd):
    for size in (2, 3, 11, 109, 200):
        assert cut(b"\0" + b"\1" * (size - 1), UP, fd) == []
