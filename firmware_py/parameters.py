# The parameters that came over the link: protocol/parameters.py's table as one flat array.

from array import array

from protocol.parameters import PARAMETERS
from protocol.tables import PARAM_OK, PARAM_UNKNOWN, PARAM_OUT_OF_RANGE, PARAM_LOCKED


class Parameters:
    # values: int32, all parameters one behind the other; firsts[id]: where id begins. Each begins with
    # its default. Locked by begin() of the mission: what ran with them can be replayed.
    # first(name) looks a name up at boot; the loop uses the index it gave.

    def __init__(self):
        n = 0
        self.firsts = array("H", bytes(2 * len(PARAMETERS)))
        for i in range(len(PARAMETERS)):
            self.firsts[i] = n
            n += PARAMETERS[i][2]
        self.values = array("i", bytes(4 * n))
        self.locked = False
        for i in range(len(PARAMETERS)):
            for k in range(PARAMETERS[i][2]):
                self.values[self.firsts[i] + k] = PARAMETERS[i][5]

    def set(self, number, index, value):
        # -> PARAM_OK, or why the old value stays
        if number >= len(PARAMETERS) or index >= PARAMETERS[number][2]:
            return PARAM_UNKNOWN
        if self.locked:
            return PARAM_LOCKED
        if value < PARAMETERS[number][3] or value > PARAMETERS[number][4]:
            return PARAM_OUT_OF_RANGE
        self.values[self.firsts[number] + index] = value
        return PARAM_OK

    def known(self, number, index):
        return number < len(PARAMETERS) and index < PARAMETERS[number][2]

    def first(self, name):
        for i in range(len(PARAMETERS)):
            if PARAMETERS[i][0] == name:
                return self.firsts[i]
        raise KeyError(name)

    def of(self, name):
        return self.values[self.first(name)]
