# map.bin: any map, coded by the core, read by the host, is the same map; coded again by the host, it is the same bytes.

import random
import struct
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from host_tools.map_file import MapError, Records, decode_map, decode_records, encode_records
from protocol.map_code import ABOUT, EDGES, HEADER_BYTES, MAGIC
from tests.firmware_py.floor_plans import Floor, crumbs_module, graph_module, image_module, image_of, rooms_in_a_row, storage, work_for
from tests.firmware_py.test_partition import SHIPPED, plan
from tests.strategies import examples

ANYWHERE = st.integers(-32768, 32767)
NEAR = st.integers(-300, 300)
BYTE = st.integers(0, 255)


@st.composite
def maps(draw):
    """Walls as rooms have them, and anything at all."""
    store = storage.VectorStore()
    for _ in range(draw(st.integers(0, 5))):
        store.open_chain(draw(BYTE))
        x = y = 0
        wild = draw(st.booleans())
        size = draw(st.sampled_from([3, 30, 300]))
        for way, length, sigma, flags in draw(st.lists(st.tuples(st.integers(0, 3), NEAR, BYTE, BYTE), max_size=size)):
            if wild:
                x, y = draw(ANYWHERE), draw(ANYWHERE)
            else:
                x, y = (x + length, y + sigma % 3) if way & 1 else (x - sigma % 3, y + length)
            store.append(x, y, sigma if wild else sigma % 6, flags if wild else flags % 4)
    return store, draw(graphs(store.used))


@st.composite
def graphs(draw, used):
    graph = graph_module.RegionGraph()
    graph.ready = draw(st.booleans())
    if not graph.ready or not used:
        return graph
    graph.region_count = draw(st.integers(1, 32))
    record = st.integers(0, used - 1)
    word = st.integers(0, 65535)
    for r in range(graph.region_count):
        row = (draw(record), draw(record), draw(word), draw(word),
               draw(st.integers(0, graph.region_count - 1)) | draw(st.sampled_from((0, graph_module.GATE_FIRST))), draw(word))
        for k, value in enumerate(row):
            graph.regions[6 * r + k] = value
    graph.node_count = draw(st.integers(graph.region_count - 1, 64))
    for n in range(graph.node_count):
        graph.shared[2 * n], graph.shared[2 * n + 1] = draw(word), draw(word)
        above = st.integers(n + 1, graph.node_count - 1) if n + 1 < graph.node_count else st.nothing()
        mine = sorted(draw(st.sets(above, max_size=min(6, 128 - graph.edge_count)))) if n + 1 < graph.node_count else []
        graph.shared[ABOUT + n] = len(mine) << 8 | graph.edge_count
        for to in mine:
            graph.shared[EDGES + graph.edge_count] = to | draw(st.integers(0, 31)) << 8
            graph.edge_count += 1
    return graph


def held(store, graph):
    """All that the map says, of the core's records or the host's."""
    counts = (graph.region_count, graph.node_count, graph.edge_count) if graph.ready else (0, 0, 0)
    return (
        [list(part[:store.used]) for part in (store.xs, store.ys, store.sigmas, store.flags)],
        [list(part[:store.chains]) for part in (store.firsts, store.counts, store.kinds)],
        list(graph.regions[:6 * counts[0]]), list(graph.shared[:2 * counts[1]]),
        list(graph.shared[ABOUT:ABOUT + counts[1]]), list(graph.shared[EDGES:EDGES + counts[2]]), counts,
    )


@given(maps())
def test_any_map_comes_back_and_is_the_same_bytes_again(a_map):
    store, graph = a_map
    before = held(store, graph)
    data = image_of(store, graph)
    assert held(store, graph) == before  # coding changes nothing
    records = decode_records(data)
    assert held(records, records) == before
    assert encode_records(records) == data
    assert data[:4] == MAGIC and data[-4:] == struct.pack("<I", zlib.crc32(data[:-4]))


@settings(max_examples=examples(20))
@given(maps(), st.lists(st.integers(0, 10**6), max_size=20))
def test_every_byte_is_to_be_had_in_any_order(a_map, order):
    store, graph = a_map
    whole = image_of(store, graph)
    image = image_module.MapImage(store, graph, crumbs_module.Breadcrumbs())
    image.begin()
    work_for(image)
    assert image.size == len(whole) and [image.byte(i % image.size) for i in order] == [whole[i % image.size] for i in order]


