# Seeded Gaussian noise, drawn in blocks: one stream per purpose, so that a
# sensor that draws more never shifts the noise of another.

import zlib

import numpy as np


def generator(seed, purpose):
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed & 0xFFFFFFFF, zlib.crc32(purpose.encode())])))


# N(0, 1) numbers one group of `width` at a time. A numpy call per number costs
# ten times the number itself: a block holds 1,024 groups.
class Noise:
    GROUPS = 1024

    def __init__(self, seed, purpose, width):
        self._generator = generator(seed, purpose)
        self._width = width
        self._block = []
        self._next = 0

    def group(self):
        """The next `width` numbers as a tuple."""
        if self._next == len(self._block):
            numbers = self._generator.standard_normal((self.GROUPS, self._width))
            self._block = list(map(tuple, numbers.tolist()))
            self._next = 0
        self._next += 1
        return self._block[self._next - 1]
