# The map made tidy: what says nothing goes, what says something stays where it is.

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon

from tests.firmware_py.watched import watched
from tests.strategies import examples

storage, tidy_module = watched("firmware_py.storage.vector_store", "firmware_py.building.tidy")


def tidied(*chains, kind=4, sigma=3):
    """[(x, y)] in map units a chain -> the same of what is left, and the store"""
    store = storage.VectorStore()
    for chain in chains:
        store.open_chain(kind)
        for k, (x, y) in enumerate(chain):
            store.append(x, y, sigma + k % 2, 0)
    tidy = tidy_module.Tidy(store)
    for _ in range(4 * storage.VectorStore.CAPACITY):
        if tidy.step():
            break
    else:
        raise AssertionError("it never ends")
    left = [[(store.xs[i], store.ys[i]) for i in range(f, f + n)]
            for f, n in zip(store.firsts[:store.chains], store.counts[:store.chains], strict=True)]
    return left, store


ROOM = [(0, 0), (800, 0), (800, 600), (0, 600)]


def test_corners_stay_and_what_lies_between_goes():
    (left,), store = tidied([(0, 0), (300, 1), (800, 0), (801, 200), (799, 400), (800, 600), (0, 600)])
    assert left == ROOM
    assert store.flags[0] & storage.LONG and list(store.sigmas[:2]) == [4, 4]  # the larger one of both


def test_on_and_back_again_is_one_line():
    # a new line's first hits, taken for a vector of their own
    (left,), _ = tidied([(0, 0), (800, 0), (800, 20), (770, 20), (790, 21), (200, 20), (200, 600), (0, 600)])
    assert left == [(0, 0), (800, 0), (800, 20), (200, 20), (200, 600), (0, 600)]


@pytest.mark.parametrize("tip", [[(400, 500), (404, 500)], [(400, 560), (440, 560)], [(380, 520), (400, 480), (420, 520)]])
def test_slender_walls_and_small_corners_stay(tip):
    ring = [(0, 0), (800, 0), (800, 600), (tip[-1][0], 600), *tip[::-1], (tip[0][0], 600), (0, 600)]
    assert tidied(ring)[0] == [ring]


def test_a_curve_of_short_lines_stays():
    ring = [(round(120 * math.cos(math.radians(a))), round(120 * math.sin(math.radians(a)))) for a in range(0, 360, 15)]
    assert tidied(ring)[0] == [ring]


def test_the_ends_of_an_open_chain_stay():
    store = storage.VectorStore()
    store.open_chain(0)
    for x in (0, 100, 200, 300, 400):
        store.append(x, 0, 1, storage.CHAIN_END if x == 400 else 0)
    while not tidy_module.Tidy(store).step():
        pass
    assert (store.xs[0], store.xs[store.used - 1]) == (0, 400) and store.flags[store.used - 1] & storage.CHAIN_END


SPOT = st.tuples(st.integers(-400, 400), st.integers(-400, 400))


@given(st.lists(st.lists(SPOT, min_size=1, max_size=60), min_size=1, max_size=4))
def test_any_map_keeps_its_chains_and_its_walls(chains):
    left, store = tidied(*chains)
    assert len(left) == len(chains) and store.used == sum(map(len, left)) and store.lost == 0
    for before, after in zip(chains, left, strict=True):
        rest = iter(before)
        assert all(spot in rest for spot in after)  # in their order, none moved
        assert (before[0], before[-1]) == (after[0], after[-1]) and len(after) >= min(len(before), 3)


@settings(max_examples=examples(40))
@given(st.lists(st.tuples(st.integers(1, 99), st.integers(-2, 2)), max_size=30, unique_by=lambda spot: spot[0]), st.integers(-2, 2))
def test_a_noisy_wall_moves_by_less_than_two_centimetres(spots, tilt):
    wall = [(0, 0), *((8 * x, y) for x, y in sorted(spots)), (800, tilt)]
    (left,), _ = tidied([*wall, (800, 600), (0, 600)])
    kept = LineString([spot for spot in left if spot[1] < 100])
    assert all(kept.distance(LineString([spot, (spot[0], spot[1] + 0.01)])) <= 4 for spot in wall)
    assert Polygon(left).is_valid


def test_a_chain_of_over_255_records_goes_on_as_one():
    ring = [(x, 0) for x in range(0, 4000, 10)] + [(4000, y) for y in range(0, 3000, 10)] + [(0, 3000)]
    left, store = tidied(ring)
    spots = [spot for chain in left for spot in chain]
    assert len(spots) < 12 and {(0, 0), (4000, 0), (0, 3000)} <= set(spots) and store.counts[0] == store.used
