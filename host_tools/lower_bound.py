"""The robot time that no mission of this kind undercuts, for the ratio in the result.

(contours of outline and islands at 0.20 m from the walls, as a disc rolls them
 + a minimum tree that connects them and the start
 + swept area / lane spacing, where lanes are driven) / v  +  the turns of the contours / omega
"""

import networkx
import numpy as np
import shapely
from shapely.geometry import LineString

from host_tools.score import ARC_SEGMENTS

CONTOUR_M = 0.20
LANE_M = 0.75


def lower_bound_s(truth, speed_m_s, turn_rad_s, lanes=False):
    """None for a home in which the disc cannot follow any wall."""
    contours = rolled_contours(truth)
    if not contours:
        return None
    length = sum(contour.length for contour in contours) + connecting_tree_m([truth.start] + contours)
    if lanes:
        length += truth.swept.area / LANE_M
    return length / speed_m_s + sum(turns_rad(contour) for contour in contours) / turn_rad_s


def rolled_contours(truth):
    """The rings on which a disc's centre goes that keeps 0.20 m from the walls, within the reachable region.

    A passage of 0.36 to 0.40 m joins the region but not the contours: each part then counts for itself.
    """
    parts = shapely.get_parts(truth.free.buffer(-CONTOUR_M, quad_segs=ARC_SEGMENTS))
    reached = [part for part in parts if not part.is_empty and part.intersects(truth.centres)]
    return [LineString(ring.coords) for part in reached for ring in [part.exterior, *part.interiors]]


def connecting_tree_m(places):
    """Length of the minimum spanning tree over the straight distances between the places."""
    graph = networkx.Graph()
    graph.add_nodes_from(range(len(places)))
    for i, place in enumerate(places):
        for j in range(i):
            graph.add_edge(i, j, weight=place.distance(places[j]))
    return sum(data["weight"] for _, _, data in networkx.minimum_spanning_edges(graph, data=True))


def turns_rad(ring):
    """Sum of the absolute turns on the way once round."""
    xy = np.asarray(ring.coords)[:-1]
    step = np.roll(xy, -1, axis=0) - xy
    step = step[np.hypot(step[:, 0], step[:, 1]) > 1e-9]
    heading = np.arctan2(step[:, 1], step[:, 0])
    turn = np.roll(heading, -1) - heading
    return float(np.sum(np.abs((turn + np.pi) % (2 * np.pi) - np.pi)))
