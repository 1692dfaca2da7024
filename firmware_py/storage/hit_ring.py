# The last infrared hits around the robot: what the follower rolls along.

from array import array

_EMPTY = const(255)


class HitRing:
    # Up to 64 points (x, y) in mm of the ODOMETRY frame, one for each 16 mm cell that a beam hit.
    # A hit in a cell that is known moves its point and renews its stamp; a new cell takes
    # the oldest slot (a slot renewed in the last 0.2 s is passed over, at most 8 of them).
    # "Full" overwrites, and counts in `lost`. Cells are found by a hash of 64 chains.
    #
    # Layout: xs, ys int32; stamps u16 tick; nexts, buckets: the chains; heads: first of each.
    # Allocates in __init__ only. Written by Infrared and Explorer, read by Follower.

    CAPACITY = 64
    RECORD_BYTES = 12  # x, y 4 each, stamp 2, next 1, bucket 1; and 64 B of heads

    def __init__(self):
        self.xs = array("i", bytes(4 * 64))
        self.ys = array("i", bytes(4 * 64))
        self.stamps = array("H", bytes(2 * 64))
        self.nexts = bytearray(64)
        self.buckets = bytearray(64)
        self.heads = bytearray(64)
        self.used = 0
        self.lost = 0
        self._write = 0
        self.clear()

    def clear(self):
        for i in range(64):
            self.heads[i] = _EMPTY
            self.buckets[i] = _EMPTY  # of a slot: _EMPTY = the slot is free
        self.used = 0
        self._write = 0

    def add(self, x_mm, y_mm, tick):
        cx = x_mm >> 4
        cy = y_mm >> 4
        bucket = (cx * 5 + cy * 23) & 63
        xs = self.xs
        ys = self.ys
        i = self.heads[bucket]
        while i != _EMPTY:
            if xs[i] >> 4 == cx and ys[i] >> 4 == cy:
                xs[i] = x_mm
                ys[i] = y_mm
                self.stamps[i] = tick & 0xFFFF
                return
            i = self.nexts[i]
        i = self._write
        n = 8
        while n and self.buckets[i] != _EMPTY and ((tick - self.stamps[i]) & 0xFFFF) < 10:
            i = (i + 1) & 63
            n -= 1
        self._write = (i + 1) & 63
        if self.buckets[i] != _EMPTY:
            self.remove(i)
            self.lost = (self.lost + 1) & 0xFFFF
        xs[i] = x_mm
        ys[i] = y_mm
        self.stamps[i] = tick & 0xFFFF
        self.buckets[i] = bucket
        self.nexts[i] = self.heads[bucket]
        self.heads[bucket] = i
        self.used += 1

    def remove(self, i):
        bucket = self.buckets[i]
        if bucket == _EMPTY:
            return
        self.buckets[i] = _EMPTY
        self.used -= 1
        j = self.heads[bucket]
        if j == i:
            self.heads[bucket] = self.nexts[i]
            return
        while self.nexts[j] != i:
            j = self.nexts[j]
        self.nexts[j] = self.nexts[i]
