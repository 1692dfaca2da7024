"""Homes and maps small enough to work out by hand."""

from types import SimpleNamespace

import numpy as np

from host_tools.map_file import KIND_OUTLINE, Chain, VectorMap


def home(outline, obstacles=(), start=None, rooms=("room",)):
    outline = [tuple(map(float, vertex)) for vertex in outline]
    start = start or tuple(np.mean(outline, axis=0))
    return SimpleNamespace(name="by hand", outline=outline, obstacles=[list(ring) for ring in obstacles], start=start, rooms=rooms)


def rectangle(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def chain(vertices, kind=KIND_OUTLINE, closed=True, sigma_mm=3, region=0):
    xy = np.array(vertices, float)
    return Chain(kind, False, region, xy, np.full(len(xy), sigma_mm, np.uint8), np.zeros(len(xy), np.uint8), closed)


def vector_map(*chains, **counts):
    return VectorMap(list(chains), **counts)
