# Whatever the sensors say, however absurd: storage never grows, capacities hold,
# no exception, no number that passes 2**30 (the core under test is the watched one).

from hypothesis import example, given

from tests.firmware_py.core_run import WatchedTvslam, booted, feed, storage_of, stores_of
from tests.strategies import Segment, settings_of_a_robot, streams

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
    assert storage_of(core) == at_boot


@given(settings_of_a_robot(), streams())
def test_what_goes_out_fits_its_message(parameters, segments):
    core = booted(WatchedTvslam, parameters)
    for _ in feed(core, segments):
        assert -32768 <= core.left_mm_s <= 32767 and -32768 <= core.right_mm_s <= 32767
        assert 0 <= core.state <= 17 and 0 <= core.ir_state <= 255
        assert 0 <= core.hash_lo <= 0xFFFF and 0 <= core.hash_hi <= 0xFFFF


@given(settings_of_a_robot(), streams(max_segments=4))
def test_the_same_stream_gives_the_same_hashes(parameters, segments):
    first = booted(WatchedTvslam, parameters)
    second = booted(WatchedTvslam, parameters)
    for _ in zip(feed(first, segments), feed(second, segments)):
        assert (first.hash_lo, first.hash_hi) == (second.hash_lo, second.hash_hi)
