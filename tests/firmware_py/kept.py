# Cores with stores at random, and the robot's memory that they are kept in. No assertion lives here.

import random
from array import array

from hypothesis import strategies as st

from firmware_py.limits import BARRIERS_MAX, CELLS_MAX, CHAINS_MAX, CORNERS_MAX
from firmware_py.pipeline import Tvslam
from protocol import schema
from protocol.schema import VALUES_MAX
from sim_device.nvm import Nvm
from tests.firmware_py.puppet import NUMBERS

WORD = st.integers(0, 65535)


@st.composite
def filled(draw, most=300):
    """A function that fills a core's stores so."""
    used = draw(st.integers(1, most))
    seed = draw(st.randoms(use_true_random=False))
    chains = draw(st.integers(1, min(CHAINS_MAX, used)))
    explored = draw(st.integers(0, 6))
    barriers, columns, rows = draw(st.integers(0, BARRIERS_MAX)), draw(st.integers(1, 90)), draw(st.integers(1, CELLS_MAX // 90))
    begun = draw(st.booleans())

    def fill(core):
        v, s = core.vectors, core.search
        cuts = sorted(seed.sample(range(1, used), chains - 1))
        v.used, v.chains = used, chains
        for i in range(used):
            v.xs[i], v.ys[i] = seed.randint(-32768, 32767), seed.randint(-32768, 32767)
            v.sigmas[i], v.flags[i] = seed.randint(0, 255), seed.randint(0, 255)
        for c, (first, end) in enumerate(zip([0, *cuts], [*cuts, used])):
            v.firsts[c], v.counts[c], v.kinds[c] = first, min(end - first, 255), seed.randint(0, 255)
        v.used = sum(v.counts[:chains])
        for c in range(1, chains):
            v.firsts[c] = v.firsts[c - 1] + v.counts[c - 1]
        v.generation, v.lost, v.chains_lost = seed.randint(0, 65535), seed.randint(0, 65535), seed.randint(0, 65535)
        s.barriers.used, s.barriers.lost = barriers, seed.randint(0, 65535)
        for i in range(barriers):
            s.barriers.xs[i], s.barriers.ys[i], s.barriers.marks[i] = seed.randint(-32768, 32767), seed.randint(-32768, 32767), i % 4
        if begun:
            s.cell_mm, s.left_mm, s.low_mm = 370, 5 * seed.randint(-32768, 32767), 5 * seed.randint(-32768, 32767)
            s.columns, s.rows, s.visits = columns, rows, seed.randint(0, 96)
            for i in range(columns * rows + 15 >> 4):
                s.seen[2 * CORNERS_MAX + i] = seed.randint(0, 65535)
        core.reason, core.finished, core.degraded = explored, bool(explored), seed.randint(0, 15)
        core.explorer.inside = bool(seed.randint(0, 1)) or not explored
        core.closure.before_mm, core.closure.after_mm = seed.randint(0, 65535), seed.randint(0, 65535)
    return fill


def fill_of(seed, vectors, explored=0):
    """A function that fills a core's stores, from a seed."""
    def fill(core):
        draw = random.Random(seed)
        v = core.vectors
        v.used, v.chains, v.generation = vectors, (vectors + 254) // 255, draw.randint(0, 65535)
        for c in range(v.chains):
            v.firsts[c], v.counts[c] = 255 * c, min(255, vectors - 255 * c)
        for i in range(vectors):
            v.xs[i], v.ys[i], v.sigmas[i] = draw.randint(-32768, 32767), draw.randint(-32768, 32767), draw.randint(0, 255)
        core.reason, core.explorer.inside = explored, True
    return fill


def state(core):
    """All that a record is to hold."""
    v, s, b = core.vectors, core.search, core.search.barriers
    words = s.columns * s.rows + 15 >> 4 if s.cell_mm else 0
    return {
        "xs": v.xs[:v.used], "ys": v.ys[:v.used], "sigmas": v.sigmas[:v.used], "flags": v.flags[:v.used],
        "firsts": v.firsts[:v.chains], "counts": v.counts[:v.chains], "kinds": v.kinds[:v.chains],
        "lost": (v.lost, v.chains_lost, b.lost), "generation": v.generation,
        "barriers": (b.xs[:b.used], b.ys[:b.used], b.marks[:b.used]),
        "cells": (s.cell_mm, s.left_mm, s.low_mm, s.columns, s.rows, s.visits, s.seen[2 * CORNERS_MAX:2 * CORNERS_MAX + words])
        if s.cell_mm else 0,
        "end": (core.reason, core.finished, core.degraded), "closure": (core.closure.before_mm, core.closure.after_mm)}


def core_with(nvm, kind=Tvslam):
    core = kind()
    core.set_parameter(NUMBERS["nvm_bytes"], 0, nvm.size)
    return core


class Served:
    """Does what the core asks of its memory. `operations`: what was asked, in order."""

    def __init__(self, core, nvm):
        self.core, self.nvm = core, nvm
        self.values = array("i", bytes(4 * VALUES_MAX))
        self.done = (0, 0, b"")
        self.operations = []

    def exchange(self):
        """One NVM_DONE, and what the core wants next; False when it wants nothing, or there is no power."""
        request, status, data = self.done
        self.values[0], self.values[1], self.values[2] = request, status, len(data)
        for i, byte in enumerate(data):
            self.values[3 + i] = byte
        count = self.core.slots.exchange(self.values, self.values)
        request, operation, _, address, size = self.values[:5]
        data = bytes(self.values[6:6 + count].tolist())
        self.operations.append((operation, address, size))
        self.done = request, 0, b""
        if operation == schema.NVM_READ:
            self.done = request, *self.nvm.read(address, size)
        elif operation == schema.NVM_ERASE:
            self.done = request, self.nvm.erase(address), b""
        elif operation == schema.NVM_PROGRAM:
            self.done = request, self.nvm.program(address, data), b""
        return operation != schema.NVM_NOTHING and not self.nvm.off

    def begin(self):
        while self.exchange():
            pass

    def save(self):
        """Whether it came to its end."""
        while not self.core.slots.save():
            if not self.exchange() and self.nvm.off:
                return False
        return True


def booted(nvm, kind=Tvslam):
    """A core that has looked for what it kept, and who serves it."""
    nvm.on()
    served = Served(core_with(nvm, kind), nvm)
    served.begin()
    return served


def kept(fill, nvm=None, kind=Tvslam):
    """Such a core that has kept its stores once, and the memory."""
    served = booted(nvm or Nvm(), kind)
    fill(served.core)
    assert served.save()
    return served
