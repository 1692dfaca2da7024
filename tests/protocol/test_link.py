# The core's end and the host's end talk: handshake, epochs, echoes, the retained answer.

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import frame_reader as fr
from protocol import schema, schema_hash
from protocol.frame_reader import BOTH
from protocol.host_link import HostLink
from protocol.link import Link
from protocol.messages import BY_ID, BY_NAME, MessageError
from protocol.tables import ERROR, HELLO, STEP, STEP_RSP, WELCOME
from tests.house.integer_guard import guarded_core
from tests.protocol.messages import message_of, messages, raw_frame, seeded, some_frame, wire

BOOT_ID = 0xBEEF
STATUS = BY_NAME["STATUS"](1)
up_messages = messages(schema.UP)
down_messages = messages(schema.DOWN)


def receive(core, data):
    """-> what the core got: (id, [values]) each, or the ERROR that it sends of its own accord."""
    buf, at, got = bytearray(data), 0, []
    while at < len(buf):
        at = core.feed(buf, at, len(buf))
        if core.message_id:
            assert core.tx_len == 0
            got.append((core.message_id, list(core.values[:core.count])))
        elif core.tx_len:
            got.append(sent(core))
    return got


def sent(core):
    return bytes(core.tx[:core.tx_len])


def send(core, message):
    flat = message.values()
    for k, value in enumerate(flat):
        core.out[k] = value
    items = len(message[-1]) if message.FIELDS[-1][1] == "*" else 0
    assert core.send(message.ID, items) == core.tx_len > 0
    return sent(core)


def hello(core):
    assert core.send_hello(1, 2, 0, 4, 26, 196608, 40000, 20000)
    return sent(core)


def joined(boot_id=BOOT_ID, make=Link):
    core, host = make(boot_id), HostLink()
    (said,) = host.feed(hello(core))
    assert receive(core, host.welcome(said))[0][0] == WELCOME
    return core, host


def test_handshake():
    core, host = Link(BOOT_ID), HostLink()
    (said,) = host.feed(hello(core))
    lo, hi = schema_hash.halves()
    assert said == BY_NAME["HELLO"](1, 1, lo, hi, 1, 2, BOOT_ID, 0, 96, 4, 2, 0, 4, 26, 196608, 40000, 20000)
    assert host.refusal(said) is None
    assert core.epoch == 0
    assert receive(core, host.welcome(said)) == [(WELCOME, [1, BOOT_ID, lo, hi])]
    assert core.epoch == host.epoch == 1
    assert receive(core, host.encode(STATUS)) == [(STATUS.ID, [1])]


@given(down=down_messages, up=up_messages)
def test_every_message_arrives(down, up):
    core, host = joined()
    if down.ID != WELCOME:
        assert receive(core, host.encode(down)) == [(down.ID, down.values())]
    assert host.feed(send(core, up)) == [up]
    assert core.counters[fr.FRAMES_IN] == 1 + (down.ID != WELCOME) and core.counters[fr.FRAMES_OUT] == 2


@given(message=message_of(next(row for row in schema.MESSAGES if row[0] == STEP)))
def test_the_step_of_the_hot_path_is_the_same_frame(message):
    _, host = joined()
    _, other = joined()
    assert host.encode_step(message.values() + [0] * 50) == other.encode(message)


def test_the_frame_is_the_documented_one():
    core, host = joined()
    pong = wire(raw_frame(0x06, b"\x07\0\x00\x01\0\0", schema.VERSION | 4 | 1 << 5, seq=1, ack=0))
    assert send(core, BY_NAME["PONG"](7, 256)) == pong
    assert host.encode(STATUS) == wire(raw_frame(0x12, b"\1", schema.VERSION | 1 << 5, seq=1, ack=0))


