"""A decoded message's flat integers, by the names that the schema gives them.

For people's tools, where clarity counts more than speed; the core and the
mission's loop read the flat array itself.
"""

from protocol import schema

NAMES = {message[0]: message[1] for message in schema.MESSAGES}
IDS = {message[1]: message[0] for message in schema.MESSAGES}
_FIELDS = {message[0]: message[4] for message in schema.MESSAGES}


def named(message_id, values):
    """(name, {field: value}): text for cN, a list for p10, a list of dicts for a group (of ints where its item has one field)."""
    out, at = {}, 0
    for name, kind, unit in _FIELDS[message_id]:
        if kind == "*":
            count, at = values[at], at + 1
            out[name], at = _items(unit, values, at, count), at + count * len(unit)
        elif kind == "p10":
            out[name], at = list(values[at:at + 8]), at + 8
        elif kind[0] == "c":
            size = int(kind[1:])
            text = bytes(value & 0xFF for value in values[at:at + size])
            out[name], at = text.split(b"\0")[0].decode("ascii", "replace"), at + size
        else:
            out[name], at = values[at], at + 1
    return NAMES[message_id], out


def _items(fields, values, at, count):
    width = len(fields)
    if width == 1:
        return list(values[at:at + count])
    names = [field[0] for field in fields]
    return [dict(zip(names, values[at + i * width:at + (i + 1) * width])) for i in range(count)]
