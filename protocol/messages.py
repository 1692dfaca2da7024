# The host's messages: one named tuple a message, made from the schema.
#
#   STEP_RSP = BY_NAME["STEP_RSP"]; m = STEP_RSP(step=1, left_mm_s=0, ...); m.pack(); STEP_RSP.unpack(body)
#
# p10 is a tuple of 8 ints, cN a str, a group a tuple of named tuples, a group of bytes `bytes`.
# The core reads the same bodies with codec.py; a test holds the two together. Host only.

import struct
from collections import namedtuple

from protocol import schema
from protocol.describe import split_group

_FORMATS = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "p10": "10s"}
_WIDE_LIMIT = 1 << 30


class MessageError(ValueError):
    """A body that its message does not allow; the sentence names the field."""


def pack_p10(values):
    a, b, c, d, e, f, g, h = values
    word = a | b << 10 | c << 20 | d << 30 | e << 40 | f << 50 | g << 60 | h << 70
    if word >> 80 or (a | b | c | d | e | f | g | h) >> 10:  # a negative one leaves ones at the top
        raise MessageError("a 10-bit value is outside 0 to 1023")
    return word.to_bytes(10, "little")


def unpack_p10(data):
    word = int.from_bytes(data, "little")
    return (word & 1023, word >> 10 & 1023, word >> 20 & 1023, word >> 30 & 1023,
            word >> 40 & 1023, word >> 50 & 1023, word >> 60 & 1023, word >> 70)


def pack_text(text, size):
    data = text.encode("ascii", "replace")
    if len(data) > size:
        raise MessageError("the text %r is longer than %d bytes" % (text, size))
    return data.ljust(size, b"\0")


def unpack_text(data):
    return data.split(b"\0", 1)[0].decode("ascii", "replace")


def struct_of(fields):
    return struct.Struct("<" + "".join(
        kind[1:] + "s" if kind[0] == "c" else _FORMATS[kind] for _, kind, _ in fields))


class Message:
    # What all messages have: ID, NAME, DIRECTION, pack(), unpack(body), values(), from_values(values, count).
    # values() is the flat layout of codec.py. unpack raises MessageError, pack too.
    __slots__ = ()

    def pack(self):
        return self._pack_parts(self)

    @classmethod
    def _pack_parts(cls, fields):
        try:
            if cls._PLAIN:
                body = cls._HEAD.pack(*fields)
            else:
                head = list(fields)
                tail = b""
                if cls._ITEM_TYPE is not None:
                    items = head.pop()
                    pack_item = cls._ITEM.pack
                    tail = bytes(items) if cls._BYTES else b"".join([pack_item(*item) for item in items])
                for at, size in cls._SPECIALS:
                    head[at] = pack_text(head[at], size) if size else pack_p10(head[at])
                body = cls._HEAD.pack(*head) + tail
        except (struct.error, TypeError, AttributeError) as error:
            raise MessageError("%s cannot carry %r: %s" % (cls.NAME, tuple(fields), error)) from None
        if len(body) > schema.BODY_MAX:
            raise MessageError("%s: body of %d bytes, at most %d" % (cls.NAME, len(body), schema.BODY_MAX))
        for at in cls._WIDE:
            if not -_WIDE_LIMIT < fields[at] < _WIDE_LIMIT:
                raise MessageError("%s.%s = %d is outside +-2**30" % (cls.NAME, cls._fields[at], fields[at]))
        return body

    @classmethod
    def unpack(cls, body):
        size = cls._HEAD.size
        if cls._PLAIN:
            if len(body) != size:
                raise MessageError("%s: body of %d bytes, not %d" % (cls.NAME, len(body), size))
            message = cls._make(cls._HEAD.unpack(body))
        else:
            extra = len(body) - size
            if extra < 0 or (extra % cls._ITEM.size if cls._ITEM_TYPE is not None else extra):
                raise MessageError("%s: a body cannot have %d bytes" % (cls.NAME, len(body)))
            head = list(cls._HEAD.unpack_from(body))
            for at, text in cls._SPECIALS:
                head[at] = unpack_text(head[at]) if text else unpack_p10(head[at])
            if cls._ITEM_TYPE is not None:
                tail = body[size:]
                head.append(bytes(tail) if cls._BYTES else tuple(map(cls._ITEM_TYPE._make, cls._ITEM.iter_unpack(tail))))
            message = cls._make(head)
        for at in cls._WIDE:
            if not -_WIDE_LIMIT < message[at] < _WIDE_LIMIT:
                raise MessageError("%s.%s = %d is outside +-2**30" % (cls.NAME, cls._fields[at], message[at]))
        return message

    def values(self):
        flat = []
        for value, (_, kind, _) in zip(self, self.FIELDS, strict=True):
            if kind == "p10":
                flat += value
            elif kind[0] == "c":
                flat += pack_text(value, int(kind[1:]))
            elif kind == "*":
                flat.append(len(value))
                flat += value if self._BYTES else [number for item in value for number in item]
            else:
                flat.append(value)
        return flat

    @classmethod
    def from_values(cls, values):
        # From the flat layout; `values` may be longer than the message.
        fields, at = [], 0
        for _, kind, group in cls.FIELDS:
            size = 8 if kind == "p10" else int(kind[1:]) if kind[0] == "c" else 1
            part = tuple(values[at:at + size])
            at += size
            if kind == "*":
                width = len(group)
                flat = values[at:at + part[0] * width]
                fields.append(bytes(flat) if cls._BYTES else tuple(
                    cls._ITEM_TYPE._make(flat[k:k + width]) for k in range(0, len(flat), width)))
            else:
                fields.append(part if kind == "p10" else unpack_text(bytes(part)) if kind[0] == "c" else part[0])
        return cls._make(fields)


def message_class(message_id, name, direction, reliable, fields):
    head, item = split_group(fields)
    specials = tuple((at, int(kind[1:]) if kind[0] == "c" else 0)
                     for at, (_, kind, _) in enumerate(head) if kind[0] in "cp")
    is_bytes = len(item) == 1 and item[0][1] == "u8"
    return type(name, (Message, namedtuple(name, [field[0] for field in fields], rename=True)), {
        "__slots__": (), "ID": message_id, "NAME": name, "DIRECTION": direction, "RELIABLE": reliable,
        "FIELDS": fields, "_HEAD": struct_of(head), "_PLAIN": not item and not specials, "_SPECIALS": specials,
        "_ITEM": struct_of(item) if item else None, "_BYTES": is_bytes,
        "_ITEM_TYPE": namedtuple(fields[-1][0].upper(), [field[0] for field in item], rename=True) if item else None,
        "_WIDE": tuple(at for at, (_, kind, _) in enumerate(head) if kind in ("u32", "i32"))})


BY_ID = {row[0]: message_class(*row) for row in schema.MESSAGES}
BY_NAME = {message.NAME: message for message in BY_ID.values()}
