# From samples to vectors: corners, jumps, bends, in the frame that held; and the outline's chains as the host reads them.

import math

import pytest

from host_tools.map_file import decode_map
from tests.firmware_py.floor_plans import image_of
from tests.firmware_py.watched import watched

vector_store, frame_module, walls_module, region_graph = watched(
    "firmware_py.storage.vector_store", "firmware_py.storage.frame", "firmware_py.building.walls",
    "firmware_py.storage.region_graph"
)
CONCAVE, LONG, CHAIN_END = vector_store.CONCAVE, vector_store.LONG, vector_store.CHAIN_END


class Mapped:
    def __init__(self, corners=1):
        self.store, self.frame = vector_store.VectorStore(), frame_module.Frame()
        self.walls = walls_module.WallMapper(self.store, self.frame)
        self.walls.begin(corners)

    def along(self, *points, spacing_mm=7, noise=0):
        """The mapping beam goes along these points."""
        for (x0, y0), (x1, y1) in zip(points, points[1:]):
            far = math.dist((x0, y0), (x1, y1))
            for i in range(int(far / spacing_mm) + 1):
                t = i * spacing_mm / far
                self.walls.add(round(x0 + (x1 - x0) * t), round(y0 + (y1 - y0) * t + noise * (i % 3 - 1)))
        return self

    def chains(self):
        s = self.store
        return [[(s.xs[i] * 5, s.ys[i] * 5, s.flags[i]) for i in range(s.firsts[c], s.firsts[c] + s.counts[c])] for c in range(s.chains)]

    def finished(self):
        self.walls.finish()
        return self.chains()


def near(vertex, x, y, within_mm=12):
    return math.dist(vertex[:2], (x, y)) <= within_mm


def test_a_wall_is_one_vector():
    ((start, end),) = Mapped().along((0, 0), (3000, 0), noise=3).finished()
    assert near(start, 0, 0) and near(end, 3000, 0, 25) and end[2] == CHAIN_END and start[2] & LONG


def test_corners_are_intersected_and_know_their_kind():
    # the wall on the right: a left turn is convex, a right turn is concave
    (vertices,) = Mapped().along((0, 0), (1500, 0), (1500, 600), (2600, 600)).finished()
    assert len(vertices) == 4
    assert near(vertices[1], 1500, 0) and near(vertices[2], 1500, 600)
    assert not vertices[1][2] & CONCAVE and vertices[2][2] & CONCAVE
    assert [bool(v[2] & LONG) for v in vertices] == [True, False, True, False]


def test_without_intersection_the_corner_is_cut():
    (vertices,) = Mapped(corners=0).along((0, 0), (1500, 0), (1500, 1500)).finished()
    assert len(vertices) == 3 and not near(vertices[1], 1500, 0, 3)


def test_a_jump_breaks_the_chain_and_a_small_one_is_bridged():
    mapped = Mapped().along((0, 0), (1000, 0)).along((1250, 0), (2000, 0))
    assert len(mapped.finished()) == 2
    assert len(Mapped().along((0, 0), (1000, 0)).along((1150, 0), (2000, 0)).finished()) == 1


def test_one_stray_sample_changes_nothing():
    mapped = Mapped().along((0, 0), (1000, 0))
    mapped.walls.add(1020, 100)
    (vertices,) = mapped.along((1040, 0), (2000, 0)).finished()
    assert len(vertices) == 2


def test_the_two_faces_of_a_slender_wall_are_two_vectors():
    (vertices,) = Mapped().along((0, 0), (1000, 0), (1000, 15), (0, 15)).finished()
    assert len(vertices) >= 3 and near(vertices[1], 1000, 8, 40) and near(vertices[-1], 0, 15, 25)


