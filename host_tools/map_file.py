"""map.bin, exactly what the device stores and sends, decoded into metres.

Layout: "TVM2"  u16 vertices  u8 chains  u8 regions  u8 nodes  u8 edges, little-endian; the map as
protocol/map_code.py codes it, by the same steps as in the core; u32 CRC-32 of all before.
A vector runs from its vertex to the next one of its chain, the last one of a closed chain
to the first. A vertex with CHAIN_END starts no vector.
"""

import struct
import zlib
from array import array
from dataclasses import dataclass, field

import numpy as np

from host_tools import map_graph
from protocol.map_code import EDGES, MAGIC, MODEL_PLACES, MapCode
from protocol.range_code import AT

HEADER = struct.Struct("<4sH4B")
UNIT_M = 0.005
CHAIN_COUNT_MAX = 255

FLAG_CONCAVE = 1
FLAG_LONG = 2
FLAG_SNAPPED = 4
FLAG_CHAIN_END = 8

KIND_OUTLINE = 0
KIND_BARRIER = 1
KIND_NAMES = ("outline", "barrier", "kind2", "kind3")


class MapError(ValueError):
    """The bytes are no map; the text is one sentence."""


@dataclass
class Chain:
    kind: int
    searched: bool
    region: int
    xy: np.ndarray  # vertices in metres, n x 2
    sigma_mm: np.ndarray  # of the vector that starts at each vertex
    flags: np.ndarray
    closed: bool

    @property
    def kind_name(self):
        return KIND_NAMES[self.kind]

    def vectors(self):
        """(n, 4) x0 y0 x1 y1 in metres, in the order of the chain."""
        ends = np.roll(self.xy, -1, axis=0) if self.closed else self.xy[1:]
        return np.hstack([self.xy[: len(ends)], ends])


@dataclass
class VectorMap:
    chains: list
    regions: int = 0
    nodes: int = 0
    edges: int = 0
    region_list: list = field(default_factory=list)  # map_graph.Region
    node_list: list = field(default_factory=list)    # (x, y) in metres
    edge_list: list = field(default_factory=list)    # map_graph.Edge

    def vectors(self, kind=None):
        """All vectors, or those of one kind, as (n, 4) metres."""
        parts = [chain.vectors() for chain in self.chains if kind is None or chain.kind == kind]
        return np.vstack(parts) if parts else np.zeros((0, 4))


class Records:
    """A map as it lies in the core: the arrays of firmware_py/storage/vector_store.py and region_graph.py."""

    def __init__(self, used=0, chains=0, regions=0, nodes=0, edges=0):
        self.used, self.chains = used, chains
        self.region_count, self.node_count, self.edge_count = regions, nodes, edges
        self.xs, self.ys = array("h", bytes(2 * used)), array("h", bytes(2 * used))
        self.sigmas, self.flags = bytearray(used), bytearray(used)
        self.firsts, self.counts, self.kinds = [0] * chains, bytearray(chains), bytearray(chains)
        self.regions, self.shared = array("H", bytes(12 * regions)), array("H", bytes(2 * (EDGES + max(edges, 1))))
        self.ready = regions > 0

    def code(self, buf, reads):
        """Written into the buffer, or read from it -> how many bytes."""
        coder = MapCode(self, self)
        coder.begin(array("H", bytes(2 * MODEL_PLACES)), buf, reads, len(buf) - 1)
        while not coder.step():  # comes to an end: each is one thing further, and so are the arrays
            pass
        return coder.s[AT]


