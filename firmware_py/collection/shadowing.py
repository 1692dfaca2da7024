# Ranges from signal strength where shadowing is a field of the place: a path loss exponent for each transmitter, in sight and
# behind walls, learnt while driving (Paper eq. 3: gamma has different values in different regions, N(mu, sigma)).

from array import array
from ..fixed import isqrt
from ..limits import ANCHORS_MAX

_BEHIND_LOSS_CDB = const(400)  # published indoor values: what walls take at 1 m, and gamma and sigma behind them
_BEHIND_GAMMA = const(3500)
_BEHIND_SIGMA_CDB = const(270)
_SPREAD = const(300)           # of gamma, in sight and behind walls
_BEHIND_SPREAD = const(970)
_GAMMA_MIN = const(1000)
_GAMMA_MAX = const(8000)
_DOUBT = const(2)              # noise is taken that many times as large: the next sample is not quite independent
_EITHER = const(32)            # 2.0, Q4: less between both likelihoods decides nothing
_LOSS_MAX_CDB = const(8000)
_ONE_MM = const(3000)          # 301.03 log2(1000)


class Shadowing:
    # look(anchor, loss_cdb, expected_mm, unsure_mm): a transmitter expected at that distance, give or take unsure_mm, is
    #   weaker by loss than at 1 m -> whether that tells anything: then the robot is z_mm nearer to it than expected, give or
    #   take sigma_mm.
    # Whether the transmitter is in sight is what its strength makes more likely. Gammas in 1/1000, those behind walls after
    # those in sight; learn false: they stay what they are taken for. Allocates in __init__ only.

    def __init__(self):
        self.z_mm = 0
        self.sigma_mm = 0
        self.gammas = array("h", bytes(4 * ANCHORS_MAX))
        self.spreads = array("h", bytes(4 * ANCHORS_MAX))
        self._sigma_cdb = 0
        self._learn = True

    def begin(self, gamma, sigma_cdb, learn):
        self._sigma_cdb = sigma_cdb
        self._learn = learn
        for i in range(ANCHORS_MAX):
            self.gammas[i] = gamma
            self.spreads[i] = _SPREAD
            self.gammas[i + ANCHORS_MAX] = _BEHIND_GAMMA
            self.spreads[i + ANCHORS_MAX] = _BEHIND_SPREAD

    def look(self, anchor, loss_cdb, expected_mm, unsure_mm):
        if not (200 < expected_mm < 40000 and -_LOSS_MAX_CDB < loss_cdb < _LOSS_MAX_CDB):
            return False
        far = (log2_q12(expected_mm) * 301 >> 12) - _ONE_MM  # cdB that a gamma of 1 takes
        best = 32767
        other = 32767
        at = 0
        z = sigma = spread = unsure = 0
        for behind in range(2):  # whether walls stand between
            i = anchor + behind * ANCHORS_MAX
            gamma = self.gammas[i]
            e = gamma * far // 1000 - loss_cdb  # so much stronger than expected: nearer
            s = self._sigma_cdb
            if behind:
                e += _BEHIND_LOSS_CDB
                s = _BEHIND_SIGMA_CDB
            p = min(unsure_mm * gamma // 1000 * 434 // expected_mm, 4000)
            g = self.spreads[i] * far // 1000
            v = s * s + g * g + p * p
            if e * e // 9 > v:
                continue
            unlikely = e * e // ((v >> 4) + 1) + (log2_q12(v) * 11 >> 12)
            if unlikely < best:
                other = best
                best = unlikely
                at = i
                z = e
                sigma = s
                spread = g
                unsure = p
            elif unlikely < other:
                other = unlikely
        if other - best < _EITHER:
            return False
        v = _DOUBT * _DOUBT * sigma * sigma + spread * spread
        # cdB a mm: gamma * 434 / distance
        gamma = self.gammas[at]
        self.z_mm = z * expected_mm // gamma * 1000 // 434
        self.sigma_mm = isqrt(v) * expected_mm // gamma * 1000 // 434
        if self._learn:
            v += unsure * unsure
            was = self.spreads[at]
            self.gammas[at] = max(_GAMMA_MIN, min(gamma - was * ((spread * z << 4) // v) // 16, _GAMMA_MAX))
            while v > 1 << 19:
                v >>= 2
                spread >>= 1
            self.spreads[at] = isqrt(was * was * ((v - spread * spread << 10) // v) >> 10)
        return True


def log2_q12(n):
    # Of 1 <= n < 2**30, within 0.008: the parabola that is exact at both ends of each octave.
    i = 0
    while n >= 8192:
        n >>= 1
        i += 4096
    while n < 4096:
        n <<= 1
        i -= 4096
    n -= 4096
    return i + 49152 + n + ((n * (4096 - n) >> 12) * 1408 >> 12)