def test_what_is_not_repeated_has_numbers_of_its_own():
    core, host = joined()
    for count in range(1, 600):
        (_, _, seq, ack), = host.take(send(core, BY_NAME["PONG"](1, 2)))
        assert (seq, ack) == (count & 255, 0)
    frame = HostLink(BOTH, any_epoch=True)
    for count in range(1, 600):
        (_, _, seq, ack), = frame.take(host.encode(STATUS))
        assert (seq, ack) == (count & 255, 0)


def test_an_echo_is_rejected_at_both_ends():
    core, host = joined()
    assert receive(core, send(core, BY_NAME["PONG"](1, 2))) == [] and core.counters[fr.BAD_HEADER] == 1
    assert host.feed(host.encode(STATUS)) == [] and host.counters[fr.BAD_HEADER] == 1


def test_before_the_welcome_nothing_but_the_handshake_passes():
    core = Link(BOOT_ID)
    stranger = HostLink()
    for epoch in range(4):
        stranger.epoch = epoch
        assert receive(core, stranger.encode(STATUS)) == []
    assert core.counters[fr.STALE] == 4
    assert receive(core, stranger.encode(BY_NAME["IDENTIFY"](0, 0))) == [(0x03, [0, 0])]


@pytest.mark.parametrize("epoch, boot_id", [(1, BOOT_ID + 1), (0, BOOT_ID), (4, BOOT_ID), (255, BOOT_ID)])
def test_a_welcome_for_another_boot_is_none(epoch, boot_id):
    core, host = Link(BOOT_ID), HostLink()
    assert receive(core, host.encode(BY_NAME["WELCOME"](epoch, boot_id, 0, 0))) == []
    assert core.epoch == 0 and core.counters[fr.STALE] == 1


def test_frames_of_an_older_epoch_are_dropped_on_both_sides():
    core, host = joined()
    old_down, old_up = host.encode(STATUS), send(core, BY_NAME["PONG"](1, 2))
    reborn = Link(BOOT_ID + 1)
    (said,) = host.feed(hello(reborn))
    receive(reborn, host.welcome(said))
    assert reborn.epoch == host.epoch == 2
    assert receive(reborn, old_down) == [] and reborn.counters[fr.STALE] == 1
    assert host.feed(old_up) == [] and host.counters[fr.STALE] == 1
    assert receive(reborn, host.encode(STATUS)) and host.feed(send(reborn, BY_NAME["PONG"](1, 2)))
    for boot_id in (3, 4, 5):  # the epochs are 3, 1, 2: never 0
        host.welcome(said._replace(boot_id=boot_id))
    assert host.epoch == 2
    host.welcome(said._replace(boot_id=5))  # the same boot says HELLO again: its epoch stays
    assert host.epoch == 2


def test_handshake_in_an_epoch_is_no_handshake():
    core, host = joined()
    welcome = raw_frame(WELCOME, BY_NAME["WELCOME"](2, BOOT_ID, 0, 0).pack(), schema.VERSION | 1 << 5)
    assert receive(core, wire(welcome)) == [] and core.epoch == 1
    said = raw_frame(HELLO, bytes(32), schema.VERSION | 4 | 1 << 5)
    assert host.feed(wire(said)) == []


@pytest.mark.parametrize("message_id", [0x00, 0x0F, 0x60, 0xFF, STEP_RSP, HELLO])
def test_an_unknown_id_is_answered_with_error(message_id):
    core, host = joined()
    ctl = schema.VERSION | (0 if message_id == HELLO else 1 << 5)
    (answer,) = receive(core, wire(raw_frame(message_id, b"\1\2\3", ctl)))
    assert host.feed(answer) == [BY_NAME["ERROR"](schema.ERROR_UNKNOWN_ID, message_id, 0)]
    assert core.counters[fr.BAD_ID] == 1 and core.message_id == 0


