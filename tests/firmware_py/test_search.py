# The search for what stands inside, with a robot that drives as it is told: everything is looked at, and it ends.

import math

import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.firmware_py.floor_plans import Floor
from tests.firmware_py.watched import watched
from tests.strategies import examples

search_module, barriers_module, traveller = watched(
    "firmware_py.collection.search", "firmware_py.storage.barrier_list", "firmware_py.collection.traveller")
BEAMS_M = 0.4   # seen on either side, in the mean
LEG_M = 0.05    # of a table
WALLS_M = st.integers(5, 40).map(lambda n: n / 4)
STEPS_MAX = 20000


class Robot:
    """Goes straight to where it is sent, and tells the search where it is on the way; `refuse`: targets that it does not reach."""

    def __init__(self, floor, x, y, sweep=True, refuse=lambda x, y: False):
        self.search = search_module.Search(floor.store, floor.sight, barriers_module.BarrierList(), floor.way, floor.graph.shared)
        self.search.sweep = sweep
        self.x_mm, self.y_mm, self.heading_bam = round(1000 * x), round(1000 * y), 0
        self.outcome = traveller.ARRIVED
        self.mapping = False
        self.refuse = refuse
        self.driven = [(x, y)]
        self.walls = []       # the targets that were said to be walls
        self.asked = []       # each target of the search, once for all the corners on the way there
        self.halted = 0
        self.states = set()

    def go_to(self, x_mm, y_mm, wall, state):
        self.states.add(state)
        target = self.search.x_mm / 1000, self.search.y_mm / 1000
        if target not in self.asked[-1:]:
            self.asked.append(target)
        if wall:
            self.walls.append((x_mm / 1000, y_mm / 1000))
        if self.refuse(x_mm / 1000, y_mm / 1000):
            self.outcome = traveller.LOST
            return
        dx, dy = x_mm - self.x_mm, y_mm - self.y_mm
        steps = max(1, round(math.hypot(dx, dy) / 40))
        x, y = self.x_mm, self.y_mm
        self.heading_bam = round(math.atan2(dy, dx) * 32768 / math.pi) & 0xFFFF
        for k in range(1, steps + 1):
            self.x_mm, self.y_mm = x + dx * k // steps, y + dy * k // steps
            self.search.passing(self)
        self.driven.append((self.x_mm / 1000, self.y_mm / 1000))
        self.outcome = traveller.ARRIVED

    def halt(self):
        self.halted += 1

    def run(self):
        for _ in range(STEPS_MAX):
            if self.search.select(self, self):
                return self
        raise AssertionError("the search does not end")


def room(width, height, *barriers):
    return Floor([(0, 0), (width, 0), (width, height), (0, height)], barriers)


def box(x, y, w, h):
    return [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]


def seen_from(robot, beside_m=0.6):
    """What lies beside the way that was driven."""
    way = shapely.LineString(robot.driven) if len(robot.driven) > 1 else shapely.Point(robot.driven[0])
    return way.buffer(beside_m)


@settings(max_examples=examples(25))
@given(WALLS_M, WALLS_M, st.data())
def test_no_free_place_is_left_unseen(width, height, data):
    floor = room(width, height)
    x, y = data.draw(st.floats(0.3, width - 0.3)), data.draw(st.floats(0.3, height - 0.3))
    robot = Robot(floor, x, y).run()
    beside_walls = shapely.box(0, 0, width, height).exterior.buffer(0.56)  # seen by whoever mapped them
    unseen = shapely.box(0, 0, width, height) - beside_walls - seen_from(robot, BEAMS_M)
    hiding = unseen.buffer(-LEG_M / 2)
    assert hiding.area < 0.1, (robot.driven, hiding.wkt)


def test_the_lanes_are_no_longer_than_they_must_be():
    robot = Robot(room(8, 6), 0.4, 0.4).run()
    way_m = shapely.LineString(robot.driven).length
    inner_m2 = (8 - 1.1) * (6 - 1.1)
    assert way_m < 1.6 * inner_m2 / 0.75, way_m   # lanes of 0.75 m, and the turns between them


