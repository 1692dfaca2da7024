# One barrier from its first vector to its last: recognised as outline or island, joined, closed.

from ..storage.breadcrumbs import OPEN, OUTLINE_CLOSED
from ..storage.vector_store import OUTLINE, BARRIER, SEARCHED

# what visit() says
GOING_ON = 0
CLOSING = 1      # the outline is closed; the robot goes on along it for the overlap
DONE = 2         # the overlap is walked, the outline is whole
ISLAND = 3       # the barrier was an island; it is recorded
STRAY = 4        # a loop round an island beside the barrier was cut out: loop_mm

_TOLERANCE_MM = const(150)
_DRIFT = const(250)          # dead reckoning alone: 4 mm a metre are three deviations
_JOIN_PATH_MM = const(700)   # past the crumb that closed, at least
_OVERLAP_MM = const(800)     # walked twice after that, to measure the closure error
_JOIN_MM = const(50)
_STRAYS_MAX = const(8)
_SLICE_BYTES = const(64)     # of the map's CRC a tick


class Outline:
    # begin() when the robot starts to follow a barrier, abandon() when it was none after all;
    #   add(x, y, map_x, map_y)  a sample of its wall, in mm of the odometry frame and of the map
    #   visit(...)               where the robot is now -> one of the words above
    #   finish()                 whatever happened: the open chain ends
    #   build()                  long work in slices, at the mission's end -> True when the map is sealed
    # The error of the closure is spread along the outline if `spread` and dead reckoning was alone.

    def __init__(self, vectors, crumbs, image, walls, closure):
        self.spread = True
        self.loop_mm = 0
        self._vectors = vectors
        self._crumbs = crumbs
        self._image = image
        self._walls = walls
        self._closure = closure
        self._first_vector = 0    # of this barrier
        self._first_chain = 0
        self._lap_vector = 0      # record that the closed outline begins with
        self._strays = 0
        self._closing_mm = -1     # path where the outline closed
        self._join_mm = 0
        self._joined = False      # the lap is mapped whole; the overlap is walked
        self._fixed = False
        self._x = 0
        self._y = 0
        self._sealing = False

    def begin(self, path_mm, turn_bam):
        self._first_vector = self._vectors.used
        self._first_chain = self._vectors.chains
        self._crumbs.clear(path_mm, turn_bam)
        self._walls.kind = OUTLINE
        self._joined = False
        self._closing_mm = -1
        self._strays = 0

    def abandon(self):
        self._walls.finish()
        self._vectors.drop(self._first_vector, self._vectors.used)

    def finish(self):
        self._walls.finish()

    def add(self, x, y, map_x, map_y):
        self._x = map_x
        self._y = map_y
        if self._joined:
            self._closure.add(map_x, map_y)
        else:
            self._walls.add(x, y)

    def visit(self, here, path_mm, turn_bam):
        # here: the estimate (x_mm, y_mm, heading_bam, fixes).
        if self._closing_mm >= 0:
            return self._overlap(path_mm - self._closing_mm)
        tolerance_mm = _TOLERANCE_MM
        self._fixed = here.fixes > 0
        if not self._fixed:
            tolerance_mm += (path_mm - self._crumbs.start_mm) // _DRIFT
        closed = self._crumbs.visit(here.x_mm, here.y_mm, here.heading_bam, turn_bam, path_mm,
                                    self._vectors.used, tolerance_mm)
        if closed == OPEN:
            return GOING_ON
        at = self._crumbs.vectors[self._crumbs.closed_at]
        if closed == OUTLINE_CLOSED:
            self._lap_vector = at
            self._closing_mm = path_mm
            self._join_mm = max(_JOIN_PATH_MM, self._crumbs.reach_mm + 100)
            return CLOSING
        return self._island(at)

    def _island(self, at):
        self._walls.finish()
        if at > self._first_vector + 1 and self._strays < _STRAYS_MAX:
            # From one barrier the robot came to an island near it and went round that. Cut the loop
            # out: seen with a wider berth, both are one barrier.
            self._strays += 1
            self.loop_mm = self._crumbs.loop_mm()
            self._vectors.split(at + 2, BARRIER | SEARCHED)
            self._crumbs.excise()
            return STRAY
        self._vectors.seal(self._first_vector, self._first_chain, BARRIER | SEARCHED)
        return ISLAND

    def _overlap(self, far_mm):
        v = self._vectors
        if not self._joined:
            i = self._lap_vector
            dx = self._x - v.xs[i] * 5
            dy = self._y - v.ys[i] * 5
            if far_mm > self._join_mm or (-_JOIN_MM < dx < _JOIN_MM and -_JOIN_MM < dy < _JOIN_MM):
                # The mapping beam has come to where the lap began. What was mapped before that is a stray.
                self._walls.finish()
                v.drop(self._first_vector, i)
                self._closure.begin(self._first_vector)
                self._joined = True
        elif far_mm > self._join_mm + _OVERLAP_MM:
            self._closure.solve(v.used)
            if not self.spread or self._fixed:
                self._closure.cancel()  # fixes bound the error: it did not grow with the way
            v.seal(self._first_vector, self._first_chain, OUTLINE | SEARCHED)
            return DONE
        return CLOSING

    def build(self):
        # First the closure error, then the CRC of the map.
        if not self._sealing:
            if self._closure.step():
                self._image.begin()
                self._sealing = True
            return False
        return self._image.step(_SLICE_BYTES)
