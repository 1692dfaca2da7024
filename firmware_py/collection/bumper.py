# A touch: what it tells of the place, and what the robot does about it.

from ..fixed import sine, cosine

_BUMP_TICKS = const(500)        # 10 s
_BUMPS_MAX = const(8)
_CLEAR_MM = const(20)           # a hit that near to the body explains a bump
_BACK_MM = const(40)
_BUMP_TURN = const(6736)        # 37 degrees

# what touch() says
STRANGE = 0        # nothing was seen there: begin() has been called, back_off() until it is True
KNOWN = 1          # a wall that the beams see: keep_off_mm() more from it for a while
OFTEN = 2          # too many in too short a time


class Bumper:
    # touch() puts a hit into the ring for each of the eight sectors of the bumper. back_off() drives back 4 cm, then
    # turns left 37 degrees: that sweeps the blind sector. Half a second at least. Allocates in __init__ only.

    def __init__(self, odometry, hits, follower, motion):
        self.bumps = 0
        self._odometry = odometry
        self._hits = hits
        self._follower = follower
        self._motion = motion
        self._squeeze_q4 = 0      # millimetres added to the disc after a bump, decaying
        self._recent_tick = 0
        self._recent_bumps = 0
        self._from_mm = 0
        self._from_turn = 0
        self._ticks = 0

    def touch(self, tick, bump):
        o = self._odometry
        f = self._follower
        self.bumps = (self.bumps + 1) & 0xFFFF
        x_mm = o.x_um // 1000
        y_mm = o.y_um // 1000
        for sector in range(8):
            if bump >> sector & 1:
                b = o.heading_bam + sector * 8192
                self._hits.add(x_mm + (f.body_mm * cosine(b) >> 15), y_mm + (f.body_mm * sine(b) >> 15), tick)
        if tick - self._recent_tick > _BUMP_TICKS:
            self._recent_tick = tick
            self._recent_bumps = 0
        self._recent_bumps += 1
        if self._recent_bumps > _BUMPS_MAX:
            self._recent_bumps = 0
            return OFTEN
        if f.nearest_mm < f.body_mm + _CLEAR_MM and self._squeeze_q4 < 256:
            self._squeeze_q4 += 128
            return KNOWN
        self.begin()
        return STRANGE

    def keep_off_mm(self):
        # Decays by a millimetre in 16 calls.
        if self._squeeze_q4:
            self._squeeze_q4 -= 1
        return self._squeeze_q4 >> 4

    def begin(self):
        self._motion.stop()
        self._from_mm = self._odometry.path_mm
        self._from_turn = self._odometry.turn_bam
        self._ticks = 0

    def back_off(self):
        # -> True when it is done
        o = self._odometry
        self._ticks += 1
        if o.path_mm - self._from_mm < _BACK_MM and self._ticks < 60:
            self._motion.drive(-100, 0)
        elif o.turn_bam - self._from_turn < _BUMP_TURN and self._ticks < 150:
            self._motion.drive(0, 1500)
        else:
            self._motion.stop()
            return True
        return False
