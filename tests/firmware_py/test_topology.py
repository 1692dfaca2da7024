# Turning nodes and the shortest way over them, against networkx: random graphs, generated floors, the shipped homes.

import math
import random

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon

from firmware_py.limits import NODES_MAX
from host_tools.map_file import decode_map
from tests.firmware_py.floor_plans import UNIT_M, Floor, graph_module, image_of, rooms_in_a_row, varied, way_module
from tests.firmware_py.test_partition import SHIPPED, plan
from tests.strategies import examples

WIDTHS = st.lists(st.floats(1.6, 5), min_size=2, max_size=6)
SEED = st.integers(0, 99)


@settings(max_examples=examples(25))
@given(WIDTHS, st.floats(0.65, 1.05), SEED)
def test_all_rooms_are_joined_and_no_edge_meets_a_wall(widths, door_m, seed):
    outline, centres = rooms_in_a_row(widths, door_m)
    outline, _, _ = varied(seed, 0.01, outline, [], centres)
    floor = Floor(outline).build()
    nodes, edges = floor.nodes(), floor.edges()
    graph = nx.Graph([edge[:2] for edge in edges])
    graph.add_nodes_from(range(len(nodes)))
    assert nx.is_connected(graph) and len(nodes) >= len(widths) - 1 and not floor.graph.lost
    walls = LineString([*outline, outline[0]])
    for a, b, region, cost in edges:
        way = LineString([[c * UNIT_M for c in nodes[n]] for n in (a, b)])
        assert a < b and walls.distance(way) >= 0.165 and cost - 2 <= 100 * way.length <= cost
        x, y = ((nodes[a][k] + (nodes[b][k] - nodes[a][k]) // 2) for k in (0, 1))
        assert region == floor.partition.region_of(x, y)


@settings(max_examples=examples(25))
@given(WIDTHS, st.floats(0.65, 1.05), SEED)
def test_the_first_nodes_are_the_middles_of_the_gates(widths, door_m, seed):
    outline, _, _ = varied(seed, 0.01, rooms_in_a_row(widths, door_m)[0], [], [])
    floor = Floor(outline).build()
    g = floor.graph
    ends = floor.store.used  # they stand behind the map
    for r in range(1, g.region_count):
        n = ends + 2 * r - 2
        assert floor.nodes()[r - 1] == tuple(each[n] + each[n + 1] >> 1 for each in (floor.store.xs, floor.store.ys))


def shortest_cm(floor, a, b):
    """By networkx, over the floor's nodes, its edges, and what both ends see of them."""
    graph = nx.Graph()
    graph.add_weighted_edges_from((n, m, cost) for n, m, _, cost in floor.edges())
    graph.add_nodes_from(["a", "b"])
    straight = floor.way_cm(a, b)
    if straight is not None:
        graph.add_edge("a", "b", weight=straight)
    for n, place in enumerate(floor.nodes()):
        for name, end in (("a", a), ("b", b)):
            cost = floor.way_cm(place, end)
            if cost is None and floor.topology.aside(n, *end):
                point = floor.topology.aside_x, floor.topology.aside_y
                parts = floor.way_cm(place, point), floor.way_cm(point, end)
                cost = None if None in parts else sum(parts)
            if cost is not None:
                graph.add_edge(name, n, weight=cost)
    return nx.shortest_path_length(graph, "a", "b", "weight") if nx.has_path(graph, "a", "b") else None


def found(floor, a, b):
    """-> (cm or None, places passed)"""
    way = floor.way
    assert way.build()
    way.begin(*(c * 5 for c in (*a, *b)))
    said = way_module.BUSY
    while said == way_module.BUSY:
        said = way.step()
    if said == way_module.NONE:
        return None, []
    places = [a]
    while way.next():
        assert way.last() == (len(places) > 0 and (way.x_mm, way.y_mm) == (b[0] * 5, b[1] * 5))
        places.append((way.x_mm // 5, way.y_mm // 5))
    return way.length_cm, places


def expect_the_shortest_way(floor, a, b):
    length, places = found(floor, a, b)
    assert length == shortest_cm(floor, a, b)
    if length is not None:
        legs = [floor.way_cm(*leg) for leg in zip(places, places[1:], strict=False)]
        assert None not in legs and sum(legs) == length and places[-1] == b
    return length


def floor_and_places(luck):
    """Rooms with tables in the ways from door to door; places where the robot may stand."""
    outline, centres = rooms_in_a_row([luck.uniform(1.6, 5) for _ in range(luck.randint(2, 6))], luck.uniform(0.65, 1.05))
    tables = [[(x - 0.3, y - 0.2), (x + 0.3, y - 0.2), (x + 0.3, y + 0.2), (x - 0.3, y + 0.2)] for x, y in centres if luck.random() < 0.5]
    outline, tables, _ = varied(luck.randint(0, 99), 0.01, outline, tables, [])
    free = Polygon(outline, tables).buffer(-0.19)
    x0, y0, x1, y1 = free.bounds
    drawn = [(luck.uniform(x0, x1), luck.uniform(y0, y1)) for _ in range(60)]
    return Floor(outline, tables).build(), [(round(x / UNIT_M), round(y / UNIT_M)) for x, y in drawn if free.contains(Point(x, y))][:8]


@settings(max_examples=examples(25))
@given(st.randoms(use_true_random=False))
def test_the_way_found_is_the_shortest(luck):
    floor, places = floor_and_places(luck)
    for a, b in zip(places, places[1:], strict=False):
        expect_the_shortest_way(floor, a, b)


def test_nearly_every_place_is_reached():
    luck = random.Random(7)
    lengths = []
    for _ in range(20):
        floor, places = floor_and_places(luck)
        lengths += [found(floor, a, b)[0] for a, b in zip(places, places[1:], strict=False)]
    assert len(lengths) > 100 and lengths.count(None) <= 0.02 * len(lengths), lengths.count(None)


@settings(max_examples=examples(25))
@given(st.lists(st.tuples(st.integers(0, 400), st.integers(0, 400)), min_size=4, max_size=20, unique=True),
       st.lists(st.tuples(st.integers(0, 63), st.integers(0, 63)), max_size=128))
def test_on_any_graph_the_way_is_the_shortest(places, links):
    # Only the first and the last place see the ends.
    hall = [(-1, -1), (21, -1), (21, 9), (-1, 9)]
    floor = Floor(hall, [[(x, -0.5), (x + 0.1, -0.5), (x + 0.1, 8.5), (x, 8.5)] for x in (4.0, 16.0)])
    g = floor.graph
    nodes = [(1000 + x * 3, 200 + y * 3) for x, y in places]
    nodes[0], nodes[-1] = (200, -150), (3800, -150)
    for k, (x, y) in enumerate(nodes):
        g.shared[2 * k], g.shared[2 * k + 1] = x, y & 0xFFFF
    chosen = {tuple(sorted((a % len(nodes), b % len(nodes)))) for a, b in links}
    for n in range(len(nodes)):
        mine = sorted(b for a, b in chosen if a == n != b)
        g.shared[graph_module.ABOUT + n] = len(mine) << 8 | g.edge_count
        for b in mine:
            g.shared[graph_module.EDGES + g.edge_count] = b
            g.edge_count += 1
    g.node_count = len(nodes)
    g.ready = True
    floor.topology.margin = floor.margin
    ends = (100, 600), (3900, 600)
    length, passed = found(floor, *ends)
    assert length == shortest_cm(floor, *ends)


@pytest.mark.parametrize("name", ["studio", "flat", "slanted_house"])
def test_in_a_shipped_home_every_place_is_reached(name):
    outline, barriers, centres = plan(SHIPPED / (name + ".json"))
    floor = Floor(outline, barriers).build()
    free = Polygon(outline, barriers).buffer(-0.2)
    rooms = [free.buffer(-0.15).intersection(Point(centre).buffer(1.2)).representative_point() for centre in centres]
    places = [(round(p.x / UNIT_M), round(p.y / UNIT_M)) for p in rooms]
    for a in places:
        for b in places:
            assert expect_the_shortest_way(floor, a, b) is not None


def test_behind_a_wall_there_is_no_way():
    floor = Floor([(0, 0), (6, 0), (6, 4), (0, 4)], [[(2, 1), (4, 1), (4, 3), (2, 3)]]).build()
    assert found(floor, (100, 100), (600, 400))[0] is None  # the goal lies within the barrier


@pytest.mark.parametrize("bays, full", [(20, False), (52, True)])
def test_too_many_corners_leave_what_fits_and_count(bays, full):
    # A corridor with bays on either side, each of which is seen from itself alone.
    walls = [1.5 * k for k in range(bays)]
    below = [(x + far, y) for x in walls for far, y in ((0, 0), (0, -3), (1.3, -3), (1.3, 0))]
    floor = Floor([*below, (1.5 * bays, 0), *((x, 2 - y) for x, y in [(1.5 * bays, 0), *below[::-1]])]).build()
    g = floor.graph
    assert g.ready and (g.node_count == NODES_MAX, g.lost > 0) == (full, full)
    assert full or nx.is_connected(nx.Graph([edge[:2] for edge in floor.edges()]))


def test_the_map_goes_out_with_its_regions_and_ways_once_they_are_ready():
    outline, centres = rooms_in_a_row([3, 4, 2], 0.8)
    table = [(4, 1), (5, 1), (5, 2), (4, 2)]
    floor = Floor(outline, [table])
    plain = decoded(floor)
    assert (plain.regions, plain.nodes, plain.edges) == (0, 0, 0) and len(plain.chains) == 2
    floor.partition.begin()
    floor.partition.step()
    assert decoded(floor).regions == 0
    whole = decoded(floor.build())
    g = floor.graph
    assert (whole.regions, whole.nodes, whole.edges) == (3, g.node_count, g.edge_count)
    for region in whole.region_list:
        here = [floor.region_of(*centre) == region.number for centre in centres]
        assert [region.polygon.contains(Point(centre)) for centre in centres] == here and sum(here) == 1
        tables = Polygon(table).intersection(region.polygon).area
        assert region.area_m2 == pytest.approx(region.polygon.area - tables, abs=0.03)
        assert (region.gate is None) == (region.number == 0)
        if region.gate:
            assert math.dist(*region.gate) == pytest.approx(0.8, abs=0.02)
    assert [(round(x / UNIT_M), round(y / UNIT_M)) for x, y in whole.node_list] == floor.nodes()
    assert [(*e.nodes, e.region, e.cost_cm) for e in whole.edge_list] == floor.edges()


def decoded(floor):
    return decode_map(image_of(floor.store, floor.graph))
