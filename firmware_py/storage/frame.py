# From the odometry frame to the map's frame.

from ..fixed import sine, cosine


class Frame:
    # A rotation by turn_bam about (from_x, from_y) of the odometry frame, which lies at
    # (to_x, to_y) of the map; all in mm. put(x, y) leaves the mapped point in x, y.
    # Points farther than 32 m from the anchor along x or y are clamped there: move() the anchor along.

    def __init__(self):
        self.turn_bam = 0
        self.from_x = 0
        self.from_y = 0
        self.to_x = 0
        self.to_y = 0
        self.x = 0
        self.y = 0
        self._cos = 16384  # Q14: 32 m of it twice stay below 2**30
        self._sin = 0

    def copy(self, other):
        self.from_x = other.from_x
        self.from_y = other.from_y
        self.to_x = other.to_x
        self.to_y = other.to_y
        self.rotate(other.turn_bam)

    def rotate(self, turn_bam):
        self.turn_bam = turn_bam & 0xFFFF
        self._cos = cosine(turn_bam) + 1 >> 1
        self._sin = sine(turn_bam) + 1 >> 1

    def move(self, x, y):
        # Anchor at (x, y) of the odometry frame; nothing mapped changes by more than the rounding.
        self.put(x, y)
        self.from_x = x
        self.from_y = y
        self.to_x = self.x
        self.to_y = self.y

    def put(self, x, y):
        dx = x - self.from_x
        dy = y - self.from_y
        if self.turn_bam:
            if dx > 32000 or dx < -32000:
                dx = 32000 if dx > 0 else -32000
            if dy > 32000 or dy < -32000:
                dy = 32000 if dy > 0 else -32000
            x = (dx * self._cos - dy * self._sin + 8192) >> 14
            dy = (dx * self._sin + dy * self._cos + 8192) >> 14
            dx = x
        self.x = self.to_x + dx
        self.y = self.to_y + dy
