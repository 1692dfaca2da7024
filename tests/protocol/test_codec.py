# The codec of the core and the messages of the host read and write the same bodies.

import struct
from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import codec, schema
from protocol.messages import BY_ID, BY_NAME, MessageError
from tests.protocol.messages import message_of, messages, size_of

BASE = 3  # bodies stand somewhere in a buffer, not at its beginning


def decoded(message_id, body):
    values = array("i", [7] * schema.VALUES_MAX)
    buf = bytearray(b"\xff" * BASE + body + b"\xff" * 4)
    count = codec.decode_into(message_id, buf, BASE, BASE + len(body), values)
    assert count <= schema.VALUES_MAX
    return None if count < 0 else list(values[:count])


def encoded(message_id, flat, items=0):
    buf = bytearray(b"\xcc" * (BASE + schema.BODY_MAX + 4))
    values = array("i", flat + [0] * (schema.VALUES_MAX - len(flat)))
    end = codec.encode_into(message_id, values, buf, BASE, items)
    assert end < 0 or bytes(buf[:BASE]) + bytes(buf[end:]) == b"\xcc" * (len(buf) - end + BASE)
    return None if end < 0 else bytes(buf[BASE:end])


ROWS = {row[1]: row for row in schema.MESSAGES}


@pytest.mark.parametrize("name", ROWS)
@given(data=st.data())
def test_every_message_makes_the_round_trip_on_both_sides(name, data):
    message = data.draw(message_of(ROWS[name]))
    body = message.pack()
    flat = message.values()
    items = len(message[-1]) if message.FIELDS[-1][1] == "*" else 0
    assert decoded(message.ID, body) == flat
    assert encoded(message.ID, flat, items) == body
    again = type(message).unpack(body)
    assert again == message and again.values() == flat
    assert type(message).from_values(flat + [99] * 3) == message


def test_step_is_laid_out_as_everyone_believes():
    step = BY_NAME["STEP"](70000, -2, 3, (0, 1, 2, 3, 4, 5, 1022, 1023), 2500, 0x81, ((7, -6800, 1234), (8, -1, 65535)))
    assert encoded(0x10, step.values(), 2) == step.pack()
    assert decoded(0x10, step.pack()) == [70000, -2, 3, 0, 1, 2, 3, 4, 5, 1022, 1023, 2500, 0x81, 2, 7, -6800, 1234, 8, -1, 65535]
    ir = sum(value << 10 * k for k, value in enumerate(step.ir)).to_bytes(10, "little")
    assert step.pack() == struct.pack("<Ihh", 70000, -2, 3) + ir + struct.pack("<HBBhHBhH", 2500, 0x81, 7, -6800, 1234, 8, -1, 65535)


@pytest.mark.parametrize("raw, value", [
    (0, 0), (2**30 - 1, 2**30 - 1), (2**30, None), (2**31 - 1, None), (-1, -1), (1 - 2**30, 1 - 2**30), (-2**30, None), (-2**31, None),
    (-2**24, -2**24), (-2**24 - 1, -2**24 - 1), (255, 255),
])  # fmt: skip
def test_wide_values_stop_at_2_to_the_30(raw, value):
    body = struct.pack("<BBi", 1, 2, raw)
    assert decoded(0x50, body) == (None if value is None else [1, 2, value])
    set_parameter = BY_NAME["PARAM_SET"]
    if value is None:
        with pytest.raises(MessageError, match="PARAM_SET.value = .* is outside"):
            set_parameter.unpack(body)
        with pytest.raises(MessageError, match="is outside"):
            set_parameter(1, 2, raw).pack()
    else:
        assert set_parameter.unpack(body).value == value
    unsigned = decoded(0x05 + 1, struct.pack("<HI", 1, raw & 0xFFFFFFFF))
    assert unsigned == ([1, raw] if 0 <= raw < 2**30 else None)


@given(message_id=st.one_of(st.sampled_from(sorted(BY_ID)), st.integers(0, 255)), body=st.binary(max_size=schema.BODY_MAX + 20))
def test_any_bytes_decode_alike_or_not_at_all(message_id, body):
    flat = decoded(message_id, body)
    kind = BY_ID.get(message_id)
    if kind is None:
        assert flat is None
        return
    try:
        message = kind.unpack(body) if len(body) <= schema.BODY_MAX else None
    except MessageError:
        message = None
    assert (flat is None) == (message is None)
    if message is not None and "c" not in "".join(f[1][0] for f in kind.FIELDS):
        assert message.values() == flat


@given(data=st.data(), message=messages())
def test_a_body_of_another_length_is_refused(data, message):
    body = message.pack()
    fields = message.FIELDS
    if fields[-1][1] != "*":
        size = data.draw(st.integers(0, len(body) + 4))
        assert (decoded(message.ID, (body + b"\1\2\3\4")[:size]) is None) == (size != len(body))
        return
    cut = body[:data.draw(st.integers(0, len(body)))]
    flat = decoded(message.ID, cut)
    head = sum(size_of(f[1]) for f in fields[:-1])
    item = sum(size_of(f[1]) for f in fields[-1][2])
    assert (flat is None) == (len(cut) < head or (len(cut) - head) % item != 0)
    if flat is not None:
        items = (len(cut) - head) // item
        assert encoded(message.ID, flat, items) == cut and flat[-1 - items * len(fields[-1][2])] == items


def test_half_a_record_is_refused():
    step = BY_NAME["STEP"](1, 2, 3, (4,) * 8, 5, 6, ((7, 8, 9), (1, 2, 3))).pack()
    assert [size for size in range(len(step) + 1) if decoded(0x10, step[:size]) is not None] == [21, 26, 31]


def test_encoding_refuses_what_the_schema_has_not():
    assert encoded(0x0F, [0]) is None                       # no such message
    assert encoded(0x11, [0] * 6, items=1) is None          # no group
    assert encoded(0x33, [0, 0, 90], items=91) is None      # body over BODY_MAX
    assert encoded(0x33, [0, 0, 90], items=-1) is None
    assert len(encoded(0x33, [0, 0, 90], items=90)) == 96


def test_encoding_cuts_a_value_to_its_field():
    assert encoded(0x11, [5, 40000, -40000, 256, -1, 65537]) == struct.pack("<IHHBBH", 5, 40000, -40000 & 65535, 0, 255, 1)


@pytest.mark.parametrize("name, fields, text", [
    ("STATUS", (256,), "STATUS cannot carry"),
    ("STEP", (0, 0, 0, (0,) * 7 + (1024,), 0, 0, ()), "10-bit"),
    ("STEP", (0, 0, 0, (-1,) + (0,) * 7, 0, 0, ()), "10-bit"),
    ("STEP", (0, 0, 0, (0,) * 8, 0, 0, ((1, 2, 3),) * 16), "body of 101 bytes, at most 96"),
    ("STORE", (0, "thirteen char", 0, 0, 0, 0), "longer than 12"),
    ("MAP_READ", (0, None), "MAP_READ cannot carry"),
])  # fmt: skip
def test_the_host_says_what_cannot_be_sent(name, fields, text):
    with pytest.raises(MessageError, match=text):
        BY_NAME[name](*fields).pack()
