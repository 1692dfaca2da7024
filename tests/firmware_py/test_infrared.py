# Raw counts to ranges, ranges to hits, open rays to points erased.

import math

import pytest

from protocol.schema import VALUES_MAX
from tests.firmware_py.puppet import BEARINGS, bam, count_of
from tests.firmware_py.watched import watched

hit_ring, infrared_module, follower_module, fixed = watched(
    "firmware_py.storage.hit_ring", "firmware_py.collection.infrared", "firmware_py.collection.follower", "firmware_py.fixed"
)


class Sensing:
    def __init__(self, radius_mm=120):
        self.hits = hit_ring.HitRing()
        self.infrared = infrared_module.Infrared(self.hits)
        self.infrared.begin(radius_mm, [bam(b) for b in BEARINGS], 0)
        self.follower = follower_module.Follower(self.hits)

    def see(self, ranges, tick=1, pose=(0, 0, 0)):
        values = [0] * VALUES_MAX
        for beam, mm in ranges.items():
            values[2 + beam] = count_of(mm)
        self.infrared.update(values, 3, *pose, tick)
        return list(self.infrared.ranges_mm)

    def look_and_erase(self, tick, beams=range(8)):
        self.follower.look(0, 0, 0, 29100)
        for j in beams:
            self.infrared.erase(j, self.follower, tick)
        return self.hits.used


@pytest.mark.parametrize("mm", [36, 45, 61, 87, 110, 133, 160, 200, 228])
def test_a_range_comes_back_to_the_millimetre_or_two(mm):
    assert abs(Sensing().see({6: mm})[5] - mm) <= 2


def test_between_two_entries_of_the_table_a_range_is_interpolated():
    sensing = Sensing()
    values = [0] * VALUES_MAX
    seen = []
    for count in range(160, 500):
        values[3] = count
        sensing.infrared.update(values, 3, 0, 0, 0, 1)
        seen.append(sensing.infrared.ranges_mm[0])
    seen = [mm for mm in seen if mm < 999]
    assert all(a >= b for a, b in zip(seen, seen[1:]))
    assert max(a - b for a, b in zip(seen, seen[1:])) <= 2  # entries lie up to 11 mm apart there


def test_the_least_count_is_that_of_the_greatest_range():
    sensing = Sensing()
    values = [0] * VALUES_MAX
    for count, mm in ((infrared_module._HIT_COUNT, 230), (infrared_module._HIT_COUNT - 1, 999)):
        values[3] = count
        sensing.infrared.update(values, 3, 0, 0, 0, 1)
        assert sensing.infrared.ranges_mm[0] == mm


def test_too_far_is_nothing():
    assert Sensing().see({6: 260})[5] == 999 and Sensing().see({})[0] == 999


@pytest.mark.parametrize("beam", range(1, 9))
@pytest.mark.parametrize("heading", [0, 90, -135])
def test_each_beam_ends_where_it_is_mounted(beam, heading):
    sensing = Sensing()
    sensing.see({beam: 100}, pose=(5000, -3000, bam(heading) & 0xFFFF))
    b = math.radians(heading + BEARINGS[beam - 1])
    (slot,) = [i for i in range(64) if sensing.hits.buckets[i] != 255]
    assert math.dist((sensing.hits.xs[slot], sensing.hits.ys[slot]), (5000 + 220 * math.cos(b), -3000 + 220 * math.sin(b))) <= 3


def test_an_open_ray_erases_an_old_point_on_it_and_no_other():
    sensing = Sensing()
    sensing.see({6: 100})                      # a point at the right, 220 mm off
    sensing.see({1: 100, 2: 100}, tick=2)
    assert sensing.hits.used == 3
    sensing.see({1: 100, 2: 100}, tick=150)    # seen again: in front and at the left
    assert sensing.look_and_erase(150) == 3    # younger than 3 s
    assert sensing.look_and_erase(160, beams=[0, 1, 2, 3, 4, 6, 7]) == 3
    assert sensing.look_and_erase(160) == 2    # the right-hand beam sees through it
    sensing.see({1: 100, 2: 100}, tick=400)
    assert sensing.look_and_erase(800) == 2    # a ray that ends there erases nothing


def test_a_point_3_mm_beside_the_ray_stays():
    for aside_mm, kept in ((2, 0), (6, 1)):
        sensing = Sensing()
        sensing.hits.add(aside_mm, -220, 1)
        sensing.see({}, tick=400)
        assert sensing.look_and_erase(400, beams=[5]) == kept
