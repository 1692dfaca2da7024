# The core behind its link: lockstep, parameters, map, and what it answers to what it should not have been asked.

import zlib

import pytest

from firmware_py.storage.vector_store import OUTLINE, SEARCHED
from protocol import schema
from protocol.messages import BY_NAME
from protocol.schema_text import SCHEMA_TEXT
from protocol.parameters import PARAMETERS
from tests.firmware_py.device_story import LOCKED, OK, OUT_OF_RANGE, UNKNOWN, Story, error
from tests.firmware_py.puppet import NUMBERS

SPEED = NUMBERS["speed_max"]


def test_a_step_is_answered_once_and_its_telemetry_follows():
    story = Story()
    (answer,) = story.step(1)
    assert type(answer).__name__ == "STEP_RSP" and answer.step == 1 and answer.hash16 == story.core.hash_lo
    for number in range(2, 51):
        (answer,) = story.step(number, 5, 5)
        assert answer.step == number
    assert (answer.left_mm_s, answer.right_mm_s, answer.state) == (story.core.left_mm_s, story.core.right_mm_s, story.core.state)
    assert answer.left_mm_s > 0
    kinds = [type(m).__name__ for m in story.telemetry]
    assert kinds.count("POSE") == 10 and kinds.count("STORE") == 5 and "LINK" in kinds and "MEMORY" in kinds
    assert len(kinds) <= 50  # never two in one step


def test_a_duplicate_gets_the_same_bytes_and_runs_nothing():
    story = Story()
    story.step(1)
    for number in (2, 3):
        frame = story.host.encode(BY_NAME["STEP"](number, 7, 7, (20,) * 8, 0, 0, ()), number - 1)
        story.give(frame)
        first, hashes = bytes(story.port.out), (story.core.hash_lo, story.core.hash_hi, story.core.tick)
        story.heard()
        for _ in range(3):
            story.give(frame)
            assert first.startswith(bytes(story.port.out)) and len(story.port.out) > 10
            assert [m.step for m in story.heard()] == [number]
        assert (story.core.hash_lo, story.core.hash_hi, story.core.tick) == hashes
    assert story.device.link.counters[4] == 6


def test_a_step_that_is_asked_again_runs_nothing_and_says_the_same():
    story = Story()
    story.step(1)
    (first,) = story.step(2, 7, 7)
    hashes = (story.core.hash_lo, story.core.hash_hi, story.core.tick)
    for _ in range(3):
        assert story.step(2, 7, 7) == [first]
    assert (story.core.hash_lo, story.core.hash_hi, story.core.tick) == hashes


def test_a_duplicate_after_a_new_welcome_is_answered_in_the_new_epoch():
    story = Story()
    story.step(1)
    (before,) = story.step(2, 7, 7)
    hashes = (story.core.hash_lo, story.core.tick)
    story.host.boot_id = None  # the host begins anew with the same core
    story.join()
    assert story.host.epoch == 2
    assert story.step(2, 7, 7) == [before]
    assert story.step(2, 7, 7) == [before]
    assert (story.core.hash_lo, story.core.tick) == hashes
    assert [m.step for m in story.step(3)] == [3]


@pytest.mark.parametrize("number", [0, 4, 6, 100, 2**30 - 1])
def test_a_step_out_of_order_is_refused_with_the_number_expected(number):
    story = Story()
    story.step(4)  # any number may be the first
    story.step(5)
    if number == 4:
        assert story.step(4) == [error(schema.ERROR_STEP_ORDER, "STEP", 6)]
    elif number != 6:
        assert story.step(number) == [error(schema.ERROR_STEP_ORDER, "STEP", 6)]
    assert story.core.tick == 2
    assert [m.step for m in story.step(6)] == [6]


