# The extended Kalman filter of the pose's error, in 31-bit integers: what dead reckoning is uncertain of, and how a
# measurement of one part of it tells of the others.

from array import array
from ..fixed import isqrt

X = const(0)                   # half a mm
Y = const(1)
HEADING = const(2)             # BAM
DRIFT = const(3)               # heading drift of unequal wheels, 1/4 BAM a metre
TRACK = const(4)               # heading rate of a track other than told, 1/65536
AXIS = const(5)                # direction of the home's walls, BAM
_N = const(6)

_VARIANCE_MAX = const(1 << 24)
_NOISE_MAX = const(1 << 26)
_GAIN_MAX = const(16383)
_SLIP = const(25)              # BAM^2 a mm of a wheel's way: 2.5 mm times the square root of a metre, the worst of wheels
_SKID = const(70)              # mm a half mm^2 of the same along the way
_PLACE = const(64)             # variances at the dock: 4 mm, 0.2 degrees
_ASKEW = const(1300)
_DOUBT_PLACE = const(160000)   # 200 mm, 3 degrees
_DOUBT_HEADING = const(300000)
_DRIFT_0 = const(290000)       # 0.75 degrees a metre: wheels 0.3 % apart
_TRACK_0 = const(520000)       # 1.1 %


class Ekf:
    # Variances in `p`, all 36 of them (symmetric), whole units of their two states; nothing passes 2**24.
    #   begin(calibrate): at the dock; with calibrate, wheels and track are estimated too
    #   restart(place, askew): elsewhere, known to these variances
    #   move(dx_mm, dy_mm, way_mm, turn_bam): dead reckoning has gone that far, at most a metre and half a turn
    #   correct(i, j, rho_q12, z_q4, noise, most): z = state i + rho * state j was measured (in 1/16) with that variance;
    #       beyond three deviations it counts for three, beyond `most` / 16 deviations for nothing (False), unless `most` is 0
    #   unsure(i, j, rho): deviation of state i + rho * state j;  doubt(): place and heading count as less certain again
    #   taken(i, bits): the correction of state i since it was last taken, in units of 2**(bits - 10): the caller applies it
    # The filter holds errors only: what it has told is taken as applied.

    def __init__(self):
        self.p = array("i", bytes(4 * _N * _N))
        self._gain = array("i", bytes(4 * _N))
        self.rest = array("i", bytes(4 * _N))  # corrections not yet taken, Q10

    def begin(self, calibrate):
        p = self.p
        p[0] = p[7] = _PLACE
        p[14] = _ASKEW
        if calibrate:
            p[21] = _DRIFT_0
            p[28] = _TRACK_0

    def restart(self, place, askew):
        # Carried elsewhere: only of the walls' axis is as much known as before. Wheels may have been mislearnt until that was noticed.
        p = self.p
        calibrate = p[21]
        axis = p[35]
        for i in range(_N):
            self.rest[i] = 0
        for i in range(_N * _N):
            p[i] = 0
        self.begin(calibrate)
        p[0] = p[7] = place
        p[14] = askew
        p[35] = axis

    def move(self, dx_mm, dy_mm, way_mm, turn_bam):
        self._shear(X, HEADING, -dy_mm * 3217 >> 10)
        self._shear(Y, HEADING, dx_mm * 3217 >> 10)
        p = self.p
        if p[21]:
            self._shear(HEADING, DRIFT, way_mm * 4194 >> 10)
            self._shear(HEADING, TRACK, turn_bam >> 2)
        way_mm = abs(way_mm) + abs(turn_bam) // 89  # a turn in place is a wheel's way too
        p[14] += way_mm * _SLIP
        p[0] += 1 + way_mm // _SKID
        p[7] += 1 + way_mm // _SKID
        for i in range(_N):
            while p[i * 7] > _VARIANCE_MAX:
                # So uncertain that it no longer matters how much: half of it, and of all that hangs on it.
                for j in range(_N):
                    p[i * _N + j] >>= 1
                for j in range(_N):
                    p[j * _N + i] = p[i * _N + j]
                p[i * 7] >>= 1

    def doubt(self):
        # Whatever made it so sure may have been wrong.
        p = self.p
        p[0] += _DOUBT_PLACE
        p[7] += _DOUBT_PLACE
        p[14] += _DOUBT_HEADING

    def tie(self, i, j, variance):
        # State i begins as state j, known to `variance` beside it.
        p = self.p
        for m in range(_N):
            p[i * _N + m] = p[m * _N + i] = p[j * _N + m]
        p[i * 7] = p[j * 7] + variance

    def _shear(self, i, j, c):
        # State i += c / 16384 of state j: its row, twice its diagonal, then its column.
        p = self.p
        row = i * _N
        of = j * _N
        for m in range(_N):
            v = p[of + m]
            p[row + m] += (v >> 12) * c + ((v & 4095) * c >> 12) + 2 >> 2
        v = p[row + j]
        p[row + i] += (v >> 12) * c + ((v & 4095) * c >> 12) + 2 >> 2
        for m in range(_N):
            p[m * _N + i] = p[row + m]

    def unsure(self, i, j, rho_q12):
        p = self.p
        v = (p[i * 7] >> 6) + ((p[j * 7] >> 6) * (rho_q12 * rho_q12 >> 12) >> 12) + ((p[i * _N + j] >> 6) * rho_q12 >> 11)
        return isqrt(v) << 3 if v > 0 else 0

    def correct(self, i, j, rho_q12, z_q4, noise, most):
        p = self.p
        gain = self._gain
        i *= _N
        j *= _N
        for m in range(_N):
            v = p[j + m]
            gain[m] = p[i + m] + (v >> 12) * rho_q12 + ((v & 4095) * rho_q12 + 2048 >> 12)
        i //= _N
        j //= _N
        # Variance of what was expected, then its deviation in as many bits as there are: root / 2**t
        v = gain[j]
        v = gain[i] + (v >> 12) * rho_q12 + ((v & 4095) * rho_q12 + 2048 >> 12)
        v = (v if v > 0 else 0) + (noise if noise < _NOISE_MAX else _NOISE_MAX)
        if v < 1:
            return False
        t = 0
        while v < 1 << 26:
            v <<= 2
            t += 1
        v = isqrt(v)
        far = v * most >> t
        if most and (z_q4 > far or z_q4 < -far):
            return False
        far = 48 * v >> t
        z_q4 = far if z_q4 > far else -far if z_q4 < -far else z_q4
        z_q4 = (z_q4 << t + 4) // v  # deviations, Q8
        rest = self.rest
        for m in range(_N):
            far = (1 << 26) >> t
            w = gain[m]
            w = far if w > far else -far if w < -far else w
            w = ((w << t + 3) // v + 1) >> 1  # Q2
            w = _GAIN_MAX if w > _GAIN_MAX else -_GAIN_MAX if w < -_GAIN_MAX else w
            gain[m] = w
            rest[m] += w * z_q4
        for m in range(_N):
            w = gain[m]
            i = m * _N
            for j in range(m + 1):
                p[i + j] -= w * gain[j] + 8 >> 4
                p[j * _N + m] = p[i + j]
            if p[i + m] < 1 and w:
                p[i + m] = 1
        return True

    def taken(self, i, bits):
        v = self.rest[i] + (1 << bits - 1) >> bits
        self.rest[i] -= v << bits
        return v
