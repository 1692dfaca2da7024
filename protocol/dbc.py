# The telemetry as CAN frames: how its fields are laid into frames of 8 bytes, and `tvslam.dbc`,
# which describes these frames to cantools and other people's tools. Host only; describe.py writes both down.

from protocol import schema, schema_hash, states

SIZES = {"u16": 2, "i16": 2, "u8": 1, "i8": 1, "u32": 4, "i32": 4}
CHANNELS = 30               # below SCHEMA_CHANNEL and END_CHANNEL of can_cutter.py
NODE, UP = 1, 1
SINGLE = 0x600 | NODE << 6 | UP << 5
FD = 0x400 | NODE << 6 | UP << 5 | 16
FD_MAX = 64
HEAD = (("ctl", "u8", "bits"), ("seq", "u8", ""), ("ack", "u8", ""), ("message", "u8", ""), ("crc", "u32", ""))
SCHEMA = (("schema_lo", "u16", ""), ("schema_hi", "u16", ""), ("version", "u8", ""))
CHOICES = {"state": states.NAMES}


class DbcError(Exception):
    """The schema's telemetry does not fit the channels."""


def telemetry(messages=schema.MESSAGES):
    # -> [(id, name, fields)] of what can be told as frames of whole fields
    return [(message_id, name, letters(fields)) for message_id, name, _, _, fields in messages
            if message_id >> 4 == 2 and not any(kind in ("*", "p10") for _, kind, _ in fields)]


def letters(fields):
    # Text is as many fields of one letter.
    flat = []
    for name, kind, unit in fields:
        flat += [("%s_%d" % (name, i), "u8", unit) for i in range(int(kind[1:]))] if kind[0] == "c" else [(name, kind, unit)]
    return flat


def parts(messages=schema.MESSAGES):
    # -> by channel: (id, name, number from 1, offset in the body, fields). No field is in two frames.
    rows = []
    for message_id, name, fields in telemetry(messages):
        number = start = at = 0
        taken = []
        for field in fields + [None]:
            size = SIZES[field[1]] if field else 9
            if at + size - start > 8:
                number += 1
                rows.append((message_id, name, number, start, taken))
                taken, start = [], at
            taken = taken + [field]
            at += size
    if len(rows) > CHANNELS:
        raise DbcError("telemetry takes %d CAN frames, there are %d channels for it" % (len(rows), CHANNELS))
    return rows


def tables(messages=schema.MESSAGES):
    # -> by channel the message, its first byte in the body and how many; by the low four bits of a message its first channel,
    # and how long its body is
    rows = parts(messages)
    first = bytearray(b"\xff" * 16)
    for channel in reversed(range(len(rows))):
        first[rows[channel][0] & 15] = channel
    ids = bytes(row[0] for row in rows).ljust(32, b"\0")
    offsets = bytes(row[3] for row in rows).ljust(32, b"\0")
    sizes = bytes(sum(SIZES[field[1]] for field in row[4]) for row in rows).ljust(32, b"\0")
    bodies = bytearray(16)
    for message_id, _, fields in telemetry(messages):
        bodies[message_id & 15] = sum(SIZES[field[1]] for field in fields)
    return ids, offsets, sizes, bytes(first), bytes(bodies)


def signals(fields, at=0):
    lines = []
    for name, kind, unit in fields:
        bits = 8 * SIZES[kind]
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if kind[0] == "i" else (0, (1 << bits) - 1)
        lines.append(' SG_ %s : %d|%d@1%s (1,0) [%d|%d] "%s" HOST' % (name, at, bits, "-" if kind[0] == "i" else "+", low, high, unit))
        at += bits
    return lines


def frames(messages=schema.MESSAGES):
    # -> [(CAN id, name, bytes, lines of its signals, names of its fields, comment, whether CAN FD)]
    rows = []
    for channel, (message_id, name, number, _, fields) in enumerate(parts(messages)):
        size = sum(SIZES[field[1]] for field in fields)
        rows.append((SINGLE | channel, "%s_%d" % (name, number), size, signals(fields), fields,
                     "Part %d of message %02X." % (number, message_id), False))
    rows.append((SINGLE | 30, "SCHEMA", 5, signals(SCHEMA), SCHEMA, "Once a second: the schema that the core speaks.", False))
    rows.append((SINGLE | 31, "FRAME_END", 8, signals(HEAD), HEAD, "Behind the parts of a message: its header and its CRC-32.", False))
    for message_id, name, fields in telemetry(messages):
        size = 8 + sum(SIZES[field[1]] for field in fields)
        if size <= FD_MAX:
            padded = next(n for n in (8, 12, 16, 20, 24, 32, 48, 64) if n >= size)
            rows.append((FD | message_id & 15, name + "_FD", padded, signals(HEAD) + signals(fields, 64), fields,
                         "Message %02X in one frame of CAN FD." % message_id, True))
    return rows


def dbc_text(messages=schema.MESSAGES):
    lo, hi = schema_hash.halves(messages)
    rows = frames(messages)
    lines = ['VERSION "%04x%04x"' % (hi, lo), "", "NS_ :", "", "BS_:", "", "BU_: CORE HOST", ""]
    for can_id, name, size, lines_of_signals, _, _, _ in rows:
        lines += ["BO_ %d %s: %d CORE" % (can_id, name, size), *lines_of_signals, ""]
    lines.append('CM_ "Made from protocol/schema.py by `python -m protocol.describe`: do not edit.";')
    lines += ['CM_ BO_ %d "%s";' % (row[0], row[5]) for row in rows]
    lines += ['BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN",%s;' % ",".join(
        ['"reserved"'] * 12 + ['"StandardCAN_FD"', '"ExtendedCAN_FD"']), 'BA_DEF_DEF_ "VFrameFormat" "StandardCAN";']
    lines += ['BA_ "VFrameFormat" BO_ %d 14;' % row[0] for row in rows if row[6]]
    for can_id, _, _, _, fields, _, _ in rows:
        for name, _, _ in fields:
            if name in CHOICES:
                lines.append("VAL_ %d %s %s ;" % (can_id, name, " ".join('%d "%s"' % choice for choice in enumerate(CHOICES[name]))))
    return "\n".join(lines) + "\n"
