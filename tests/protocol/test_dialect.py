# Two ends of different schemas: what passes between them means the same at both, and what cannot is a sentence.

import copy
import json
import random
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import schema, states
from protocol.dialect import BITS, OURS, SchemaError, dialect_of, from_text, name_of, names_of_bits
from protocol.frame_reader import BOTH
from protocol.host_link import HostLink
from protocol.messages import BY_NAME, MessageError
from protocol.schema_pull import SchemaPull, known, piece
from protocol.translation import Translation, of_log
from tests.protocol.edited_schema import edited, some_message, told
from tests.protocol.messages import raw_frame, wire

HELLO = BY_NAME["HELLO"](*[0] * 17)


def hello_of(value):
    return HELLO._replace(protocol_min=1, protocol_max=1, boot_id=7, schema_lo=value & 0xFFFF, schema_hi=value >> 16)


def deflated(new):
    deflater = zlib.compressobj(9, zlib.DEFLATED, BITS)
    return deflater.compress(json.dumps(new).encode()) + deflater.flush()


def changed(name, change):
    """The Dialect of ours after change(the fields of that message)."""
    new = told()
    row = next(row for row in new["messages"] if row[1] == name)
    change(row[4])
    return dialect_of(new)


def read(theirs, name, *values):
    """A message of theirs as ours."""
    kind = theirs.by_name[name]
    return Translation(theirs).reads[kind.ID].unpack(kind(*values).pack())


def test_what_the_core_serves_is_our_schema():
    pull = SchemaPull(hello_of(OURS.hash))
    while not pull.whole:
        question = pull.question()
        answer = piece(OURS.data, question.offset)
        assert len(answer.pack()) <= schema.BODY_MAX and pull.fits(answer)
        pull.take(answer)
    dialect = pull.dialect()
    assert dialect.messages == OURS.messages and dialect.codes == OURS.codes and dialect.hash == OURS.hash
    units = {(row[1], field[0]): field[2] for row in dialect.messages for field in row[4]}
    assert units["POSE", "x_um"] == "um" and units["VECTOR", "x"] == "5 mm"
    assert known(hello_of(dialect.hash)) is dialect, "who meets it again need not ask"


def test_the_handshake_is_ours_whatever_they_say():
    theirs = dialect_of({**told(), "messages": [[1, "HELLO", 0, 0, []], [2, "OTHER", 1, 1, [["a", "u8", ""]]]]})
    assert theirs.by_id == {number: kind for number, kind in OURS.by_id.items() if number <= 4}


@given(seed=st.integers(0, 2**32), edits=st.integers(1, 12))
def test_whatever_they_speak_nothing_but_the_sentence_is_raised(seed, edits):
    rng = random.Random(seed)
    try:
        theirs = dialect_of(edited(seed, edits))
    except SchemaError as error:
        assert "\n" not in str(error)
        return
    heard = []
    translation = Translation(theirs, heard=heard.append)
    assert "\n" not in translation.summary()
    for name, ours in OURS.by_name.items():
        flaw = translation.flaw([name]) or translation.unread([name] if ours.ID > 4 else [])
        assert "\n" not in flaw and (not flaw or name in flaw)
    for number, kind in theirs.by_id.items():
        message = some_message(rng, kind)
        try:
            ours = translation.reads[number].unpack(message.pack())
        except MessageError:
            continue
        if ours is None:
            assert heard[-1] == message
        elif number > 4:
            same(theirs, message, ours)
    for kind in OURS.by_id.values():
        try:
            number, body = translation.write(some_message(rng, kind)) if kind.DIRECTION == 0 and kind.ID > 4 else (None, None)
        except SchemaError as error:
            assert "\n" not in str(error) and kind.NAME in str(error)
        else:
            assert number is None or theirs.by_id[number].unpack(body).NAME == kind.NAME
    for row in OURS.parameters:
        try:
            number = translation.parameter(row[0], 0, rng.choice((row[5], 1)))
        except SchemaError as error:
            assert row[0] in str(error)
        else:
            assert number is None or theirs.parameters[number][0] == row[0]


def same(theirs, message, ours):
    """Each field of ours is theirs of that name, or empty and optional."""
    there = {field[0]: (value, field[1]) for value, field in zip(message, message.FIELDS, strict=True)}
    for value, (name, kind, _) in zip(ours, ours.FIELDS, strict=True):
        if name not in there:
            assert not any(value) if kind == "p10" else not value
            assert "%s.%s" % (ours.NAME, name) in schema.OPTIONAL
        elif name not in ("state", "reason", "degraded", "message_id") and kind != "*":
            assert value == there[name][0]


