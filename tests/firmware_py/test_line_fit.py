# The running-sum line fit against numpy's, up to the wall of 30 m on which the sums
# would pass 2**30 if they were not in the wall's own frame. Every number is watched.

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

LineFit = watched("firmware_py.building.line_fit").LineFit


def fitted(points):
    line = LineFit()
    line.begin(*points[0])
    assert all([line.add(x, y) for x, y in points[1:]])
    line.solve()
    return line


def wall(length_mm, bearing, noise_mm, seed, x=0, y=0, spacing_mm=20):
    """Samples of one wall as the mapper gives them: 2 cm apart, 4 cm after the first 200; with the walls' true sigma."""
    rng = np.random.default_rng(seed)
    along, u = [0.0], 0.0
    while u < length_mm:
        u += spacing_mm if len(along) < 200 else 2 * spacing_mm
        along.append(u)
    across = rng.normal(0, noise_mm, len(along))
    across[0] = 0
    return [(round(x + a * math.cos(bearing) - b * math.sin(bearing)), round(y + a * math.sin(bearing) + b * math.cos(bearing)))
            for a, b in zip(along, across)]  # fmt: skip


WALLS = {
    "length_mm": st.integers(300, 30000), "bearing": st.floats(0, math.tau), "noise_mm": st.floats(0, 2), "seed": st.integers(0, 999),
    "x": st.integers(-100_000, 100_000), "y": st.integers(-100_000, 100_000),
}  # fmt: skip


@given(st.fixed_dictionaries(WALLS))
def test_it_is_the_least_squares_line(spec):
    points = wall(**spec)
    line = fitted(points)
    xy = np.array(points, float)
    mean = xy.mean(0)
    values, vectors = np.linalg.eigh(np.cov((xy - mean).T, bias=True))
    direction, normal = vectors[:, 1], vectors[:, 0]
    # its two ends lie on numpy's line, to the millimetres that the coordinates have
    for end in (points[0], points[-1]):
        a = line.along(*end)
        on_line = np.array([line.point_x + a * line.cos_q14 / 16384, line.point_y + a * line.sin_q14 / 16384])
        assert abs(float((on_line - mean) @ normal)) <= 4 + spec["length_mm"] / 4000
    assert abs(abs(float(direction @ [line.cos_q14, line.sin_q14]) / 16384) - 1) < 2e-3
    assert abs(line.sigma_mm - math.sqrt(max(values[0], 0))) <= 3 + spec["length_mm"] / 8000


@given(st.fixed_dictionaries(WALLS))
def test_the_residual_is_the_signed_distance(spec):
    line = fitted(wall(**{**spec, "noise_mm": 0}))
    bearing = spec["bearing"]
    for across in (-500, -50, 50, 500):
        x = round(spec["x"] - across * math.sin(bearing))
        y = round(spec["y"] + across * math.cos(bearing))
        assert abs(line.residual(x, y) - across) <= 4 + spec["length_mm"] / 4000


@given(st.lists(st.tuples(st.integers(-(2**20), 2**20), st.integers(-(2**20), 2**20)), min_size=1, max_size=60))
def test_any_points_are_fitted_or_refused(points):
    line = LineFit()
    line.begin(*points[0])
    for x, y in points[1:]:
        n = line.n
        taken = line.add(x, y)
        assert line.n == n + taken
        line.solve()
        line.residual(x, y)
        line.along(x, y)


def test_a_line_is_full_at_a_thousand_samples():
    line = LineFit()
    line.begin(0, 0)
    assert sum(line.add(i * 20, i % 3) for i in range(1, 1500)) == 999 and line.n == 1000
