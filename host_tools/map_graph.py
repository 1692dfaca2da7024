"""The regions, turning nodes and edges of map.bin, in metres; firmware_py/storage/region_graph.py says what their fields mean."""

from dataclasses import dataclass

import numpy as np
from shapely import MultiPolygon, Polygon
from shapely.ops import unary_union

REGION = np.dtype([("first", "<u2"), ("count", "<u2"), ("area_dm2", "<u2"), ("x", "<i2"), ("y", "<i2"), ("long", "u1"), ("short", "u1"),
                   ("parent", "u1"), ("flags", "u1"), ("change_rate", "u1"), ("times", "u1")])
NODE = np.dtype([("x", "<i2"), ("y", "<i2"), ("first_edge", "u1"), ("edges", "u1")])
EDGE = np.dtype([("to", "u1"), ("region", "u1"), ("cost_cm", "<u2")])
TABLES = (REGION, NODE, EDGE)
FLAG_GATE_FIRST = 1
UNIT_M = 0.005


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


def regions(rows, xy, rings):
    """`xy`: every record in metres, n x 2; `rings`: lists of records, the outline's first, then one a barrier."""
    borders, gates = [], []
    for number, row in enumerate(rows):
        ring = next((ring for ring in rings if row["first"] in ring), [])
        at = ring.index(row["first"]) if ring else 0
        border = [tuple(xy[ring[(at + k) % len(ring)]]) for k in range(row["count"])] if ring else []
        gate = None
        if number and border:
            end = border[0] if row["flags"] & FLAG_GATE_FIRST else border[-1]
            gate = (end, (2 * row["x"] * UNIT_M - end[0], 2 * row["y"] * UNIT_M - end[1]))
            border = [*border, gate[1]]
        borders.append(Polygon(border).buffer(0) if len(border) > 2 else Polygon())
        gates.append(gate)
    found = []
    for number, row in enumerate(rows):
        inner = [borders[k] for k in range(1, len(rows)) if k != number and rows[k]["parent"] == number]
        polygon = borders[number].difference(unary_union(inner)) if inner else borders[number]
        found.append(Region(number, int(row["parent"]), gates[number], row["area_dm2"] / 100, int(row["long"]), int(row["short"]),
                            _largest(polygon), (int(row["first"]), int(row["count"]))))
    return found


def _largest(shape):
    """Rounding leaves slivers at the gates."""
    return max(shape.geoms, key=lambda part: part.area) if isinstance(shape, MultiPolygon) else shape


def edges(nodes, rows):
    return [Edge((number, int(row["to"])), int(row["region"]), int(row["cost_cm"]))
            for number, node in enumerate(nodes) for row in rows[node["first_edge"]:node["first_edge"] + node["edges"]]]
