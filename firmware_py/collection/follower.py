# Wall following by rolling a disc over the remembered hits (design: a follower that works).

from array import array

from . import rolling
from .rolling import REACH_MM, BOXED_IN

LINEAR = const(109)           # BAM a millimetre: 6 degrees a cm outside the disc
STEEP = const(300)            # boxed in: 16 degrees a cm, so that only what the next 5 cm would touch is in the way
_INSIDE = const(131)          # 1.2 times LINEAR inside the disc
_DEEPEST_MM = const(-90)
_NARROW = const(10377)        # 57 degrees: the standing disc and the touching disc disagree
_SHRINK_MM = const(4)
_RIGHT_STEP = const(1456)
_RIGHT_MOST = const(8736)

NO_WALL = 1 << 20     # no point to roll along


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
        self._scope = array("i", bytes(36))
        self.near = 0
        self.nearest_mm = REACH_MM
        self.gap_mm = REACH_MM
        self.reference_bearing = 0
        self.reference_mm = REACH_MM
        self.body_mm = 170
        self.disc_mm = 200
        self.tight_mm = 174   # a passage that this disc fits through is entered; disc_mm or more: none is

    def look(self, x_mm, y_mm, heading_bam, window_bam):
        # The reference is the nearest hit with a bearing from -200 degrees to window_bam.
        hits = self._hits
        scope = self._scope
        scope[0] = x_mm
        scope[1] = y_mm
        scope[2] = heading_bam
        scope[3] = window_bam
        scope[8] = self.body_mm
        self.near = rolling.collect(hits.xs, hits.ys, hits.buckets, scope, self.near_bearing, self.near_mm, self.near_slot)
        self.nearest_mm = scope[4]
        self.reference_mm = scope[5]
        self.reference_bearing = scope[6]
        self.gap_mm = scope[7] - self.body_mm

    def solve(self):
        if self.reference_mm == REACH_MM:
            return NO_WALL
        disc = self.disc_mm
        wide = self._scan(disc, LINEAR)
        if wide == BOXED_IN or (disc > self.tight_mm and wide != self._first(disc, LINEAR)):
            wide = self._squeeze(disc, wide)
        return wide

    def free(self, heading, disc_mm, slope):
        # The heading nearest to this one that no hit blocks; to the right in steps of 8 degrees, 48 at most.
        left = self._unblocked(heading, disc_mm, slope)
        right = heading
        while left - heading > heading - right and heading - right < _RIGHT_MOST:
            right -= _RIGHT_STEP
            if self._unblocked(right, disc_mm, slope) == right:
                return right
        return left

    def _unblocked(self, heading, disc_mm, slope):
        return rolling.first_free(self.near_bearing, self.near_mm, self._blocks, self.near, disc_mm, slope, heading, heading)

    def _squeeze(self, disc, wide):
        # More than the reference stands in the way.
        tight = self._scan(self.tight_mm, LINEAR)
        # A narrow passage: the standing disc turns away where the body would pass.
        # Shrink until both agree; that centres the robot.
        while (wide - tight > _NARROW or tight - wide > _NARROW) and disc > self.tight_mm:
            disc -= _SHRINK_MM
            wide = self._scan(disc, LINEAR)
        if wide == BOXED_IN:
            wide = self._scan(self.body_mm + 2, STEEP)
        return wide

    def _first(self, disc_mm, slope):
        # Where the scan begins: along the reference.
        e = self.reference_mm - disc_mm
        if e < _DEEPEST_MM:
            e = _DEEPEST_MM
        return self.reference_bearing + 16384 - (e * slope if e > 0 else e * _INSIDE)

    def _scan(self, disc_mm, slope):
        return rolling.first_free(self.near_bearing, self.near_mm, self._blocks, self.near, disc_mm, slope,
                                  self.reference_bearing, self._first(disc_mm, slope))
