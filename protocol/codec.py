# Bodies of messages <-> flat ints, driven by the tables made from the schema.
#
# Layout of `values` (array "i" of VALUES_MAX, the caller's): the fields in order;
# p10 = 8 ints, cN = N ints, a group = its item count, then the items.
#
# Nothing allocates, wire input never raises, no int reaches 2**30 in magnitude.

from protocol.tables import BODY_MAX, HEAD_BYTES, HEAD_PLAN, HEAD_VALUES, ITEM_BYTES, ITEM_PLAN, ITEM_VALUES, PLACE


def decode_into(message_id, buf, start, end, values):
    # -> how many ints were written, or -1: unknown id, wrong length, or a value out of +-2**30
    row = PLACE[message_id]
    if row == 255:
        return -1
    count = HEAD_VALUES[row]
    item = ITEM_BYTES[row]
    extra = end - start - HEAD_BYTES[row]
    if extra != 0 and (extra < 0 or item == 0 or extra % item != 0 or end - start > BODY_MAX):
        return -1
    if not _take(HEAD_PLAN[row], 1, buf, start, values, 0):
        return -1
    if item == 0:
        return count
    items = extra // item
    values[count] = items
    if items and not _take(ITEM_PLAN[row], items, buf, end - extra, values, count + 1):
        return -1
    return count + 1 + items * ITEM_VALUES[row]


def encode_into(message_id, values, buf, start, items=0):
    # -> the end of the body in buf, or -1: unknown id, a group that the message has not, or a body over
    # BODY_MAX. `items` is the group's count; its items stand where decode_into puts them.
    # A value wider than its field is cut to the field's bits.
    row = PLACE[message_id]
    if row == 255:
        return -1
    end = start + HEAD_BYTES[row]
    if items == 0:
        _put(HEAD_PLAN[row], 1, buf, start, values, 0)
        return end
    size = HEAD_BYTES[row] + items * ITEM_BYTES[row]
    if items < 0 or ITEM_BYTES[row] == 0 or size > BODY_MAX:
        return -1
    _put(HEAD_PLAN[row], 1, buf, start, values, 0)
    _put(ITEM_PLAN[row], items, buf, end, values, HEAD_VALUES[row] + 1)
    return start + size


def _take(plan, repeats, buf, at, values, k):
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


def _put(plan, repeats, buf, at, values, k):
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
