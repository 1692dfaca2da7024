# How long a question waits: for a line that is quick or slow, that loses frames, whose far end sleeps now and then.

import pytest

from protocol.host_window import Window
from protocol.round_trip import BACKOFF_MAX_US, PATIENCE_MAX_US, PATIENCE_US, RTO_FIRST_US, RTO_MAX_US, RTO_MIN_US, RoundTrip


def trip_of(way_us, patience_us=RTO_MIN_US):
    trip = RoundTrip()
    for _ in range(100):
        trip.add(way_us, 0)
    trip.patience_us = patience_us
    return trip


def test_the_wait_follows_the_line():
    assert RoundTrip().timeout_us() == RTO_FIRST_US
    trip = trip_of(200)
    assert [trip.timeout_us(tries) for tries in (0, 1, 20)] == [RTO_MIN_US, 2 * RTO_MIN_US, BACKOFF_MAX_US]
    assert trip_of(200, PATIENCE_US).timeout_us() == PATIENCE_US
    trip = trip_of(80_000)
    assert 80_000 <= trip.timeout_us() <= 90_000 and trip.timeout_us(5) == trip.timeout_us()
    assert trip_of(9_000_000).timeout_us() == RTO_MAX_US


def test_an_answer_to_a_repeated_question_says_nothing():
    trip = trip_of(300)
    for _ in range(50):
        trip.add(70_000, 1)
    assert trip.timeout_us() == RTO_MIN_US


@pytest.mark.parametrize("way_us", [10_000, 70_000, 150_000])
def test_a_line_that_has_become_slow_is_measured_again(way_us):
    # Every question is sent twice, and answered twice, until the wait is longer than the way.
    trip = trip_of(300)
    for _ in range(100):
        if trip.timeout_us() > way_us:
            trip.add(way_us, 0)
        else:
            trip.add(way_us, 1)
            trip.needless()
    assert way_us < trip.timeout_us() < 2 * way_us and abs(trip.smooth_us - way_us) < way_us / 10


# One that answers at once; `late` says for which steps the core sleeps for 15 ms, `lost` which answers are lost.
def steps_with(late=(), lost=(), steps=1000):
    window, now_us, repeats = Window(), 0, []
    for step in range(steps):
        question = window.open()
        window.sent(question, b"", now_us)
        awake_us = now_us + (15_000 if step in late else 200)
        came_us = None if step in lost else awake_us
        copies = 1
        while came_us is None or now_us < came_us:
            wait_us = window.wait_us(now_us)
            now_us = now_us + wait_us if came_us is None else min(now_us + max(wait_us, 1), came_us)
            if (came_us is None or now_us < came_us) and window.due(now_us):
                repeats.append(step)
                copies += 1
                came_us = came_us or now_us + 200
        for _ in range(copies - (step in lost)):
            window.answered(question.seq, now_us)
    return window, repeats


def test_a_core_that_sleeps_now_and_then_is_not_asked_twice():
    window, repeats = steps_with(late=range(0, 1000, 10))
    assert len(repeats) == window.repeats <= 2


def test_where_repeats_are_needed_the_wait_becomes_short():
    window, repeats = steps_with(lost=range(0, 1000, 5))
    assert len(repeats) == 200 and window.round_trip.timeout_us() == RTO_MIN_US


def test_needless_repeats_teach_patience():
    window, _ = steps_with(lost=range(0, 100, 2), steps=100)
    trip = window.round_trip
    assert trip.patience_us == RTO_MIN_US
    for _ in range(200):
        question = window.open()
        window.sent(question, b"", 0)
        question.tries = 1
        assert window.answered(question.seq, 1) and window.answered(question.seq, 1) is None
    assert trip.patience_us == PATIENCE_MAX_US and window.duplicates == 200


@pytest.mark.parametrize("way_us", [1, 250, 20_000, 999_999])
def test_all_numbers_are_whole(way_us):
    trip = RoundTrip()
    for k in range(50):
        trip.add(way_us + k * 37, 0)
        assert isinstance(trip.smooth_us, int) and isinstance(trip.spread_us, int) and isinstance(trip.timeout_us(k), int)
