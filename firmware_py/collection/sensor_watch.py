# Which sensor cannot be believed: a map that one of them has spoilt must not look like a sound one.

from ..fixed import cosine, sine

# bits of STATUS_RSP.degraded, as in protocol/states.py
ENCODER = 16
INFRARED = 32
ULTRASONIC = 64
UWB = 128

_LEFT = const(1)             # where things stand in the values of a STEP
_IR = const(3)
_SONAR = const(11)
_UWB = const(13)
_WINDOW = const(255)         # ticks, less one: 5 s
_MOVED_MM = const(300)       # in that time: who stands may well see the same
_PULSES_MAX = const(64)
_UM_TICK = const(20)         # 1 mm/s makes so many micrometres a tick
_WHEEL_UM = const(60000)     # wheels may be so far behind their orders, and by 7/32 of the way
_STRIKES = const(2)          # windows in a row
_TELLING_UM = const(600000)  # less way in a window says nothing of 1/32 of it
_APART = const(1280)         # 10 mm: so far from the estimate fixes may see the robot along its way, in the mean of a hundred
_MEAN_SHIFT = const(7)
_FIX_MAX_MM = const(100)     # one fix alone says no more than that
_JUMP = const(200)           # of a beam in two ticks, counts: a wall does that only where it ends
_WILD_MAX = const(60)
_ECHO_JUMP_MM = const(500)
_ECHO_SAME = const(17)       # echoes, 2 s
_ECHO_MAX_MM = const(2500)   # farther off a part may have its end
_NO_ECHO_TICKS = const(125)  # every second one counts
_UNHEARD_TICKS = const(250)


