# The running hash of everything that must be equal on every target.


class Tally:
    # Two 16-bit halves; mix(value) folds in one int of any size below 2**30. Every product stays
    # below 2**30. Never fed with link counters, memory or timing.

    def __init__(self):
        self.lo = 0x1D0F
        self.hi = 0x7A3B

    def mix(self, value):
        lo = (self.lo ^ (value & 0xFFFF)) * 251 + 0x2F5B
        hi = (self.hi ^ (value >> 16 & 0xFFFF)) * 241 + (lo >> 8)
        self.lo = (lo ^ hi >> 7) & 0xFFFF
        self.hi = (hi ^ lo << 3) & 0xFFFF
