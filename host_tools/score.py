"""The map against the home's truth: precision, recall, Hausdorff, free space.

No alignment after the fact: the map's frame is the home's. The truth is the border of the
free space, outline and obstacles; only what the robot can come near to counts as missed.
"""

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Point, Polygon

from host_tools.lines import distances, ring_segments, sample, share, weighted_percentile
from host_tools.map_file import KIND_BARRIER, KIND_OUTLINE

REACH_RADIUS_M = 0.18  # the robot has 0.17 m: what only a perfect squeeze reaches is not asked for
NEAR_M = 0.05
ARC_SEGMENTS = 32  # per quarter turn: a chord error below 0.1 mm at 0.23 m


# What the home asks of a map: its walls in 1 cm samples, which of them are reachable,
# and the area that the robot can sweep. Made once a home; holds no reference to a map.
class HomeTruth:
    def __init__(self, home):
        self.outer = ring_segments(home.outline)
        islands = [ring_segments(ring) for ring in obstacle_rings(home)]
        self.islands = np.vstack(islands) if islands else np.zeros((0, 4))
        self.walls = np.vstack([self.outer, self.islands])
        self.free = Polygon(home.outline, obstacle_rings(home))
        self.start = Point(home.start)
        self.centres = component(self.free.buffer(-REACH_RADIUS_M, quad_segs=ARC_SEGMENTS), self.start)
        self.swept = self.centres.buffer(REACH_RADIUS_M, quad_segs=ARC_SEGMENTS).intersection(self.free)
        self.outer_points, self.outer_weights = self._reachable(self.outer)
        self.island_points, self.island_weights = self._reachable(self.islands)

    def _reachable(self, segments):
        """Samples of the wall within 0.18 m + 0.05 m of where the disc's centre can be."""
        points, weights = sample(segments)
        if not len(points):
            return points, weights
        shapely.prepare(self.centres)
        near = shapely.dwithin(self.centres, shapely.points(points), REACH_RADIUS_M + NEAR_M)
        return points[near], weights[near]


def obstacle_rings(home):
    """The inside barriers as rings of vertices."""
    return [[tuple(vertex) for vertex in ring] for ring in home.obstacles]


def component(region, start):
    """The connected part that holds the start, or comes nearest to it."""
    parts = [part for part in shapely.get_parts(region) if not part.is_empty]
    return min(parts, key=lambda part: part.distance(start)) if parts else Polygon()


def score_map(truth, vector_map):
    """The figures of the result file's "map" that compare with the truth; None where undefined."""
    every, outline = vector_map.vectors(), vector_map.vectors(KIND_OUTLINE)
    reach_points = np.vstack([truth.outer_points, truth.island_points])
    reach_weights = np.concatenate([truth.outer_weights, truth.island_weights])
    to_truth, mapped_weights = _from_map(every, truth.walls)
    to_map = distances(reach_points, every)
    outline_to_truth, outline_weights = _from_map(outline, truth.outer)
    outline_to_map = distances(truth.outer_points, outline)
    return {
        "precision_5cm": share(mapped_weights, to_truth <= NEAR_M),
        "recall_5cm": share(reach_weights, to_map <= NEAR_M),
        "outline_precision_5cm": share(outline_weights, outline_to_truth <= NEAR_M),
        "outline_recall_5cm": share(truth.outer_weights, outline_to_map <= NEAR_M),
        "hausdorff_p95_cm": _hausdorff_cm(to_truth, mapped_weights, to_map, reach_weights),
        "iou_free": iou_free(truth, vector_map),
    }


def _from_map(vectors, walls):
    points, weights = sample(vectors)
    return distances(points, walls), weights


def _hausdorff_cm(to_truth, mapped_weights, to_map, reach_weights):
    """The worse of the two directions, each the 95th percentile by length."""
    if not len(to_truth) or not len(to_map):
        return None
    worst = max(weighted_percentile(to_truth, mapped_weights, 95), weighted_percentile(to_map, reach_weights, 95))
    return 100.0 * worst


def iou_free(truth, vector_map):
    """Free space enclosed by the map against the home's, both within the area that the robot sweeps."""
    mapped = enclosed_area(vector_map)
    if mapped is None:
        return None
    mapped, free = mapped.intersection(truth.swept), truth.free.intersection(truth.swept)
    union = mapped.union(free).area
    return mapped.intersection(free).area / union if union > 0 else None


def enclosed_area(vector_map):
    """The area inside the outline's chains, joined in their order to one ring, less the closed barriers."""
    chains = [chain.xy for chain in vector_map.chains if chain.kind == KIND_OUTLINE]
    ring = np.vstack(chains) if chains else np.zeros((0, 2))
    if len(ring) < 3:
        return None
    area = _ring_area(ring)
    for chain in vector_map.chains:
        if chain.kind == KIND_BARRIER and chain.closed and len(chain.xy) >= 3:
            area = area.difference(_ring_area(chain.xy))
    return area


def _ring_area(ring):
    """The polygons that a ring winds around: a crossing of the ring with itself must not lose area."""
    closed = np.vstack([ring, ring[:1]])
    if MultiPoint(ring).convex_hull.area == 0:
        return Polygon()
    polygon = Polygon(ring)
    if polygon.is_valid:
        return polygon
    # Snapped to the 0.01 mm: noding without a grid gives up on almost collinear pieces.
    pieces = shapely.linestrings(np.hstack([closed[:-1], closed[1:]]).reshape(-1, 2, 2))
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(pieces, grid_size=1e-5)]))
    inside = [face for face in faces if _winding(face.representative_point(), closed) != 0]
    return shapely.union_all(inside) if inside else Polygon()


def _winding(point, closed):
    angle = np.arctan2(closed[:, 1] - point.y, closed[:, 0] - point.x)
    turns = np.diff(angle)
    return round(float(np.sum((turns + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi)))