@pytest.mark.parametrize("body", [b"\1\2" + (2**30).to_bytes(4, "little"), b"\1\2\3", b""])
def test_a_body_out_of_bounds_is_answered_with_error(body):
    core, host = joined()
    (answer,) = receive(core, wire(raw_frame(0x50, body, schema.VERSION | 1 << 5)))
    assert host.feed(answer) == [BY_NAME["ERROR"](schema.ERROR_RANGE, 0x50, 0)]
    assert core.counters[fr.BAD_VALUE] == 1
    assert host.feed(wire(raw_frame(0x13, body, schema.VERSION | 4 | 1 << 5))) == [] and host.counters[fr.BAD_VALUE] == 1
    assert host.feed(wire(raw_frame(0x7F, body, schema.VERSION | 4 | 1 << 5))) == [] and host.counters[fr.BAD_ID] == 1


def test_byte_by_byte_is_the_same():
    core, host = joined()
    got = []
    for byte in host.encode(STATUS) + wire(raw_frame(0x7F, b"", schema.VERSION | 1 << 5)) + host.encode(STATUS):
        if core.feed_byte(byte):
            got.append(core.message_id or -core.tx_len)
    assert got[0] == got[2] == STATUS.ID and got[1] < 0


def test_the_host_takes_no_message_that_is_its_own_to_send():
    _, host = joined()
    assert host.feed(wire(raw_frame(0x12, b"\1", schema.VERSION | 4 | 1 << 5))) == [] and host.counters[fr.BAD_ID] == 1


def test_a_message_that_does_not_fit_is_not_sent():
    core, _ = joined()
    frames = core.counters[fr.FRAMES_OUT]
    assert core.send(0x33, 91) == 0 and core.tx_len == 0 and core.counters[fr.FRAMES_OUT] == frames


def test_refusals_name_both_sides():
    _, host = joined()
    said = BY_NAME["HELLO"](*[0] * 17)._replace(protocol_min=1, protocol_max=1)
    assert host.refusal(said) is None
    assert "versions 2 to 3" in host.refusal(said._replace(protocol_min=2, protocol_max=3))


def test_a_tap_hears_both_and_the_log_gets_the_raw_frames():
    records = []
    core, host = joined()
    tap = HostLink(BOTH, any_epoch=True, sink=lambda direction, raw: records.append((direction, raw)))
    stream = host.encode(STATUS) + send(core, BY_NAME["PONG"](1, 2)) + b"\1\2\3\0"
    assert tap.feed(stream) == [STATUS, BY_NAME["PONG"](1, 2)]
    assert [direction for direction, _ in records] == [0, 1]
    assert b"".join(wire(raw) for _, raw in records) + b"\1\2\3\0" == stream
    logged = []
    logging_host = HostLink(sink=lambda direction, raw: logged.append((direction, raw)))
    told = logging_host.encode(STATUS)
    assert [(direction, wire(raw)) for direction, raw in logged] == [(0, told)]


def test_the_host_refuses_a_step_that_is_too_long():
    _, host = joined()
    with pytest.raises(MessageError, match="16 UWB records"):
        host.encode_step([0] * 13 + [16] + [0] * 48)
    with pytest.raises(MessageError, match="step 1073741824"):
        host.encode_step([2**30] + [0] * 13)


@pytest.fixture(scope="module")
def watched_link():
    """Link with every number watched, on the table loop of the CRC."""
    with guarded_core() as module:
        link, reader = module("protocol.link"), module("protocol.frame_reader")
        link.crc32_into = reader.crc32_into = module("protocol.crc32").TableCrc32().into
    return link.Link


@given(stream=st.lists(st.one_of(st.binary(max_size=40), messages()), max_size=8), seed=st.integers(0, 2**32))
def test_no_int_reaches_2_to_the_30_whatever_comes(watched_link, stream, seed):
    core, host = joined(make=watched_link)
    data = [item if isinstance(item, bytes) else wire(raw_frame(item.ID, item.pack(), schema.VERSION | 1 << 5)) for item in stream]
    receive(core, b"".join(data) + wire(some_frame(seeded(seed))))
    for message_id in BY_ID:
        core.send(message_id)
    core.out[0] = core.out[1] = core.out[2] = -2**30 + 1
    assert core.send(ERROR) and core.send(STEP_RSP)
