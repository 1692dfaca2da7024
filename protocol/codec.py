# Bodies of messages <-> flat ints, driven by the tables made from the schema.
#
# Layout of `values` (array "i" of VALUES_MAX, the caller's): the fields in order;
# p10 = 8 ints, cN = N ints, a group = its item count, then the items.
#
# Nothing allocates, wire input never raises, no int reaches 2**30 in magnitude.

from protocol.tables import BODY_MAX, HEAD_BYTES, HEAD_PLAN, HEAD_VALUES, ITEM_BYTES, ITEM_PLAN, ITEM_VALUES, PLACE

try:
    from protocol.codec_viper import take, put
except (ImportError, SyntaxError, ValueError):  # CPython, a port without the emitter, or .mpy of another machine
    from protocol.codec_fields import take, put


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
    plan = HEAD_PLAN[row]
    if not take(plan, len(plan), 1, buf, start, values, 0):
        return -1
    if item == 0:
        return count
    items = extra // item
    values[count] = items
    plan = ITEM_PLAN[row]
    if items and not take(plan, len(plan), items, buf, end - extra, values, count + 1):
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
    plan = HEAD_PLAN[row]
    if items == 0:
        put(plan, len(plan), 1, buf, start, values, 0)
        return end
    size = HEAD_BYTES[row] + items * ITEM_BYTES[row]
    if items < 0 or ITEM_BYTES[row] == 0 or size > BODY_MAX:
        return -1
    put(plan, len(plan), 1, buf, start, values, 0)
    plan = ITEM_PLAN[row]
    put(plan, len(plan), items, buf, end, values, HEAD_VALUES[row] + 1)
    return start + size
