# A schema as one end of the link speaks it: its messages as classes, its parameters, the names of its codes. OURS is that of this
# program; another is built out of the text that a core (schema_pull.py) or the head of a log brings. Host only.

import json
import re
import zlib

from protocol import parameters, schema, schema_hash, states
from protocol.describe import told_of
from protocol.messages import BY_ID, message_class
from protocol.schema_text import SCHEMA_TEXT

HANDSHAKE_MAX = 0x04    # HELLO, WELCOME, IDENTIFY, IDENTITY: the same in every schema, and always in epoch 0
TEXT_MAX = 1 << 16
NAMES_MAX = 256
BITS = -15              # deflate without a head: the schema's hash is its check
NUMBERS = frozenset(("u8", "i8", "u16", "i16", "u32", "i32"))
CODES = {"states": states.NAMES, "reasons": states.REASONS, "degraded": states.DEGRADED}
_SIZES = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "p10": 10}
_MESSAGE = re.compile(r"[A-Z][A-Z0-9_]{0,31}")
_FIELD = re.compile(r"[a-z][a-z0-9_]{0,47}")
_TEXT = re.compile(r"c[1-9][0-9]?")


class SchemaError(ValueError):
    """One sentence: what the two ends of a link cannot tell one another, and why."""


# by_id, by_name: its message classes (messages.py), the handshake's always ours. parameters: (name, unit, count, ...) by number.
# codes: the names of states, reasons and degraded bits. data: the text as it was served, for whoever asks next; None of a log's.
class Dialect:
    def __init__(self, messages, table, codes, optional, data=None):
        self.messages, self.parameters, self.codes, self.optional, self.data = messages, table, codes, frozenset(optional), data
        self.numbers = {row[0]: number for number, row in enumerate(table)}
        self.hash = schema_hash.schema_hash(messages, table)
        handshake = {number: kind for number, kind in BY_ID.items() if number <= HANDSHAKE_MAX}
        ours = {kind.NAME for kind in handshake.values()}
        self.by_id = {row[0]: message_class(*row) for row in messages if row[0] > HANDSHAKE_MAX and row[1] not in ours} | handshake
        self.by_name = {kind.NAME: kind for kind in self.by_id.values()}

    def told(self):
        return told_of(self.messages, self.parameters, self.codes, sorted(self.optional))


def name_of(names, number, what):
    """What a code says; one that has no name goes by its number."""
    return names[number] if number < len(names) else "%s %d" % (what, number)


def names_of_bits(names, bits):
    return [name_of(names, bit, "bit") for bit in range(bits.bit_length()) if bits >> bit & 1]


def dialect_of(told, data=None):
    """The Dialect that this JSON tells. A log of earlier times has no codes in its head: they are today's."""
    if not isinstance(told, dict):
        raise SchemaError("a schema is an object of JSON, this is none")
    messages = tuple(_message(row) for row in _list(told, "messages", NAMES_MAX))
    _unlike([row[0] for row in messages], "two messages have one id")
    _unlike([row[1] for row in messages], "two messages have one name")
    table = tuple(_parameter(row) for row in _list(told, "parameters", NAMES_MAX))
    _unlike([row[0] for row in table], "two parameters have one name")
    codes = {name: tuple(_word(word) for word in _list(told, name, NAMES_MAX)) if name in told else ours for name, ours in CODES.items()}
    optional = [_word(word) for word in _list(told, "optional", 8 * NAMES_MAX)] if "optional" in told else ()
    return Dialect(messages, table, codes, optional, data)


def from_text(data, wanted):
    """The Dialect of the text that a core has served; `wanted` is the hash that its HELLO said."""
    inflater = zlib.decompressobj(BITS)
    try:
        dialect = dialect_of(json.loads(inflater.decompress(data, TEXT_MAX)), data)
    except SchemaError as error:
        raise SchemaError("the core tells a schema that is none: %s" % error) from None
    except (zlib.error, ValueError, RecursionError):
        raise SchemaError("the core tells a schema that cannot be read") from None
    if dialect.hash != wanted:
        raise SchemaError("the core says that it speaks schema %08x, and tells another, %08x" % (wanted, dialect.hash))
    return dialect


def _list(told, name, most):
    rows = told.get(name)
    if not isinstance(rows, (list, tuple)) or len(rows) > most:
        raise SchemaError("it has no list of %s" % name)
    return rows


def _unlike(names, flaw):
    if len(set(names)) != len(names):
        raise SchemaError(flaw)


def _word(text):
    if not isinstance(text, str) or len(text) > 80 or not text.isprintable():
        raise SchemaError("a name is no text of a line")
    return text


def _name(text, pattern):
    if not isinstance(text, str) or not pattern.fullmatch(text):
        raise SchemaError("%.40r is no name" % (text,))
    return text


def _number(value, most):
    if type(value) is not int or not 0 <= value <= most:
        raise SchemaError("%.40r is no number up to %d" % (value, most))
    return value


def _row(row, least):
    if not isinstance(row, (list, tuple)) or len(row) < least:
        raise SchemaError("%.40r is no row of %d" % (row, least))
    return row


def _parameter(row):
    name, unit, count, *more = _row(row, 3)
    return (_name(name, _FIELD), _word(unit), _number(count, 255), *more)


def _message(row):
    message_id, name, direction, reliable, fields = _row(row, 5)[:5]
    _name(name, _MESSAGE)
    fields = [_row(field, 3) for field in _row(fields, 0)]
    made = tuple(_field(field, name, last=at == len(fields) - 1) for at, field in enumerate(fields))
    _unlike([field[0] for field in made], "two fields of %s have one name" % name)
    if sum(_size(field[1]) for field in made) > schema.BODY_MAX:
        raise SchemaError("%s is longer than any body" % name)
    return _number(message_id, 255), name, _number(direction, 1), _number(reliable, 1), made


def _size(kind):
    return 0 if kind == "*" else _SIZES[kind] if kind in _SIZES else int(kind[1:])


def _field(field, message, last):
    name, kind, unit = _name(field[0], _FIELD), field[1], field[2]
    if kind == "*" and last:
        items = tuple(_field(_row(item, 3), message, last=False) for item in _row(unit, 1))
        _unlike([item[0] for item in items], "two fields of %s.%s have one name" % (message, name))
        if all(item[1] in NUMBERS for item in items):
            return name, kind, items
    elif isinstance(kind, str) and (kind in _SIZES or _TEXT.fullmatch(kind)):
        return name, kind, _word(unit)
    raise SchemaError("%s.%s is of a type that this host does not know, %.40r" % (message, name, kind))


OURS = Dialect(schema.MESSAGES, parameters.PARAMETERS, CODES, schema.OPTIONAL, SCHEMA_TEXT)
OURS.by_id, OURS.by_name = BY_ID, {kind.NAME: kind for kind in BY_ID.values()}
