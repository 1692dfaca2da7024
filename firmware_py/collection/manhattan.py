# Walls stand square to each other, most of them in most homes: which way, and what a piece of wall tells of the heading.

from ..fixed import cosine, polar, sine, wrap

_CHORD_MM = const(500)         # of wall: its direction is known to 0.45 degrees
_LONGER_MM = const(600)        # what begins farther off is another wall
_BENT_MM = const(8)            # off the chord in its middle: not straight
_CAP_BAM = const(1092)         # 6 degrees off the axis: another direction
_VOTE = const(512)
_VOTES_MIN = const(1400)       # three chords
_MAJORITY = const(6)           # tenths of the votes that elect an axis
_STRANGE_MAX = const(24)       # chords off the axis, one after the other or nearly so


class Manhattan:
    # add(x, y): a hit of the mapping beam, in mm of the odometry frame; each straight chord of wall leaves `waiting` and
    #   chord_bam, its direction in that frame
    # off(bam): how far a wall of direction bam (in the map) is off the axis, to left and right of it; 32767: not near it,
    #   or no axis is known. Its vote counts for the next election.
    # match(): it belongs to the axis. miss(): it does not -> True when the newest 16 chords or so have elected another:
    #   none yet, or long none of its walls. Where walls stand in too many directions none is elected.
    # axis_bam: of its four directions the one nearest to 0

    def __init__(self):
        self.axis_bam = 0
        self.waiting = False
        self.chord_bam = 0
        self._x = 1 << 20      # where the chord begins: nowhere yet
        self._y = 0
        self._middle_x = 0     # a hit about half-way, from there
        self._middle_y = 0
        self._known = False
        self._strange = 0
        self._votes = 0
        self._vote_x = 0       # directions times four, so that square ones are the same
        self._vote_y = 0
        self._elected = 0      # their sum: strength << 16 | direction

    def add(self, x, y):
        x -= self._x
        y -= self._y
        far = x * x + y * y if -1000 < x < 1000 and -1000 < y < 1000 else 1000000
        if far < _CHORD_MM * _CHORD_MM:
            if far < _CHORD_MM * _CHORD_MM // 4:
                self._middle_x = x
                self._middle_y = y
            return
        self._x += x
        self._y += y
        if far < _LONGER_MM * _LONGER_MM:
            far = (self._middle_x * y - self._middle_y * x) // _CHORD_MM
            if -_BENT_MM < far < _BENT_MM:
                self.waiting = True
                self.chord_bam = polar(x, y) & 0xFFFF
        self._middle_x = 0
        self._middle_y = 0

    def off(self, bam):
        self.waiting = False
        self._vote_x += (cosine(bam << 2) >> 6) - (self._vote_x >> 4)
        self._vote_y += (sine(bam << 2) >> 6) - (self._vote_y >> 4)
        self._votes += _VOTE - (self._votes >> 4)
        self._elected = polar(self._vote_x, self._vote_y)
        bam = wrap(bam - self.axis_bam << 2) >> 2
        return bam if self._known and -_CAP_BAM < bam < _CAP_BAM else 32767

    def match(self):
        self._strange = max(self._strange - 3, 0)

    def miss(self):
        self._strange += 1
        if self._votes < _VOTES_MIN or (self._elected >> 16) * 10 < self._votes * _MAJORITY:
            return False
        bam = wrap(self._elected & 0xFFFF) >> 2
        off = wrap(bam - self.axis_bam << 2) >> 2
        if self._known and (self._strange < _STRANGE_MAX or -_CAP_BAM < off < _CAP_BAM):
            return False
        self._known = True
        self.axis_bam = bam
        self._strange = 0
        return True
