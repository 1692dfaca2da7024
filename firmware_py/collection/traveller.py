# To a place on the map: straight, and round what stands in the way with the wall on the right.

from ..fixed import polar
from .follower import LINEAR, STEEP

# what step() says
GOING = 0
ARRIVED = 1
AT_WALL = 2        # a wall stands before the goal, near to it
LOST = 3           # there is no way, or none was found

_ARRIVED_MM = const(120)
_NEAR_GOAL_MM = const(350)
_FRONT_MM = const(50)
_STRAIGHT_BAM = const(1500)    # who can head so near to the goal's bearing goes straight
_DEFLECT_BAM = const(9000)     # who must turn away farther goes round
_LEAVE_MM = const(150)         # nearer to the goal by that than where it was met: the obstacle is left
_ROUND_MM = const(15000)       # farther round an obstacle nobody goes, nor farther beside the straight way and back


class Traveller:
    # A bug algorithm: who leaves an obstacle is nearer to the goal than when he met it. Turning aside a little may still lead in
    # circles, so that a way has its limit.
    #   begin(x_mm, y_mm, wall)   on the map; wall: the goal is a wall, not a place
    #   step(here, follower, path_mm)  in even ticks -> GOING, ...; heading_bam: where to go, relative to the robot's heading
    #                             at the follower's last look; around: the follower is to steer
    # Allocates nothing after __init__.

    def __init__(self):
        self.x_mm = 0
        self.y_mm = 0
        self.heading_bam = 0
        self.around = False
        self._wall = False
        self._met_mm = 0        # distance to the goal where the obstacle was met
        self._met_path_mm = 0
        self._limit_mm = -1     # path by which it must be there; -1: not known yet

    def begin(self, x_mm, y_mm, wall):
        self.x_mm = x_mm
        self.y_mm = y_mm
        self._wall = wall
        self.around = False
        self._limit_mm = -1

    def step(self, here, follower, path_mm):
        dx = self.x_mm - here.x_mm
        dy = self.y_mm - here.y_mm
        scale = 0
        while dx > 8000 or dx < -8000 or dy > 8000 or dy < -8000:
            dx >>= 1
            dy >>= 1
            scale += 1
        p = polar(dx, dy)
        far_mm = p >> 16 << scale
        error = ((p & 0xFFFF) - here.heading_bam + 32768 & 0xFFFF) - 32768
        if far_mm < _ARRIVED_MM:
            return ARRIVED
        if self._wall and far_mm < _NEAR_GOAL_MM and (self.around or follower.gap_mm < _FRONT_MM):
            return AT_WALL
        free = follower.free(error, follower.body_mm + 8, LINEAR)
        if not -_DEFLECT_BAM < free - error < _DEFLECT_BAM:
            free = follower.free(error, follower.body_mm + 2, STEEP)  # through the needle's eye
        if self._limit_mm < 0:
            self._limit_mm = path_mm + 2 * far_mm + _ROUND_MM
        elif path_mm > self._limit_mm:
            return LOST
        if self.around:
            if path_mm - self._met_path_mm > _ROUND_MM:
                return LOST
            if far_mm > self._met_mm - _LEAVE_MM or not -_STRAIGHT_BAM < free - error < _STRAIGHT_BAM:
                return GOING
            self.around = False
        elif free - error > _DEFLECT_BAM:
            self.around = True
            self._met_mm = far_mm
            self._met_path_mm = path_mm
            return GOING
        self.heading_bam = free
        return GOING
