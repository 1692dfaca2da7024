# firmware_py/ports/sight_viper.py against the loops that it stands for (in building/sight.py, building/passage.py and
# storage/vector_store.py), inside MicroPython, on random maps, strips and places: chains of every kind, full ones that go on,
# coordinates up to the store's borders. Locked: neither may allocate.

from array import array

from firmware_py.building import passage, sight
from firmware_py.ports import sight_viper
from firmware_py.storage import vector_store
from firmware_py.storage.vector_store import VectorStore

state = array("i", bytes(8))
rounds = array("i", bytes(4))
told = array("i", bytes(16))  # strips that met something, that met nothing, rounds that differed, gates found
store = VectorStore()
other = VectorStore()
scopes = (array("i", bytes(36)), array("i", bytes(36)))


def boot(args):
    state[0] = int(args[0])
    rounds[0] = int(args[1])


def number(below):
    state[0] = (state[0] * 1103 + 12345) & 0xFFFFF
    return (state[0] >> 3) % below


def locked():
    plain, fast = scopes
    for turn in range(rounds[0]):
        far = (200, 4000, 65536)[turn % 3]
        if turn % 4 == 0:
            draw(far)
        number(2)
        plain[0] = number(far) - far // 2
        plain[1] = number(far) - far // 2
        # (5, 12, 13), (3, 4, 5) and the axes: directions of a whole length
        u = ((4096, 0), (0, -4096), (-2458, 3277), (-1575, -3781))[number(4)]
        plain[2] = u[0]
        plain[3] = u[1]
        plain[4] = number(60) if number(3) else 0
        plain[5] = store.chains
        plain[6] = number(2)
        plain[7] = number(far)
        for i in range(9):
            fast[i] = plain[i]
        a = sight.look(store.xs, store.ys, store.flags, store.firsts, store.counts, store.kinds, plain)
        b = sight_viper.look(store.xs, store.ys, store.flags, store.firsts, store.counts, store.kinds, fast)
        same = a == b
        for i in range(9):
            same = same and plain[i] == fast[i]
        told[0 if a else 1] += 1
        if not same or beside(far):
            told[2] += 1


def beside(far):
    # -> whether the other two loops differ
    plain, fast = scopes
    plain[0] = number(far) - far // 2
    plain[1] = number(far) - far // 2
    plain[2] = far >> 5
    plain[3] = far >> 3
    for i in range(9):
        fast[i] = plain[i]
    begin = number(store.used)
    end = begin + number(store.used - begin + 1)
    a = passage.narrow(store.xs, store.ys, 0, begin, end, plain)
    b = sight_viper.narrow(store.xs, store.ys, 0, begin, end, fast)
    if a >= 0:
        told[3] += 1
    differ = a != b
    plain[2] = number(store.used)
    plain[3] = begin
    plain[4] = number(store.used)
    plain[5] = store.chains
    for i in range(9):
        fast[i] = plain[i]
    passage.trace(store.xs, store.ys, store.firsts, store.counts, store.kinds, plain)
    sight_viper.trace(store.xs, store.ys, store.firsts, store.counts, store.kinds, fast)
    for i in range(9):
        differ = differ or plain[i] != fast[i]
    return moved(begin, end) or differ


def moved(to, begin):
    # -> whether records are moved down in another way
    for i in range(store.used):
        other.xs[i] = store.xs[i]
        other.ys[i] = store.ys[i]
        other.sigmas[i] = store.sigmas[i]
        other.flags[i] = store.flags[i]
    vector_store.move_down(other.xs, other.ys, other.sigmas, other.flags, to, begin, store.used)
    sight_viper.move_down(store.xs, store.ys, store.sigmas, store.flags, to, begin, store.used)
    differ = False
    for i in range(store.used):
        differ = differ or store.xs[i] != other.xs[i] or store.ys[i] != other.ys[i]
        differ = differ or store.sigmas[i] != other.sigmas[i] or store.flags[i] != other.flags[i]
    return differ


def draw(far):
    store.used = store.chains = 0
    while store.chains < 6 and store.used < 700:
        store.open_chain((0, 1, 4, 5, 5)[number(5)])
        n = 1 + number(300) if number(4) == 0 else 1 + number(12)
        while n:
            n -= 1
            store.append(number(far) - far // 2, number(far) - far // 2, number(9), 0)
        if number(3) == 0:
            store.flags[store.used - 1] |= 8


def report():
    print("met", told[0], "free", told[1], "differed", told[2], "gates", told[3])
