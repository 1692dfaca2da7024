# The free run in the core: STEPs wait for the core's own grid of 20 ms, and what came late is counted.

from hypothesis import given
from hypothesis import strategies as st

from protocol.parameters import PARAMETERS
from tests.firmware_py.device_story import OK, Story

TICK_MS = 20
NUMBER = next(i for i, row in enumerate(PARAMETERS) if row[0] == "tick_ms")
WRAP_MS = 1 << 26


def free_run(start_ms):
    story = Story()
    assert story.one("PARAM_SET", NUMBER, 0, TICK_MS).status == OK
    story.port.ms = start_ms
    return story


def executed(story, number, arrival_ms):
    """The moment at which the STEP that comes then was run."""
    story.port.ms = arrival_ms
    (answer,) = story.step(number)
    assert (answer.NAME, answer.step) == ("STEP_RSP", number)
    return story.port.ms


def lateness(story):
    status = story.one("STATUS", 0)
    return status.late_ticks, status.late_ms


@given(start_ms=st.integers(0, WRAP_MS - 1) | st.integers(WRAP_MS - 200, WRAP_MS - 1), gaps_ms=st.lists(st.integers(0, 130), max_size=25))
def test_a_step_runs_on_the_grid_or_soon_after_it_and_every_late_tick_is_counted(start_ms, gaps_ms):
    story = free_run(start_ms)
    base_ms = start_ms - start_ms % TICK_MS
    now_ms = executed(story, 1, start_ms)
    assert now_ms == base_ms + TICK_MS
    first = last = 1
    on_time, latest_ms = 1, 0
    for number, gap_ms in enumerate(gaps_ms, 2):
        arrival_ms = now_ms + gap_ms
        now_ms = executed(story, number, arrival_ms)
        tick, beyond_ms = divmod(now_ms - base_ms, TICK_MS)
        assert now_ms >= arrival_ms and tick > last, "one step a tick"
        assert beyond_ms == 0 or now_ms == arrival_ms and beyond_ms < TICK_MS // 2, "only a late one runs beside the grid, and at once"
        latest_ms = max(latest_ms, arrival_ms - base_ms - (last + 1) * TICK_MS)
        on_time += beyond_ms == 0
        last = tick
    assert lateness(story) == (last - first + 1 - on_time, latest_ms)


def test_a_pause_in_the_middle_of_waiting_is_late_too():
    story = free_run(1000)
    executed(story, 1, 1005)
    story.port.wait = lambda ms: setattr(story.port, "ms", story.port.ms + 300)
    assert executed(story, 2, 1025) == 1325
    assert lateness(story) == (1, 285)
    del story.port.wait
    assert executed(story, 3, 1330) == 1340, "on the same grid as before"
    assert lateness(story) == (15, 285), "14 ticks passed without a step"


def test_counts_stay_at_what_their_fields_hold():
    story = free_run(0)
    executed(story, 1, 0)
    executed(story, 2, 3_000_000)
    assert lateness(story) == (65535, 65535)


def test_in_lockstep_nothing_waits_and_nothing_is_late():
    story = Story()
    for number, arrival_ms in enumerate((1001, 1003, 9000), 1):
        assert executed(story, number, arrival_ms) == arrival_ms
    assert lateness(story) == (0, 0)


def test_the_clock_changes_no_result():
    lock, free = Story(), free_run(5)
    for number in range(1, 60):
        assert lock.step(number, left=number, right=9) == free.step(number, left=number, right=9)
        free.port.ms += number % 37
    assert (lock.core.hash_lo, lock.core.hash_hi) == (free.core.hash_lo, free.core.hash_hi)
