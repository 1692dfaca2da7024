# firmware_py/ports/rolling_viper.py against the loops of firmware_py/collection, inside MicroPython: the same
# hits, headings, rays, ranges and fixes, on input of every kind. Locked throughout: neither may allocate.

from array import array

from firmware_py.collection import infrared, rolling, uwb
from firmware_py.fixed import isqrt, power2
from firmware_py.ports import rolling_viper

state = array("i", bytes(8))  # seed; rounds that differed
xs = array("i", bytes(256))
ys = array("i", bytes(256))
buckets = bytearray(64)


class Side:
    def __init__(self, loops, sensing, receiver):
        self.collect = loops.collect
        self.first_free = loops.first_free
        self.seen_through = loops.seen_through
        self.project = sensing.project
        self.weigh = receiver.weigh
        self.scope = array("i", bytes(36))
        self.bearings = array("h", bytes(128))
        self.distances = array("h", bytes(128))
        self.slots = bytearray(64)
        self.blocks = array("h", bytes(128))
        self.near = 0
        self.heading = 0
        self.seen = 0
        self.beams = 0
        self.ranges = array("h", bytes(16))
        self.hit_x = array("i", bytes(32))
        self.hit_y = array("i", bytes(32))
        self.told = 0
        self.sums = array("i", bytes(60))
        self.lately = array("h", bytes(64))


SIDES = (Side(rolling, infrared, uwb), Side(rolling_viper, rolling_viper, rolling_viper))
counts = array("i", bytes(44))
mounted = array("h", bytes(16))
records = array("i", bytes(64))
places = array("i", bytes(4 * 96))
rounds = array("i", bytes(4))
rays = array("i", bytes(12))  # that something was seen at all: rays through a hit, ranges that counted, outliers


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
        bearing = number(65536) - 32768
        near = number(200)
        for side in SIDES:
            side.seen = side.seen_through(side.bearings, side.distances, side.near, bearing, near, near + 150)
        rays[0] += side.seen >= 0
        beams(x, y, heading)
        ranges(spread)
        if differ(SIDES[0], SIDES[1]):
            state[1] += 1


def beams(x, y, heading):
    for j in range(8):
        counts[j + 2] = number(1024) if number(3) else number(400)
        mounted[j] = number(65536) - 32768
    for side in SIDES:
        side.beams = side.project(counts, 2, x * 100, y * 100, heading, 120, mounted, side.ranges, side.hit_x, side.hit_y)


def ranges(spread):
    # Transmitters up to 26 m away; ranges and levels that fit and that do not.
    far = 2 + spread // 40
    for i in range(96):
        places[i] = (number(2000) - 1000) * far if i < 64 else number(3000)
    gamma = 0 if number(3) == 0 else 1000 + number(5000)
    x = number(4000) - 2000
    y = number(4000) - 2000
    sigma = 20 + number(400)
    prior = number(2)
    slack = number(2000)
    filtered = number(2)
    if number(5) == 0:
        # At a transmitter of no height, with no range to speak of.
        places[3] = x
        places[35] = y
        places[67] = number(2)
        records[15] = 3 << 16 | number(3)
    for k in range(15):
        i = number(32)
        d = 1 + number(40000)
        if number(4):
            d = uwb_range(places[i] - x, places[i + 32] - y, places[i + 64])
            if gamma:
                d = 20000 + (number(9) - 4) * 100 + loss(d, gamma)
        records[k] = i << 16 | d
    for side in SIDES:
        s = side.sums
        for i in range(5):
            s[i] -= s[i] >> 5
        s[5] = x
        s[6] = y
        s[7] = 0
        s[8] = gamma
        s[9] = sigma
        s[10] = 4096 - (sigma * sigma >> 13)
        s[11] = prior
        s[12] = slack
        s[13] = 640000 << 6 if filtered else 640000
        s[14] = 30000 if filtered else 800
        side.told = side.weigh(s, records, places, side.lately, 0, 16)
    rays[1] += side.told & 255
    rays[2] += side.told >> 8 & 255


def uwb_range(dx, dy, dz):
    d = isqrt(dx * dx + dy * dy + dz * dz) + number(400) - 200
    return 1 if d < 1 else 40000 if d > 40000 else d


def loss(d, gamma):
    # The loss in cdB that a range of d mm comes from: by halves.
    low = -12000
    high = 12000
    while high - low > 1:
        middle = (low + high) >> 1
        if power2(middle * 13607 // gamma) < d:
            low = middle
        else:
            high = middle
    return low


def differ(a, b):
    if a.near != b.near or a.heading != b.heading or a.seen != b.seen or a.beams != b.beams or a.told != b.told:
        return True
    for i in range(8):
        if a.ranges[i] != b.ranges[i] or a.hit_x[i] != b.hit_x[i] or a.hit_y[i] != b.hit_y[i]:
            return True
    for i in range(15):
        if a.sums[i] != b.sums[i]:
            return True
    for i in range(32):
        if a.lately[i] != b.lately[i]:
            return True
    for i in range(9):
        if a.scope[i] != b.scope[i]:
            return True
    for i in range(a.near):
        if a.bearings[i] != b.bearings[i] or a.distances[i] != b.distances[i] or a.slots[i] != b.slots[i] or a.blocks[i] != b.blocks[i]:
            return True
    return False


def report():
    print("rounds", rounds[0], "differed", state[1], "rays", rays[0], "counted", rays[1], "outliers", rays[2])