class SensorWatch:
    # look(values, ...) sees each STEP before it is acted on. `bits`: what has failed; they stay, as what was mapped stays.
    #   encoder      a wheel against its orders over 5 s; both against their orders and against fixes
    #   infrared     a beam that says the very same while the robot moves; beams that jump from tick to tick
    #   ultrasonic   silent for 5 s; the very same echo while the robot moves; echoes that jump
    #   uwb          transmitters are known, and none is heard for 10 s
    # What misleads UWB is noticed elsewhere (uwb.py: strife), and what is slow, late or a little off errs within bounds.

    def __init__(self):
        self.bits = 0
        self._uwb = False
        self._unheard = 0
        self._left = 0          # sums of the window: pulses, and those either way
        self._right = 0
        self._driven = 0
        self._left_mm_s = 0     # likewise what was ordered
        self._right_mm_s = 0
        self._ordered_mm_s = 0
        self._strikes = 0
        self._path_mm = 0       # where the window began
        self._beam = 0          # count of the beam whose turn it is, two ticks ago
        self._beams = 0         # those that have said something new, a bit each
        self._wild = 0
        self._echo = 0
        self._same = 0
        self._echo_mm = 0       # path at the first of the same
        self._echo_wild = 0
        self._silent = 0
        self._sums = None       # of the UWB's least squares (uwb.py)
        self._off = False       # the wheels are off their orders: what do the fixes say?
        self._ahead = 0         # the mean of that, mm << _MEAN_SHIFT

    def begin(self, transmitters, sums, odometry):
        self._uwb = transmitters
        self._sums = sums
        self._open(odometry)

    def look(self, values, tick, odometry, here, left_mm_s, right_mm_s):
        # -> bits. The speeds: what was ordered a tick ago. `here`: the estimate (localization.py).
        if not tick & 1:
            self._look_out(values, tick >> 1 & 7, odometry.path_mm)
        left = values[_LEFT]
        right = values[_LEFT + 1]
        if left > _PULSES_MAX or left < -_PULSES_MAX or right > _PULSES_MAX or right < -_PULSES_MAX:
            left = right = 0  # as in the odometry
        self._left += left
        self._right += right
        self._driven += abs(left) + abs(right)
        self._left_mm_s += left_mm_s
        self._right_mm_s += right_mm_s
        self._ordered_mm_s += abs(left_mm_s) + abs(right_mm_s)
        if self._off and here.due == 1:
            self._ahead += ahead_mm(self._sums, here.heading_bam) - (self._ahead >> _MEAN_SHIFT)
        if tick & _WINDOW == 0:
            self._judge(odometry)
            self._open(odometry)
        return self.bits

    def _look_out(self, values, j, path_mm):
        # In every second tick, when the follower has less to do.
        self._look_beam(values, j)
        if values[_SONAR]:
            self._hear_echo(values[_SONAR], path_mm)
        else:
            self._silent += 1
            if self._silent > _NO_ECHO_TICKS:
                self.bits |= ULTRASONIC
                self._silent = 0
        if values[_UWB] > 0 or not self._uwb:
            self._unheard = 0
        else:
            self._unheard += 1
            if self._unheard > _UNHEARD_TICKS:
                self.bits |= UWB
                self._unheard = 0

    def _look_beam(self, values, j):
        step = (values[_IR + j] & 1023) - self._beam
        if step:
            self._beams |= 1 << j
        if step > _JUMP or step < -_JUMP:
            self._wild += 3
            if self._wild > _WILD_MAX:
                self.bits |= INFRARED
                self._wild = 0
        elif self._wild:
            self._wild -= 1
        self._beam = values[_IR + (j + 1 & 7)] & 1023

    def _hear_echo(self, mm, path_mm):
        self._silent = 0
        step = mm - self._echo
        self._echo = mm
        if step or mm > _ECHO_MAX_MM:
            self._same = 0
            self._echo_mm = path_mm
        else:
            self._same += 1
            if self._same > _ECHO_SAME and path_mm - self._echo_mm > _MOVED_MM:
                self.bits |= ULTRASONIC
        if step > _ECHO_JUMP_MM or step < -_ECHO_JUMP_MM:
            self._echo_wild += 1
            if self._echo_wild > _WILD_MAX:
                self.bits |= ULTRASONIC
                self._echo_wild = 0
        else:
            self._echo_wild = max(self._echo_wild - 2, 0)

    def _judge(self, o):
        if o.path_mm - self._path_mm > _MOVED_MM and self._beams != 255:
            self.bits |= INFRARED
        ordered_um = self._ordered_mm_s * (_UM_TICK // 2)
        most = _WHEEL_UM + (ordered_um * 7 >> 5)
        left_um = o.way_um(self._left) - self._left_mm_s * _UM_TICK
        right_um = o.way_um(self._right) - self._right_mm_s * _UM_TICK
        if left_um > most or left_um < -most or right_um > most or right_um < -most:
            self._strikes += 1
            if self._strikes >= _STRIKES:
                self.bits |= ENCODER
        else:
            self._strikes = 0
        # Wheels that say more than was ordered may be quick, fixes that lag may be late. Both: there is less way than the wheels say.
        more = (o.way_um(self._driven) >> 1) - ordered_um
        most = ordered_um >> 5
        if ordered_um < _TELLING_UM:
            return
        self._off = more > most or more < -most
        if not self._off:
            self._ahead = 0
        elif more > 0 and self._ahead < -_APART or more < 0 and self._ahead > _APART:
            self.bits |= ENCODER

    def _open(self, o):
        self._beams = 0
        self._left = 0
        self._right = 0
        self._driven = 0
        self._left_mm_s = 0
        self._right_mm_s = 0
        self._ordered_mm_s = 0
        self._path_mm = o.path_mm


def ahead_mm(sums, heading_bam):
    # How far ahead of the estimate these sums see the robot, along its heading.
    x = cosine(heading_bam) >> 5
    y = sine(heading_bam) >> 5
    known = (sums[0] >> 4) * (x * x >> 10) + (sums[1] >> 3) * (x * y >> 10) + (sums[2] >> 4) * (y * y >> 10) >> 7
    if known < 8:
        return 0
    told = (sums[3] >> 11) * x + (sums[4] >> 11) * y
    return max(-_FIX_MAX_MM, min(told // known, _FIX_MAX_MM))
