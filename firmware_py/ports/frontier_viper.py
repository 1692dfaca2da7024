# The loops of building/frontier.py as machine code, the same to the last bit (tests/upy/frontier_same.py).

# ruff: noqa: F821  (ptr8, ptr16, ptr32 are viper's)

import micropython


@micropython.viper
def choose(costs: ptr16, marks: ptr16, places: ptr16, used: int, x: int, y: int) -> int:
    x += 32768  # ptr16 reads without the sign: (v ^ 32768) is v + 32768
    y += 32768
    least = 65535
    best = 0
    n = 0
    while n < used:
        cost = costs[n]
        if cost < least and marks[n] < 256:
            dx = (places[2 * n] ^ 32768) - x
            dy = (places[2 * n + 1] ^ 32768) - y
            if dx < 0:
                dx = 0 - dx
            if dy < 0:
                dy = 0 - dy
            far = (dx + dy) * 181 >> 8
            if dx > far:
                far = dx
            if dy > far:
                far = dy
            cost += far >> 1
            if cost < least:
                least = cost
                best = n
        n += 1
    return least << 8 | best


@micropython.viper
def offer(costs: ptr16, marks: ptr16, places: ptr16, used: int, x: int, y: int, a: int):
    x += 32768
    y += 32768
    cost = costs[a]
    n = 0
    while n < used:
        if marks[n] < 256:
            dx = (places[2 * n] ^ 32768) - x
            dy = (places[2 * n + 1] ^ 32768) - y
            left = costs[n] - cost << 1
            if left > 11000:
                left = 11000
            if dx < left and dy < left and 0 - left < dx and 0 - left < dy:
                d = dx * dx + dy * dy
                root = 64 if d < 4096 else 512 if d < 262144 else 4096 if d < 16777216 else 32768
                better = root + d // root >> 1
                while better < root:
                    root = better
                    better = root + d // root >> 1 if root else 0
                d = cost + 8 + (root + 2 >> 1)
                if d < costs[n] or d == costs[n] and a < marks[n]:
                    costs[n] = d
                    marks[n] = a
        n += 1


@micropython.viper
def next_best(costs: ptr16, marks: ptr16, places: ptr16, used: int, x: int, y: int, tried: int) -> int:
    x += 32768
    y += 32768
    best = 65535 << 8
    n = 0
    while n < used:
        if marks[n] >= 256:
            cost = costs[n] + 8
            dx = (places[2 * n] ^ 32768) - x
            dy = (places[2 * n + 1] ^ 32768) - y
            left = (best >> 8) - cost << 1
            if left > 11000:
                left = 11000
            if dx < left and dy < left and 0 - left < dx and 0 - left < dy:
                d = dx * dx + dy * dy
                root = 64 if d < 4096 else 512 if d < 262144 else 4096 if d < 16777216 else 32768
                better = root + d // root >> 1
                while better < root:
                    root = better
                    better = root + d // root >> 1 if root else 0
                cost = cost + (root + 2 >> 1) << 8 | n
                if tried < cost and cost < best:
                    best = cost
        n += 1
    return best
