# One barrier from its first vector to its last: recognised as outline or island, joined, closed.

from ..storage.breadcrumbs import OPEN, OUTLINE_CLOSED
from ..storage.vector_store import OUTLINE, BARRIER, SEARCHED, CHAIN_END

# what visit() says
GOING_ON = 0
CLOSING = 1      # the outline is closed; the robot goes on along it for the overlap
DONE = 2         # the overlap is walked, the outline is whole
ISLAND = 3       # the barrier was an island; it is recorded
STRAY = 4        # a loop round an island beside the barrier was cut out: loop_mm
STALE = 5        # for long there has been nothing that was not on the map: give up

_TOLERANCE_MM = const(150)
_DRIFT = const(250)          # dead reckoning alone: 4 mm a metre are three deviations
_JOIN_PATH_MM = const(700)   # past the crumb that closed, at least
_OVERLAP_MM = const(800)     # walked twice after that, to measure the closure error
_JOIN_MM = const(50)
_CROSSING_MM = const(5000)   # the same, at most, where fixes do not bound the error: as far as the next corner
_STRAYS_MAX = const(8)
_STALE_MM = const(1200)      # so far along what is known, and the rest is known, too
_CHECK_MM = const(40)
_KNOWN_MM = const(130)
_FRESH_MIN = const(4)
_SLICE = const(2)            # pieces of the map coded a tick


class Outline:
    # begin() when the robot starts to follow a barrier, abandon() when it was none after all;
    #   add(x, y, map_x, map_y)  a sample of its wall, in mm of the odometry frame and of the map
    #   visit(...)               where the robot is now -> one of the words above
    #   finish()                 whatever happened: the open chain ends
    #   build()                  long work in slices, at the mission's end -> True when the map is sealed
    # The error of the closure is spread along the outline if `spread` and dead reckoning was alone.

    def __init__(self, vectors, crumbs, image, walls, closure, sight):
        self._sight = sight
        self.spread = True
        self.whole = False        # the outline is known: what follows are the barriers inside
        self.loop_mm = 0
        self._fresh = 0           # samples of this barrier that were not on the map
        self._stale_mm = 0        # path where the last of them was
        self._checked_mm = 0
        self._fresh_vectors = 0   # records by then
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
        self._heading_bam = 0
        self._sealing = False

    def begin(self, path_mm, turn_bam):
        self._first_vector = self._vectors.used
        self._first_chain = self._vectors.chains
        self._crumbs.clear(path_mm, turn_bam)
        self._walls.kind = BARRIER if self.whole else OUTLINE
        self._fresh = 0
        self._fresh_vectors = self._first_vector
        self._stale_mm = self._checked_mm = path_mm
        self._joined = False
        self._closing_mm = -1
        self._strays = 0

    def abandon(self):
        self._walls.finish()
        self._vectors.drop(self._first_vector, self._vectors.used)

    def give_up(self):
        # What of this barrier was not on the map stays; where it was, it goes on as something known.
        self._walls.finish()
        if self._fresh < _FRESH_MIN:
            self._fresh_vectors = self._first_vector
        self._vectors.drop(self._fresh_vectors, self._vectors.used)
        if self._fresh_vectors > self._first_vector:
            self._vectors.flags[self._vectors.used - 1] |= CHAIN_END
        self._vectors.seal(self._first_vector, self._first_chain, BARRIER | SEARCHED)

    def finish(self):
        self._walls.finish()

    def add(self, x, y, map_x, map_y):
        self._x = map_x
        self._y = map_y
        if self._joined:
            self._closure.add(map_x, map_y, self._heading_bam)
        else:
            self._walls.add(x, y)

    def visit(self, here, path_mm, turn_bam):
        # here: the estimate (x_mm, y_mm, heading_bam, fixes, adrift).
        self._heading_bam = here.heading_bam
        if self._closing_mm >= 0:
            return self._overlap(path_mm - self._closing_mm)
        tolerance_mm = _TOLERANCE_MM
        self._fixed = here.fixes > 0 and not here.adrift
        if not self._fixed:
            tolerance_mm += (path_mm - self._crumbs.start_mm) // _DRIFT
        if self.whole and self._stale(path_mm):
            return STALE
        closed = self._crumbs.visit(here.x_mm, here.y_mm, here.heading_bam, turn_bam, path_mm,
                                    self._vectors.used, tolerance_mm)
        if closed == OPEN:
            return GOING_ON
        at = self._crumbs.vectors[self._crumbs.closed_at]
        if closed == OUTLINE_CLOSED and self.whole:
            return STALE
        if closed == OUTLINE_CLOSED:
            self._lap_vector = at
            self._closing_mm = path_mm
            self._join_mm = max(_JOIN_PATH_MM, self._crumbs.reach_mm + 100)
            return CLOSING
        return self._island(at)

    def _stale(self, path_mm):
        # Whether the robot has long been following what is on the map already.
        if path_mm - self._checked_mm >= _CHECK_MM:
            self._checked_mm = path_mm
            self._sight.chains = self._first_chain
            if self._sight.clear(self._x - _KNOWN_MM, self._y, self._x + _KNOWN_MM, self._y, _KNOWN_MM):
                self._fresh += 1
                self._stale_mm = path_mm
                self._fresh_vectors = self._vectors.used
            self._sight.chains = -1
        return path_mm - self._stale_mm > _STALE_MM

    def _island(self, at):
        if self.whole and self._fresh < _FRESH_MIN:
            return STALE
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
                self._closure.begin(self._first_vector, not self._fixed)
                self._joined = True
        elif far_mm > self._join_mm + (_OVERLAP_MM if self._fixed or self._closure.crossed() else _CROSSING_MM):
            self._closure.solve(v.used)
            if not self.spread or self._fixed:
                self._closure.cancel()  # fixes bound the error: it did not grow with the way
            v.seal(self._first_vector, self._first_chain, OUTLINE | SEARCHED)
            self.whole = True
            return DONE
        return CLOSING

    def settled(self):
        # Long work in slices: the closure error. -> True when it is done
        return self._closure.step()

    def build(self):
        # First the closure error, then the bytes of the map.
        if not self._sealing:
            if self._closure.step():
                self._image.begin()
                self._sealing = True
            return False
        return self._image.step(_SLICE)
