# The grid ray caster, clearance and wall counting, each against shapely.

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import LineString, Point

from sim_device.home import load_home
from sim_device.world import Nearby, WallCounter, World, distance2
from tests.sim_device.random_homes import drawn_home, hall, homes, place_in

SEEDS = st.integers(0, 2**32 - 1)


def oracle_ray(home, x, y, angle, max_m):
    beam = LineString([(x, y), (x + max_m * math.cos(angle), y + max_m * math.sin(angle))])
    hit = beam.intersection(home.free.boundary)
    return max_m if hit.is_empty else hit.distance(Point(x, y))


def expect_rays_like_shapely(home, seed, count):
    world = World(home)
    rng = random.Random(seed)
    for _ in range(count):
        x, y = place_in(home, rng)
        angle = rng.choice([rng.uniform(-math.pi, math.pi), rng.randrange(8) * math.pi / 4])
        max_m = rng.choice([0.3, 3.0, 40.0])
        got = world.ray(x, y, math.cos(angle), math.sin(angle), max_m)
        assert got == pytest.approx(oracle_ray(home, x, y, angle, max_m), abs=1e-6), (home.name, x, y, angle, max_m)
        assert (world.hit >= 0) == (got < max_m)


@given(homes(), SEEDS)
def test_a_ray_ends_where_shapely_says(home, seed):
    expect_rays_like_shapely(home, seed, 20)


@pytest.mark.parametrize("name", ["rmf_office", "giraff_a", "vac_corridor_29m", "tb3_house"])
def test_rays_in_real_homes(real_homes, name):
    expect_rays_like_shapely(load_home(real_homes / f"{name}.json"), 7, 200)


@given(homes(), SEEDS)
def test_a_ray_aimed_at_a_corner_never_slips_between_two_walls(home, seed):
    world = World(home)
    x, y = place_in(home, random.Random(seed))
    inside = home.free.buffer(1e-6)
    for cx, cy in (point for ring in home.rings for point in ring):
        distance = math.hypot(cx - x, cy - y)
        cos, sin = (cx - x) / distance, (cy - y) / distance
        reach = world.ray(x, y, cos, sin, 40.0)
        assert reach < 40.0
        assert inside.covers(LineString([(x, y), (x + reach * cos, y + reach * sin)]))


def test_the_segment_hit_is_the_wall_in_front():
    world = World(hall(4, 3, (1, 1)))
    for cos, sin, distance, segment in ((1, 0, 3, 1), (-1, 0, 1, 3), (0, 1, 2, 2), (0, -1, 1, 0)):
        assert world.ray(1, 1, cos, sin, 9) == pytest.approx(distance)
        assert world.hit == segment
    assert world.ray(1, 1, 1, 0, 2.5) == 2.5
    assert world.hit == -1


@given(homes(), SEEDS)
def test_clearance_is_the_distance_to_the_border(home, seed):
    world = World(home)
    rng = random.Random(seed)
    for _ in range(10):
        x, y = place_in(home, rng)
        limit = rng.choice([0.2, 0.5, 5.0])
        assert world.clearance(x, y, limit) == pytest.approx(min(limit, home.free.boundary.distance(Point(x, y))), abs=1e-9)


@given(homes(), SEEDS)
def test_nearby_misses_no_segment_in_reach_along_a_walk(home, seed):
    world = World(home)
    nearby = Nearby(world, 0.5)
    rng = random.Random(seed)
    x, y = home.start
    for _ in range(60):
        x += rng.uniform(-0.05, 0.05)
        y += rng.uniform(-0.05, 0.05)
        wanted = {s[5] for s in world.segments if distance2(s, x, y) <= 0.25}
        assert wanted <= {s[5] for s in nearby.at(x, y)}


def walls_between(home, here, there):
    """Stretches of the line of sight outside the free space."""
    outside = LineString([here, there]).difference(home.free)
    return sum(part.length > 1e-7 for part in getattr(outside, "geoms", [outside]))


@given(homes(), SEEDS)
def test_walls_are_the_stretches_outside_the_free_space(home, seed):
    rng = random.Random(seed)
    there = [place_in(home, rng) for _ in range(6)]
    counter = WallCounter(home, there)
    for _ in range(6):
        here = place_in(home, rng)
        crossings = counter.crossings(*here)
        assert [int(n) for n in crossings] == [2 * walls_between(home, here, point) for point in there]


@given(SEEDS, SEEDS)
def test_a_corner_is_not_behind_its_own_walls(home_seed, seed):
    home = drawn_home(home_seed)
    counter = WallCounter(home, home.outline)
    here = place_in(home, random.Random(seed))
    walls = (counter.crossings(*here) + 1) // 2
    assert [int(n) for n in walls] == [walls_between(home, here, corner) for corner in home.outline]
