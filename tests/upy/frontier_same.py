# firmware_py/ports/frontier_viper.py against the loops of firmware_py/building/frontier.py, inside MicroPython, on random searches:
# coordinates up to the store's borders, nodes at one place, costs that tie. Locked: neither may allocate.

from array import array

from firmware_py.building import frontier
from firmware_py.ports import frontier_viper

NODES = const(60)
state = array("i", bytes(8))
rounds = array("i", bytes(4))
told = array("i", bytes(16))  # searches with a node to choose, offers taken, nodes with another candidate, rounds that differed
places = array("H", bytes(4 * NODES))
costs = array("H", bytes(2 * NODES))
marks = array("H", bytes(2 * NODES))
fast_costs = array("H", bytes(2 * NODES))
fast_marks = array("H", bytes(2 * NODES))


def boot(args):
    state[0] = int(args[0])
    rounds[0] = int(args[1])


def number(below):
    state[0] = (state[0] * 1103 + 12345) & 0xFFFFF
    return (state[0] >> 3) % below


def locked():
    for turn in range(rounds[0]):
        far = (8, 200, 4000, 65536)[turn & 3]
        draw(far)
        used = number(NODES + 1)
        x = number(far) - far // 2
        y = number(far) - far // 2
        one = frontier.choose(costs, marks, places, used, x, y)
        two = frontier_viper.choose(costs, marks, places, used, x, y)
        told[0] += one < frontier.NOBODY
        differ = one != two
        tried = number(20000) << 8 | number(256)
        one = frontier.next_best(costs, marks, places, used, x, y, tried)
        two = frontier_viper.next_best(costs, marks, places, used, x, y, tried)
        told[2] += one < frontier.NOBODY
        differ = differ or one != two
        a = number(NODES)
        marks[a] |= 256
        before = costs[0]
        for n in range(NODES):
            fast_costs[n] = costs[n]
            fast_marks[n] = marks[n]
        frontier.offer(costs, marks, places, used, x, y, a)
        frontier_viper.offer(fast_costs, fast_marks, places, used, x, y, a)
        told[1] += costs[0] != before
        for n in range(NODES):
            differ = differ or costs[n] != fast_costs[n] or marks[n] != fast_marks[n]
        told[3] += differ


def draw(far):
    for n in range(NODES):
        places[2 * n] = number(far) - far // 2 & 0xFFFF
        places[2 * n + 1] = number(far) - far // 2 & 0xFFFF
        costs[n] = 65535 if number(3) == 0 else number(far)
        marks[n] = number(NODES) | (256 if number(3) == 0 and costs[n] < 65535 else 0)


def report():
    print("chosen", told[0], "taken", told[1], "others", told[2], "differed", told[3])
