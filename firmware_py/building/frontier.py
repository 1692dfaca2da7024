# The loops of the search over corners: which of the nodes comes next, whom a settled one helps, and what else leads to one.
#
# A port may put machine code in their place (ports/frontier_viper.py).

from ..fixed import isqrt

UNREACHED = 65535
CLOSED = 256           # a mark: the node's own way is known; the lower bits are the next node on it
STOP_CM = 8            # a stop and a turn on the way over corners cost as much
_LONGEST = const(11000)  # map units: 55 m at a stretch

# Nodes have costs and marks (way.py), and places: x, y in map units, int16 as u16. A candidate is a cost << 8 | a node: of two that
# cost the same the lower node is the better one; NOBODY is worse than any.
NOBODY = UNREACHED << 8


def leg_cm(dx, dy):
    # Straight on, never less than it is.
    if not (-_LONGEST < dx < _LONGEST and -_LONGEST < dy < _LONGEST):
        return UNREACHED
    return isqrt(dx * dx + dy * dy) + 2 >> 1


def choose(costs, marks, places, used, x, y):
    # -> the open node that the shortest way to (x, y) may lead over, as a candidate at the cost of that way.
    # What is left is taken for the longer side of the box between, or of one that is turned by 45 degrees: never more than it is,
    # and it never falls by more than a way is long.
    least = UNREACHED
    best = 0
    n = 0
    while n < used:
        cost = costs[n]
        if cost < least and marks[n] < CLOSED:
            dx = (places[2 * n] ^ 32768) - 32768 - x
            dy = (places[2 * n + 1] ^ 32768) - 32768 - y
            if dx < 0:
                dx = -dx
            if dy < 0:
                dy = -dy
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


def offer(costs, marks, places, used, x, y, a):
    # Node a at (x, y) is settled: each open node that it is the better candidate for takes it, seen or not.
    cost = costs[a]
    n = 0
    while n < used:
        if marks[n] < CLOSED:
            dx = (places[2 * n] ^ 32768) - 32768 - x
            dy = (places[2 * n + 1] ^ 32768) - 32768 - y
            left = costs[n] - cost << 1
            if left > _LONGEST:
                left = _LONGEST
            if -left < dx < left and -left < dy < left:  # most are seen off here, without a root
                sum_cm = cost + STOP_CM + (isqrt(dx * dx + dy * dy) + 2 >> 1)
                if sum_cm < costs[n] or sum_cm == costs[n] and a < marks[n]:
                    costs[n] = sum_cm
                    marks[n] = a
        n += 1


def next_best(costs, marks, places, used, x, y, tried):
    # -> the best candidate for the node at (x, y) after `tried`, among the settled ones; NOBODY
    best = NOBODY
    n = 0
    while n < used:
        if marks[n] >= CLOSED:
            cost = costs[n] + STOP_CM
            dx = (places[2 * n] ^ 32768) - 32768 - x
            dy = (places[2 * n + 1] ^ 32768) - 32768 - y
            left = (best >> 8) - cost << 1
            if left > _LONGEST:
                left = _LONGEST
            if -left < dx < left and -left < dy < left:
                cost = cost + (isqrt(dx * dx + dy * dy) + 2 >> 1) << 8 | n
                if tried < cost < best:
                    best = cost
        n += 1
    return best
