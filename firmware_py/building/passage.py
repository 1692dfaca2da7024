# The loops of the partition over the vectors: which come near a point, and what a range of them encloses.
#
# A port may put machine code in their place (ports/sight_viper.py).

from ..limits import FLOOR_MAX

FAR = 65536              # said of a place that is farther than FLOOR_MAX: it is taken for no farther
_FULL = const(1 << 29)
_BARRIER = const(1)      # storage/vector_store.py


# Places in `scope` of narrow(), an array "i", in map units:
#   in   0, 1 the point   2, 3 nearest and farthest that counts
#   out  4, 5 the place on the vector found that is nearest to the point   6 whether it lies before the vector's end


def narrow(xs, ys, j, k, end, scope):
    # The first of the vectors to the records k .. end - 1 that passes the point at such a distance; the first one begins at
    # record j. Where its beginning is nearest, the one before it counts. -> the record at its end, or -1
    x = scope[0]
    y = scope[1]
    low = scope[2]
    high = scope[3]
    while k < end:
        ax = xs[j] - x
        ay = ys[j] - y
        bx = xs[k] - x
        by = ys[k] - y
        j = k
        k += 1
        if ax > high and bx > high or ax < -high and bx < -high or ay > high and by > high or ay < -high and by < -high:
            continue
        ex = bx - ax
        ey = by - ay
        if ex > FLOOR_MAX or ex < -FLOOR_MAX or ey > FLOOR_MAX or ey < -FLOOR_MAX:
            continue
        t = -(ax * ex + ay * ey)
        length = ex * ex + ey * ey
        if t <= 0:
            continue
        foot = 0
        if t < length:
            foot = 1
            t = (t << 12) // length if length < 131072 else t // (length >> 12)
            bx = ax + (ex * t >> 12)
            by = ay + (ey * t >> 12)
        if -high <= bx <= high and -high <= by <= high:
            length = bx * bx + by * by
            if low * low <= length <= high * high:
                scope[4] = bx + x
                scope[5] = by + y
                scope[6] = foot
                return j
    return -1


# Places in `scope` of trace():
#   in   0, 1 a point   2 record of the gate   3 first record of the range   4 how many   5 chains in the map
#   out  0 the area, in 200 mm2   1 borders crossed on the way from the point out to the right | FAR


def trace(xs, ys, firsts, counts, kinds, scope):
    # Goes round from the gate's record over those of the range, along their ring, back to the gate's.
    x = scope[0]
    y = scope[1]
    k = scope[2]
    i = scope[3]
    left = scope[4] + 1
    c = scope[5] - 1
    while c > 0 and firsts[c] > i:
        c -= 1
    end = firsts[c] + counts[c]
    ax = ay = area = crossed = 0
    while left >= 0:
        bx = xs[k] - x
        by = ys[k] - y
        if bx > FLOOR_MAX or bx < -FLOOR_MAX or by > FLOOR_MAX or by < -FLOOR_MAX:
            crossed |= FAR
            bx = max(-FLOOR_MAX, min(bx, FLOOR_MAX))
            by = max(-FLOOR_MAX, min(by, FLOOR_MAX))
        z = ax * by - ay * bx
        if ay > 0:
            if by <= 0 and z < 0:
                crossed += 1
        elif by > 0 and z > 0:
            crossed += 1
        area += z >> 4
        if area > _FULL:
            area = _FULL
        elif area < -_FULL:
            area = -_FULL
        ax = bx
        ay = by
        left -= 1
        k = scope[2]
        if left > 0:
            if i == end:
                if not kinds[c] & _BARRIER:
                    c += 1
                    while c >= scope[5] or kinds[c] & _BARRIER or counts[c] == 0:
                        c = c + 1 if c < scope[5] else 0
                    end = firsts[c] + counts[c]
                i = firsts[c]
            k = i
            i += 1
    scope[0] = area
    scope[1] = crossed
