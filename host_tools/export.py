"""The files of --out. Those written here are replaced, others in the folder are left alone."""

import json
import math
import os

from host_tools.result import tum_rows
from host_tools.picture import draw_mission
from host_tools.whole_file import whole_file, write_result

FILES = ("map.geojson", "map.bin", "map.png", "estimate.tum", "truth.tum", "result.json")


def write_all(folder, home, mission, vector_map, result):
    """Write what there is; returns sentences about files that there is nothing for."""
    notes = []
    for name in FILES:  # a file of an earlier mission must not pass for one of this
        path = os.path.join(folder, name)
        if os.path.lexists(path):
            os.unlink(path)
    if mission is not None:
        estimate, truth = tum_rows(mission)
        _write_text(folder, "estimate.tum", tum(estimate))
        _write_text(folder, "truth.tum", tum(truth))
        notes += _pictures(folder, home, mission, vector_map, result)
    if vector_map is not None:
        _write_text(folder, "map.geojson", json.dumps(geojson(vector_map, home.name), indent=1) + "\n")
        with whole_file(os.path.join(folder, "map.bin")) as beside, open(beside, "wb") as file:
            file.write(mission.map_bytes)
    write_result(os.path.join(folder, "result.json"), result)
    return notes


def geojson(vector_map, name):
    """Local metres, x right and y up: not longitude and latitude."""
    features = []
    for number, chain in enumerate(vector_map.chains):
        for order, (x0, y0, x1, y1) in enumerate(chain.vectors()):
            features.append({
                "type": "Feature",
                "geometry": {"type": "LineString", "coordinates": [_point(x0, y0), _point(x1, y1)]},
                "properties": {"kind": chain.kind_name, "chain": number, "order": order,
                               "sigma_mm": int(chain.sigma_mm[order]), "region": chain.region}})
    features += _graph_features(vector_map)
    return {"type": "FeatureCollection", "name": name, "coordinate_system": "local metres, x right, y up", "features": features}


def _graph_features(vector_map):
    """Regions as polygons, turning nodes as points, edges as lines from node to node."""
    for region in vector_map.region_list:
        if not region.polygon.is_empty:
            rings = [region.polygon.exterior, *region.polygon.interiors]
            yield {"type": "Feature",
                   "geometry": {"type": "Polygon", "coordinates": [[_point(*place) for place in ring.coords] for ring in rings]},
                   "properties": {"kind": "region", "region": region.number, "parent": region.parent if region.number else None,
                                  "area_m2": region.area_m2, "long": region.long, "short": region.short,
                                  "first": region.range[0], "count": region.range[1],
                                  "gate": [_point(*place) for place in region.gate] if region.gate else None}}
    for number, place in enumerate(vector_map.node_list):
        yield {"type": "Feature", "geometry": {"type": "Point", "coordinates": _point(*place)},
               "properties": {"kind": "node", "node": number}}
    for edge in vector_map.edge_list:
        yield {"type": "Feature",
               "geometry": {"type": "LineString", "coordinates": [_point(*vector_map.node_list[n]) for n in edge.nodes]},
               "properties": {"kind": "edge", "nodes": list(edge.nodes), "region": edge.region, "cost_cm": edge.cost_cm}}


def _point(x, y):
    return [round(float(x), 3), round(float(y), 3)]


def tum(rows):
    """t x y z qx qy qz qw, a line a row of (t_s, x_m, y_m, heading_rad)."""
    lines = ["%.2f %.6f %.6f 0 0 0 %.9f %.9f\n" % (t, x, y, math.sin(heading / 2), math.cos(heading / 2))
             for t, x, y, heading in rows]
    return "".join(lines)


def _pictures(folder, home, mission, vector_map, result):
    try:
        with whole_file(os.path.join(folder, "map.png")) as beside:
            draw_mission(beside, home, mission, vector_map, result)
    except ImportError:
        return ["map.png was left out: matplotlib is not installed; pip install 'tvslam[plot]' gets it."]
    return []


def _write_text(folder, name, text):
    with whole_file(os.path.join(folder, name)) as beside, open(beside, "w", encoding="utf-8") as file:
        file.write(text)
