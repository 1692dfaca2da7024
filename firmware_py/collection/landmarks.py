# The outline's walls as landmarks: who meets one again learns how far off he is across it.

from ..fixed import cosine, isqrt, sine

_OUTLINE_ONLY = const(1)   # kind of a barrier (storage/vector_store.py): mapped later, from a place that was known less well
_GATE_MM = const(300)
_SHORT = const(50)         # 25 cm, in map units: a shorter vector tells too little
_MARGIN = const(16)        # 8 cm from its ends: corners are the least certain
_ECHO = const(3900)        # cosine of 17 degrees: within the cone the echo comes from where the wall is nearest
_SONAR_MM = const(150)     # from the robot's centre
_ECHO_MIN_MM = const(100)
_ECHO_MAX_MM = const(2500)
_EVERY_MM = const(100)
_HIT_MAX_MM = const(250)
_SIDE = const(5)           # the mapping beam
_ALIKE_MM = const(40)


class Landmarks:
    # look(here, path_mm, j, sonar_mm): each step inside. Beam j (-1: none, a barrier is being mapped) or an echo of the ultrasonic
    #   sensor that ends at a vector of the outline, twice in a row and alike (once it may be anything that stands before the
    #   wall), is told to `here`: off_mm beyond it, (nx, ny) Q12 the way there. So are the walls that the robot passes.
    # Each 10 cm of way at most, and only while `here` is unsure. Allocates nothing after __init__.

    def __init__(self, vectors, sight, infrared, frame):
        self.on = 0
        self.off_mm = 0
        self.nx = 0
        self.ny = 0
        self._vectors = vectors
        self._sight = sight
        self._infrared = infrared
        self._frame = frame
        self._met = -1         # the vector met last
        self._met_off_mm = 0
        self._met_path_mm = 0

    def look(self, here, path_mm, j, sonar_mm):
        seen = self._infrared
        if j >= 0 and seen.ranges_mm[_SIDE] < _HIT_MAX_MM:
            here.wall(seen.hit_x[_SIDE], seen.hit_y[_SIDE])
        if path_mm - self._met_path_mm < _EVERY_MM or not here.unsure():
            return
        x = here.x_mm
        y = here.y_mm
        if _ECHO_MIN_MM < sonar_mm < _ECHO_MAX_MM:
            far = sonar_mm + _SONAR_MM
            bam = here.heading_bam
            if self._met_again(x, y, x + (far * cosine(bam) >> 15), y + (far * sine(bam) >> 15), sonar_mm, path_mm):
                here.met(self)
        elif j >= 0 and seen.ranges_mm[j] < _HIT_MAX_MM:
            f = self._frame
            f.put(seen.hit_x[j], seen.hit_y[j])
            if self._met_again(x, y, f.x, f.y, 0, path_mm):
                here.met(self)

    def _met_again(self, x, y, hit_x, hit_y, echo_mm, path_mm):
        if not self._meet(x, y, hit_x, hit_y, echo_mm):
            return False
        k = self._sight.scope[8]
        alike = k == self._met and -_ALIKE_MM < self.off_mm - self._met_off_mm < _ALIKE_MM
        self._met = k
        self._met_off_mm = self.off_mm
        self._met_path_mm = path_mm
        return alike

    def _meet(self, x_mm, y_mm, hit_x, hit_y, echo_mm):
        v = self._vectors
        dx = hit_x - x_mm
        dy = hit_y - y_mm
        far = isqrt(dx * dx + dy * dy)
        if far < 100:
            return False
        s = self._sight
        reach = far + _GATE_MM
        if not s.met(x_mm // 5, y_mm // 5, dx * reach // far // 5, dy * reach // far // 5, 1, 0):
            return False
        k = s.scope[8]
        c = v.chain_of(k)
        if k <= v.firsts[c] or v.kinds[c] & _OUTLINE_ONLY:
            return False
        x = v.xs[k - 1]
        y = v.ys[k - 1]
        ux = v.xs[k] - x
        uy = v.ys[k] - y
        if not (-6000 < ux < 6000 and -6000 < uy < 6000):
            return False
        length = isqrt(ux * ux + uy * uy)
        if length < _SHORT:
            return False
        ux = (ux << 12) // length
        uy = (uy << 12) // length
        x = hit_x - x * 5
        y = hit_y - y * 5
        along = (x * ux + y * uy >> 12) // 5
        steep = ((dx * uy - dy * ux >> 12) << 12) // far  # cosine of the angle at which the beam meets it
        # Free space lies to the left of a vector: beyond it is to its right.
        self.nx = uy
        self.ny = -ux
        self.off_mm = (x * uy - y * ux >> 12) + (echo_mm * (4096 - steep) >> 12)
        return (_MARGIN < along < length - _MARGIN and steep > (_ECHO if echo_mm else 2048)
                and -_GATE_MM < self.off_mm < _GATE_MM)
