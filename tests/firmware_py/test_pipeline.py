# What joins the layers: modes and flags, turning points, the hash, the ends of a mission.

import math

import pytest

from firmware_py import pipeline
from firmware_py.building import closure, outline
from firmware_py.collection import sensor_watch
from firmware_py.collection import states as core_states
from firmware_py.limits import ANCHORS_MAX, CHAINS_MAX, VECTORS_MAX
from firmware_py.storage.point_ring import CONCAVE, CONVEX, SHORT
from protocol import parameters, states
from tests.firmware_py.puppet import NUMBERS, Puppet, told, wall_ahead
from tests.firmware_py.test_explorer import aligned_with_a_wall


def test_the_numbers_that_the_core_repeats_are_the_protocols():
    for name in "INIT FIND_WALL ALIGN FOLLOW CORNER_IN CORNER_OUT CLOSE_CHECK BUILD BUMP FAILED DONE STUCK LOST SAVE".split():
        assert getattr(core_states, name) == getattr(states, name), name
    for name in ("CLOSED", "NO_WALL", "STORE_FULL", "STUCK", "TOO_LONG", "LOST"):
        assert getattr(pipeline, f"REASON_{name}") == getattr(states, f"REASON_{name}"), name
    assert states.DEGRADED == ("vectors", "chains", "topology", "search", "encoder", "infrared", "ultrasonic", "uwb", "storage")
    watched = (sensor_watch.ENCODER, sensor_watch.INFRARED, sensor_watch.ULTRASONIC, sensor_watch.UWB)
    assert watched == tuple(1 << states.DEGRADED.index(name) for name in ("encoder", "infrared", "ultrasonic", "uwb"))
    stores = {name: 1 << i for i, name in enumerate(states.DEGRADED) if hasattr(pipeline, "DEGRADED_" + name.upper())}
    assert stores == {"vectors": 1, "chains": 2, "topology": 4, "search": 8, "storage": 256}
    assert all(getattr(pipeline, "DEGRADED_" + name.upper()) == bit for name, bit in stores.items())
    bits = ["_MIDPOINT", "_WALL_OFFSET", "_CORNERS", "_SPREAD", "_DISTANCE_FIXES", "_WEIGHTED", "_EQ1_LITERAL",
            "_FILTER", "_CALIBRATE", "_MANHATTAN", "_LANDMARKS", "_SHADOWING", "_KIDNAP"]
    assert [getattr(pipeline, bit) for bit in bits] == [1 << i for i in range(len(parameters.FLAGS))]
    assert parameters.PARAMETERS[NUMBERS["flags"]][5] == sum(flag[1] << i for i, flag in enumerate(parameters.FLAGS))
    assert ANCHORS_MAX == parameters.ANCHORS_MAX


def turned(core):
    puppet = Puppet(core)
    puppet.core.left_mm_s, puppet.core.right_mm_s = -100, 100
    puppet.step()
    return puppet.core.odometry.turn_bam


def test_eq_1_as_printed_doubles_the_heading_in_both_modes():
    for mode in (0, 1):
        once = turned(told(mode=mode))
        assert once > 50 and abs(turned(told(mode=mode, flags=1 << 6)) - 2 * once) <= 1


BY_MODE = [(0, 0x3F, 1, True), (0, 0x3E, 0, True), (0, 0x37, 1, False), (1, 0x3F, 0, False)]


@pytest.mark.parametrize("mode, flags, midpoint, spread", BY_MODE)
def test_the_mode_and_the_flags_reach_the_layers(mode, flags, midpoint, spread):
    core = told(mode=mode, flags=flags)
    assert bool(core.odometry._midpoint) == bool(midpoint) and core.outline.spread == spread


def test_the_path_counts_both_ways():
    puppet = Puppet()
    for speed in (100, -100):
        for _ in range(100):
            puppet.core.left_mm_s = puppet.core.right_mm_s = speed
            puppet.step()
    assert abs(puppet.core.odometry.path_mm - 400) <= 3 and abs(puppet.core.odometry.x_um) < 2000


def test_a_wall_is_mapped_where_the_beam_hits_or_in_paper_mode_where_the_robot_was():
    for mode, x_mm in ((0, 1000), (1, 785)):
        puppet = Puppet(mode=mode)
        wall = wall_ahead(1000)
        assert puppet.run(1500, until=lambda core: core.explorer.mapping, ranges=wall)
        puppet.run(400, ranges=wall)
        puppet.core.walls.finish()
        v = puppet.core.vectors
        assert v.used >= 2 and abs(v.xs[v.used - 1] * 5 - x_mm) < 25


def test_turning_points_have_their_kind():
    puppet, _ = aligned_with_a_wall()
    core = puppet.core
    before = core.points.count
    wall_ahead_and_right = {1: 60, 3: 60, 4: 60, 5: 60, 6: 80}
    for ranges, kind in ((wall_ahead_and_right, CONVEX), ({6: 80, 5: 80}, None), ({7: 80}, CONCAVE)):
        count = core.points.count
        puppet.run(12, ranges=ranges, blocked=True)
        if kind is not None:
            assert core.points.count > count and core.points.kinds[core.points.count - 1 & 63] == kind
    assert core.points.count >= before + 2
    core.explorer.state = states.FOLLOW
    core.turning_points.visit(states.FOLLOW, core.odometry.path_mm)
    core.walls.corners += 1
    core.turning_points.visit(states.FOLLOW, core.odometry.path_mm)
    assert core.points.kinds[core.points.count - 1 & 63] == SHORT


