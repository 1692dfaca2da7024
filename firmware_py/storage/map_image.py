# The map as the bytes that the device stores and sends (map.bin), made on the fly.

from array import array

from protocol.crc32_tables import T0, T1, T2, T3
from protocol.map_code import HEADER_BYTES, MAGIC, MODEL_PLACES, MapCode, STEP_BYTES_MAX
from protocol.range_code import AT
from ..limits import CRUMBS_MAX, REGIONS_MAX

_MUCH = const(3)     # bytes that are work enough for a step

assert CRUMBS_MAX >= MODEL_PLACES and 6 * REGIONS_MAX >= MODEL_PLACES


class MapImage:
    # A header, the map as protocol/map_code.py codes it, and the CRC-32 of all before; regions, nodes and edges once they are ready.
    # begin() takes stock; step(n) codes n pieces, fewer where they are large -> whole; once it is, size, generation and crc (low, high
    # half) belong to what stood in the store at begin(). byte(i) makes any byte of it: in order is fast, for one that came long before
    # it begins again. No copy of the map is kept. The model takes a place that nobody needs: before there are regions, theirs; then
    # the breadcrumbs'.
    # Allocates in __init__ only.

    def __init__(self, store, graph, crumbs):
        self.size = 0
        self.generation = -1
        self.whole = False
        self.crc = array("H", bytes(4))
        self._store = store
        self._graph = graph
        self._crumbs = crumbs
        self._code = MapCode(store, graph)
        self._last = bytearray(STEP_BYTES_MAX)   # of what is coded
        self._model = None

    def begin(self):
        self.generation = self._store.generation
        self.whole = False
        self.crc[0] = self.crc[1] = 65535
        for i in range(HEADER_BYTES):
            self._sum(self._head(i))
        self._again()

    def _again(self):
        self._model = self._spare()
        self._code.begin(self._model, self._last, 0, STEP_BYTES_MAX - 1)

    def _spare(self):
        return self._crumbs.turns if self._graph.region_count else self._graph.regions

    def step(self, count):
        s = self._code.s
        much = s[AT] + _MUCH
        while count and not self.whole:
            count -= 1
            at = s[AT]
            self.whole = self._code.step()
            while at < s[AT]:
                self._sum(self._last[at % STEP_BYTES_MAX])
                at += 1
            if at > much:
                count = 0
            if self.whole:
                self.crc[0] ^= 65535
                self.crc[1] ^= 65535
                self.size = HEADER_BYTES + at + 4
        return self.whole

    def _sum(self, byte):
        i = (self.crc[0] ^ byte) & 255
        high = self.crc[1]
        self.crc[0] = (self.crc[0] >> 8 | (high & 255) << 8) ^ (T0[i] | T1[i] << 8)
        self.crc[1] = high >> 8 ^ (T2[i] | T3[i] << 8)

    def byte(self, i):
        if i < HEADER_BYTES:
            return self._head(i)
        if i >= self.size - 4:
            i -= self.size - 4
            return self.crc[i >> 1] >> 8 * (i & 1) & 255
        i -= HEADER_BYTES
        s = self._code.s
        if i < s[AT] - STEP_BYTES_MAX or self._model is not self._spare():
            self._again()
        while i >= s[AT]:
            self._code.step()
        return self._last[i % STEP_BYTES_MAX]

    def _head(self, i):
        g = self._graph
        if i < 4:
            return MAGIC[i]
        if i < 6:
            return self._store.used >> 8 * (i - 4) & 255
        if i == 6:
            return self._store.chains
        return 0 if not g.ready else g.region_count if i == 7 else g.node_count if i == 8 else g.edge_count
