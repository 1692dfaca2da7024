# What the map means: its regions, its turning nodes, and the ways between them (Paper 4.3, 4.4, Fig. 1).

from array import array
from ..limits import EDGES_MAX, NODES_MAX, REGIONS_MAX

# a region's eight places in `regions`
FIRST = 0      # record of the vector store that its range begins with
COUNT = 1      # records in it, along the ring that FIRST is of (the outline, or one barrier); it may pass the ring's last one
AREA = 2       # of its free floor, dm2
X = 3          # middle of its gate, map units, int16; region 0 has none
Y = 4
LINES = 5      # long vectors | short ones << 8: how often a region is to be explored comes from them
PARENT = 6     # region on the gate's other side | flags << 8
LEARNED = 7    # change rate | times to explore << 8

GATE_FIRST = 256   # flag: the gate begins at the range's first record, not at its last


class RegionGraph:
    # regions  8 u16   the above: 16 B. Region 0 is all that no other one is. A gate leads from a record, the range's first or last, to the
    #                  point as far beyond its middle; that point and the range are the region's border. What lies in a child's
    #                  range is the child's.
    # nodes    3 u16   x, y in map units (int16), first of its edges | how many << 8: 6 B
    # edges    2 u16   the other node | region << 8, cost in cm: 4 B. An edge stands once, at the node of the lower number.
    # Full: what comes is refused and counted in `lost`. Allocates in __init__ only. Written by Partition and Topology.

    def __init__(self):
        self.regions = array("H", bytes(16 * REGIONS_MAX))
        self.nodes = array("H", bytes(6 * NODES_MAX))
        self.edges = array("H", bytes(4 * EDGES_MAX))
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

    def at(self, places, i):
        # regions[i] or nodes[i], a coordinate, with its sign.
        return (places[i] ^ 32768) - 32768