def test_the_step_number_goes_round_before_it_is_too_big_for_a_small_int():
    story = Story()
    story.step(2**30 - 1)
    assert story.step(5) == [error(schema.ERROR_STEP_ORDER, "STEP", 0)]
    assert [m.step for m in story.step(0)] == [0]
    assert [m.step for m in story.step(1)] == [1]


def test_parameters_are_set_read_and_listed():
    story = Story()
    value = BY_NAME["PARAM_VALUE"]
    assert story.one("PARAM_GET", SPEED, 0) == value(SPEED, 0, OK, 300)
    assert story.one("PARAM_SET", SPEED, 0, 250) == value(SPEED, 0, OK, 250)
    assert story.one("PARAM_SET", SPEED, 0, 1001) == value(SPEED, 0, OUT_OF_RANGE, 250)
    assert story.one("PARAM_SET", SPEED, 0, 49) == value(SPEED, 0, OUT_OF_RANGE, 250)
    assert story.one("PARAM_SET", SPEED, 1, 250) == value(SPEED, 1, UNKNOWN, 0)
    assert story.one("PARAM_GET", len(PARAMETERS), 0) == value(len(PARAMETERS), 0, UNKNOWN, 0)
    assert story.one("PARAM_SET", 255, 255, 1) == value(255, 255, UNKNOWN, 0)


@pytest.mark.parametrize("number", range(len(PARAMETERS)))
def test_the_list_is_the_table(number):
    name, unit, count, low, high, default = PARAMETERS[number]
    info = Story().one("PARAM_LIST", number)
    assert (info.parameter, info.count, info.minimum, info.maximum, info.default) == (number, count, low, high, default)
    assert (info.unit.rstrip("\0"), info.name.rstrip("\0")) == (unit, name)


def test_past_the_list_is_an_error():
    assert Story().one("PARAM_LIST", len(PARAMETERS)) == error(schema.ERROR_RANGE, "PARAM_LIST", len(PARAMETERS))


def test_the_first_step_locks_the_parameters():
    story = Story()
    story.one("PARAM_SET", SPEED, 0, 200)
    story.step(1)
    assert story.one("PARAM_SET", SPEED, 0, 100) == BY_NAME["PARAM_VALUE"](SPEED, 0, LOCKED, 200)
    for number in range(2, 60):
        (answer,) = story.step(number, 4, 4)
    assert (answer.left_mm_s + answer.right_mm_s) // 2 in (199, 200)  # and the mission runs with them


def with_a_map(story, vectors=40):
    store = story.core.vectors
    store.open_chain(OUTLINE | SEARCHED)
    for i in range(vectors):
        store.append(i * 300 - 5000, -i * 7, i, i & 7)


