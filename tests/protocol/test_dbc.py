# tvslam.dbc: what cantools reads out of the CAN frames is what the message said.

from hypothesis import given
from hypothesis import strategies as st
import cantools
import pytest

from protocol import dbc, describe, schema, schema_hash
from protocol.host_link import HostLink
from tests.protocol.messages import message_of
from tests.protocol.test_can_frames import UP, WAYS, cut

DATABASE = cantools.database.load_file(describe.DBC)
ROWS = {row[1]: row for row in schema.MESSAGES}
TELEMETRY = [name for _, name, _ in dbc.telemetry()]


def decoded(frames):
    """{signal: value} of these CAN frames together."""
    values = {}
    for can_id, data in frames:
        message = DATABASE.get_message_by_frame_id(can_id)
        assert len(data) == message.length
        values.update(message.decode(data, decode_choices=False))
    return values


def flat(message):
    """The message's fields by the names that they have in the DBC."""
    values = {}
    for (name, kind, _), value in zip(ROWS[message.NAME][4], message):
        if kind[0] == "c":
            values.update(("%s_%d" % (name, i), byte) for i, byte in enumerate(value.encode().ljust(int(kind[1:]), b"\0")))
        else:
            values[name] = value
    return values


@WAYS
@given(message=st.one_of([message_of(ROWS[name]) for name in TELEMETRY]))
def test_cantools_reads_every_field_of_every_telemetry_message(fd, message):
    values = decoded(cut(HostLink().encode(message), UP, fd))
    told = flat(message)
    assert {name: values[name] for name in told} == told
    assert values["message"] == message.ID


def test_all_of_the_telemetry_is_in_it_with_its_units_and_states():
    assert set(TELEMETRY) >= {"POSE", "STORE", "VECTOR", "POINT", "LINK", "MEMORY"}
    pose = DATABASE.get_message_by_name("POSE_4")
    assert pose.get_signal_by_name("path_mm").unit == "mm"
    assert str(pose.decode(bytes((0, 0, 15, 0, 0, 0, 0, 0)))["state"]) == "DONE"
    assert DATABASE.get_message_by_name("POSE_FD").is_fd and not pose.is_fd
    assert DATABASE.version == "%08x" % schema_hash.schema_hash()


def test_no_id_is_there_twice_and_none_has_more_than_eight_bytes_without_fd():
    assert len({message.frame_id for message in DATABASE.messages}) == len(DATABASE.messages)
    assert all(message.length <= 8 or message.is_fd for message in DATABASE.messages)


def test_telemetry_for_which_there_is_no_channel_is_refused():
    crowd = tuple((0x20 + i, "T%d" % i, UP, 0, tuple(("f%d" % k, "u32", "") for k in range(8))) for i in range(8))
    with pytest.raises(dbc.DbcError, match="32 CAN frames"):
        dbc.parts(crowd)