@given(st.recursive(st.none() | st.integers() | st.text(max_size=5) | st.sampled_from(("u8", "*", "A", "a")),
                    lambda part: st.lists(part, max_size=5) | st.dictionaries(st.sampled_from(("messages", "parameters", "states")), part)))
def test_whatever_is_told_as_a_schema(json_value):
    for new in (json_value, {**told(), "messages": json_value}, {**told(), "parameters": json_value}, {**told(), "states": json_value}):
        try:
            dialect_of(new)
        except SchemaError as error:
            assert "\n" not in str(error) and len(str(error)) < 200


@given(data=st.binary(max_size=200), cut=st.integers(0, len(OURS.data)))
def test_whatever_is_served_as_a_schema(data, cut):
    for text in (data, OURS.data[:cut] + data if cut < len(OURS.data) else b"", deflated({"messages": []})):
        with pytest.raises(SchemaError):
            from_text(text, OURS.hash ^ 1)


def test_a_text_of_another_hash_is_not_believed():
    with pytest.raises(SchemaError, match="%08x" % OURS.hash):
        from_text(OURS.data, OURS.hash ^ 1)


def test_a_bomb_is_not_unpacked():
    with pytest.raises(SchemaError, match="cannot be read"):
        from_text(deflated(" " * (1 << 24)), OURS.hash)


def test_states_are_followed_by_name():
    new = told()
    new["states"] = ["SLEEP", *new["states"]]
    theirs = dialect_of(new)
    translation = Translation(theirs)
    answer = read(theirs, "STEP_RSP", 1, 2, 3, 1 + states.FOLLOW, 0, 9)
    assert answer == BY_NAME["STEP_RSP"](1, 2, 3, states.FOLLOW, 0, 9)
    unknown = read(theirs, "STEP_RSP", 1, 2, 3, 0, 0, 9)
    assert translation.names["states"][unknown.state] == "SLEEP" and unknown.state >= len(states.NAMES)


def test_reasons_and_degraded_bits_too():
    new = told()
    new["reasons"].reverse()
    new["degraded"].reverse()
    theirs = dialect_of(new)
    values = [0] * len(BY_NAME["STATUS_RSP"].FIELDS)
    values[3], values[4] = len(states.REASONS) - 1 - states.REASON_STUCK, 0b0001
    status = read(theirs, "STATUS_RSP", *values)
    assert (status.reason, status.degraded) == (states.REASON_STUCK, 1 << len(states.DEGRADED) - 1)


def test_a_code_of_theirs_never_passes_for_another_one_of_ours():
    new = told()
    new["reasons"][1], new["degraded"][1] = "the battery is empty", "battery"
    theirs = dialect_of(new)
    names = Translation(theirs).names
    values = [0] * len(BY_NAME["STATUS_RSP"].FIELDS)
    values[3], values[4] = 1, 0b10 | 1 << 12
    status = read(theirs, "STATUS_RSP", *values)
    assert name_of(names["reasons"], status.reason, "reason") == "the battery is empty"
    assert names_of_bits(names["degraded"], status.degraded) == ["battery", "bit 12"]
    new["states"] = new["states"][:3]   # it says a state for which it has told no name
    theirs = dialect_of(new)
    answer = read(theirs, "STEP_RSP", 1, 2, 3, 5, 0, 9)
    assert Translation(theirs).names["states"][answer.state] == "state 5" and answer.state >= len(states.NAMES)


def test_the_handshake_has_no_second_id():
    new = told()
    hello = next(row for row in new["messages"] if row[1] == "HELLO")
    new["messages"].append([0x7E, *hello[1:]])
    hello[1] = "HELLO_OF_OLD"
    theirs = dialect_of(new)
    assert 0x7E not in theirs.by_id and theirs.by_name["HELLO"] is BY_NAME["HELLO"]


def test_an_error_names_our_message():
    new = told()
    next(row for row in new["messages"] if row[1] == "STEP")[0] = 0x1F
    assert read(dialect_of(new), "ERROR", 2, 0x1F, 5).message_id == BY_NAME["STEP"].ID


def test_a_group_is_joined_by_name():
    def swap(fields):
        fields[-1][2] = [["quality", "u8", ""], ["range_mm", "u32", "mm"], ["anchor", "u16", ""], ["strength_cdb", "i32", "cdB"]]
    theirs = changed("STEP", swap)
    head = (1, 2, 3, (0,) * 8, 4, 5)
    assert read(theirs, "STEP", *head, ((9, 2500, 3, -6000),)).uwb == ((3, -6000, 2500),)
    assert "STEP.uwb.quality (u8) is needed by the core" not in Translation(theirs).unread(["STEP"])
    assert "STEP.uwb.quality (u8) is needed by the core, and this host has no such field" in Translation(theirs).flaw(["STEP"])