@pytest.mark.parametrize("vectors", [0, 1, 40, 300])
def test_the_map_comes_in_pieces_and_its_checksum_is_zlibs(vectors):
    story = Story()
    if vectors:
        with_a_map(story, vectors)
    info, data = story.map()
    assert data[:4] == b"TVM2" and data[4] | data[5] << 8 == vectors and data[6] == -(-vectors // 255)
    assert zlib.crc32(data[:-4]) == int.from_bytes(data[-4:], "little") == info.crc_lo | info.crc_hi << 16
    status = story.one("STATUS", 0)
    assert (status.map_lo, status.map_hi) == (info.crc_lo, info.crc_hi)
    assert story.one("MAP_READ", info.generation, info.size + 1) == error(schema.ERROR_RANGE, "MAP_READ", info.size)
    assert len(story.one("MAP_READ", info.generation, info.size).data) == 0


def test_whoever_only_looks_in_makes_the_core_code_no_map():
    story = Story()
    with_a_map(story)
    brief = story.one("STATUS", schema.STATUS_BRIEF)
    assert (brief.map_lo, brief.map_hi) == (0, 0) and story.core.image.generation != story.core.vectors.generation
    whole = story.one("STATUS", 0)
    assert whole.map_lo | whole.map_hi << 16 and whole._replace(map_lo=0, map_hi=0, heap_used_bytes=0) == brief._replace(heap_used_bytes=0)


def test_a_map_that_has_changed_since_is_stale():
    story = Story()
    now = story.core.vectors.generation
    assert story.one("MAP_READ", now, 0) == error(schema.ERROR_STALE, "MAP_READ", now)  # nobody took stock yet
    with_a_map(story)
    info, _ = story.map()
    story.core.vectors.append(1, 1, 1, 0)
    now = story.core.vectors.generation
    assert story.one("MAP_READ", info.generation, 0) == error(schema.ERROR_STALE, "MAP_READ", now)
    assert story.one("MAP_READ", now, 0) == error(schema.ERROR_STALE, "MAP_READ", now)
    story.map()


def test_a_map_asked_for_while_it_is_sealed_is_whole_and_the_seal_ends():
    story = Story()
    with_a_map(story, 100)
    image = story.core.image
    image.begin()
    assert not image.step(64)
    info, data = story.map()
    assert zlib.crc32(data[:-4]) == info.crc_lo | info.crc_hi << 16
    assert image.step(64)


def test_the_status_tells_memory_and_numbers():
    story = Story()
    story.step(1)
    story.port.used = 60480
    status = story.one("STATUS", 0)
    assert (status.step, status.finished, status.reason, status.degraded) == (1, 0, 0, 0)
    assert (status.steps_lo, status.steps_hi) == (story.core.hash_lo, story.core.hash_hi)
    assert (status.heap_bytes, status.heap_used_bytes, status.heap_locked, status.allocated_after_boot_bytes) == (196608, 60480, 1, 480)
    story.core.degraded = 2
    assert story.one("STATUS", 0).degraded == 2


def test_identify_ping_and_what_is_unknown():
    story = Story()
    assert story.one("PING", 9) == BY_NAME["PONG"](9, 1000)
    assert type(story.one("IDENTIFY", 0, 0)).__name__ == "HELLO"
    identity = story.one("IDENTIFY", 1, 0)
    assert identity.data.startswith(b"tvslam ")
    assert story.one("IDENTIFY", 9, 50).size == 0
    assert len(story.one("IDENTIFY", 1, 60000).data) == 0


def test_the_schema_is_told_in_pieces_of_64_bytes():
    story, text = Story(joined=False), b""
    while True:
        piece = story.one("IDENTIFY", 4, len(text))
        assert (piece.section, piece.offset, piece.size) == (4, len(text), len(SCHEMA_TEXT)) and len(piece.data) <= 64
        if not piece.data:
            break
        text += piece.data
    assert text == SCHEMA_TEXT, "also before the core is welcomed"


def test_every_store_can_be_asked_for():
    story = Story()
    hello = story.join()
    names = []
    for index in range(hello.stores):
        story.give(story.host.encode(BY_NAME["IDENTIFY"](2, index)))
        story.heard()
        store = story.telemetry[-1]
        names.append(store.name.rstrip("\0"))
        assert store.index == index and 0 <= store.used <= store.capacity and store.record_bytes > 0
    assert len(set(names)) == len(names) >= 14


def test_nothing_runs_before_the_welcome():
    story = Story(joined=False)
    story.host.epoch = 1
    assert story.step(1) == [] and story.core.tick == 0 and not story.device.welcomed


@pytest.mark.parametrize("boot_ms", [0, 1234, (1 << 26) - 700])  # the last: the clock wraps on the way
def test_hello_is_said_twice_a_second_until_somebody_answers(boot_ms):
    story = Story(joined=False)
    story.port.ms = boot_ms
    said_ms = []
    for _ in range(2400):
        story.device.greet()
        said_ms += [story.port.ms] * len(story.heard())
        story.port.ms += 1
    assert said_ms == [boot_ms + k * 500 for k in range(5)]
    story.join()
    story.port.ms += 5000
    story.device.greet()
    assert story.heard() == []