def test_a_curve_becomes_chords_within_2_cm():
    arc = [(600 * math.sin(a / 50), 600 * (1 - math.cos(a / 50))) for a in range(158)]
    (vertices,) = Mapped().along(*arc).finished()
    assert 5 <= len(vertices) <= 16
    for a, b in zip(vertices, vertices[1:]):
        for t in (0, 0.5, 1):
            assert abs(math.dist((a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t), (0, 600)) - 600) < 30


def test_a_line_keeps_the_frame_that_held_when_it_began():
    mapped = Mapped().along((0, 0), (1000, 0))
    mapped.frame.to_y = 100  # a fix in the middle of a wall
    mapped.along((1000, 0), (1500, 0), (1500, 1500))
    mapped.walls.finish()
    (vertices,) = mapped.chains()
    assert near(vertices[0], 0, 0) and near(vertices[1], 1500, 100, 105)
    assert near(vertices[-1], 1500, 1600, 25)  # the next line has the new one


@pytest.mark.parametrize("length_mm", [18000, 30000])
def test_a_long_wall_in_a_turned_frame_is_not_cut_short(length_mm):
    mapped = Mapped()
    mapped.frame.rotate(16384)
    (vertices,) = mapped.along((0, 0), (length_mm, 0)).finished()
    assert near(vertices[-1], 0, length_mm, 60)


def test_corners_are_counted():
    mapped = Mapped().along((0, 0), (1500, 0), (1500, 1500), (0, 1500), (0, 100))
    mapped.walls.finish()
    assert mapped.walls.corners == 3


def square_store(records=4, kind=0):
    store = vector_store.VectorStore()
    store.open_chain(kind)
    for i in range(records):
        store.append(i * 10, i % 7, 0, 0)
    return store


def test_a_barrier_whose_ends_meet_is_closed():
    for gap, closed in ((39, True), (40, False)):
        store = square_store()
        store.append(gap, 0, 0, CHAIN_END)
        store.seal(0, 0, vector_store.SEARCHED)
        assert bool(store.flags[4] & CHAIN_END) != closed
        assert store.next_of(4) == (0 if closed else -1)
        assert [store.next_of(i) for i in range(4)] == [1, 2, 3, 4]


def test_an_open_chain_that_still_grows_has_no_way_back():
    assert square_store().next_of(3) == -1


def test_split_ends_what_was_before():
    store = square_store(10)
    store.split(6, vector_store.BARRIER | vector_store.SEARCHED)
    assert list(store.firsts[:2]) == [0, 6] and list(store.counts[:2]) == [6, 4] and list(store.kinds[:2]) == [0, 5]
    assert store.flags[5] & CHAIN_END and store.next_of(5) == -1 and store.next_of(9) == 6
    assert store.chain_of(5) == 0 and store.chain_of(6) == 1


def decoded(store):
    return decode_map(image_of(store, region_graph.RegionGraph())).chains


@pytest.mark.parametrize("begin, end, kept", [(0, 10, 590), (0, 300, 300), (0, 520, 80), (100, 110, 590), (590, 600, 590)])
def test_a_chain_of_over_255_records_stays_one_when_its_beginning_is_dropped(begin, end, kept):
    store = square_store(600)
    store.flags[store.used - 1] = CHAIN_END
    store.open_chain(1)
    for i in range(5):
        store.append(i, 9, 0, 0)
    store.drop(begin, end)
    if end == 600:
        store.flags[store.used - 6] |= CHAIN_END
    first, second = decoded(store)
    left = [i for i in range(600) if not begin <= i < end]
    assert len(first.xy) == kept == len(left) and not first.closed and len(second.xy) == 5
    assert [round(x / 0.05) for x, _ in first.xy] == left
    assert list(store.counts[: store.chains]) == [*[255] * (kept // 255), kept % 255, 5]


def test_a_closed_chain_leads_back_though_another_follows_and_a_long_one_goes_on():
    store = square_store(5)
    store.open_chain(1)
    store.append(0, 0, 0, 0)
    assert store.next_of(4) == 0
    assert square_store(300).next_of(254) == 255
