# Each store against a model in plain Python lists: what it holds, what it does
# when full, what it counts. Every number is watched.

from hypothesis import given
from hypothesis import strategies as st

from tests.firmware_py.watched import watched

limits, point_ring, hit_ring, vector_store = watched(
    "firmware_py.limits", "firmware_py.storage.point_ring", "firmware_py.storage.hit_ring", "firmware_py.storage.vector_store"
)
UNITS = st.integers(-32768, 32767)


@given(st.lists(st.tuples(UNITS, UNITS, st.integers(0, 65535), st.integers(0, 2)), max_size=200))
def test_the_point_ring_keeps_the_newest_and_counts_the_rest(points):
    ring = point_ring.PointRing()
    for point in points:
        ring.add(*point)
    kept = points[-limits.POINTS_MAX :]
    assert ring.used == len(kept) and ring.lost == len(points) - len(kept)
    for order, (x, y, heading, kind) in enumerate(points):
        if order >= ring.lost:
            i = order % limits.POINTS_MAX
            assert (ring.xs[i], ring.ys[i], ring.headings[i], ring.kinds[i], ring.orders[i]) == (x, y, heading, kind, order)


@given(st.integers(-(2**29), 2**29), st.integers(-(2**29), 2**29))
def test_a_point_beyond_the_map_is_clamped_to_its_border(x, y):
    ring = point_ring.PointRing()
    ring.add(x, y, 0, 0)
    assert (ring.xs[0], ring.ys[0]) == (max(-32768, min(32767, x)), max(-32768, min(32767, y)))


NEAR_MM = st.integers(-200, 200)  # few cells, so that they are hit again


@given(st.lists(st.tuples(st.sampled_from(("add", "add", "add", "remove")), NEAR_MM, NEAR_MM), max_size=300))
def test_the_hit_ring_has_one_point_a_cell(work):
    ring = hit_ring.HitRing()
    cells = {}
    tick = removed = 0
    for what, x, y in work:
        tick += 11  # older than the 0.2 s in which a slot is passed over
        if what == "add":
            ring.add(x, y, tick)
            cells[x >> 4, y >> 4] = (x, y)
        else:
            slot = (x + 200) % ring.CAPACITY
            removed += ring.buckets[slot] != 255
            ring.remove(slot)
        held = {(ring.xs[i] >> 4, ring.ys[i] >> 4): (ring.xs[i], ring.ys[i]) for i in range(ring.CAPACITY) if ring.buckets[i] != 255}
        assert len(held) == ring.used <= ring.CAPACITY  # no cell twice
        assert held.items() <= cells.items()  # each with its newest point
        assert ring.used + ring.lost + removed >= len(cells)  # and none gone uncounted
        if what == "add":
            assert held[x >> 4, y >> 4] == (x, y)


@given(st.lists(st.tuples(st.integers(-(2**29), 2**29), st.integers(-(2**29), 2**29), st.integers(0, 65535)), max_size=300))
def test_the_hit_ring_survives_any_coordinates_and_ticks(hits):
    ring = hit_ring.HitRing()
    for x, y, tick in hits:
        ring.add(x, y, tick)
        assert 0 < ring.used <= ring.CAPACITY
    ring.clear()
    assert ring.used == 0


# The vector store as a list of chains, each a list of records.
class Model:
    def __init__(self):
        self.chains = []
        self.lost = 0

    @property
    def used(self):
        return sum(map(len, self.chains))

    def open_chain(self, kind):
        if len(self.chains) < limits.CHAINS_MAX:
            self.chains.append([])

    def append(self, record):
        if self.chains and len(self.chains[-1]) == 255:
            full = len(self.chains) == limits.CHAINS_MAX
            if not full:
                self.chains.append([])
            if full:
                self.lost += 1
                return
        if not self.chains or self.used == limits.VECTORS_MAX:
            self.lost += 1
        else:
            self.chains[-1].append(record)

    def drop(self, begin, end):
        if not 0 <= begin < end <= self.used:
            return
        kept, i = [], 0
        for chain in self.chains:
            kept.append([r for k, r in enumerate(chain, i) if not begin <= k < end])
            i += len(chain)
        self.chains = [chain for chain in kept if chain]


ADD = st.tuples(st.just("add"), st.integers(1, 300), UNITS)
OPEN = st.tuples(st.just("open"), st.integers(0, 1), st.just(0))
DROP = st.tuples(st.just("drop"), st.integers(-3, 800), st.integers(-3, 800))


def check(store, model):
    assert (store.used, store.lost, store.chains) == (model.used, model.lost, len(model.chains))
    held = [[tuple(a[i] for a in (store.xs, store.ys, store.sigmas, store.flags)) for i in range(f, f + n)]
            for f, n in zip(store.firsts[: store.chains], store.counts[: store.chains])]  # fmt: skip
    assert held == model.chains


@given(st.lists(st.one_of(ADD, OPEN, DROP), max_size=14))
def test_the_vector_store_against_its_model(work):
    store, model = vector_store.VectorStore(), Model()
    for what, a, b in work:
        if what == "open":
            store.open_chain(a)
            model.open_chain(a)
        elif what == "add":
            for i in range(a):
                record = (b, -b - 1, i & 255, i & 15 | vector_store.CHAIN_END)  # test_walls.py has chains that go on
                store.append(*record)
                model.append(record)
        else:
            store.drop(a, b)
            model.drop(a, b)
        check(store, model)


def test_a_full_vector_store_refuses_and_counts():
    store = vector_store.VectorStore()
    assert not store.append(0, 0, 0, 0) and store.lost == 1  # no chain is open
    assert store.open_chain(0)
    taken = [store.append(i, i, 300, 0) for i in range(limits.VECTORS_MAX + 5)]
    assert sum(taken) == limits.VECTORS_MAX == store.used and store.lost == 6
    assert store.sigmas[0] == 255 and store.chains == (limits.VECTORS_MAX + 254) // 255
    opened = sum(store.open_chain(1) for _ in range(limits.CHAINS_MAX))
    assert store.chains == limits.CHAINS_MAX and store.chains_lost == limits.CHAINS_MAX - opened
