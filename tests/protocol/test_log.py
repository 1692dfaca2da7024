# The log of a link: whatever happens to its bytes, what is whole comes back, in order.

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import schema
from protocol.log import MAGIC, MARK, MARK_EVERY_BYTES, LogError, LogReader, LogWriter, Record
from tests.fuzz.file_targets import ENDS, SOUND, log
from tests.host_tools.recorded import wander

frames = st.lists(st.tuples(st.integers(0, 10**10), st.sampled_from((schema.DOWN, schema.UP)), st.binary(max_size=105)), max_size=60)


def written(items, **notes):
    writer = LogWriter()
    data = writer.head(**notes)
    records, now_us = [], 0
    for t_us, direction, frame in items:
        now_us += min(max(t_us - now_us, 0), 0xFFFFFFFF)
        data += writer.record(t_us, direction, frame)
        records.append(Record(now_us, direction, frame))
    return data, records


def read(data, size=1 << 20):
    reader, found = LogReader(), []
    for at in range(0, len(data), size):
        found += reader.feed(data[at:at + size])
    return reader, found


def long_log(count=4000):
    return written([(i * 100, i & 1, bytes((i & 255, i >> 8)) * 20) for i in range(count)])


@given(frames, st.integers(1, 200))
def test_what_goes_in_comes_out_however_it_is_cut(items, size):
    data, records = written(items, home="studio")
    reader, found = read(data, size)
    assert found == records
    assert (reader.damaged, reader.lost, reader.left_over) == (0, 0, 0)
    assert reader.told["home"] == "studio"
    assert reader.told["messages"] == [list(map(_listed, row)) for row in schema.MESSAGES]


def _listed(part):
    return [_listed(item) for item in part] if isinstance(part, tuple) else part


@given(frames, st.data())
def test_a_writer_killed_at_any_byte_loses_its_last_record_only(items, data):
    log, records = written(items)
    head = len(LogWriter().head())
    cut = data.draw(st.integers(head, len(log)))
    reader, found = read(log[:cut])
    assert found == records[:len(found)] and reader.damaged == 0
    assert len(written(items[:len(found)])[0]) + reader.left_over == cut


@pytest.mark.parametrize("size", [1, 7])
def test_a_log_of_a_mission_cut_at_every_byte_has_every_whole_record(size):
    data, frames = wander().log(), wander().frames
    reader, found, borders = LogReader(), [], 0
    for at in range(0, len(data), size):    # what a reader knows here is what it knows of a file that ends here
        found += [record.frame for record in reader.feed(data[at:at + size])]
        if reader.damage == "":
            borders += 1
            continue
        if reader.told is not None:
            assert reader.damage == "breaks off at byte %d, in the middle of record %d" % (
                min(at + size, len(data)) - reader.left_over, len(found) + 1)
        else:
            assert reader.damage == "ends within its head" and not found
    assert found == [raw for _, raw in frames] and reader.damage == "" and reader.damaged_at is None
    assert borders > len(frames) / size / 2


def test_a_short_log_cut_at_every_byte_is_read_anew_each_time():
    ends = [end for end, _, _ in ENDS]
    for cut in range(len(SOUND) + 1):
        reader, found = read(SOUND[:cut])
        assert len(found) == sum(end <= cut for end in ends) and reader.damaged_at is None, cut
        assert [record.frame for record in found] == [raw for _, _, raw in ENDS[:len(found)]]


@given(st.lists(st.tuples(st.integers(0, 65535), st.integers(0, 3), st.integers(0, 255)), min_size=1, max_size=6))
def test_bytes_changed_taken_out_put_in_or_there_twice_are_located(edits):
    # The target of the fuzzer says what must hold.
    log(bytes((1,)) + b"".join(place.to_bytes(2, "little") + bytes((what, byte)) for place, what, byte in edits))


