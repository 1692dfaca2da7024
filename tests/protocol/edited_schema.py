# Schemas as they may come from another version, or from nowhere: ours after some random changes, as the JSON that a core tells; and
# messages of any such schema, made without the code under test.

import json
import random

from protocol.describe import schema_told
from tests.protocol.messages import RANGES

KINDS = ("u8", "i8", "u16", "i16", "u32", "i32", "p10", "c8", "*")
UNITS = ("", "mm", "um", "5 mm", "tick")


TOLD = schema_told()


def told():
    return json.loads(TOLD)


def edited(seed, edits):
    """That many changes of fields, messages, parameters and codes."""
    rng = random.Random(seed)
    new = told()
    for _ in range(edits):
        rng.choice((_field, _field, _field, _field, _message, _message, _parameter, _code))(rng, new)
    return new


def _field(rng, new):
    row = rng.choice([row for row in new["messages"] if row[0] > 4])
    fields = row[4]
    at = rng.randrange(len(fields))
    kind = rng.choice(KINDS)
    unit = [["one", rng.choice(KINDS[:6]), ""], ["two", "u8", ""]][:rng.choice((1, 2))] if kind == "*" else rng.choice(UNITS)
    what = rng.randrange(6)
    if what == 0 and len(fields) > 1:
        del fields[at]
    elif what == 1:
        fields.insert(len(fields) if kind == "*" else at, ["new_%d" % rng.randrange(99), kind, unit])
    elif what == 2:
        fields[at] = [fields[at][0], kind, unit]
    elif what == 3:
        rng.shuffle(fields)
    elif what == 4:
        fields[at] = ["old_%d" % rng.randrange(99), *fields[at][1:]]
    else:
        new["optional"].append("%s.%s" % (row[1], fields[at][0]))


def _message(rng, new):
    row = rng.choice([row for row in new["messages"] if row[0] > 4])
    what = rng.randrange(5)
    if what == 0:
        new["messages"].remove(row)
    elif what == 1:
        row[0] = rng.choice((rng.randrange(256), rng.randrange(0x60, 0x80)))
    elif what == 2:
        row[1] = "M%d" % rng.randrange(99)
    elif what == 3:
        row[rng.choice((2, 3))] ^= 1
    else:
        new["messages"].append([rng.randrange(0x60, 0x80), "N%d" % rng.randrange(99), 1, 0, [["some", "u16", "mm"]]])


def _parameter(rng, new):
    rows = new["parameters"]
    at = rng.randrange(len(rows))
    rng.choice((lambda: rows.pop(at), lambda: rows.insert(at, ["p%d" % rng.randrange(99), "mm", 1]), lambda: rng.shuffle(rows)))()


def _code(rng, new):
    words = new[rng.choice(("states", "reasons", "degraded"))]
    rng.choice((lambda: rng.shuffle(words), lambda: words.append("NEW"), lambda: words and words.pop()))()


def some_message(rng, kind):
    """A message of this class with any values that its fields hold."""
    return kind._make([_value(rng, field) for field in kind.FIELDS])


def _value(rng, field):
    _, kind, unit = field
    if kind == "*":
        items = [tuple(rng.randint(*RANGES[item[1]]) for item in unit) for _ in range(rng.randrange(4))]
        return bytes(item[0] for item in items) if [item[1] for item in unit] == ["u8"] else tuple(items)
    if kind == "p10":
        return tuple(rng.randrange(1024) for _ in range(8))
    if kind[0] == "c":
        return "abcdefgh"[:rng.randrange(int(kind[1:]) + 1)]
    low, high = RANGES[kind]
    return rng.choice((0, low, high, rng.randint(low, high)))
