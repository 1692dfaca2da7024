# The closure error of a lap: measured on walls walked twice, spread over the way.

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

vector_store, closure_module = watched("firmware_py.storage.vector_store", "firmware_py.building.closure")

# a room of 4 m by 3 m, mm, counter-clockwise from a corner
ROOM = [(0, 0), (4000, 0), (4000, 3000), (0, 3000), (0, 0)]


def room(corners=ROOM, shift=(0, 0)):
    store = vector_store.VectorStore()
    store.open_chain(0)
    for x, y in corners:
        store.append((x + shift[0]) // 5, (y + shift[1]) // 5, 0, 0)
    return store


def walked_again(store, ex, ey, xs=range(200, 2000, 20), ys=()):
    """The second pass sees the first wall's points displaced by the error that has grown."""
    closure = closure_module.Closure(store)
    closure.begin(0)
    for x in xs:
        closure.add(x + ex, ey, 0)
    for y in ys:
        closure.add(4000 + ex, y + ey, 16384)
    closure.solve(store.used)
    return closure


def vertices(store):
    return [(store.xs[i] * 5, store.ys[i] * 5) for i in range(store.used)]


def spread(closure):
    for _ in range(100):
        if closure.step():
            return
    raise AssertionError("it never ends")


@given(st.integers(-60, 60), st.integers(-60, 60))
def test_two_walls_tell_the_whole_error(ex, ey):
    closure = walked_again(room(), ex, ey, ys=range(200, 2000, 20))
    assert abs(closure.before_mm - (ex * ex + ey * ey) ** 0.5) <= 6 + 0.06 * closure.before_mm
    assert closure.after_mm <= 20


def test_one_wall_tells_the_error_across_it_alone():
    closure = walked_again(room(), 50, 80)
    assert abs(closure.before_mm - 80) <= 8


def test_the_error_is_taken_back_in_proportion_to_the_way():
    store = room()
    closure = walked_again(store, 60, 100, ys=range(200, 2000, 20))
    before, generation = vertices(store), store.generation
    spread(closure)
    assert store.generation != generation  # who has read the map must read it again
    way = [0, 4000, 7000, 11000, 14000]
    for (x0, y0), (x1, y1), s in zip(before, vertices(store), way):
        assert abs(x0 - x1 - 60 * s / 14000) <= 9 and abs(y0 - y1 - 100 * s / 14000) <= 9


@pytest.mark.parametrize("ex, ey", [(0, 5), (0, 0)])
def test_what_is_small_moves_nothing(ex, ey):
    store = room()
    before = vertices(store)
    spread(walked_again(store, ex, ey))
    assert vertices(store) == before


def test_passes_that_do_not_tell_of_one_shift_move_nothing():
    store = room()
    closure = closure_module.Closure(store)
    closure.begin(0)
    for x in range(200, 2000, 20):
        closure.add(x, 150 if x < 1500 else -150, 0)
    closure.solve(store.used)
    before = vertices(store)
    spread(closure)
    assert closure.before_mm > 20 and closure.after_mm * 2 > closure.before_mm and vertices(store) == before


@pytest.mark.parametrize("ex, ey", [(350, -120), (-30, 380)])
def test_where_dead_reckoning_was_alone_the_error_may_be_large(ex, ey):
    closure = closure_module.Closure(room())
    closure.begin(0, True)
    for x in range(500, 2000, 20):
        closure.add(x + ex, ey, 0)
    assert not closure.crossed()  # one wall alone
    for y in range(500, 2000, 20):
        closure.add(4000 + ex, y + ey, 16384)
    assert closure.crossed()
    closure.solve(4)
    assert abs(closure.x_mm + ex) <= 12 + 0.03 * abs(ex) and abs(closure.y_mm + ey) <= 12 + 0.03 * abs(ey)


def test_a_wall_that_runs_another_way_is_not_the_one_walked_along():
    closure = closure_module.Closure(room())
    closure.begin(0)
    for x in range(200, 2000, 20):
        closure.add(x, 80, 16384)
    assert closure.samples == 0


def test_cancelled_it_moves_nothing():
    store = room()
    closure = walked_again(store, 60, 100, ys=range(200, 2000, 20))
    closure.cancel()
    before = vertices(store)
    spread(closure)
    assert vertices(store) == before and closure.before_mm > 100


def test_too_few_samples_or_none_near_tell_nothing():
    assert walked_again(room(), 0, 80, xs=range(200, 280, 20)).before_mm == 0
    far = walked_again(room(), 0, 250)
    assert far.samples == 0 and far.before_mm == 0
    assert far.step()


def test_at_the_border_of_the_map_a_vertex_is_clamped():
    store = room(shift=(163_800 - 4000, 163_800 - 3000))
    closure = closure_module.Closure(store)
    closure.begin(0)
    for x in range(200, 2000, 20):
        closure.add(159_800 + x, 160_800 - 150, 0)
    closure.solve(store.used)
    spread(closure)
    assert max(store.xs) <= 32767 and max(store.ys) <= 32767


UNIT = st.integers(-32768, 32767)


RECORD = st.tuples(UNIT, UNIT, st.integers(0, 15))
SAMPLE = st.tuples(st.integers(0, 79), UNIT, UNIT)


@given(st.lists(RECORD, min_size=1, max_size=80), st.lists(SAMPLE, max_size=60))
def test_any_map_and_any_second_pass_come_to_an_end(records, samples):
    store = vector_store.VectorStore()
    store.open_chain(0)
    for x, y, flags in records:
        store.append(x, y, 0, flags)
    closure = closure_module.Closure(store)
    closure.begin(0)
    for at, dx, dy in samples:
        at %= len(records)
        closure.add(records[at][0] * 5 + dx // 200, records[at][1] * 5 + dy // 200, dx)
    closure.solve(store.used)
    spread(closure)
