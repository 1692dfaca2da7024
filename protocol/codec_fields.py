# The loops of codec.py where there is no machine code for them (codec_viper.py).
#
#   take(plan, len(plan), repeats, buf, at, values, k)   bytes from buf[at] on to ints from values[k] on
#                                                        -> False for a value out of +-2**30
#   put(plan, len(plan), repeats, buf, at, values, k)    and back


def take(plan, fields, repeats, buf, at, values, k):
    # The commonest kinds come first. `for kind in plan` costs two bytecodes a field, a range ten.
    while repeats > 0:
        repeats -= 1
        for kind in plan:
            if kind < 3:  # u16, i16
                value = buf[at] | buf[at + 1] << 8
                if kind == 2 and value > 32767:
                    value -= 65536
                at += 2
            elif kind < 5:  # u8, i8
                value = buf[at]
                if kind == 4 and value > 127:
                    value -= 256
                at += 1
            elif kind == 7:
                _take_p10(buf, at, values, k)
                _take_p10(buf, at + 5, values, k + 4)
                at += 10
                k += 8
                continue
            else:  # u32, i32
                value = buf[at] | buf[at + 1] << 8 | buf[at + 2] << 16
                high = buf[at + 3]
                if high < 64:
                    value |= high << 24
                elif kind == 5 or high < 192 or (high == 192 and value == 0):
                    return False
                else:
                    value = value - 16777216 + (high - 255 << 24)
                at += 4
            values[k] = value
            k += 1
    return True


def _take_p10(buf, at, values, k):
    # Four values of ten bits from five bytes, least significant bit first.
    low = buf[at + 1]
    middle = buf[at + 2]
    high = buf[at + 3]
    values[k] = buf[at] | (low & 3) << 8
    values[k + 1] = low >> 2 | (middle & 15) << 6
    values[k + 2] = middle >> 4 | (high & 63) << 4
    values[k + 3] = high >> 6 | buf[at + 4] << 2


def put(plan, fields, repeats, buf, at, values, k):
    while repeats > 0:
        repeats -= 1
        for kind in plan:
            if kind == 7:
                _put_p10(buf, at, values, k)
                _put_p10(buf, at + 5, values, k + 4)
                at += 10
                k += 8
                continue
            value = values[k]
            k += 1
            buf[at] = value & 255
            if kind < 3:
                buf[at + 1] = value >> 8 & 255
                at += 2
            elif kind < 5:
                at += 1
            else:
                buf[at + 1] = value >> 8 & 255
                buf[at + 2] = value >> 16 & 255
                buf[at + 3] = value >> 24 & 255
                at += 4


def _put_p10(buf, at, values, k):
    second = values[k + 1]
    third = values[k + 2]
    fourth = values[k + 3]
    buf[at] = values[k] & 255
    buf[at + 1] = values[k] >> 8 & 3 | (second & 63) << 2
    buf[at + 2] = second >> 6 & 15 | (third & 15) << 4
    buf[at + 3] = third >> 4 & 63 | (fourth & 3) << 6
    buf[at + 4] = fourth >> 2 & 255
