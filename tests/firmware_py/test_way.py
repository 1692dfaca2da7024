# Ways over the map's corners: against networkx on the same corners, and against the walls themselves.

import math

import networkx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon

from sim_device.home import load_home
from tests.firmware_py.watched import watched
from tests.strategies import examples

vector_store, sight_module, way_module, graph_module = watched(
    "firmware_py.storage.vector_store", "firmware_py.building.sight", "firmware_py.building.way", "firmware_py.storage.region_graph")
BUSY, FOUND, NONE = way_module.BUSY, way_module.FOUND, way_module.NONE
# Two rooms, a door between them of 0.9 m, and a table.
ROOMS = [(0, 0), (8000, 0), (8000, 4000), (4100, 4000), (4100, 2900), (4000, 2900), (4000, 4000), (0, 4000)]
WALL = [(4000, 0), (4000, 2000), (4100, 2000), (4100, 0)]
OUTLINE = [(0, 0), (4000, 0), (4000, 2000), (4100, 2000), (4100, 0), *ROOMS[1:]]
TABLE = [(1500, 1500), (1500, 2500), (2300, 2500), (2300, 1500)]


def planner(*chains):
    store = vector_store.VectorStore()
    for kind, ring in chains:
        store.open_chain(kind)
        for x, y in ring:
            store.append(x // 5, y // 5, 0, 0)
    way = way_module.Way(store, sight_module.Sight(store), graph_module.RegionGraph(), None)
    while not way.build():
        pass
    return way


def path(way, a, b):
    """The places to pass, None without a way."""
    way.begin(*a, *b)
    for _ in range(20000):
        said = way.step()
        if said != BUSY:
            break
    assert said in (FOUND, NONE)
    if said == NONE:
        return None
    places = []
    while way.next():
        places.append((way.x_mm, way.y_mm))
        assert way.last() == (places[-1] == (b[0] // 5 * 5, b[1] // 5 * 5)) and len(places) < 66
    return places


def free_space():
    return Polygon(OUTLINE, [TABLE])


def test_through_the_door_round_the_table_and_never_through_a_wall():
    way = planner((4, OUTLINE), (5, TABLE))
    places = path(way, (1000, 2000), (7000, 500))
    assert places[-1] == (7000, 500) and len(places) >= 2
    line = LineString([(1000, 2000), *places])
    assert free_space().contains(line) and free_space().boundary.distance(line) >= 175
    assert line.length < 9000


def test_where_there_is_no_way_it_says_so():
    way = planner((4, [(0, 0), (4000, 0), (4000, 4000), (0, 4000)]), (5, TABLE))
    assert path(way, (500, 500), (1900, 2000)) is None


PLACE = st.sampled_from([(x, y) for x in range(300, 8000, 350) for y in range(300, 4000, 350)
                         if Polygon(OUTLINE, [TABLE]).buffer(-210).contains(LineString([(x, y), (x + 1, y)]))])


@settings(max_examples=examples(40))
@given(PLACE, PLACE)
def test_the_way_is_the_shortest_that_networkx_finds_over_the_same_corners(a, b):
    way = planner((4, OUTLINE), (5, TABLE))
    places = path(way, a, b)
    nodes = [*((way._g.at(2 * n), way._g.at(2 * n + 1)) for n in range(way.used)), [c // 5 for c in a], [c // 5 for c in b]]
    lengths = []
    for margin_mm in (190, 170):  # the second one only if the first finds none
        graph = networkx.Graph()
        graph.add_nodes_from(range(len(nodes)))
        for i, (x0, y0) in enumerate(nodes):
            for j, (x1, y1) in enumerate(nodes[:i]):
                if way._sight.clear(x0 * 5, y0 * 5, x1 * 5, y1 * 5, margin_mm):
                    graph.add_edge(i, j, weight=(math.isqrt((x0 - x1) ** 2 + (y0 - y1) ** 2) + 2 >> 1) + 8)
        if networkx.has_path(graph, way.used, way.used + 1):
            lengths.append(networkx.dijkstra_path_length(graph, way.used, way.used + 1))
    assert (places is None and not lengths) or way.length_cm == lengths[0]


def ticks_and_cm(way, a, b):
    way.begin(*a, *b)
    for ticks in range(1, 2000):
        if way.step() != BUSY:
            return ticks, way.length_cm
    raise AssertionError("it never ends")


def test_through_an_office_the_way_there_is_as_long_as_the_way_back_and_soon_found():
    home = load_home("office_458")
    rings = [[(round(1000 * x), round(1000 * y)) for x, y in ring] for ring in (home.outline, *home.obstacles)]
    way = planner((4, rings[0]), *((5, ring[::-1]) for ring in rings[1:]))
    assert way.used > 150
    a, b = (10750, 2275), (38575, 2275)  # the middles of two rooms
    there, cm = ticks_and_cm(way, a, b)
    back, cm_back = ticks_and_cm(way, b, a)
    assert math.dist(a, b) / 10 <= cm == cm_back < way_module.UNREACHED
    assert max(there, back) < 500, "10 s: with a look at every leg that might be shorter it would be 36"


def test_more_corners_than_nodes_are_counted():
    comb = [(0, 0), (20000, 0), (20000, 4000)]
    for k in range(24, 0, -1):
        x = 800 * k
        comb += [(x + 100, 4000), (x + 100, 2000), (x, 2000), (x, 4000)]
    way = planner((4, comb + [(0, 4000)]))
    assert way.used <= way_module.GOAL and way.corners.lost == 0
    places = [(1500 * k, 1500 * m) for k in range(1, 10) for m in range(1, 9)]
    chains = [(5, [(x, y), (x, y + 505), (x + 505, y + 505), (x + 505, y)]) for x, y in places]
    way = planner((4, [(0, 0), (16000, 0), (16000, 14000), (0, 14000)]), *chains[:63])
    assert way.used == way_module.GOAL and way.corners.lost > 0
    assert path(way, (300, 300), (15700, 13700)) is not None


@pytest.mark.parametrize("far", [10_000, 50_000, 60_000, 100_000, 32767 * 5])
def test_on_a_map_of_any_size_there_are_ways_of_up_to_55_m_at_a_stretch(far):
    way = planner((4, [(-far, -far), (far, -far), (far, far), (0, far), (0, 0), (-far, 0)]))
    corner = (190, -195)
    assert path(way, (-2000, -300), (300, 2000)) == [corner, (300, 2000)]
    goal = (far - 1000, far - 1000)
    assert path(way, (1000 - far, 1000 - far), goal) == ([corner, goal] if far < 55_000 else None)
