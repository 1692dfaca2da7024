# The map as the bytes that the device stores and sends (map.bin), made on the fly.

from array import array

_HEADER = const(12)
_VECTOR = const(6)
_CHAIN = const(4)
_REGION = const(16)
_NODE = const(6)
_EDGE = const(4)


class MapImage:
    # "TVM1", vectors u16, chains u8, regions u8, nodes u8, edges u8, reserved u16; the vectors, the chains; once they are ready the
    # regions, the nodes, the edges; CRC-32 of all before. byte(i) makes any one of them; no copy of the map is kept.
    # begin() takes stock; step(n) adds n bytes to the CRC -> whole; once it is, size, generation and
    # crc (low, high half) belong to what stood in the store at begin(). Nothing is allocated.

    def __init__(self, store, graph):
        self.size = 0
        self.generation = -1
        self.whole = False
        self.crc = array("H", bytes(4))
        self._store = store
        self._graph = graph
        self._regions = 0
        self._nodes = 0
        self._edges = 0
        self._vectors = 0
        self._chains = 0
        self._at = 0
        self._low = array("H", bytes(32))   # CRC-32 by half bytes
        self._high = array("H", bytes(32))
        for i in range(16):
            low = i
            high = 0
            for _ in range(4):
                odd = low & 1
                low = low >> 1 | (high & 1) << 15
                high >>= 1
                if odd:
                    low ^= 0x8320
                    high ^= 0xEDB8
            self._low[i] = low
            self._high[i] = high

    def begin(self):
        s = self._store
        self._vectors = s.used
        self._chains = s.chains
        self.generation = s.generation
        g = self._graph
        self._regions = g.region_count if g.ready else 0
        self._nodes = g.node_count if g.ready else 0
        self._edges = g.edge_count if g.ready else 0
        self.size = (_HEADER + self._vectors * _VECTOR + self._chains * _CHAIN
                     + self._regions * _REGION + self._nodes * _NODE + self._edges * _EDGE + 4)
        self._at = 0
        self.whole = False
        self.crc[0] = self.crc[1] = 65535

    def step(self, count):
        if self.whole:
            return True
        low = self.crc[0]
        high = self.crc[1]
        while count and self._at < self.size - 4:
            count -= 1
            low ^= self.byte(self._at)
            self._at += 1
            for _ in range(2):
                i = low & 15
                low = (low >> 4 | (high & 15) << 12) ^ self._low[i]
                high = high >> 4 ^ self._high[i]
        if self._at == self.size - 4:
            low ^= 65535
            high ^= 65535
            self.whole = True
        self.crc[0] = low
        self.crc[1] = high
        return self.whole

    def byte(self, i):
        s = self._store
        if i < _HEADER:
            if i < 4:
                return b"TVM1"[i]
            if i == 4:
                return self._vectors & 255
            if i == 5:
                return self._vectors >> 8
            return self._chains if i == 6 else self._regions if i == 7 else self._nodes if i == 8 else self._edges if i == 9 else 0
        i -= _HEADER
        n = i // _VECTOR
        if n < self._vectors:
            i -= n * _VECTOR
            if i < 2:
                return s.xs[n] >> 8 * i & 255
            if i < 4:
                return s.ys[n] >> 8 * (i - 2) & 255
            return s.sigmas[n] if i == 4 else s.flags[n]
        i -= self._vectors * _VECTOR
        n = i // _CHAIN
        if n < self._chains:
            i -= n * _CHAIN
            if i < 2:
                return s.firsts[n] >> 8 * i & 255
            return s.counts[n] if i == 2 else s.kinds[n]
        i -= self._chains * _CHAIN
        g = self._graph
        if i < self._regions * _REGION:
            n = i // _REGION
            k = (i - n * _REGION) >> 1
            if k == 3 or k == 4:
                value = g.shared[2 * n - 2 + k - 3] if n else 0
            else:
                value = g.regions[6 * n + (k if k < 3 else k - 2)]
            return value >> 8 * (i & 1) & 255
        i -= self._regions * _REGION
        if i < self._nodes * _NODE:
            n = i // _NODE
            k = (i - n * _NODE) >> 1
            return g.shared[2 * n + k if k < 2 else 128 + n] >> 8 * (i & 1) & 255
        i -= self._nodes * _NODE
        if i < self._edges * _EDGE:
            n = i // _EDGE
            i -= n * _EDGE
            return g.shared[192 + n] >> 8 * i & 255 if i < 2 else 0
        i -= self._edges * _EDGE
        return self.crc[i >> 1] >> 8 * (i & 1) & 255
