# What the map means: its regions, its turning nodes, and the ways between them (Paper 4.3, 4.4, Fig. 1).

from array import array
from protocol.map_code import ABOUT, EDGES
from ..limits import AREA_MAX, EDGES_MAX, NODES_MAX, REGIONS_MAX, SHARED_MAX

# a region's six places in `regions`
FIRST = 0      # record of the vector store that its range begins with
COUNT = 1      # records in it, along the ring that FIRST is of (the outline, or one barrier); it may pass the ring's last one
AREA = 2       # of its free floor, dm2
LINES = 3      # long vectors | short ones << 8: how often a region is to be explored comes from them
PARENT = 4     # region on the gate's other side | flags << 8
LEARNED = 5    # change rate | times to explore << 8

GATE_FIRST = 256   # flag: the gate begins at the range's first record, not at its last

assert ABOUT == 2 * NODES_MAX and EDGES == 3 * NODES_MAX and EDGES + EDGES_MAX <= SHARED_MAX


class RegionGraph:
    # regions  6 u16   the above: 12 B. Region 0 is all that no other one is. The gate of region r leads from a record, the range's first
    #                  or last, to the point as far beyond its middle, which is node r - 1; that point and the range are the region's
    #                  border. What lies in a child's range is the child's.
    # shared   nodes: x, y in map units (int16) at 2 n; first edge | how many << 8 at ABOUT + n: 6 B
    #          edges: the other node | region << 8 at EDGES + k: 2 B. An edge stands once, at the node of the lower number, its cost
    #          is its length.
    # Before there are nodes, `shared` holds what exploring needs (limits.py), then the candidates for gates; until settle_floors(), a
    # region's LEARNED has the upper bits of its area, so that what is larger than AREA_MAX may still be cut, and LINES whether it lies
    # in what the gate that is tried would cut off.
    # Full: what comes is refused and counted in `lost`, as is an area that cannot be told. Allocates in __init__ only.

    def __init__(self):
        self.regions = array("H", bytes(12 * REGIONS_MAX))
        self.shared = array("H", bytes(2 * SHARED_MAX))
        self.region_count = 0
        self.node_count = 0
        self.edge_count = 0
        self.lost = 0
        self.ready = False    # whole: before that it is no part of the map

    def clear(self):
        self.ready = False
        self.region_count = 0
        self.node_count = 0
        self.edge_count = 0

    def floor(self, r):
        # dm2, below 2**24
        return self.regions[6 * r + AREA] | self.regions[6 * r + LEARNED] << 16

    def set_floor(self, r, area):
        area = max(0, area)
        self.regions[6 * r + AREA] = area & 0xFFFF
        self.regions[6 * r + LEARNED] = area >> 16

    def add_line(self, r, long):
        n = 1 if long else 256
        if self.regions[6 * r + LINES] // n & 255 < 255:
            self.regions[6 * r + LINES] += n

    def settle_floors(self, doubtful):
        lost = 1 if doubtful else 0
        for r in range(self.region_count):
            if self.floor(r) > AREA_MAX:
                self.set_floor(r, AREA_MAX)
                lost += 1
        self.lost = min(self.lost + lost, 65535)

    def at(self, i):
        # shared[i], a coordinate, with its sign.
        return (self.shared[i] ^ 32768) - 32768

    def edge(self, a, b):
        # Where the edge of two nodes stands, -1 if there is none.
        if a > b:
            return self.edge(b, a)
        k = EDGES + (self.shared[ABOUT + a] & 255)
        end = k + (self.shared[ABOUT + a] >> 8)
        while k < end:
            if self.shared[k] & 255 == b:
                return k
            k += 1
        return -1

    def join(self, a, b, region):
        # A new edge at node a, the lower one; the others make room.
        s = self.shared
        first = s[ABOUT + a] & 255
        behind = EDGES + first + (s[ABOUT + a] >> 8)  # node a's edges, those to lower nodes first
        k = EDGES + self.edge_count
        while k > behind or k > EDGES + first and s[k - 1] & 255 > b:
            s[k] = s[k - 1]
            k -= 1
        self.edge_count += 1
        s[ABOUT + a] += 256
        for n in range(a + 1, self.node_count):
            s[ABOUT + n] += 1
        s[k] = b | region << 8
