"""The regions, turning nodes and edges of map.bin, in metres; firmware_py/storage/region_graph.py says what their fields mean."""

import math
from dataclasses import dataclass

from shapely import MultiPolygon, Polygon
from shapely.ops import unary_union

from protocol.map_code import ABOUT, EDGES

FIRST, COUNT, AREA, LINES, PARENT = range(5)  # places of six
FLAG_GATE_FIRST = 256
UNIT_M = 0.005
NODES_MAX = EDGES - ABOUT


@dataclass
class Region:
    number: int
    parent: int
    gate: object            # ((x, y), (x, y)) or None: region 0 is all that no other one is
    area_m2: float          # of the free floor, as the core states it
    long: int               # vectors of at least 1 m, and shorter ones
    short: int
    polygon: object         # shapely: within its border, less the regions cut off it; barriers are not taken out
    range: tuple            # first record, count


@dataclass
class Edge:
    nodes: tuple            # numbers
    region: int
    cost_cm: int


def flaw(records):
    """What cannot be, in words; "" for a graph that holds together."""
    here, there = records.node_count, records.region_count
    if here > NODES_MAX:
        return "%d turning nodes, and no map has more than %d" % (here, NODES_MAX)
    if (here or records.edge_count) and not there:
        return "%d turning nodes and %d edges in no region" % (here, records.edge_count)
    for r in range(there):
        first, count, parent = (records.regions[6 * r + place] for place in (FIRST, COUNT, PARENT))
        if first >= records.used or count > records.used:
            return "region %d is %d of %d records from record %d on" % (r, count, records.used, first)
        if parent & 255 >= there:
            return "region %d lies in region %d of %d" % (r, parent & 255, there)
    told = 0
    for n in range(here):
        first, many = records.shared[ABOUT + n] & 255, records.shared[ABOUT + n] >> 8
        if first != told or told + many > records.edge_count:
            return "node %d has %d edges from edge %d of %d on" % (n, many, first, records.edge_count)
        told += many
        for row in records.shared[EDGES + first:EDGES + first + many]:
            if not n < row & 255 < here:
                return "an edge leads from node %d to node %d of %d" % (n, row & 255, here)
    return "" if told == records.edge_count else "its nodes have %d of %d edges" % (told, records.edge_count)


def regions(records, xy, rings, places):
    """`xy`: every record in metres, n x 2; `rings`: lists of records, the outline's first, then one a barrier; `places`: of the nodes."""
    rows = [records.regions[6 * r:6 * r + 6] for r in range(records.region_count)]
    borders, gates = [], []
    for number, row in enumerate(rows):
        ring = next((ring for ring in rings if row[FIRST] in ring), [])
        at = ring.index(row[FIRST]) if ring else 0
        border = [tuple(xy[ring[(at + k) % len(ring)]]) for k in range(row[COUNT])] if ring else []
        gate = None
        if 0 < number <= len(places) and border:
            x, y = places[number - 1]
            end = border[0] if row[PARENT] & FLAG_GATE_FIRST else border[-1]
            gate = (end, (2 * x - end[0], 2 * y - end[1]))
            border = [*border, gate[1]]
        borders.append(Polygon(border).buffer(0) if len(border) > 2 else Polygon())
        gates.append(gate)
    found = []
    for number, row in enumerate(rows):
        inner = [borders[k] for k in range(1, len(rows)) if k != number and rows[k][PARENT] & 255 == number]
        polygon = borders[number].difference(unary_union(inner)) if inner else borders[number]
        found.append(Region(number, row[PARENT] & 255, gates[number], row[AREA] / 100, row[LINES] & 255, row[LINES] >> 8,
                            _largest(polygon), (row[FIRST], row[COUNT])))
    return found


def _largest(shape):
    """Rounding leaves slivers at the gates."""
    return max(shape.geoms, key=lambda part: part.area) if isinstance(shape, MultiPolygon) else shape


def nodes(records):
    """[(x, y)] in metres"""
    return [tuple(((c ^ 32768) - 32768) * UNIT_M for c in records.shared[2 * n:2 * n + 2]) for n in range(records.node_count)]


def edges(records, places):
    found = []
    for number, here in enumerate(places):
        about = records.shared[ABOUT + number]
        for row in records.shared[EDGES + (about & 255):EDGES + (about & 255) + (about >> 8)]:
            # the core's cost: its length in cm, in whole map units, never less than it is
            units = (round((a - b) / UNIT_M) for a, b in zip(here, places[row & 255], strict=True))
            found.append(Edge((number, row & 255), row >> 8, (math.isqrt(sum(d * d for d in units)) + 2) >> 1))
    return found
