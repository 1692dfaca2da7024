# The loops over the map, of building/sight.py, building/passage.py and storage/vector_store.py, as machine code, the same to the
# last bit (tests/upy/sight_same.py).

# ruff: noqa: F821  (ptr8, ptr16, ptr32 are viper's)

import micropython


@micropython.viper
def look(xs: ptr16, ys: ptr16, flags: ptr8, firsts: ptr16, counts: ptr8, kinds: ptr8, s: ptr32) -> int:
    sign = 1
    sign <<= 31  # a 64-bit machine reads 32 bits without their sign: (v ^ sign) - sign gives it back
    x = ((s[0] ^ sign) - sign) + 32768
    y = ((s[1] ^ sign) - sign) + 32768
    ux = (s[2] ^ sign) - sign
    uy = (s[3] ^ sign) - sign
    half = s[4]
    chains = s[5]
    reach = nearest = s[7]
    met = 0
    which = -1
    c = chains - 1
    while c >= 0 and kinds[c] & 1:
        c -= 1
    tail = firsts[c] + counts[c] - 1 if c >= 0 and (half == 0 or kinds[c] & 4) else -1
    c = 0
    while c < chains:
        k = firsts[c]
        end = k + counts[c]
        j = k - 1
        if kinds[c] & 1 == 0:
            j = tail
            tail = end - 1
        elif c == 0 or counts[c - 1] != 255 or flags[j] & 8 or kinds[c - 1] & 1 == 0:
            i = c
            while counts[i] == 255 and i + 1 < chains and flags[int(firsts[i]) + 254] & 8 == 0:
                i += 1
            j = firsts[i] + counts[i] - 1
            if half and (flags[j] & 8 or kinds[i] & 4 == 0):
                j = -1
        j = j if j >= 0 else k
        # ptr16 reads without the sign: (v ^ 32768) is v + 32768, and x, y are moved alike.
        was = ((ys[j] ^ 32768) - y) * ux - ((xs[j] ^ 32768) - x) * uy >> 12
        while k < end:
            across = ((ys[k] ^ 32768) - y) * ux - ((xs[k] ^ 32768) - x) * uy >> 12
            if not (across > half and was > half or across <= 0 - half and was <= 0 - half):
                low = was if was < across else across
                high = was + across - low
                i = j if was < across else k
                enter = ((xs[i] ^ 32768) - x) * ux + ((ys[i] ^ 32768) - y) * uy >> 12
                i = j + k - i
                leave = ((xs[i] ^ 32768) - x) * ux + ((ys[i] ^ 32768) - y) * uy >> 12
                shift = 4 if high - low > 11000 else 0
                run = leave - enter
                rise = high - low >> shift
                if high > half:
                    leave = enter + run * (half - low >> shift) // rise
                if low < 0 - half:
                    enter += run * (0 - half - low >> shift) // rise
                if enter > leave:
                    i = enter
                    enter = leave
                    leave = i
                if leave >= 0 and enter <= reach:
                    met += 1
                    if enter < nearest or which < 0:
                        nearest = enter if enter > 0 else 0
                        which = k
                    if s[6]:
                        break
            was = across
            j = k
            k += 1
        c = c + 1 if met == 0 or s[6] == 0 else chains
    s[7] = nearest
    s[8] = which
    return met


@micropython.viper
def narrow(xs: ptr16, ys: ptr16, j: int, k: int, end: int, s: ptr32) -> int:
    sign = 1
    sign = sign << 31
    x = (s[0] ^ sign) - sign
    y = (s[1] ^ sign) - sign
    low = s[2] * s[2]
    high = s[3]
    while k < end:
        ax = (xs[j] ^ 32768) - 32768 - x
        ay = (ys[j] ^ 32768) - 32768 - y
        bx = (xs[k] ^ 32768) - 32768 - x
        by = (ys[k] ^ 32768) - 32768 - y
        j = k
        k += 1
        beside = ax > high and bx > high or ay > high and by > high
        if not (beside or ax < 0 - high and bx < 0 - high or ay < 0 - high and by < 0 - high):
            ex = bx - ax
            ey = by - ay
            if not (ex > 16383 or ex < -16383 or ey > 16383 or ey < -16383):
                t = 0 - (ax * ex + ay * ey)
                length = ex * ex + ey * ey
                if t > 0:
                    foot = 0
                    if t < length:
                        foot = 1
                        t = (t << 12) // length if length < 131072 else t // (length >> 12)
                        bx = ax + (ex * t >> 12)
                        by = ay + (ey * t >> 12)
                    if 0 - high <= bx and bx <= high and 0 - high <= by and by <= high:
                        length = bx * bx + by * by
                        if low <= length and length <= high * high:
                            s[4] = bx + x
                            s[5] = by + y
                            s[6] = foot
                            return j
    return -1


@micropython.viper
def trace(xs: ptr16, ys: ptr16, firsts: ptr16, counts: ptr8, kinds: ptr8, s: ptr32):
    sign = 1
    sign = sign << 31
    x = ((s[0] ^ sign) - sign) + 32768
    y = ((s[1] ^ sign) - sign) + 32768
    gate = k = s[2]
    i = s[3]
    left = s[4] + 1
    chains = s[5]
    c = chains - 1
    while c > 0 and firsts[c] > i:
        c -= 1
    end = firsts[c] + counts[c]
    ax = 0
    ay = 0
    area = 0
    crossed = 0
    limit = 1 << 29
    while left >= 0:
        bx = (xs[k] ^ 32768) - x
        by = (ys[k] ^ 32768) - y
        if (bx + 8192 | by + 8192) >> 14:  # one comparison for most
            if bx > 16383 or bx < -16383 or by > 16383 or by < -16383:
                crossed |= 65536
                bx = 16383 if bx > 16383 else bx if bx > -16383 else -16383
                by = 16383 if by > 16383 else by if by > -16383 else -16383
        z = ax * by - ay * bx
        if ay > 0:
            if by <= 0 and z < 0:
                crossed += 1
        elif by > 0 and z > 0:
            crossed += 1
        area += z >> 4
        if (area + limit) >> 30:
            area = limit if area > 0 else 0 - limit
        ax = bx
        ay = by
        left -= 1
        k = gate
        if left > 0:
            if i == end:
                if kinds[c] & 1 == 0:
                    c += 1
                    while c >= chains or kinds[c] & 1 or counts[c] == 0:
                        c = c + 1 if c < chains else 0
                    end = firsts[c] + counts[c]
                i = firsts[c]
            k = i
            i += 1
    s[0] = area
    s[1] = crossed


@micropython.viper
def move_down(xs: ptr16, ys: ptr16, sigmas: ptr8, flags: ptr8, begin: int, i: int, end: int):
    while i < end:
        xs[begin] = xs[i]
        ys[begin] = ys[i]
        sigmas[begin] = sigmas[i]
        flags[begin] = flags[i]
        begin += 1
        i += 1
