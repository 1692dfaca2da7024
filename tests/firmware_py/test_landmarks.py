# Walls of the outline met again: by a beam, by an echo; and what is no landmark.

from array import array
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

store_module, sight_module, frame_module, landmarks_module = watched(
    "firmware_py.storage.vector_store", "firmware_py.building.sight", "firmware_py.storage.frame", "firmware_py.collection.landmarks"
)
ROOM = [(0, 0), (4000, 0), (4000, 3000), (0, 3000)]
EAST, NORTH, WEST = 0, 16384, 32768


class Robot:
    def __init__(self, x_mm, y_mm, heading_bam=0, is_unsure=True):
        self.x_mm, self.y_mm, self.heading_bam = x_mm, y_mm, heading_bam
        self.is_unsure = is_unsure
        self.told, self.walls = [], []

    def unsure(self):
        return self.is_unsure

    def met(self, wall):
        self.told.append((wall.off_mm, round(wall.nx / 4096), round(wall.ny / 4096)))

    def wall(self, x, y):
        self.walls.append((x, y))


class Met:
    def __init__(self, corners=ROOM, kind=0):
        self.store = store_module.VectorStore()
        self.store.open_chain(kind)
        for x, y in corners:
            self.store.append(x // 5, y // 5, 0, 0)
        self.store.seal(0, 0, kind | store_module.SEARCHED)
        self.seen = SimpleNamespace(ranges_mm=array("h", [999] * 8), hit_x=array("i", [0] * 8), hit_y=array("i", [0] * 8))
        self.marks = landmarks_module.Landmarks(self.store, sight_module.Sight(self.store), self.seen, frame_module.Frame())
        self.path_mm = 0

    def beam(self, here, x, y, j=0, way_mm=150):
        self.seen.ranges_mm[j], self.seen.hit_x[j], self.seen.hit_y[j] = 200, x, y
        self.path_mm += way_mm
        self.marks.look(here, self.path_mm, j, 0)

    def echo(self, here, sonar_mm, way_mm=150):
        self.path_mm += way_mm
        self.marks.look(here, self.path_mm, -1, sonar_mm)


def test_a_beam_that_ends_beyond_a_wall_says_so_the_second_time():
    met, here = Met(), Robot(3700, 1000)
    met.beam(here, 4060, 1000)
    assert here.told == []
    met.beam(here, 4060, 1100)
    assert len(here.told) == 1 and abs(here.told[0][0] - 60) <= 6 and here.told[0][1:] == (1, 0)


def test_an_echo_tells_how_far_the_wall_ahead_is_even_if_it_is_met_at_an_angle():
    for heading in (NORTH, NORTH + 1800):
        met, here = Met(), Robot(2000, 1000, heading)
        met.echo(here, 1810)   # 150 mm ahead of the centre: the wall should be 1850 mm off
        met.echo(here, 1810)
        assert len(here.told) == 1 and abs(here.told[0][0] + 40) <= 12 and here.told[0][1:] == (0, 1)


@pytest.mark.parametrize("second", [(4150, 1100), (4060, 1010)])
def test_what_is_not_alike_or_too_soon_is_not_believed(second):
    met, here = Met(), Robot(3700, 1000)
    met.beam(here, 4060, 1000)
    met.beam(here, *second, way_mm=150 if second[0] > 4100 else 50)
    assert here.told == []


@pytest.mark.parametrize("corners, kind, hit", [
    (ROOM, 0, (4000, 2980)),                                       # its corner
    (ROOM, 0, (3550, 1000)),                                       # something that stands far before it
    ([(3800, 900), (3800, 1100), (3900, 1100), (3900, 900)], 1, (3800, 1000)),  # a barrier inside
])  # fmt: skip
def test_what_is_no_landmark(corners, kind, hit):
    met, here = Met(corners, kind), Robot(3450, 1000)
    for _ in range(4):
        met.beam(here, *hit)
    assert here.told == []


def test_who_is_sure_is_told_nothing_but_the_walls_beside_him():
    met, here = Met(), Robot(3700, 1000, is_unsure=False)
    for _ in range(4):
        met.beam(here, 4060, 1000, j=5)
    assert here.told == [] and len(here.walls) == 4


MM = st.integers(-160_000, 160_000)


@given(st.lists(st.tuples(MM, MM), min_size=3, max_size=12), MM, MM, st.integers(-600, 600), st.integers(-600, 600),
       st.integers(0, 65535), st.integers(0, 3000))  # fmt: skip
def test_any_map_and_any_place_make_no_number_too_big(corners, x, y, dx, dy, heading, sonar):
    met, here = Met(corners), Robot(x, y, heading)
    for _ in range(3):
        met.beam(here, x + dx, y + dy)
        met.echo(here, sonar)
    assert all(abs(off) < 300 for off, _, _ in here.told)
