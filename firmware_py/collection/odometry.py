# Dead reckoning from encoder pulses (Paper eq. 1 and 2), integers only.

from ..fixed import sine, ratio
from ..limits import COORDINATE_MAX_UM

_PULSES_MAX = const(64)  # a tick; more than 1.4 m/s is a broken encoder (fewer for coarse encoders: see begin)


class Odometry:
    # Pose in the ODOMETRY frame: x_um, y_um, heading_bam (0..65535). It begins at the
    # dock pose, after a kidnapping anew, and is never corrected; localization.py keeps the correction beside it.
    #
    # No fraction is lost: heading is an exact multiple of the pulse difference, and the
    # remainders of distance and of both coordinates are carried from tick to tick.
    # Departures from Paper eq. 1: heading rate (v_r - v_l) / track, and the heading in the middle of the
    # tick (midpoint false: at its end). eq. 1 as printed, 2 (v_r - v_l) / W, is had by half the track.

    def __init__(self):
        self.x_um = 0
        self.y_um = 0
        self.heading_bam = 0
        self.turn_bam = 0        # unwrapped heading, for the winding number
        self.path_um = 0         # below 1 mm; path_mm holds the rest
        self.path_mm = 0
        self.glitches = 0
        self._pulses_max = _PULSES_MAX
        self._um_q12 = 0         # micrometres a pulse
        self._bam_q13 = 0        # BAM a pulse of difference
        self._told_q13 = 0       # the same by the parameters
        self._drift_q13 = 0      # BAM a pulse of both: unequal wheels
        self._heading_q13 = 0
        self._midpoint = 1
        self._rest_um = 0
        self._rest_x = 0
        self._rest_y = 0

    def begin(self, x_um, y_um, heading_bam, wheel_um, track_um, pulses, midpoint=1):
        # Paper eq. 2: 2 pi R / N a pulse, with pi = 355/113.
        self._um_q12 = ratio(wheel_um * 355, 113, pulses, 12)
        # 65536 / (2 pi) * 2 pi R / (N W): pi cancels.
        self._bam_q13 = self._told_q13 = ratio(wheel_um, track_um, pulses, 28)
        # What a tick may bring so that every product of update() stays below 2**30, calibrated too.
        most = self._bam_q13 + (self._bam_q13 >> 4) + 1
        self._pulses_max = min(_PULSES_MAX, (1 << 27) // (self._um_q12 + 1), (1 << 28) // most - 1)
        self._midpoint = midpoint
        self.place(x_um, y_um, heading_bam)

    def place(self, x_um, y_um, heading_bam):
        # At the dock; and where a robot that was carried finds itself.
        self.x_um = x_um
        self.y_um = y_um
        self.heading_bam = heading_bam
        self._heading_q13 = heading_bam << 13

    def calibrate(self, drift, track):
        # From here on the heading drifts by so much more (1/4 BAM a metre) and turns by so much faster (1/65536).
        self._drift_q13 = self._um_q12 // 1000 * drift // 4000
        self._bam_q13 = self._told_q13 + self._told_q13 // 64 * track // 1024

    def way_um(self, pulses):
        # Of one wheel, in as many as 2**15 pulses, to 16 of them.
        return (pulses >> 4) * (self._um_q12 >> 8)

    def update(self, left, right):
        most = self._pulses_max
        if left > most or left < -most or right > most or right < -most:
            self.glitches = (self.glitches + 1) & 0xFFFF
            left = right = 0
        was = self.heading_bam
        turn = (right - left) * self._bam_q13 + (left + right) * self._drift_q13
        turn = self._heading_q13 + turn & 0x1FFFFFFF
        self._heading_q13 = turn
        turn >>= 13
        turned = ((turn - was + 32768) & 0xFFFF) - 32768
        self.heading_bam = turn
        middle = was + (turned >> 1) if self._midpoint else turn
        self.turn_bam += turned
        if self.turn_bam > 0xFFFFFFF or self.turn_bam < -0xFFFFFFF:
            self.turn_bam = 0  # 4096 turns one way; the difference of any two stays below 2**30
        s = (left + right) * self._um_q12 + self._rest_um
        self._rest_um = s & 0x1FFF
        s >>= 13
        x = s * sine(middle + 16384) + self._rest_x
        y = s * sine(middle) + self._rest_y
        self._rest_x = x & 0x7FFF
        self._rest_y = y & 0x7FFF
        x = (x >> 15) + self.x_um
        y = (y >> 15) + self.y_um
        most = COORDINATE_MAX_UM
        if not (-most <= x <= most and -most <= y <= most):
            x = y = 0  # 536 m from the dock: no home; absurd input must stay bounded
            self.glitches = (self.glitches + 1) & 0xFFFF
        self.x_um = x
        self.y_um = y
        s = self.path_um + (s if s >= 0 else -s)
        if s >= 1000:
            path = self.path_mm + s // 1000
            self.path_mm = path if path < 0x1FFFFFFF else 0x1FFFFFFF
            s %= 1000
        self.path_um = s
