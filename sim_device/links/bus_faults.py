# What goes wrong on a CAN bus by itself: frames that nobody hears, queues that are full, the traffic of others.

import random

from sim_device.faults import BUSY_MAX
from sim_device.links.can_frame import parse

CHANCES = {"loss": 1.0, "full": 1.0, "busy": BUSY_MAX}     # and the largest
_NODE = 1       # of the ids of ours, which others leave alone


# `loss`: the probability that a frame reaches nobody. `full`: that one finds its sender's queue full. `busy`: the share of
# the bus's time that frames of others take, in between. All by the seed; each 0 until set() is told otherwise.
class BusFaults:
    def __init__(self, seed=1):
        self.loss = self.full = self.busy = 0.0
        self._random = random.Random(seed)
        self._owed_s = 0.0

    def set(self, name, value):
        """Whether this could be done."""
        if name == "seed":
            self._random = random.Random(int(value))
        elif 0 <= value <= CHANCES.get(name, -1):
            setattr(self, name, value)
        else:
            return False
        return True

    def loses(self):
        return self.loss > 0 and self._random.random() < self.loss

    def refuses(self):
        return self.full > 0 and self._random.random() < self.full

    def passed(self, bus_s):
        """A frame of ours has kept the bus for so long: others get their share."""
        if self.busy:
            self._owed_s += bus_s * self.busy / (1 - self.busy)

    def others(self):
        """The next frame of others; None once they have had their share."""
        if self._owed_s <= 0:
            return None
        draw = self._random.randrange
        can_id = draw(1 << 11)
        if can_id >> 6 & 7 == _NODE:
            can_id ^= 1 << 8
        head = "t%03X" % can_id if draw(2) else "T%08X" % (can_id << 18 | draw(1 << 18))
        size = draw(9)
        frame = parse(("%s%d%s" % (head, size, self._random.randbytes(size).hex())).encode())
        self._owed_s -= frame.bus_s
        return frame
