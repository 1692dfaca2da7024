# Wall following by rolling a disc over the remembered hits (design: a follower that works).

from array import array

from ..fixed import polar

_REACH_MM = const(350)       # points farther than this block nothing
_REACH_SQUARED = const(350 * 350)
_LINEAR = const(109)         # BAM a millimetre: 6 degrees a cm outside the disc
_INSIDE = const(131)         # 1.2 times as much inside it
_STEEP = const(300)          # boxed in: 16 degrees a cm, so that only what the next 5 cm would touch is in the way
_DEEPEST_MM = const(-90)     # deeper inside makes no difference: the block is half a turn wide by then
_NARROW = const(10377)       # 57 degrees: the standing disc and the touching disc disagree
_SHRINK_MM = const(4)
_FRONT = const(7300)         # 40 degrees: what counts as in front

NO_WALL = 1 << 20     # no point to roll along
BOXED_IN = 1 << 21    # every heading is blocked


class Follower:
    # look() collects the hits within reach, solve() gives the heading to take, relative to that of
    # look(), in BAM, left positive and NOT wrapped: a dead end must be left by turning left. It scans
    # counter-clockwise from the nearest point on the right for the first heading that no hit blocks.
    # They may be called in different ticks: together they are the dearest part of a step.
    #
    # near_bearing (int16 BAM, relative), near_mm, near_slot (in the ring): the hits within reach.
    # gap_mm: free way in front of the body. Allocates in __init__ only.

    def __init__(self, hits):
        self._hits = hits
        self.near_bearing = array("h", bytes(2 * hits.CAPACITY))
        self.near_mm = array("h", bytes(2 * hits.CAPACITY))
        self.near_slot = bytearray(hits.CAPACITY)
        self._blocks = array("h", bytes(2 * hits.CAPACITY))
        self.near = 0
        self.nearest_mm = _REACH_MM
        self.gap_mm = _REACH_MM
        self.reference_bearing = 0
        self.reference_mm = _REACH_MM
        self.body_mm = 170
        self.disc_mm = 200
        self.tight_mm = 174   # a passage that this disc fits through is entered; disc_mm or more: none is

    def look(self, x_mm, y_mm, heading_bam, window_bam):
        # The reference is the nearest hit with a bearing from -200 degrees to window_bam.
        hits = self._hits
        xs = hits.xs
        ys = hits.ys
        buckets = hits.buckets
        bearings = self.near_bearing
        distances = self.near_mm
        slots = self.near_slot
        n = 0
        nearest = _REACH_MM
        reference = _REACH_MM
        front = _REACH_MM + self.body_mm
        heading_bam -= 32768
        for i in range(64):
            if buckets[i] != 255:
                dx = xs[i] - x_mm
                if -_REACH_MM < dx < _REACH_MM:
                    dy = ys[i] - y_mm
                    if -_REACH_MM < dy < _REACH_MM and dx * dx + dy * dy < _REACH_SQUARED:
                        b = polar(dx, dy)
                        d = b >> 16
                        b = ((b - heading_bam) & 0xFFFF) - 32768
                        bearings[n] = b
                        distances[n] = d
                        slots[n] = i
                        n += 1
                        if d < nearest:
                            nearest = d
                        if d < reference and (b <= window_bam or b >= 29127):
                            reference = d
                            self.reference_bearing = b if b < 29127 else b - 65536
                        if d < front and -_FRONT < b < _FRONT:
                            front = d
        self.near = n
        self.nearest_mm = nearest
        self.reference_mm = reference
        self.gap_mm = front - self.body_mm

    def solve(self):
        if self.reference_mm == _REACH_MM:
            return NO_WALL
        disc = self.disc_mm
        wide = self._scan(disc, _LINEAR)
        if wide == BOXED_IN or (disc > self.tight_mm and wide != self._first(disc, _LINEAR)):
            wide = self._squeeze(disc, wide)
        return wide

    def _squeeze(self, disc, wide):
        # More than the reference stands in the way.
        tight = self._scan(self.tight_mm, _LINEAR)
        # A narrow passage: the standing disc turns away where the body would pass.
        # Shrink until both agree; that centres the robot.
        while (wide - tight > _NARROW or tight - wide > _NARROW) and disc > self.tight_mm:
            disc -= _SHRINK_MM
            wide = self._scan(disc, _LINEAR)
        if wide == BOXED_IN:
            wide = self._scan(self.body_mm + 2, _STEEP)
        return wide

    def _first(self, disc_mm, slope):
        # Where the scan begins: along the reference.
        e = self.reference_mm - disc_mm
        if e < _DEEPEST_MM:
            e = _DEEPEST_MM
        return self.reference_bearing + 16384 - (e * slope if e > 0 else e * _INSIDE)

    def _scan(self, disc_mm, slope):
        n = self.near
        bearings = self.near_bearing
        blocks = self._blocks
        i = 0
        for d in self.near_mm:
            if i == n:
                break
            d -= disc_mm
            if d > 0:
                d = 16384 - d * slope
                blocks[i] = d if d > 0 else 0
            else:
                blocks[i] = 16384 - (d if d > _DEEPEST_MM else _DEEPEST_MM) * _INSIDE
            i += 1
        start = self.reference_bearing
        heading = self._first(disc_mm, slope)
        moved = True
        while moved:
            moved = False
            i = 0
            for a in blocks:
                if i == n:
                    break
                if a > 0:
                    d = ((heading - bearings[i] + 32768) & 0xFFFF) - 32768
                    if -a < d < a:
                        heading += a - d
                        moved = True
                i += 1
            if heading - start > 65536:
                return BOXED_IN
        return heading
