# What makes a room of what a gate cuts off: floor enough, and a free square at one of its walls, a little wider than the gate.

from ..fixed import sine, cosine

ROOM_MIN = const(165)        # dm2
_OPEN = const(33)            # 32nds of the gate's width must fit into the rooms if a wall ends at it,
_PLAIN = const(40)           # so many if none does
_SHORTEST = const(10)        # map units: at a shorter vector no square is tried


def square(gates):
    # How wide it must be, on either side of this gate.
    wall_ends = gates.wall_ends(gates.i) or not gates.foot and gates.wall_ends(gates.k)
    return gates.width * (_OPEN if wall_ends else _PLAIN) >> 5


def fits(vectors, sight, rings, i, wide):
    # Whether it stands at the vector from record i on: at its middle, or at either end.
    p = rings.polar(i, 1)
    far = p >> 16
    c = cosine(p & 0xFFFF)
    s = sine(p & 0xFFFF)
    for k in range(3 if far > wide + 4 else 1 if far >= _SHORTEST else 0):
        t = far >> 1 if k == 0 else wide // 2 + 2 if k == 1 else far - wide // 2 - 2
        x = vectors.xs[i] + (t * c - 4 * s >> 15)
        y = vectors.ys[i] + (t * s + 4 * c >> 15)
        met = sight.met(x, y, -wide * s >> 15, wide * c >> 15, wide // 2, 1)
        rings.looked(sight)
        if met == 0:
            return True
    return False
