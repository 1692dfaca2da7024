# The hash by which two ends know that they speak the same schema: the CRC-32
# of the canonical text (ids, names, directions, types, order; units are not in
# it, they change no byte on the wire). The core carries it in tables.py.

import zlib

from protocol import schema


def canonical(messages=schema.MESSAGES):
    # One line a message: `10 STEP D 0 step:u32 ... uwb:*(anchor:u8 strength_cdb:i16 range_mm:u16)`
    lines = []
    for message_id, name, direction, reliable, fields in messages:
        words = ["%02x" % message_id, name, "DU"[direction], str(reliable)]
        for field, kind, unit in fields:
            if kind == "*":
                words.append("%s:*(%s)" % (field, " ".join("%s:%s" % (item[0], item[1]) for item in unit)))
            else:
                words.append("%s:%s" % (field, kind))
        lines.append(" ".join(words))
    return "\n".join(lines) + "\n"


def schema_hash(messages=schema.MESSAGES):
    # The 32 bits; low and high half are what HELLO and WELCOME carry.
    return zlib.crc32(canonical(messages).encode())


def halves(messages=schema.MESSAGES):
    value = schema_hash(messages)
    return value & 0xFFFF, value >> 16
