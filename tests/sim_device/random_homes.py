# Homes drawn by a seed: a star-shaped outline with slanted walls, spikes and
# niches, and small obstacles that stand free. Written as a file and loaded by
# load_home, so every drawn home passes the product's own checks.

import json
import math
import random
import tempfile
from pathlib import Path

from hypothesis import strategies as st
from shapely.geometry import Point, Polygon

from sim_device.home import load_home


def home_of(outline, obstacles=(), rooms=(), start=(0.0, 0.0), name="drawn"):
    """A loaded home from bare polygons."""
    data = {"name": name, "units": "m", "outline": outline, "obstacles": list(obstacles), "start": list(start),
            "rooms": [{"name": f"room {i}", "centre": list(c), "polygon": []} for i, c in enumerate(rooms)]}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "home.json"
        path.write_text(json.dumps(data))
        return load_home(path)


def hall(width, height, start, obstacles=(), rooms=()):
    """A rectangular hall with its lower left corner at the origin."""
    return home_of([[0, 0], [width, 0], [width, height], [0, height]], obstacles, rooms, start)


def _star(rng, x, y, corners, least, most):
    turns = sorted((i + rng.uniform(0, 0.9)) / corners for i in range(corners))
    return [[round(x + r * math.cos(2 * math.pi * t), 3), round(y + r * math.sin(2 * math.pi * t), 3)]
            for t in turns for r in (rng.uniform(least, most),)]


def drawn_home(seed):
    rng = random.Random(seed)
    outline = _star(rng, 0, 0, rng.randint(4, 24), 0.8, rng.uniform(1.5, 6))
    border = Polygon(outline)
    shapes = []
    for _ in range(rng.randint(0, 8)):
        spot = _star(rng, rng.uniform(-3, 3), rng.uniform(-3, 3), rng.randint(3, 7), 0.03, rng.uniform(0.05, 0.6))
        shape = Polygon(spot)
        far_from_others = all(shape.distance(other) > 0.02 for other in shapes)
        if shape.is_valid and border.contains(shape) and border.exterior.distance(shape) > 0.02 and far_from_others \
                and shape.distance(Point(0, 0)) > 0.2:
            shapes.append(shape)
    obstacles = [[list(p) for p in shape.exterior.coords[:-1]] for shape in shapes]
    return home_of(outline, obstacles, [(0.1, 0.1)], _start(outline, obstacles), f"drawn {seed}")


def _start(outline, obstacles):
    """The place with the most room near the middle; the outline leaves at least that of a thin star."""
    free = Polygon(outline, obstacles)
    spots = [Point(i * 0.1, j * 0.1) for i in range(-8, 9) for j in range(-8, 9)]
    best = max((p for p in spots if free.contains(p)), key=free.boundary.distance)
    return round(best.x, 3), round(best.y, 3)


def homes():
    return st.integers(0, 2**32 - 1).map(drawn_home)


def place_in(home, rng):
    """A random place in the free space, at least 1 mm from every wall."""
    x0, y0, x1, y1 = home.free.bounds
    while True:
        spot = Point(rng.uniform(x0, x1), rng.uniform(y0, y1))
        if home.free.contains(spot) and home.free.boundary.distance(spot) > 0.001:
            return spot.x, spot.y
