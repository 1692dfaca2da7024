# UWB reports to the deviation of the position (Paper eq. 3), integers only.

from array import array
from ..fixed import isqrt, power2
from ..limits import ANCHORS_MAX

SOURCE_NONE = 0
SOURCE_STRENGTH = 1
SOURCE_TIME_OF_FLIGHT = 2

_RECORDS_MAX = const(15)       # as many as a STEP holds
_RECORDS = const(8)            # worked off a tick: a report comes in one of five, and the filter needs two of them
_RANGE_MAX_MM = const(40000)
_LOSS_MAX = const(20000)       # cdB from the level at 1 m, either way
_AGE_SHIFT = const(5)          # each report fades the older ones by 1/32: about three seconds of them count
_AXIS_MAX_MM = const(20000)    # no transmitter is heard farther off
_GATE_MM = const(120)          # a range farther off than this and four deviations is an outlier
_RESIDUAL_MAX_MM = const(900)
_TOF_SIGMA_MM = const(100)
_DEVIATION_MAX_MM = const(800) # a range less accurate than that has no weight
_SOLUTION_MAX_MM = const(4000) # farther off, the geometry is too poor
_WEIGHT = const(640000)         # 64 for a range of 100 mm
_NOISE_CDB = const(50)
_SEEN_SHIFT = const(3)         # over the last eight reports or so
_SEEN_MAX_MM = const(2000)
_TRUSTED = const(3000)         # 29 mm: what dead reckoning is trusted for where the ranges say little
_STRIFE_MAX = const(99)
_WALLS_MM = const(1000)        # so far walls may draw the estimate away, where ranges are by time of flight
_UNIT = const(2560000)         # square millimetres times information

# Places in `scope`, an array "i": first a11, a12, a22, b1, b2, the sums
_X = const(5)                  # where the report's ranges are seen from, mm
_Y = const(6)
_FIRST = const(7)              # in the table of parameters: the transmitters' x, then their y, then their heights
_GAMMA = const(8)              # 0: ranges by time of flight
_SPREAD = const(9)             # relative deviation of a range, Q12
_ALPHA = const(10)             # Q12
PRIOR = const(11)              # _TRUSTED, or 0: dead reckoning is not weighed in
SLACK = const(12)              # mm that the estimate may be off, beside what the range may
_WORTH = const(13)             # a range's weight times its variance
_FAR = const(14)               # the deviation beyond which a range has no weight


