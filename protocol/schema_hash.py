# The hash by which two ends know that they speak the same schema: the CRC-32
# of the canonical text (ids, names, directions, types, order; units are not in
# it, they change no byte on the wire) and of the parameters' names, which the
# link carries as numbers. The core carries it in tables.py.

import zlib

from protocol import schema
from protocol.parameters import PARAMETERS


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


def schema_hash(messages=schema.MESSAGES, parameters=PARAMETERS):
    # The 32 bits; low and high half are what HELLO and WELCOME carry.
    names = "".join("parameter %s\n" % row[0] for row in parameters)
    return zlib.crc32((canonical(messages) + names).encode())


def halves(messages=schema.MESSAGES):
    value = schema_hash(messages)
    return value & 0xFFFF, value >> 16
