# Regions against rooms: generated floors, the shipped homes, and real ones where they are to be had; turned, mirrored, noisy.

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from sim_device.home import load_home
from tests.firmware_py.floor_plans import UNIT_M, Floor, graph_module, rooms_in_a_row, storage, varied, work
from tests.house.tree import PROJECT
from tests.strategies import examples

WIDTHS = st.lists(st.floats(1.6, 5), min_size=2, max_size=6)


def expect_a_region_a_room(floor, centres):
    found = [floor.region_of(*centre) for centre in centres]
    assert sorted(found) == list(range(len(centres))) and floor.graph.region_count == len(centres), found


@settings(max_examples=examples(25))
@given(WIDTHS, st.floats(0.65, 1.05), st.floats(0.08, 0.35), st.floats(0.1, 0.9), st.integers(0, 99))
def test_rooms_joined_by_doorways_are_regions(widths, door_m, wall_m, at, seed):
    outline, centres = rooms_in_a_row(widths, door_m, wall_m, at=at)
    outline, _, centres = varied(seed, 0.01, outline, [], centres)
    floor = Floor(outline).build()
    expect_a_region_a_room(floor, centres)
    assert sum(floor.areas_m2()) == pytest.approx(Polygon(outline).area, rel=0.01, abs=0.1)


@settings(max_examples=examples(25))
@given(WIDTHS, st.floats(1.4, 2.4), st.integers(0, 99))
def test_a_wide_opening_is_no_doorway(widths, door_m, seed):
    outline, centres = rooms_in_a_row(widths, door_m)
    outline, _, _ = varied(seed, 0.01, outline, [], centres)
    assert Floor(outline).build().graph.region_count == 1


@settings(max_examples=examples(25))
@given(st.floats(0.65, 1.1), st.floats(0.2, 1.3), st.integers(0, 99))
def test_a_niche_is_no_room(width, depth, seed):
    outline = [(0, 0), (4, 0), (4, 3), (2 + width, 3), (2 + width, 3 + depth), (2, 3 + depth), (2, 3), (0, 3)]
    outline, _, _ = varied(seed, 0.01, outline, [], [])
    assert Floor(outline).build().graph.region_count == 1


@pytest.mark.parametrize("door_m", [0.7, 0.9, 1.05])
@pytest.mark.parametrize("seed", range(4))
def test_a_room_within_a_barrier_is_a_region(door_m, seed):
    # A block of walls stands free in the hall; through its doorway a room is entered.
    block = [(2, 2), (5, 2), (5, 5), (2, 5), (2, 3.5 + door_m / 2), (2.1, 3.5 + door_m / 2), (2.1, 4.9), (4.9, 4.9), (4.9, 2.1),
             (2.1, 2.1), (2.1, 3.5 - door_m / 2), (2, 3.5 - door_m / 2)]
    outline, (block,), centres = varied(seed, 0.01, [(0, 0), (9, 0), (9, 7), (0, 7)], [block], [(7, 3.5), (3.5, 3.5)])
    floor = Floor(outline, [block]).build()
    expect_a_region_a_room(floor, centres)
    hall, room = (floor.areas_m2()[floor.region_of(*centre)] for centre in centres)
    assert room == pytest.approx(2.8 * 2.8, abs=0.4) and hall + room == pytest.approx(63 - Polygon(block).area, abs=0.3)


def test_a_barrier_belongs_to_its_region_and_takes_its_floor():
    outline, centres = rooms_in_a_row([3, 4], 0.8)
    table = [(5, 1), (6, 1), (6, 2), (5, 2)]
    floor = Floor(outline, [table]).build()
    region = floor.store.kinds[1] >> 3
    assert floor.store.kinds[1] & 7 == storage.BARRIER | storage.SEARCHED and region == floor.region_of(*centres[1])
    assert floor.areas_m2()[region] == pytest.approx(4 * 3 - 1, abs=0.1)


def test_a_region_counts_its_long_and_its_short_vectors():
    outline, centres = rooms_in_a_row([3, 4], 0.8)
    floor = Floor(outline).build()
    lines = [floor.graph.regions[6 * r + graph_module.LINES] for r in range(2)]
    assert [(n & 255, n >> 8) for n in lines] in ([(5, 2), (5, 0)], [(5, 0), (5, 2)], [(5, 1), (5, 1)])


def test_an_outline_in_pieces_is_cut_as_a_whole_one():
    outline, centres = rooms_in_a_row([3, 4, 2], 0.8)
    floor = Floor(outline[:9])
    floor.store.flags[8] |= storage.CHAIN_END
    floor._chain([(1, 1), (1, 2), (2, 2)], 5)
    floor._chain(outline[9:], 4)
    floor.build()
    expect_a_region_a_room(floor, centres)


def test_no_outline_no_region():
    floor = Floor([(0, 0), (4, 0), (4, 3), (0, 3)])
    floor.store.kinds[0] = 5
    assert floor.build().graph.region_count == 0 and floor.graph.ready