class Uwb:
    # Weighted least squares of the deviation (dx, dy) of the true from the estimated position, over the
    # ranges of the last reports (Paper eq. 3 averages n samples of one transmitter; here all count,
    # each by its own accuracy, linearised at the estimate; transmitter heights are known).
    #   add(values, first, x_mm, y_mm): takes the records of a STEP, seen from the estimate
    #   work(): treats some of those waiting; a report at once would be twice what the rest of a step costs
    #   solve(): dx_mm, dy_mm, reports -> False when the geometry or the reports are too few
    #   next(x, y): instead of work(), the next of the strengths waiting -> its transmitter is dx_mm, dy_mm from there
    #   clear(): after the estimate was replaced; forget(): after the robot was set down elsewhere
    # variance_mm2: of one axis of the solution. A and its right-hand side hold information: 1 is worth
    # a deviation of 1600 mm (1 / 2.56e6 a square millimetre). Allocates in __init__ only.

    def __init__(self):
        self.dx_mm = 0
        self.dy_mm = 0
        self.variance_mm2 = 0
        self.reports = 0
        self.outliers = 0
        self.static = 0        # the ranges' errors are a field of the place
        self.anchor = 0        # next(): the transmitter
        self.loss_cdb = 0
        self.far_mm = 0
        self.gamma = 0
        self.sigma_cdb = 0
        self.contradicted = False  # the last report contradicts the estimate
        self.strife = 0        # so many reports, one after the other or nearly so
        self._source = 0
        self._anchors = 0
        self._table = None
        self._level_1m = 0
        self._level_min = 0
        self._seen_mm = array("h", bytes(2 * ANCHORS_MAX))
        self.scope = array("i", bytes(60))
        self.waiting = 0
        self._told = 0         # of the present report: what weigh() said
        self._queue = array("i", bytes(4 * _RECORDS_MAX))  # transmitter << 16 | range in mm, or loss + _LOSS_MAX

    def begin(self, parameters, weighted, filtered=0):
        scope = self.scope
        scope[PRIOR] = _TRUSTED if weighted else 0
        self._source = parameters.of("uwb_source")
        self._anchors = parameters.of("anchor_count")
        self._table = parameters.values
        scope[_FIRST] = parameters.first("anchor_x")
        self._level_1m = parameters.of("uwb_level_1m")
        self._level_min = parameters.of("uwb_level_min")
        gamma = parameters.of("uwb_gamma")
        sigma = parameters.of("uwb_sigma")
        self.gamma = gamma
        self.sigma_cdb = sigma
        scope[_GAMMA] = gamma if self._source == SOURCE_STRENGTH else 0
        # s = ln 10 sigma / (10 gamma); alpha = exp(-s^2 / 2), to the second order
        s = sigma * 9431 // gamma           # Q12: ln(10) / 10 * 4096 * 10
        scope[_SPREAD] = s if s > 20 else 20
        scope[_ALPHA] = 4096 - (s * s >> 13) if s < 2048 else 3584
        # Shadowing beyond a receiver's own noise is a property of the place: averaging does not help against it.
        self.static = filtered and scope[_GAMMA] and sigma > _NOISE_CDB
        scope[_WORTH] = _WEIGHT
        scope[_FAR] = 30000 if filtered else _DEVIATION_MAX_MM

    def clear(self):
        for i in range(5):
            self.scope[i] = 0
        self.reports = 0

    def forget(self):
        # What was told was told of another place.
        self.clear()
        self.waiting = 0
        self.strife = 0
        for i in range(ANCHORS_MAX):
            self._seen_mm[i] = 0

    def shift(self, dx_mm, dy_mm):
        # The estimate has moved by (dx, dy): the reports that count now deviate by so much less.
        s = self.scope
        s[_X] += dx_mm
        s[_Y] += dy_mm
        if (s[0] + s[2] >> 10) * (abs(dx_mm) + abs(dy_mm)) > 1 << 19:
            self.clear()  # so far that they were linearised elsewhere, and that a product would pass 2**30
            return
        s[3] -= s[0] * dx_mm + s[1] * dy_mm
        s[4] -= s[1] * dx_mm + s[2] * dy_mm
        if abs(s[3]) > 1 << 29 or abs(s[4]) > 1 << 29:
            self.clear()

    def add(self, values, first, x_mm, y_mm):
        if self._source == SOURCE_NONE:
            return
        while self.waiting:
            self.work()  # reports come faster than they are worked off
        self.scope[_X] = x_mm
        self.scope[_Y] = y_mm
        self._told = 0
        for i in range(5):
            self.scope[i] -= self.scope[i] >> _AGE_SHIFT
        if abs(self.scope[3]) > 1 << 28 or abs(self.scope[4]) > 1 << 28:
            self.clear()  # near and exact transmitters that contradict the estimate, all of them
        queue = self._queue
        anchors = self._anchors
        weakest = self._level_min
        loss = self._level_1m + _LOSS_MAX if self._source == SOURCE_STRENGTH else 0
        n = values[first] if values[first] < _RECORDS_MAX else _RECORDS_MAX
        first += 1
        used = 0
        while n > 0:
            n -= 1
            anchor = values[first]
            d = values[first + 1]
            if d >= weakest and 0 <= anchor < anchors:
                d = loss - d if loss else values[first + 2]
                if 0 < d <= _RANGE_MAX_MM:
                    queue[used] = anchor << 16 | d
                    used += 1
            first += 3
        self.waiting = used

    def work(self):
        n = self.waiting
        self.waiting = n - _RECORDS if n > _RECORDS else 0
        n = weigh(self.scope, self._queue, self._table, self._seen_mm, self.waiting, n)
        self.outliers = self.outliers + (n >> 8 & 255) & 0xFFFF
        if n & 0xFF and not self._told & 0xFF and self.reports < 1000:
            self.reports += 1
        self._told += n
        if self.waiting == 0:
            # Walls make a range longer, never shorter: who is told that he is nearer to transmitters than he can be, and to half
            # as many as agree with him, is not where he thinks, whatever stands between.
            n = self._told >> 16
            self.contradicted = n > 0 and 2 * n >= self._told & 0xFF and (self._told >> 8) + self._told & 0xFF > 3
            self.strife = min(self.strife + 1, _STRIFE_MAX) if self.contradicted else max(self.strife - 2, 0)

    def next(self, x_mm, y_mm):
        # Of a report of strengths one transmitter: dx_mm, dy_mm the way there, far_mm with its height. -> False: out of reach
        n = self.waiting - 1
        self.waiting = n
        n = self._queue[n]
        self.anchor = n >> 16
        self.loss_cdb = (n & 0xFFFF) - _LOSS_MAX
        n = self.scope[_FIRST] + self.anchor
        table = self._table
        x_mm = table[n] - x_mm
        y_mm = table[n + ANCHORS_MAX] - y_mm
        self.dx_mm = x_mm
        self.dy_mm = y_mm
        if not (-_AXIS_MAX_MM < x_mm < _AXIS_MAX_MM and -_AXIS_MAX_MM < y_mm < _AXIS_MAX_MM):
            return False
        n = table[n + 2 * ANCHORS_MAX]
        self.far_mm = isqrt(x_mm * x_mm + y_mm * y_mm + n * n)
        return self.far_mm > 0

    def solve(self):
        scope = self.scope
        prior = scope[PRIOR]
        a = scope[0] + prior
        b = scope[1]
        c = scope[2] + prior
        p = scope[3]
        q = scope[4]
        # The same by halves until every product stays below 2**30; unit is what one of A is worth then.
        unit = _UNIT
        while a > 8191 or c > 8191:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
            unit >>= 1
        det = a * c - b * b
        mean = a + c >> 1
        if self.reports < 6 or det < 4096 or (prior == 0 and det < mean * mean >> 5):
            return False  # too few, or all in one direction, within 10 degrees
        self.variance_mm2 = (a + c) * (unit // 2 + 1 >> 6) // (det >> 6)
        while p > 16383 or p < -16384 or q > 16383 or q < -16384:
            a >>= 1
            b >>= 1
            c >>= 1
            p >>= 1
            q >>= 1
        det = a * c - b * b
        if det < 64:
            return False
        self.dx_mm = (c * p - b * q) // det
        self.dy_mm = (a * q - b * p) // det
        return abs(self.dx_mm) < _SOLUTION_MAX_MM and abs(self.dy_mm) < _SOLUTION_MAX_MM


def weigh(scope, queue, table, seen_mm, begin, end):
    # Adds the records queue[begin .. end) to the sums. -> how many counted, outliers << 8, those of them that are far too short << 16
    # A port may put machine code in its place: ports/rolling_viper.py.
    x_mm = scope[_X]
    y_mm = scope[_Y]
    gamma = scope[_GAMMA]
    transmitters = ANCHORS_MAX
    deviation = _TOF_SIGMA_MM
    told = 0
    while begin < end:
        d = queue[begin]
        begin += 1
        anchor = d >> 16
        d &= 0xFFFF
        i = scope[_FIRST] + anchor
        dx = table[i] - x_mm
        dy = table[i + transmitters] - y_mm
        if not (-_AXIS_MAX_MM < dx < _AXIS_MAX_MM and -_AXIS_MAX_MM < dy < _AXIS_MAX_MM):
            continue
        if gamma:
            # Paper eq. 3: d = alpha 10^((PL_1 - P) / (10 gamma)) = alpha 2^(log2(10) / 10 ...)
            d = power2((d - _LOSS_MAX) * 13607 // gamma)
            if d < 2 or d > _RANGE_MAX_MM:
                continue
            d = d * scope[_ALPHA] >> 12
            deviation = d * scope[_SPREAD] >> 12
        # Two rounds of Newton from the range itself: exact where it is near, and an outlier stays one.
        i = table[i + 2 * transmitters]
        i = dx * dx + dy * dy + i * i
        if d < 1 or i < 10000:
            continue  # nearer than 100 mm no direction is told
        expected = d + i // d >> 1
        expected = expected + i // expected >> 1
        e = expected - d
        likely = deviation
        if scope[PRIOR]:
            # What this transmitter's ranges deviate by lately, if that is more than the model says: behind
            # walls it is many times as much.
            i = e if e >= 0 else -e
            i = seen_mm[anchor] + ((i if i < _SEEN_MAX_MM else _SEEN_MAX_MM) - seen_mm[anchor] >> _SEEN_SHIFT)
            seen_mm[anchor] = i
            i = i * 5 >> 2  # from a mean to a deviation
            if i > likely:
                likely = i
        i = _GATE_MM + 4 * deviation
        if i > _RESIDUAL_MAX_MM:
            i = _RESIDUAL_MAX_MM
        i += scope[SLACK]
        if e > i or e < -i:
            told += 65792 if e > i + (0 if gamma else _WALLS_MM) else 256
        elif likely <= scope[_FAR]:
            # A move by u (towards the transmitter) shortens the range by 1: e = u . (dx, dy)
            w = scope[_WORTH] // (likely * likely) if likely > 25 else 1024
            if w > 1024:
                w = 1024
            dx = (dx << 6) // expected
            dy = (dy << 6) // expected
            scope[0] += w * dx * dx >> 10
            scope[1] += w * dx * dy >> 10
            scope[2] += w * dy * dy >> 10
            scope[3] += w * dx * e >> 4
            scope[4] += w * dy * e >> 4
            told += 1
    return told