def decode_records(data):
    if len(data) < HEADER.size + 4:
        raise MapError("the map has %d bytes, fewer than its header" % len(data))
    magic, *counts = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise MapError("the map starts with %r instead of %r" % (bytes(magic), MAGIC))
    (crc,) = struct.unpack_from("<I", data, len(data) - 4)
    if crc != zlib.crc32(data[:-4]):
        raise MapError("the map's checksum does not fit its bytes: it was cut, or changed on its way; fetch it again")
    records = Records(*counts)
    body = data[HEADER.size:-4]
    try:
        size = records.code(body + bytes(16), 1) - 1  # behind its end there are zeros
    except (IndexError, OverflowError, ValueError):
        size = -1
    if size != len(body) or sum(records.counts) != records.used:
        raise MapError("the map's bytes do not agree with the counts in its header")
    flaw = map_graph.flaw(records)
    if flaw:
        raise MapError("the map contradicts itself: %s; it was damaged before its checksum was made" % flaw)
    return records


def encode_records(records):
    buf = bytearray(1 << 20)
    size = records.code(buf, 0)
    ready = records.ready
    graph = (records.region_count, records.node_count, records.edge_count) if ready else (0, 0, 0)
    data = HEADER.pack(MAGIC, records.used, records.chains, *graph) + bytes(buf[:size])
    return data + struct.pack("<I", zlib.crc32(data))


def decode_map(data):
    records = decode_records(data)
    entries = _joined(records)
    counts = records.region_count, records.node_count, records.edge_count
    return VectorMap([_chain(records, *entry) for entry in entries], *counts, *_graph(records, entries))


def _graph(records, entries):
    outline = [i for first, count, kind in entries if kind & 3 == KIND_OUTLINE for i in range(first, first + count)]
    rings = [outline, *(list(range(first, first + count)) for first, count, kind in entries if kind & 3 != KIND_OUTLINE)]
    places = map_graph.nodes(records)
    return map_graph.regions(records, _xy(records), rings, places), places, map_graph.edges(records, places)


def _xy(records):
    return np.column_stack([records.xs, records.ys]).reshape(-1, 2) * UNIT_M


def _joined(records):
    """A chain of over 255 records comes as several entries: put them together again."""
    joined = []
    for first, count, kind in zip(records.firsts, records.counts, records.kinds, strict=True):
        last = joined[-1] if joined else None
        if (last and last[2] == kind and last[0] + last[1] == first and last[3] == CHAIN_COUNT_MAX
                and not records.flags[first - 1] & FLAG_CHAIN_END):
            joined[-1] = (last[0], last[1] + count, kind, count)
        else:
            joined.append((first, count, kind, count))
    return [(first, count, kind) for first, count, kind, _ in joined]


def _chain(records, first, count, kind):
    part = slice(first, first + count)
    flags = np.frombuffer(bytes(records.flags[part]), np.uint8)
    closed = count > 1 and not flags[-1] & FLAG_CHAIN_END
    sigma_mm = np.frombuffer(bytes(records.sigmas[part]), np.uint8)
    return Chain(kind & 3, bool(kind & 4), kind >> 3, _xy(records)[part], sigma_mm, flags, bool(closed))


def encode_map(chains, fill=None, **counts):
    """The inverse, for tests and importers: Chain objects -> bytes. `counts` of regions, nodes and edges; fill(records) fills them."""
    entries = [(chain, start, min(CHAIN_COUNT_MAX, len(chain.xy) - start))
               for chain in chains for start in range(0, len(chain.xy), CHAIN_COUNT_MAX)]
    records = Records(sum(count for *_, count in entries), len(entries), **counts)
    at = 0
    for c, (chain, start, count) in enumerate(entries):
        records.firsts[c], records.counts[c] = at, count
        records.kinds[c] = chain.kind | (4 if chain.searched else 0) | chain.region << 3
        for i, (x, y) in enumerate(np.rint(chain.xy / UNIT_M).astype(int)[start:start + count], start):
            ends = i == len(chain.xy) - 1 and not chain.closed
            records.xs[at], records.ys[at] = int(x), int(y)
            records.sigmas[at] = int(chain.sigma_mm[i])
            records.flags[at] = int(chain.flags[i]) & ~FLAG_CHAIN_END | (FLAG_CHAIN_END if ends else 0)
            at += 1
    if fill:
        fill(records)
    return encode_records(records)