def test_more_rooms_than_regions_leaves_what_fits_and_counts():
    outline, _ = rooms_in_a_row([1.7] * 40, 0.8)
    floor = Floor(outline).build()
    assert floor.graph.region_count == 32 and floor.graph.lost > 0
    assert sum(floor.areas_m2()) == pytest.approx(Polygon(outline).area, abs=0.5)


@pytest.mark.parametrize("height", [13.2, 26.4])
def test_a_large_floor_is_cut_as_a_small_one(height):
    # 14 rooms of 75 or of 150 m2. The doorway in the middle is the narrowest: first half of all is cut off, more than AREA_MAX.
    door_m = 0.9
    outline, centres = rooms_in_a_row([5.7] * 14, door_m, height=height)
    middle = 7 * 5.8
    low = (height - door_m) / 2
    outline = [(x, y + 0.15) if abs(x - middle) < 0.3 and y == low else (x, y) for x, y in outline]
    floor = Floor(outline).build()
    expect_a_region_a_room(floor, centres)
    assert floor.areas_m2() == pytest.approx([5.7 * height] * 14, abs=0.3) and floor.graph.lost == 0
    assert set(floor.graph.regions[graph_module.LEARNED::6]) == {0}


def test_an_area_that_cannot_be_told_is_told_as_the_largest_and_counted():
    outline, centres = rooms_in_a_row([3, 30, 35], 0.9, height=25)
    floor = Floor(outline).build()
    expect_a_region_a_room(floor, centres)
    assert sorted(floor.areas_m2()) == [pytest.approx(75, abs=0.3), 655.35, 655.35] and floor.graph.lost == 2


def test_a_floor_that_is_too_wide_is_counted():
    for widths, lost in ((75, 0), (84, 1)):
        assert Floor([(0, 0), (widths, 0), (widths, 3), (0, 3)]).build().graph.lost == lost


def test_a_full_store_leaves_one_region():
    outline, _ = rooms_in_a_row([3, 4], 0.8)
    floor = Floor(outline)
    while floor.store.used < floor.store.CAPACITY - 1:
        floor.store.append(0, round((3 - 3 * floor.store.used / 800) / UNIT_M), 0, 0)
    used, chains = floor.store.used, floor.store.chains
    floor.build()
    assert (floor.store.used, floor.store.chains) == (used, chains)
    assert floor.graph.region_count == 1 and floor.graph.lost


def test_the_map_itself_is_left_as_it_is():
    outline, _ = rooms_in_a_row([3, 4, 2], 0.8)
    floor = Floor(outline, [[(1, 1), (2, 1), (2, 2)]])
    v = floor.store

    def whole():
        return v.used, v.chains, v.xs[:v.used], v.ys[:v.used], v.flags[:v.used], v.firsts[:2], v.counts[:2]

    before = whole()
    floor.build()
    assert before == whole()


ANY_RING = st.lists(st.tuples(st.integers(-32768, 32767), st.integers(-32768, 32767)), min_size=1, max_size=12)
NEAR_RING = st.lists(st.tuples(st.integers(-600, 600), st.integers(-600, 600)), min_size=3, max_size=30)


@settings(max_examples=examples(40))
@given(st.one_of(ANY_RING, NEAR_RING), st.lists(st.one_of(ANY_RING, NEAR_RING), max_size=3), st.booleans())
def test_any_map_however_tangled_comes_to_an_end(outline, barriers, is_open):
    floor = Floor([(x * UNIT_M, y * UNIT_M) for x, y in outline], [[(x * UNIT_M, y * UNIT_M) for x, y in ring] for ring in barriers])
    if is_open:
        floor.store.flags[len(outline) - 1] |= storage.CHAIN_END
    floor.build()
    assert 1 <= floor.graph.region_count <= 32 and work(floor.partition) == 0


def plan(path):
    home = load_home(str(path))
    return home.outline, list(home.obstacles), [room["centre"] for room in json.loads(path.read_text())["rooms"]]


SHIPPED = PROJECT / "sim_device" / "homes"


@pytest.mark.parametrize("name, spare", [("studio", 0), ("fig3_barriers", 0), ("flat", 1), ("slanted_house", 2)])
@pytest.mark.parametrize("seed", [None, 1, 2])
def test_the_shipped_homes_have_their_rooms_or_a_few_more(name, spare, seed):
    expect_rooms(SHIPPED / (name + ".json"), 0, spare, seed)


# Rooms that no doorway parts, and what else is cut off.
@pytest.mark.parametrize("name, joined, spare", [("arch_flat_51", 1, 0), ("arch_flat_77", 1, 0), ("tb3_house", 0, 1), ("giraff_c", 0, 0)])
@pytest.mark.parametrize("seed", [None, 1, 2, 3])
def test_real_homes_have_their_rooms_or_one_off(real_homes, name, joined, spare, seed):
    expect_rooms(real_homes / (name + ".json"), joined, spare, seed)


def expect_rooms(path, joined, spare, seed):
    outline, barriers, centres = plan(path)
    if seed is not None:
        outline, barriers, centres = varied(seed, 0.012, outline, barriers, centres)
    floor = Floor(outline, barriers).build()
    entered = {floor.region_of(*centre) for centre in centres}
    assert len(entered) >= len(centres) - joined and floor.graph.region_count <= len(centres) + spare