@settings(max_examples=examples(20))
@given(maps(), st.data())
def test_a_map_that_is_cut_or_changed_is_refused_in_one_sentence(a_map, data):
    whole = image_of(*a_map)
    broken = bytearray(whole)
    broken[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    for damaged in (bytes(broken), whole[:data.draw(st.integers(0, len(whole) - 1))]):
        with pytest.raises(MapError) as refused:
            decode_records(damaged)
        assert len(str(refused.value)) < 160 and "\n" not in str(refused.value)


def summed(body):
    """As if the damage had been there when the checksum was made."""
    return bytes(body) + struct.pack("<I", zlib.crc32(body))


def test_damage_that_the_checksum_does_not_tell_is_refused_or_another_map():
    floor = Floor(rooms_in_a_row([3, 4, 2], 0.8)[0], [[(1, 1), (2, 1), (2, 2)]]).build()
    whole = image_of(floor.store, floor.graph)
    luck = random.Random(1)
    said = set()
    for _ in range(600):
        broken = bytearray(whole[:-4])
        low = luck.choice((4, len(broken) * 3 // 4))  # the graph stands at the end
        for _ in range(luck.choice((1, 2))):
            broken[luck.randrange(low, len(broken))] ^= 1 << luck.randrange(8)
        try:
            the_map = decode_map(summed(broken))
        except MapError as error:
            assert len(str(error)) < 160 and "\n" not in str(error)
            said.add(str(error).partition(":")[0])
        else:
            assert all(n < len(the_map.node_list) for edge in the_map.edge_list for n in edge.nodes)
            said.add("a map")
    assert said == {"the map's bytes do not agree with the counts in its header", "the map contradicts itself", "a map"}


@pytest.mark.parametrize("part, place, value, flaw", [
    ("shared", EDGES, 50, "contradicts itself: an edge leads from node 0 to node 50 of 2;"),
    ("regions", graph_module.FIRST, 999, "contradicts itself: region 0 is 20 of 20 records from record 999 on"),
    ("regions", graph_module.COUNT, 21, "contradicts itself: region 0 is 21 of 20 records from record"),
    ("regions", 6 + graph_module.PARENT, 3, "contradicts itself: region 1 lies in region 3 of 3"),
    ("header", 7, 0, "do not agree with the counts in its header"),
    ("header", 8, 97, "do not agree with the counts in its header"),
    ("header", 9, 0, "contradicts itself: node 0 has 1 edges from edge 0 of 0 on"),
    ("header", 9, 200, "contradicts itself: its nodes have 1 of 200 edges"),
])
def test_a_map_that_contradicts_itself_is_refused(part, place, value, flaw):
    floor = Floor(rooms_in_a_row([3, 4, 2], 0.8)[0]).build()
    records = decode_records(image_of(floor.store, floor.graph))
    assert (records.used, records.region_count, records.node_count, records.edge_count) == (20, 3, 2, 1)
    if part != "header":
        getattr(records, part)[place] = value
    body = bytearray(encode_records(records)[:-4])
    if part == "header":
        body[place] = value
    with pytest.raises(MapError, match=flaw):
        decode_map(summed(body))


@pytest.mark.parametrize("nodes, edges", [(5, 0), (0, 1)])
def test_ways_without_regions_are_refused(nodes, edges):
    body = bytearray(image_of(Floor([(0, 0), (4, 0), (4, 3)]).store, graph_module.RegionGraph())[:-4])
    body[8:10] = nodes, edges
    with pytest.raises(MapError, match="%d turning nodes and %d edges in no region" % (nodes, edges)):
        decode_map(summed(body))


def test_more_nodes_than_a_map_has_are_refused():
    records = Records(1, 1, 1, 97, 0)
    records.counts[0] = 1
    with pytest.raises(MapError, match="97 turning nodes, and no map has more than 96"):
        decode_map(encode_records(records))


def test_it_begins_again_wherever_it_was_left():
    floor = Floor(rooms_in_a_row([3, 4, 2], 0.8)[0]).build()
    whole = image_of(floor.store, floor.graph)
    image = image_module.MapImage(floor.store, floor.graph, crumbs_module.Breadcrumbs())
    for left_after in range(120):
        image.begin()
        image.step(left_after)
        image.begin()
        work_for(image)
        assert bytes(image.byte(i) for i in range(image.size)) == whole, left_after


def test_it_may_be_asked_for_at_any_time_and_disturbs_nobody():
    floor = Floor(rooms_in_a_row([3, 4, 2], 0.8)[0])
    crumbs = crumbs_module.Breadcrumbs()
    crumbs.turns[5] = 77
    image = image_module.MapImage(floor.store, floor.graph, crumbs)
    image.begin()
    work_for(image)
    plain = bytes(image.byte(i) for i in range(image.size))
    assert crumbs.turns[5] == 77  # while they are in use
    floor.partition.begin()
    floor.partition.step()  # the regions' places are taken now
    regions = list(floor.graph.regions)
    assert bytes(image.byte(i) for i in range(image.size)) == plain and list(floor.graph.regions) == regions


def test_the_map_of_458_vectors_is_as_small_as_it_must_be():
    outline, barriers, _ = plan(SHIPPED / "office_458.json")
    floor = Floor(outline, barriers).build()
    v, g = floor.store, floor.graph
    assert v.used == 458 and g.ready and not g.lost
    ram = 6 * v.used + 4 * v.chains + 12 * g.region_count + 6 * g.node_count + 2 * g.edge_count
    data = image_of(v, g)
    assert ram < 3700 and len(data) < 1000, (ram, len(data))
    assert held(decode_records(data), decode_records(data)) == held(v, g) and len(data) > HEADER_BYTES