@pytest.mark.parametrize("back, noticed", [(490, 0), (500, 500)])   # in the middle of a record; ten whole records: at the marker behind
def test_what_is_there_twice_is_told_and_nothing_counted_as_lost(back, noticed):
    data, records = long_log()
    first = data.index(MARK, data.index(MARK) + 1)
    again = data[:first + 36] + data[first - back:]
    reader, found = read(again)
    assert reader.damaged_at == first + 36 + noticed and reader.lost == 0 and set(found) >= set(records[:reader.sound])
    assert found[-1] == records[-1]


def test_a_marker_stands_in_every_64_kilobytes():
    data, _ = long_log()
    places, at = [], data.find(MARK)
    while at >= 0:
        places.append(at)
        at = data.find(MARK, at + 1)
    assert len(places) >= 3
    assert all(b - a <= MARK_EVERY_BYTES for a, b in zip(places, [*places[1:], len(data)], strict=True))


LONG, LONG_RECORDS = long_log()


@given(st.integers(len(LogWriter().head()), len(LONG) - 1), st.integers(1, 255), st.integers(1, 70000))
def test_damage_costs_what_lies_before_the_next_marker(place, flip, size):
    spoilt = bytearray(LONG)
    spoilt[place] ^= flip
    reader, found = read(bytes(spoilt), size)
    assert reader.damaged == 1 or found == LONG_RECORDS  # a flipped byte of a marker behind no damage costs a stretch, too
    known = set(LONG_RECORDS)
    assert all(record in known for record in found), "nothing is invented, no time is shifted"
    last_mark = LONG.rfind(MARK)
    if place < last_mark:
        assert found[-1] == LONG_RECORDS[-1] and reader.lost == len(LONG_RECORDS) - len(found)


@given(st.binary(max_size=3000))
def test_any_bytes_behind_the_head_are_survived(noise):
    head = len(LogWriter().head()) - len(LogWriter().marker())  # the long log's own first marker follows the noise
    reader, found = read(LONG[:head] + noise + LONG[head:])
    assert found == LONG_RECORDS and reader.damaged == bool(noise)


def headed(told):
    head = MAGIC + len(told).to_bytes(4, "little") + told
    return head + zlib.crc32(head).to_bytes(4, "little")


@pytest.mark.parametrize("data, sentence", [
    (b"PK\x03\x04 something else", "no log of a TVSLAM link"),
    (MAGIC + b"\xff\xff\xff\xff", "claims a length"),
    (MAGIC + b"\x02\0\0\0{}\0\0\0\0", "check sum is wrong"),
    (headed(b"{}"), "not understood"), (headed(b"[" * 9000), "not understood"), (headed(b"\xff"), "not understood"),
    (headed(b'{"messages": [], "parameters": [1]}'), "not understood"),
])
def test_another_file_is_named(data, sentence):
    with pytest.raises(LogError, match=sentence):
        LogReader().feed(data)


@given(frames, st.integers(1, 200), st.data())
def test_the_first_damage_is_told_with_the_records_before_it(items, size, data):
    log, records = written(items)
    head = len(LogWriter().head())
    at = data.draw(st.integers(0, len(log) - head - 1)) + head if len(log) > head else None
    if at is None:
        return
    bad = bytearray(log)
    bad[at] ^= data.draw(st.integers(1, 255))
    reader, found = read(bytes(bad), size)
    whole = sum(len(written(items[:n])[0]) <= at for n in range(1, len(items) + 1))
    if reader.damaged_at is None:   # a length made longer: all that follows waits for the rest of it
        assert reader.left_over and found == records[:whole] and reader.sound == whole
        return
    assert reader.damaged_at == len(written(items[:whole])[0]) and reader.sound == whole
    assert found[:whole] == records[:whole]


def test_records_that_were_cut_out_cleanly_are_missed_at_the_next_marker():
    data, records = long_log()
    size = len(written([(0, 0, records[0].frame)])[0]) - len(LogWriter().head())
    head = len(LogWriter().head())
    reader, found = read(data[:head + 10 * size] + data[head + 12 * size:])
    assert reader.lost == 2 and reader.damaged == 0
    first_mark = data.index(MARK, head)
    assert reader.damaged_at == first_mark - 2 * size and found[:10] == records[:10]
    assert reader.sound == (first_mark - head) // size - 2 < len(found)
