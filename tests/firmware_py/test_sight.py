# Sight against shapely on random maps, and its machine code against itself.

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import LineString, MultiLineString, Point, Polygon, affinity

from tests.firmware_py.watched import watched
from tests.upy import run

vector_store, sight_module = watched("firmware_py.storage.vector_store", "firmware_py.building.sight")

OUTLINE, BARRIER = 4, 5  # sealed
CHAIN_END = 8
HALL = (OUTLINE, [(-9000, -9000), (9000, -9000), (9000, 9000), (-9000, 9000)], False)
UNIT = st.integers(-32768, 32767)
ANY_CHAIN = st.tuples(st.integers(0, 5), st.lists(st.tuples(UNIT, UNIT), min_size=1, max_size=9))
PLACE = st.tuples(st.integers(-9000, 9000), st.integers(-9000, 9000))


def mapped(*chains):
    """A store of (kind, vertices in mm, open) and the sight over it."""
    store = vector_store.VectorStore()
    for kind, vertices, is_open in chains:
        store.open_chain(kind)
        for x, y in vertices:
            store.append(x // 5, y // 5, 0, 0)
        if is_open:
            store.flags[store.used - 1] |= CHAIN_END
    return sight_module.Sight(store)


def walls(*chains):
    lines = []
    for _, vertices, is_open in chains:
        ring = [(x // 5 * 5, y // 5 * 5) for x, y in vertices]
        lines.append(ring if is_open else [*ring, ring[0]])
    return MultiLineString(lines)


@st.composite
def rooms(draw):
    """A room, turned, with tables in it."""
    turn = draw(st.integers(0, 359))
    width, height = draw(st.integers(3000, 20000)), draw(st.integers(3000, 9000))

    def placed(box):
        ring = affinity.rotate(Polygon(box), turn, origin=(0, 0)).exterior.coords[:-1]
        return [(round(x), round(y)) for x, y in ring]

    chains = [(OUTLINE, placed([(0, 0), (width, 0), (width, height), (0, height)]), False)]
    for k in range(draw(st.integers(0, 3))):
        x, y = 400 + 800 * k, draw(st.integers(300, height - 900))
        chains.append((BARRIER, placed([(x, y), (x, y + 500), (x + 500, y + 500), (x + 500, y)]), draw(st.booleans())))
    return chains


@given(rooms(), PLACE, PLACE, st.integers(0, 60).map(lambda n: n * 5))
def test_clear_is_what_shapely_says_of_the_strip(chains, a, b, margin):
    a, b = [(x // 5 * 5, y // 5 * 5) for x, y in (a, b)]
    assume(a != b)
    clear = mapped(*chains).clear(*a, *b, margin)
    way = LineString([a, b])
    lines = walls(*chains)
    if margin:
        # 12 mm either way, for rounding to 5 mm
        if margin > 12 and _inset(way).buffer(margin - 12, cap_style="flat").intersects(lines):
            assert not clear
        if not way.buffer(margin + 12, cap_style="square").intersects(lines):
            assert clear
    elif lines.distance(way) > 12:
        assert clear


def _inset(way):
    return LineString([way.interpolate(12), way.interpolate(max(way.length - 12, 13))])


@given(rooms(), PLACE)
def test_inside_is_within_the_outline_and_in_no_barrier(chains, place):
    inside = mapped(*chains).inside(*place)
    outline, *barriers = [Polygon(vertices) for _, vertices, _ in chains]
    assume(all(Point(place).distance(shape.exterior) > 15 for shape in (outline, *barriers)))
    assert inside == (outline.contains(Point(place)) and not any(b.contains(Point(place)) for b in barriers))


def test_an_outline_in_pieces_is_one_ring():
    corners = [(0, 0), (4000, 0), (4000, 3000), (0, 3000)]
    whole = mapped((OUTLINE, corners, False))
    triangle = (BARRIER, [(1000, 1000), (1000, 2000), (2000, 2000)], False)
    pieces = mapped((OUTLINE, corners[:2], True), triangle, (OUTLINE, corners[2:], True))
    for x in range(-500, 4600, 490):
        for y in range(-500, 3600, 490):
            island = 1000 <= x <= y <= 2000
            assert pieces.inside(x, y) == (whole.inside(x, y) and not island), (x, y)
    assert not pieces.clear(3500, 1500, 4500, 1500, 0) and not pieces.clear(500, 1500, -500, 1500, 0)


def test_a_barrier_goes_on_in_the_next_chain():
    ring = [(5 * i, 0) for i in range(200)] + [(1000, 5 * i) for i in range(200)]
    sight = mapped(HALL, (BARRIER, ring, False))
    assert not sight.inside(900, 100) and sight.inside(100, 900)
    assert not sight.clear(400, 600, 600, 400, 50) and sight.clear(300, 600, 300, 2000, 50)  # the vector back to the first


def test_a_barrier_that_is_still_mapped_is_open():
    sight = mapped(HALL, (1, [(0, 0), (1000, 0), (1000, 1000)], False))
    assert sight.clear(200, 600, 600, 400, 20) and not sight.clear(700, 300, 700, -300, 20)


def test_a_way_of_over_80_m_is_not_clear_and_one_of_no_length_is():
    sight = mapped((OUTLINE, [(-150000, -9000), (150000, -9000), (150000, 9000), (-150000, 9000)], False))
    assert not sight.clear(-50000, 0, 50000, 0, 200) and sight.clear(-40000, 0, 40000, 0, 200) and sight.clear(0, 0, 0, 0, 200)


def test_an_empty_map_hides_nothing_and_holds_nothing():
    sight = mapped()
    assert sight.clear(0, 0, 5000, 5000, 200) and not sight.inside(0, 0)


@given(st.lists(ANY_CHAIN, max_size=5), st.tuples(UNIT, UNIT, UNIT, UNIT), st.integers(0, 100))
def test_any_map_is_answered_in_small_ints(chains, way, margin):
    sight = mapped(*((kind, [(x * 5, y * 5) for x, y in vertices], kind & 2) for kind, vertices in chains))
    x0, y0, x1, y1 = [5 * v for v in way]
    assert sight.clear(x0, y0, x1, y1, margin) in (True, False) and sight.inside(x0, y0) in (True, False)


@pytest.mark.parametrize("seed", [1, 77])
def test_the_machine_code_agrees(seed):
    printed = run.script("tests.upy.sight_same", seed, 2000, heap="256k")
    met, free, differed, gates = [int(word) for word in printed.split()[1::2]]
    assert differed == 0 and min(met, free, gates) > 200, printed
