# firmware_py/ports/rolling_viper.py against firmware_py/collection/rolling.py, inside MicroPython: the same
# hits, the same headings, on rings of every kind. Locked throughout: neither may allocate.

from array import array

from firmware_py.collection import rolling
from firmware_py.ports import rolling_viper

state = array("i", bytes(8))  # seed; rounds that differed
xs = array("i", bytes(256))
ys = array("i", bytes(256))
buckets = bytearray(64)


class Side:
    def __init__(self, collect, first_free):
        self.collect = collect
        self.first_free = first_free
        self.scope = array("i", bytes(36))
        self.bearings = array("h", bytes(128))
        self.distances = array("h", bytes(128))
        self.slots = bytearray(64)
        self.blocks = array("h", bytes(128))
        self.near = 0
        self.heading = 0


SIDES = (Side(rolling.collect, rolling.first_free), Side(rolling_viper.collect, rolling_viper.first_free))
rounds = array("i", bytes(4))


def boot(args):
    state[0] = int(args[0])
    rounds[0] = int(args[1])


def number(below):
    state[0] = (state[0] * 1103 + 12345) & 0xFFFFF
    return (state[0] >> 3) % below


def locked():
    for _ in range(rounds[0]):
        spread = 100 + number(900)
        for i in range(64):
            xs[i] = number(spread) - (spread >> 1) + 70
            ys[i] = number(spread) - (spread >> 1) - 30
            buckets[i] = 255 if number(4) == 0 else number(64)
        x = 70 + number(60) - 30
        y = number(60) - 60
        heading = number(65536)
        window = 3641 if number(2) else 29100
        disc = 172 + number(60)
        slope = 109 if number(3) else 300
        for side in SIDES:
            s = side.scope
            s[0] = x
            s[1] = y
            s[2] = heading
            s[3] = window
            s[8] = 170
            side.near = side.collect(xs, ys, buckets, s, side.bearings, side.distances, side.slots)
            start = s[6]
            side.heading = side.first_free(side.bearings, side.distances, side.blocks, side.near, disc, slope, start, start + 16000)
        if differ(SIDES[0], SIDES[1]):
            state[1] += 1


def differ(a, b):
    if a.near != b.near or a.heading != b.heading:
        return True
    for i in range(9):
        if a.scope[i] != b.scope[i]:
            return True
    for i in range(a.near):
        if a.bearings[i] != b.bearings[i] or a.distances[i] != b.distances[i] or a.slots[i] != b.slots[i] or a.blocks[i] != b.blocks[i]:
            return True
    return False


def report():
    print("rounds", rounds[0], "differed", state[1])