def test_behind_a_wall_it_goes_round_the_corner():
    outline = [(0, 0), (3, 0), (3, 3), (3.1, 3), (3.1, 0), (6, 0), (6, 4), (0, 4)]
    robot = Robot(Floor(outline), 0.4, 0.4).run()
    walls = shapely.LineString([(3, 0), (3, 3)])
    assert not shapely.LineString(robot.driven).intersects(walls)
    assert any(x > 4 for x, _ in robot.driven)


def test_what_stands_in_the_way_is_gone_to_the_newest_and_nearest_first():
    robot = Robot(room(8, 6), 4, 3, sweep=False)
    assert robot.run().walls == [], "nothing is known of"
    robot.search.note(2000, 3000, robot)
    robot.search.note(5000, 3000, robot)
    robot.search.note(7980, 3000, robot)   # the wall itself
    robot.run()
    assert robot.walls == [(5, 3), (2, 3)]


def test_a_hit_halts_who_is_on_his_way_to_a_place():
    robot = Robot(room(8, 6), 0.4, 0.4)
    for _ in range(200):
        robot.search.select(robot, robot)
        if robot.search.kind == search_module.PLACE:
            break
    robot.search.note(4000, 3000, robot)
    assert robot.halted == 1
    robot.mapping = True
    robot.search.kind = search_module.PLACE
    robot.search.note(6000, 3000, robot)
    assert robot.halted == 1, "who maps a barrier goes on"


def test_who_follows_a_long_barrier_forgets_the_places_of_it_that_are_on_the_map_by_now():
    floor = room(30, 20)
    robot = Robot(floor, 1, 1, sweep=False)
    robot.mapping = True
    floor.store.open_chain(1)
    for x in range(4000, 26000, 350):    # seen one by one from 70 cm behind, mapped when it passes
        robot.search.note(x + 700, 10000, robot)
        floor.store.append(x // 5, 2000, 3, 0)
        for _ in range(10):
            robot.search.note(x + 690, 10000, robot)
    barriers = robot.search.barriers
    assert barriers.lost == 0 and barriers.used < 6
    robot.search.note(15000, 5000, robot)
    assert (3000, 1000) in list(zip(barriers.xs, barriers.ys, strict=True))[:barriers.used], "what is not on the map stays"


def test_a_barrier_out_of_reach_is_tried_twice_and_the_search_ends():
    robot = Robot(room(8, 6), 4, 3, sweep=False, refuse=lambda x, y: (x, y) == (6, 3)).run()
    robot.search.note(6000, 3000, robot)
    robot.search.note(2000, 3000, robot)
    robot.run()
    assert robot.walls.count((6, 3)) == 2 and (2, 3) in robot.walls


@settings(max_examples=examples(15))
@given(st.integers(0, 7))
def test_each_place_is_tried_once_though_few_can_be_reached(k):
    robot = Robot(room(5, 4, box(2, 1.5, 0.5, 0.5)), 0.5, 0.5, refuse=lambda x, y: round(10 * x) % 8 != k).run()
    assert len(set(robot.asked)) == len(robot.asked)
    reached = [place for place in robot.asked if place in robot.driven]
    assert len(reached) < len(robot.asked) and all(round(10 * x) % 8 == k for x, _ in reached)
    looked_at = shapely.MultiPoint(robot.asked).buffer(0.6) | seen_from(robot)
    beside_walls = (shapely.box(0, 0, 5, 4).exterior | shapely.box(2, 1.5, 2.5, 2).exterior).buffer(0.56)
    unseen = shapely.box(0, 0, 5, 4) - shapely.box(2, 1.5, 2.5, 2) - beside_walls - looked_at
    assert unseen.area < 0.02, (robot.asked, unseen.wkt)


def test_inside_a_barrier_nobody_looks():
    robot = Robot(room(8, 6, box(2, 2, 3, 2)), 0.5, 0.5).run()
    assert not shapely.LineString(robot.driven).intersects(shapely.box(2.01, 2.01, 4.99, 3.99))
