# protocol/range_code_viper.py against the loops of protocol/range_code.py, inside MicroPython: the same bytes, models and values,
# written and read. Locked: neither may allocate. The plain loops come from the source without its last lines, which put the
# machine code in their place.

from array import array

from protocol import range_code, range_code_viper

state = array("i", bytes(8))
told = array("i", bytes(8))
plain = {}
sides = []


def boot(args):
    state[0] = int(args[0])
    state[1] = int(args[1])
    with open(range_code.__file__) as file:
        exec(file.read().split("if sys.implementation")[0], plain)
    for code, number in ((plain["code_bit"], plain["code_number"]), (range_code_viper.code_bit, range_code_viper.code_number)):
        sides.append((code, number, array("i", bytes(24)), array("h", bytes(64)), bytearray(16384)))
    print("coded", end=" ")


def luck(below):
    state[0] = (state[0] * 1103 + 12345) & 0xFFFFF
    return (state[0] >> 3) % below


def locked():
    seed = state[0]
    for reads in range(2):
        state[0] = seed
        for side in sides:
            range_code.open_range(side[2], side[4], reads, 16383)
            range_code.forget(side[3], 32)
        for _ in range(state[1]):
            size = 1 + luck(8)
            value = luck(3) if luck(2) else luck(65536)
            place = luck(11) - 1
            bit = luck(7) == 0
            for code, number, s, model, buf in sides:
                told[0] += 1
                if number(s, model, buf, 10, size, 0 if reads else value) != value:
                    told[1] += 1
                if code(s, model, buf, place, 0 if reads else bit) != bit:
                    told[1] += 1
        for side in sides:
            range_code.close_range(side[2], side[4])
        same(0, 2)
        same(0, 3)
        same(0, 4)


def same(first, part):
    for i in range(len(sides[0][part])):
        if sides[first][part][i] != sides[first + 1][part][i]:
            told[1] += 1


def report():
    print(told[0], "differed", told[1])
