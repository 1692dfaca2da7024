# What does not fit is left out, counted, and told: the map that is left is sound.

import networkx as nx
import pytest

from host_tools.map_file import decode_records
from tests.firmware_py.floor_plans import Floor, image_of, partition_module, rooms_in_a_row, topology_module
from tests.firmware_py.test_topology import expect_the_shortest_way

WIDTHS = [3, 4, 2, 3, 4, 2.5]


def floor_with(monkeypatch, **capacities):
    for name, value in capacities.items():
        for module in (partition_module, topology_module):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, value)
    outline, centres = rooms_in_a_row(WIDTHS, 0.8, at=0.1)
    tables = [[(x - 0.3, y - 0.2), (x + 0.3, y - 0.2), (x + 0.3, y + 0.2), (x - 0.3, y + 0.2)] for x, y in centres]
    return Floor(outline, tables).build()


def test_with_room_for_all_nothing_is_lost(monkeypatch):
    g = floor_with(monkeypatch).graph
    assert (g.region_count, g.lost, g.ready) == (len(WIDTHS), 0, True) and g.node_count > 6 and g.edge_count > 8


@pytest.mark.parametrize("name, capacity, used", [
    ("REGIONS_MAX", 3, "region_count"), ("NODES_MAX", 6, "node_count"), ("EDGES_MAX", 3, "edge_count")])
def test_a_full_graph_says_so_and_what_it_has_is_sound(monkeypatch, name, capacity, used):
    floor = floor_with(monkeypatch, **{name: capacity})
    g = floor.graph
    assert g.ready and g.lost > 0 and getattr(g, used) == capacity
    ways = nx.Graph([edge[:2] for edge in floor.edges()])
    assert set(ways) <= set(range(g.node_count)) and all(region < g.region_count for _, _, region, _ in floor.edges())
    areas = sum(floor.areas_m2())
    assert areas == pytest.approx(sum(WIDTHS) * 3.0 - 0.24 * len(WIDTHS), rel=0.05)  # rooms that are not cut off stay with the others
    records = decode_records(image_of(floor.store, g))
    assert (records.region_count, records.node_count, records.edge_count) == (g.region_count, g.node_count, g.edge_count)


def test_over_a_graph_with_pieces_missing_the_ways_are_those_that_are_left(monkeypatch):
    floor = floor_with(monkeypatch, EDGES_MAX=3)
    places = [(120, 120), (120, 560), (700, 120), (1100, 560), (2200, 560), (3600, 120)]
    lengths = [expect_the_shortest_way(floor, a, b) for a in places for b in places if a != b]
    assert None in lengths and any(lengths)


def test_no_place_behind_the_map_for_gates_leaves_one_region():
    outline, _ = rooms_in_a_row(WIDTHS, 0.8)
    floor = Floor(outline)
    free = floor.store.CAPACITY - floor.store.used
    floor.store.open_chain(5)
    for i in range(free - 1):
        floor.store.append(400 + i % 2, 100, 0, 0)
    floor.build()
    assert floor.graph.region_count == 1 and floor.graph.lost > 0 and floor.graph.ready
