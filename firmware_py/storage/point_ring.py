# The turning points that the robot recorded (Paper eq. 5).

from array import array
from ..fixed import int16
from ..limits import POINTS_MAX

CONVEX = 0    # barrier in front, left turn
CONCAVE = 1   # right-hand wall lost, right turn
SHORT = 2     # neither: a bend, a short line of a curve begins


class PointRing:
    # p_i = [(x_i, y_i), theta_i, o_i, c_i]: x, y int16 in 5 mm of the map, theta u16 BAM,
    # order u16, type u8: 9 bytes. Full: the oldest is overwritten and counted in `lost`
    # (its vectors stand in the map by then). Allocates in __init__ only.

    RECORD_BYTES = 9
    CAPACITY = POINTS_MAX

    def __init__(self):
        self.xs = array("h", bytes(2 * POINTS_MAX))
        self.ys = array("h", bytes(2 * POINTS_MAX))
        self.headings = array("H", bytes(2 * POINTS_MAX))
        self.orders = array("H", bytes(2 * POINTS_MAX))
        self.kinds = bytearray(POINTS_MAX)
        self.count = 0    # ever recorded, wraps at 65536
        self.used = 0
        self.lost = 0

    def add(self, x, y, heading_bam, kind):
        if self.used == POINTS_MAX:
            self.lost = (self.lost + 1) & 0xFFFF
        else:
            self.used += 1
        i = self.count & (POINTS_MAX - 1)
        self.xs[i] = int16(x)
        self.ys[i] = int16(y)
        self.headings[i] = heading_bam
        self.orders[i] = self.count
        self.kinds[i] = kind
        self.count = (self.count + 1) & 0xFFFF
