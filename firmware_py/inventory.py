# Every store and buffer of the running core, with what it holds and what it costs.

from .limits import CHAINS_MAX, EDGES_MAX, NODES_MAX, REGIONS_MAX, RX_BYTES

_NAMES = (
    b"vectors", b"chains", b"hits", b"near hits", b"points", b"breadcrumbs", b"parameters", b"map bytes",
    b"rx buffer", b"rx frame", b"tx frame", b"kept answer", b"values", b"link counts",
    b"regions", b"nodes", b"edges",
)
STORES = len(_NAMES)


class Inventory:
    # fill(index, out): message STORE of protocol/schema.py: index, name (12), used, capacity, record_bytes, lost.
    # Rings and stores report their records; a buffer of fixed content counts as full, one byte a record.

    def __init__(self, core, link):
        self._core = core
        self._link = link
        self._out = link.out

    def fill(self, index):
        out = self._out
        name = _NAMES[index]
        out[0] = index
        for i in range(12):
            out[1 + i] = name[i] if i < len(name) else 0
        core = self._core
        link = self._link
        if index == 0:
            self._store(core.vectors)
        elif index == 1:
            self._put(core.vectors.chains, CHAINS_MAX, 4, core.vectors.chains_lost)
        elif index == 2:
            self._store(core.hits)
        elif index == 3:
            self._put(core.follower.near, core.hits.CAPACITY, 7, 0)
        elif index == 4:
            self._store(core.points)
        elif index == 5:
            self._store(core.crumbs)
        elif index == 6:
            n = len(core.parameters.values)
            self._put(n, n, 4, 0)
        elif index == 7:
            self._buffer(64)
        elif index == 8:
            self._buffer(RX_BYTES)
        elif index == 9:
            self._buffer(len(link.reader.held))
        elif index == 10:
            self._buffer(len(link.tx))
        elif index == 11:
            self._buffer(2 * len(link.tx))
        elif index == 12:
            self._buffer(4 * len(link.values))
        elif index == 13:
            self._buffer(4 * len(link.counters))
        elif index == 14:
            self._put(core.graph.region_count, REGIONS_MAX, 12, core.graph.lost)
        elif index == 15:
            self._put(core.graph.node_count, NODES_MAX, 6, 0)
        else:
            self._put(core.graph.edge_count, EDGES_MAX, 2, 0)

    def _store(self, store):
        self._put(store.used, store.CAPACITY, store.RECORD_BYTES, store.lost)

    def _buffer(self, size):
        self._put(size, size, 1, 0)

    def _put(self, used, capacity, record_bytes, lost):
        out = self._out
        out[13] = used
        out[14] = capacity
        out[15] = record_bytes
        out[16] = lost
