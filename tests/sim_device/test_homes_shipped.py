# The homes that the project ships: true to their plans, legal, and what their names promise.

import json
import math

import pytest
from shapely.geometry import Point, Polygon

from sim_device.home import HOMES, home_names, load_home
from sim_device.homes.draw import PlanError, as_text, check
from sim_device.homes.plans import PLANS

NAMES = ("fig3_barriers", "flat", "office_458", "slanted_house", "studio")
KEYS = {
    "name", "source", "licence", "units", "outline", "obstacles", "rooms", "segments_total", "start", "has_furniture",
    "free_area_m2", "reach_area_m2", "bbox_m", "rooms_source", "provenance", "conversion", "notes",
}


def read(name):
    return json.loads((HOMES / (name + ".json")).read_text())


def free_of(home):
    return Polygon(home["outline"], home["obstacles"])


def test_all_are_there():
    assert set(NAMES) <= set(home_names())


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: plan.__name__)
def test_a_file_is_what_its_plan_draws(plan):
    home = plan().home()
    assert (HOMES / (home["name"] + ".json")).read_text() == as_text(home), "stale: run `python -m sim_device.homes`"


@pytest.mark.parametrize("name", NAMES)
def test_a_home_keeps_the_rules_of_the_format(name):
    home = read(name)
    assert KEYS <= set(home) and home["name"] == name and home["units"] == "m" and home["licence"] == "MIT"
    outline, free = Polygon(home["outline"]), free_of(home)
    assert free.is_valid and math.isclose(free.area, home["free_area_m2"], abs_tol=0.01)
    rings = [home["outline"], *home["obstacles"]]
    assert home["segments_total"] == sum(map(len, rings))
    for ring in rings:
        assert Polygon(ring).exterior.is_ccw
        assert all(math.dist(ring[i - 1], ring[i]) >= 0.02 for i in range(len(ring)))
        assert all(round(v, 3) == v for point in ring for v in point)
    for i, ring in enumerate(home["obstacles"]):
        assert outline.contains_properly(Polygon(ring))
        assert all(Polygon(ring).disjoint(Polygon(other)) for other in home["obstacles"][:i])
    region = free.buffer(-0.17)
    assert region.geom_type == "Polygon" and region.contains(Point(home["start"]))
    for room in home["rooms"]:
        assert region.contains(Point(room["centre"])) and Polygon(room["polygon"]).contains(Point(room["centre"]))


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_that_keeps_3_cm_off_reaches_every_room(name):
    home = read(name)
    region = free_of(home).buffer(-0.20)
    main = max(getattr(region, "geoms", [region]), key=lambda part: part.area)
    assert main.contains(Point(home["start"]))
    assert all(main.intersects(Polygon(room["polygon"])) for room in home["rooms"])


@pytest.mark.parametrize("name", NAMES)
def test_the_program_takes_its_own_homes(name):
    assert load_home(name).name == name


def test_what_the_names_promise():
    flat, slanted, barriers = read("flat"), read("slanted_house"), read("fig3_barriers")
    assert len(flat["rooms"]) == 5 and flat["has_furniture"] and len(flat["obstacles"]) >= 10
    assert sorted(len(ring) for ring in barriers["obstacles"]) == [3, 4, 6, 32]
    askew = 0.0
    for ring in [slanted["outline"], *slanted["obstacles"]]:
        for i, (x, y) in enumerate(ring):
            turn = math.degrees(math.atan2(y - ring[i - 1][1], x - ring[i - 1][0])) % 90
            askew += math.dist(ring[i - 1], (x, y)) if 5 < turn < 85 else 0
    assert askew > 25


@pytest.mark.parametrize("spoil, rule", [
    (lambda h: h["obstacles"][0].reverse(), "clockwise"),
    (lambda h: h["obstacles"].append([[0.1, 0.1], [0.11, 0.1], [0.11, 0.11]]), "under 2 cm"),
    (lambda h: h["obstacles"].append([[-1, 1], [1, 1], [1, 2]]), "obstacle"),
    (lambda h: h.update(start=[0.1, 0.1]), "start"),
    (lambda h: h["obstacles"].append([[3.0, 0.1], [3.4, 0.1], [3.4, 5.1], [3.0, 5.1]]), "2 pieces"),
])
def test_the_check_of_plans_finds_what_it_is_for(spoil, rule):
    home = read("fig3_barriers")
    spoil(home)
    with pytest.raises(PlanError, match=rule):
        check(home)