def test_where_a_way_ends_there_is_a_fix_and_no_point():
    core = Puppet().core
    fixes = []
    core.localization.fix = lambda: fixes.append(core.points.count)
    for state, path_mm in ((states.GOTO, 1000), (states.SELECT, 1200), (states.SELECT, 1230), (states.GOTO, 1250), (states.SELECT, 1290)):
        core.turning_points.visit(state, path_mm)
    assert fixes == [0] and core.points.count == 0


def hash_after(change, steps=3):
    puppet, wall = aligned_with_a_wall()
    change(puppet.core)
    puppet.run(steps, ranges=wall, blocked=True)
    return puppet.core.hash_lo, puppet.core.hash_hi


def nothing(core):
    pass


@pytest.mark.parametrize("change", [
    lambda core: setattr(core.odometry, "x_um", core.odometry.x_um + 1),
    lambda core: setattr(core.odometry, "y_um", core.odometry.y_um + 1),
    lambda core: setattr(core.frame, "to_x", core.frame.to_x + 1),
    lambda core: core.frame.rotate(1),
    lambda core: core.points.add(0, 0, 0, 0),
    lambda core: core.vectors.append(7, 7, 0, 0),
    lambda core: setattr(core.explorer, "state", states.BUMP),
    lambda core: core.hits.clear(),
], ids=["x", "y", "estimate", "heading", "points", "map", "state", "hits"])  # fmt: skip
def test_the_hash_of_the_steps_sees(change):
    assert hash_after(change, 1) != hash_after(nothing, 1)


def test_the_hash_of_the_steps_does_not_see_what_is_not_the_mission():
    def counters(core):
        core.uwb.outliers += 1
        core.hits.lost += 1
        core.image.begin()
    assert hash_after(counters) == hash_after(nothing)


def test_a_path_without_an_end_ends_the_mission():
    puppet, wall = aligned_with_a_wall()
    puppet.core.odometry.path_mm = 1_500_001
    puppet.run(3, ranges=wall)
    core = puppet.core
    assert (core.state, core.reason, core.finished) == (states.FAILED, states.REASON_TOO_LONG, False)
    assert not core.walls.active and core.vectors.used >= 2  # what was mapped stands


@pytest.mark.parametrize("store, degraded", [("vectors", 1), ("chains", 2)])
def test_a_full_store_ends_the_mission_in_good_order(store, degraded):
    puppet, wall = aligned_with_a_wall()
    core = puppet.core
    if store == "vectors":
        while core.vectors.used < VECTORS_MAX:
            core.vectors.append(0, 0, 0, 0)
        core.walls.finish()
    else:
        while core.vectors.chains < CHAINS_MAX:
            core.vectors.open_chain(0)
        core.walls.finish()
    assert puppet.run(2000, until=lambda core: core.state == states.DONE, ranges=wall)
    assert core.finished and core.reason == states.REASON_STORE_FULL and core.degraded & degraded
    assert core.image.whole


# An estimate that goes where it is told.
class Estimate:
    x_mm = y_mm = heading_bam = fixes = adrift = 0


class Lap:
    """The outline of a round room, walked by a robot on rails at `radius_mm` inside it."""

    def __init__(self, drift_mm_a_lap=0, fixes=0, radius_mm=1500):
        self.core = told()
        self.here = Estimate()
        self.here.fixes = fixes
        self.drift, self.radius, self.path = drift_mm_a_lap, radius_mm, 0
        self.laps = 0  # made when the outline closed
        self.core.outline.begin(0, 0)

    def go(self):
        """-> the words in their order, until DONE or three laps."""
        said = []
        around = math.tau * self.radius
        while self.path < 3 * around and said[-1:] != [outline.DONE]:
            a = self.path / self.radius
            drift = self.drift * self.path / around
            self.here.x_mm = round(self.radius * math.sin(a))
            self.here.y_mm = round(-self.radius * math.cos(a) + drift)
            turn = round(a * 65536 / math.tau)
            self.here.heading_bam = turn & 0xFFFF
            x, y = round((self.radius + 200) * math.sin(a)), round(-(self.radius + 200) * math.cos(a) + drift)
            self.core.outline.add(x, y, x, y)
            came = self.core.outline.visit(self.here, self.path, turn)
            if came not in said[-1:]:
                said.append(came)
                self.laps = self.path / around if came == outline.CLOSING else self.laps
            self.path += 6
        return said


def test_a_lap_closes_walks_the_overlap_and_is_sealed():
    lap = Lap()
    assert lap.go() == [outline.GOING_ON, outline.CLOSING, outline.DONE]
    v = lap.core.vectors
    assert v.kinds[0] & 4 and v.next_of(v.used - 1) == 0
    assert 1500 < lap.path - math.tau * 1500 + 400 < 2600


@pytest.mark.parametrize("fixes, closes", [(0, True), (1, False)])
def test_dead_reckoning_alone_may_be_off_by_4_mm_a_metre(fixes, closes):
    lap = Lap(drift_mm_a_lap=172, fixes=fixes)
    lap.go()
    assert (lap.laps < 1.02) == closes  # with fixes only where the way leads along the error


@pytest.mark.parametrize("fixes, moved", [(0, True), (1, False)])
def test_the_error_is_spread_only_where_no_fix_bounded_it(fixes, moved):
    lap = Lap(drift_mm_a_lap=80, fixes=fixes)
    assert lap.go()[-1] == outline.DONE
    v = lap.core.vectors
    before = list(v.xs[: v.used])
    while not lap.core.outline.build():
        pass
    assert lap.core.closure.before_mm > 30
    assert (list(v.xs[: v.used]) != before) == moved
    assert isinstance(lap.core.closure, closure.Closure) and lap.core.image.whole
