# Round the end of a wall: its other edge is looked for before the robot rolls into it.

from ..fixed import sine, cosine
from .rolling import REACH_MM

_SAME_MM = const(50)        # the reference is still the same place: hits lie a little before the edge, and behind it
_NEW_MM = const(15)         # on the way straight on it is another one
_QUARTER = const(18205)     # 100 degrees: past the first edge, and a little towards the wall's end
_STRAIGHT_MM = const(40)    # so far on without anything new: there is no more
_END_MM = const(140)        # the beam at -65 degrees sees the edge of a thicker wall in time


class WallEnd:
    # Who rolls round an edge has it at -90 degrees all the time. The other edge of a wall that is 3 to 10 cm thick comes up between the
    # beams at -65 and -90 and stays there until it is touched. So one place on the right turns the robot a quarter and no more: then
    # straight on, while the mapping beam sees the wall go on.
    # limit() each time that the follower has solved -> the course to take, unwrapped like Odometry.turn_bam. Allocates in __init__ only.

    def __init__(self):
        self._x_mm = 0          # the reference, in the frame of dead reckoning
        self._y_mm = 0
        self._turn = 0          # the robot's heading when it became that
        self._to_mm = -1        # path up to which it goes straight on; -1: it does not
        self._end_mm = 0

    def limit(self, odometry, follower, looked_turn, course_turn):
        o = odometry
        b = o.heading_bam + looked_turn - o.turn_bam + follower.reference_bearing
        d = follower.reference_mm
        x_mm = o.x_um // 1000 + (d * cosine(b) >> 15)
        y_mm = o.y_um // 1000 + (d * sine(b) >> 15)
        near = _SAME_MM if self._to_mm < 0 else _NEW_MM
        if not (-near < x_mm - self._x_mm < near and -near < y_mm - self._y_mm < near):
            self._x_mm = x_mm
            self._y_mm = y_mm
            if self._to_mm < 0:
                self._turn = o.turn_bam
            else:
                self._to_mm = o.path_mm + _STRAIGHT_MM
        least = self._turn - _QUARTER
        if course_turn >= least or follower.gap_mm < REACH_MM:
            return course_turn
        if self._to_mm < 0:
            if o.turn_bam >= least:
                return course_turn
            self._to_mm = o.path_mm + _STRAIGHT_MM
            self._end_mm = o.path_mm + _END_MM
        elif o.path_mm > self._to_mm or o.path_mm > self._end_mm:
            self._to_mm = -1
            self._turn = o.turn_bam
            return course_turn
        return least
