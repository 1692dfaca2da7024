"""map.bin, exactly what the device stores and sends, decoded into metres.

Layout (little-endian):
    "TVM1"  u16 records  u8 chains  u8 regions  u8 nodes  u8 edges  u16 reserved
    record x 6 B   i16 x, i16 y (5 mm)   u8 sigma_mm   u8 flags
    chain  x 4 B   u16 first, u8 count, u8 kind (bits 0-1) | searched (bit 2) | region (bits 3-7)
    region x 16 B, node x 6 B, edge x 4 B   see map_graph.py
    u32 CRC-32 of all before
A vector runs from its record to the next one of the chain, the last one of a closed chain
to the first. A record with CHAIN_END starts no vector.
"""

import struct
import zlib
from dataclasses import dataclass, field

import numpy as np

from host_tools import map_graph

MAGIC = b"TVM1"
HEADER = struct.Struct("<4sH4BH")
CHAIN = struct.Struct("<HBB")
RECORD = np.dtype([("x", "<i2"), ("y", "<i2"), ("sigma_mm", "u1"), ("flags", "u1")])
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


def decode_map(data):
    if len(data) < HEADER.size + 4:
        raise MapError("the map has %d bytes, fewer than its header" % len(data))
    magic, records, chains, regions, nodes, edges, _ = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise MapError("the map starts with %r instead of %r" % (bytes(magic), MAGIC))
    counts = (regions, nodes, edges)
    size = HEADER.size + records * RECORD.itemsize + chains * CHAIN.size + 4
    size += sum(count * kind.itemsize for count, kind in zip(counts, map_graph.TABLES, strict=True))
    if len(data) < size:
        raise MapError("the map has %d bytes, its header speaks of %d" % (len(data), size))
    (crc,) = struct.unpack_from("<I", data, len(data) - 4)
    if crc != zlib.crc32(data[:-4]):
        raise MapError("the map's checksum does not fit its bytes")
    table = np.frombuffer(data, RECORD, records, HEADER.size)
    at = HEADER.size + records * RECORD.itemsize
    entries = [CHAIN.unpack_from(data, at + CHAIN.size * i) for i in range(chains)]
    joined = _joined(table, entries)
    tables, at = [], at + CHAIN.size * chains
    for count, kind in zip(counts, map_graph.TABLES, strict=True):
        tables.append(np.frombuffer(data, kind, count, at))
        at += count * kind.itemsize
    return VectorMap([_chain(table, *entry) for entry in joined], *counts, *_graph(table, joined, *tables))


def _graph(table, entries, regions, nodes, edges):
    xy = np.column_stack([table["x"], table["y"]]) * UNIT_M
    outline = [i for first, count, kind in entries if kind & 3 == KIND_OUTLINE for i in range(first, first + count)]
    rings = [outline, *(list(range(first, first + count)) for first, count, kind in entries if kind & 3 != KIND_OUTLINE)]
    places = [(float(node["x"]) * UNIT_M, float(node["y"]) * UNIT_M) for node in nodes]
    return map_graph.regions(regions, xy, rings), places, map_graph.edges(nodes, edges)


def _joined(table, entries):
    """A chain of over 255 records comes as several entries: put them together again."""
    joined = []
    for first, count, kind in entries:
        if first + count > len(table):
            raise MapError("a chain of the map runs past the %d records" % len(table))
        last = joined[-1] if joined else None
        if (last and last[2] == kind and last[0] + last[1] == first and last[3] == CHAIN_COUNT_MAX
                and not table["flags"][first - 1] & FLAG_CHAIN_END):
            joined[-1] = (last[0], last[1] + count, kind, count)
        else:
            joined.append((first, count, kind, count))
    return [(first, count, kind) for first, count, kind, _ in joined]


def _chain(table, first, count, kind):
    part = table[first:first + count]
    xy = np.column_stack([part["x"], part["y"]]).astype(float) * UNIT_M
    closed = count > 1 and not part["flags"][-1] & FLAG_CHAIN_END
    return Chain(kind & 3, bool(kind & 4), kind >> 3, xy, part["sigma_mm"].copy(), part["flags"].copy(), bool(closed))


def encode_map(chains, regions=0, nodes=0, edges=0, graph=b""):
    """The inverse, for tests and importers: Chain objects, and the bytes of regions, nodes and edges -> bytes."""
    graph = graph or bytes(sum(count * kind.itemsize for count, kind in zip((regions, nodes, edges), map_graph.TABLES, strict=True)))
    records, entries = [], []
    for chain in chains:
        count, first = len(chain.xy), len(records)
        for i, (x, y) in enumerate(np.rint(chain.xy / UNIT_M).astype(int)):
            flags = int(chain.flags[i]) & ~FLAG_CHAIN_END
            if i == count - 1 and not chain.closed:
                flags |= FLAG_CHAIN_END
            records.append((x, y, int(chain.sigma_mm[i]), flags))
        kind = chain.kind | (4 if chain.searched else 0) | chain.region << 3
        for start in range(0, count, CHAIN_COUNT_MAX):
            entries.append((first + start, min(CHAIN_COUNT_MAX, count - start), kind))
    data = HEADER.pack(MAGIC, len(records), len(entries), regions, nodes, edges, 0)
    data += np.array(records, RECORD).tobytes() + b"".join(CHAIN.pack(*entry) for entry in entries) + graph
    return data + struct.pack("<I", zlib.crc32(data))