def step(**fields):
    return BY_NAME["STEP"](1, 2, 3, (4,) * 8, 0, 0, ())._replace(**fields)


def test_what_has_no_place_there_may_be_nothing_only():
    theirs = changed("STEP", lambda fields: fields.pop(4))
    translation = Translation(theirs)
    number, body = translation.write(step())
    assert theirs.by_id[number].unpack(body)[:4] == (1, 2, 3, (4,) * 8)
    with pytest.raises(SchemaError, match=r"STEP.ultrasonic_mm \(u16, mm\) = 700 has no place in it"):
        translation.write(step(ultrasonic_mm=700))


def test_what_is_wanted_there_is_nothing_only_where_they_say_so():
    fields = lambda rows: rows.insert(2, ["lidar_mm", "u16", "mm"])  # noqa: E731
    assert "STEP.lidar_mm (u16, mm) is needed by the core" in Translation(changed("STEP", fields)).flaw(["STEP"])
    new = told()
    fields(next(row for row in new["messages"] if row[1] == "STEP")[4])
    new["optional"].append("STEP.lidar_mm")
    theirs = dialect_of(new)
    _, body = Translation(theirs).write(step())
    assert theirs.by_name["STEP"].unpack(body)[:4] == (1, 2, 0, 3)


@pytest.mark.parametrize(("change", "words"), [
    (["left", "u8", "pulse"], r"STEP.left \(i16, pulse\) = 300 does not fit its u8"),
    (["left", "i32", "mm"], r"STEP.left \(i16, pulse\) of this host is no STEP.left \(i32, mm\) of the core"),
    (["left", "p10", "pulse"], r"STEP.left \(i16, pulse\) of this host is no STEP.left \(p10, pulse\) of the core"),
])
def test_both_types_are_named(change, words):
    with pytest.raises(SchemaError, match=words):
        Translation(changed("STEP", lambda fields: fields.__setitem__(1, change))).write(step(left=300))


def test_parameters_are_told_by_name_and_unit():
    new = told()
    new["parameters"] = [["battery", "mV", 1], *[row for row in new["parameters"] if row[0] != "tick_ms"]]
    next(row for row in new["parameters"] if row[0] == "track")[1] = "mm"
    translation = Translation(dialect_of(new))
    assert translation.parameter("dock_x", 0, 5) == 1 and translation.parameter("tick_ms", 0, 0) is None
    for name, value, words in (("tick_ms", 20, r"no parameter tick_ms\[0\], which is to be 20"), ("track", 1, "track is in mm, ours in")):
        with pytest.raises(SchemaError, match=words):
            translation.parameter(name, 0, value)


def test_a_log_with_our_schema_needs_no_translation():
    assert of_log(json.loads(json.dumps(OURS.told()))) is None
    old = copy.deepcopy(OURS.told())
    for name in ("states", "reasons", "degraded", "optional"):
        del old[name]
    assert of_log(old) is None, "a log of earlier times"


def test_a_tap_takes_what_follows_a_hello_as_said_by_that_core():
    theirs = changed("PONG", lambda fields: fields.reverse())
    hello = hello_of(theirs.hash)
    tap = HostLink(listen=BOTH, any_epoch=True)
    pong = wire(raw_frame(0x06, theirs.by_name["PONG"](1, 2).pack(), schema.VERSION | 4 | 1 << 5))
    assert tap.feed(wire(raw_frame(0x01, hello.pack(), schema.VERSION | 4)) + pong) == [hello], "in one piece: two numbers, but which?"
    tap.adopt(theirs)
    assert tap.feed(pong) == [BY_NAME["PONG"](2, 1)]


def test_until_the_schema_is_known_nothing_is_taken():
    theirs = changed("PONG", lambda fields: fields.insert(0, ["new", "u8", ""]))
    link = HostLink()
    frame = wire(raw_frame(0x06, theirs.by_name["PONG"](1, 2, 3).pack(), schema.VERSION | 4 | 1 << 5))
    assert not link.meet(hello_of(theirs.hash))
    link.welcome(hello_of(theirs.hash))
    assert link.feed(frame) == [] and not any(count for name, count in link.counts().items() if name.startswith("bad_"))
    link.adopt(theirs)
    assert link.feed(frame) == [BY_NAME["PONG"](2, 3)] and link.foreign["PONG"][0] == 1 and link.foreign_counts == {"PONG": 1}
