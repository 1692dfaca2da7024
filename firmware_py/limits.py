# Every capacity of the core in one place, each with its reason and its assertion.

HITS_MAX = 64            # the follower needs 48; 64 leaves a margin (design study, eight homes)
assert HITS_MAX == 64    # HitRing masks its index

POINTS_MAX = 32          # turning points not yet built into vectors
assert POINTS_MAX & (POINTS_MAX - 1) == 0

CRUMBS_MAX = 128         # 32 m at 25 cm; the spacing doubles when they run out
assert CRUMBS_MAX % 2 == 0

VECTORS_MAX = 1024       # an office of 535 true vectors gives 760 mapped ones while it is explored, 640 of which stay
assert VECTORS_MAX < 4096

CHAINS_MAX = 64          # barriers of one floor, and the pieces of a broken outline
assert CHAINS_MAX < 256

BARRIERS_MAX = 32        # seen and not yet searched; searched ones make room

CELLS_MAX = 8192         # 1,120 m2 of cells of 37 cm; larger homes get larger cells, and may keep places that nobody saw: degraded
assert CELLS_MAX % 16 == 0

REGIONS_MAX = 32         # rooms of one floor
assert REGIONS_MAX <= 32  # five bits in a chain's kind

AREA_MAX = 65535         # dm2, 655 m2: a larger region is told as this; what is cut off it is reckoned from its true floor
assert AREA_MAX < 65536  # two bytes of a region

FLOOR_MAX = 16383        # map units, 82 m: places of a floor that are farther apart are taken for no farther, and areas come out wrong
assert 2 * FLOOR_MAX * FLOOR_MAX < 1 << 30

NODES_MAX = 96           # turning nodes
assert NODES_MAX < 255   # 255: no node

EDGES_MAX = 192          # between them
assert EDGES_MAX < 256

CORNERS_MAX = 240        # places that ways lead over while exploring; an office of 30 rooms has 150
assert NODES_MAX <= CORNERS_MAX <= 253  # eight bits, and two for the ends

# u16 that no two need at once: exploring (corners that ways bend round, cells seen), then the gates that may be, then nodes and edges.
SHARED_MAX = 992
assert SHARED_MAX >= 2 * CORNERS_MAX + CELLS_MAX // 16
assert SHARED_MAX >= 3 * NODES_MAX + EDGES_MAX

ANCHORS_MAX = 32

COORDINATE_MAX_UM = 1 << 29  # 536 m: beyond it the odometry starts again at 0
assert COORDINATE_MAX_UM < 1 << 30

RX_BYTES = 128           # what a port reads at once: a whole frame
assert RX_BYTES >= 108

HELLO_MS = 500           # between two HELLOs while nobody answers

UNIX_HEAP_BYTES = 272 * 1024  # the Unix port boots from here on straight from the sources: there code and compiler work in the heap too
