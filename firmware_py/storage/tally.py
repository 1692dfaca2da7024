# The running hash of everything that must be equal on every target.


class Tally:
    # Two 16-bit halves; mix(value) folds in one int of any size below 2**30, step(core) what a step has left there. Every product
    # stays below 2**30. Never fed with link counters, memory or timing.

    def __init__(self):
        self.lo = 0x1D0F
        self.hi = 0x7A3B
        self._generation = 0

    def mix(self, value):
        lo = (self.lo ^ (value & 0xFFFF)) * 251 + 0x2F5B
        hi = (self.hi ^ (value >> 16 & 0xFFFF)) * 241 + (lo >> 8)
        self.lo = (lo ^ hi >> 7) & 0xFFFF
        self.hi = (hi ^ lo << 3) & 0xFFFF

    def step(self, core):
        o = core.odometry
        here = core.localization
        v = core.vectors
        self.mix(o.x_um)
        self.mix(o.y_um)
        self.mix(here.x_mm)
        self.mix(here.y_mm)
        self.mix(here.heading_bam << 8 | core.state)
        self.mix(core.hits.used << 16 | core.points.count)
        self.mix((core.left_mm_s & 0x1FFF) << 13 | core.right_mm_s & 0x1FFF)
        if v.generation != self._generation:
            self._generation = v.generation
            self.mix(v.used << 8 | v.chains)
            if v.used:
                self.mix(v.xs[v.used - 1])
                self.mix(v.ys[v.used - 1])
        core.hash_lo = self.lo
        core.hash_hi = self.hi
