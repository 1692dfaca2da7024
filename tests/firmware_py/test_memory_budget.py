# Whatever the sensors say, however absurd: storage never grows, capacities hold,
# no exception, no number that passes 2**30 (the core under test is the watched one).

import pytest
from hypothesis import example, given, settings

from protocol import states
from protocol.parameters import PARAMETERS
from tests.firmware_py.core_run import WatchedTvslam, booted, feed, storage_of, stores_of
from tests.strategies import KINDS, Segment, examples, settings_of_a_robot, streams

NAMES = [parameter[0] for parameter in PARAMETERS]
UWB_SOURCE, ANCHOR_COUNT = NAMES.index("uwb_source"), NAMES.index("anchor_count")
LONG_AND_BUSY = [Segment("wander", 4000, 1), Segment("along_a_wall", 1500, 2), Segment("noise", 500, 3)]


@given(settings_of_a_robot(), streams())
@example([], LONG_AND_BUSY)
@example([], [Segment("extremes", 3000, 7)])
@example([], [Segment("in_the_open", 6000, 0)])
def test_any_stream_leaves_the_storage_as_it_was_at_boot(parameters, segments):
    core = booted(WatchedTvslam, parameters)
    at_boot = storage_of(core)
    stores = stores_of(core)
    assert stores, "no store found: this test would say nothing"
    for tick, _ in enumerate(feed(core, segments)):
        for path, store in stores.items():
            assert 0 <= store.used <= store.CAPACITY, f"{path} holds {store.used} of {store.CAPACITY} at tick {tick}"
        expect_answer_fits_its_message(core)
    assert storage_of(core) == at_boot


ENDS = [(number, end) for number in range(len(PARAMETERS)) for end in (3, 4)]


@pytest.mark.parametrize("number, end", ENDS, ids=[f"{PARAMETERS[n][0]}-{'min' if e == 3 else 'max'}" for n, e in ENDS])
def test_each_parameter_may_stand_at_each_end_of_its_range(number, end):
    values = [(number, index, PARAMETERS[number][end]) for index in range(PARAMETERS[number][2])]
    ranging = [(UWB_SOURCE, 0, 1), (ANCHOR_COUNT, 0, 4)]
    core = booted(WatchedTvslam, ranging + values)
    at_boot = storage_of(core)
    for _ in feed(core, [Segment(kind, 60, 1) for kind in sorted(KINDS)]):
        expect_answer_fits_its_message(core)
    assert storage_of(core) == at_boot


def expect_answer_fits_its_message(core):
    assert -32768 <= core.left_mm_s <= 32767 and -32768 <= core.right_mm_s <= 32767
    assert 0 <= core.state < len(states.NAMES) and 0 <= core.ir_state <= 255
    assert 0 <= core.hash_lo <= 0xFFFF and 0 <= core.hash_hi <= 0xFFFF


@settings(max_examples=examples(15))
@given(settings_of_a_robot(), streams(max_segments=4))
def test_the_same_stream_gives_the_same_hashes(parameters, segments):
    first = booted(WatchedTvslam, parameters)
    second = booted(WatchedTvslam, parameters)
    for _ in zip(feed(first, segments), feed(second, segments)):
        assert (first.hash_lo, first.hash_hi) == (second.hash_lo, second.hash_hi)


def test_what_does_not_fit_is_counted():
    core = booted(WatchedTvslam)
    stores = stores_of(core)
    hits = next(store for path, store in stores.items() if path.endswith("hits"))
    for _ in feed(core, [Segment("wander", 3000, 1)]):
        pass
    assert hits.used == hits.CAPACITY and hits.lost > 0
