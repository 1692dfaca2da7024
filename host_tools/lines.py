"""Lengths of line work near other line work, measured by samples of 1 cm.

Samples carry their share of the length as weight, distances are exact (shapely's index),
so a share is right to 1 cm for each place where it changes.
"""

import numpy as np
import shapely

SAMPLE_M = 0.01


def ring_segments(ring):
    """(n, 4) segments of an implicitly closed ring of vertices."""
    xy = np.asarray(ring, float)
    return np.hstack([xy, np.roll(xy, -1, axis=0)])


def sample(segments):
    """Midpoints of pieces of at most 1 cm, and the length of each piece."""
    segments = np.asarray(segments, float).reshape(-1, 4)
    length = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
    segments, length = segments[length > 0], length[length > 0]
    count = np.ceil(length / SAMPLE_M - 1e-9).astype(int)
    which = np.repeat(np.arange(len(length)), count)
    order = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    t = ((order + 0.5) / count[which])[:, None]
    return segments[which, :2] * (1 - t) + segments[which, 2:] * t, (length / np.maximum(count, 1))[which]


def distances(points, segments):
    """Distance of each point to the nearest segment; infinite where there is none."""
    if not len(segments):
        return np.full(len(points), np.inf)
    if not len(points):
        return np.zeros(0)
    tree = shapely.STRtree(shapely.linestrings(np.asarray(segments, float).reshape(-1, 2, 2)))
    (index, _), found = tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)
    result = np.empty(len(points))
    result[index] = found
    return result


def share(weights, mask):
    """Share of the length where mask holds; None where there is no length at all."""
    total = float(np.sum(weights))
    return float(np.sum(weights[mask])) / total if total > 0 else None


def weighted_percentile(values, weights, percent):
    """Smallest value that at least `percent` of the weight does not exceed."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, reached[-1] * percent / 100.0 * (1 - 1e-12))])
