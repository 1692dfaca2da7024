# What is derived from the schema, written by `python -m protocol.describe`:
#   protocol/tables.py   flat tables and message ids for the core (no schema in its memory)
#   docs/protocol.md     the message table, between its two markers
#   protocol/tvslam.dbc  telemetry as CAN frames, for cantools and its like
#   protocol/schema_text.py  all of it as text for a host of another version, which the core serves
# `python -m protocol.describe --check` writes nothing and exits 1 if one is stale.
# Host only.

import ast
import json
import os
import sys
import zlib

from protocol import dbc, parameters, schema, schema_hash, states

KINDS = {"u16": 1, "i16": 2, "u8": 3, "i8": 4, "u32": 5, "i32": 6, "p10": 7}
SIZES = {"u16": 2, "i16": 2, "u8": 1, "i8": 1, "u32": 4, "i32": 4, "p10": 10}

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
TABLES = os.path.join(ROOT, "protocol", "tables.py")
PAGE = os.path.join(ROOT, "docs", "protocol.md")
DBC = os.path.join(ROOT, "protocol", "tvslam.dbc")
TEXT = os.path.join(ROOT, "protocol", "schema_text.py")
MARK_BEGIN = "<!-- messages: made by `python -m protocol.describe`, do not edit -->"
MARK_END = "<!-- end of messages -->"

TABLES_HEAD = '''\
# Made from schema.py and parameters.py by `python -m protocol.describe`: do not edit.
# The schema as flat tables, so that the core needs neither schema.py nor any
# work at boot; frozen, all of it stays in flash. A row is a message.
'''

TEXT_HEAD = """\
# Made from schema.py, parameters.py and states.py by `python -m protocol.describe`: do not edit.
# The schema with its units and the names of its codes, as JSON, deflated: by it a host of another version
# knows what this core says (IDENTIFY, section 4). Frozen, it stays in flash.
"""


def field_size(kind):
    return int(kind[1:]) if kind[0] == "c" else SIZES[kind]


def field_values(kind):
    return int(kind[1:]) if kind[0] == "c" else 8 if kind == "p10" else 1


def plan(fields):
    # The kinds of a run of fields, a byte each; text is that many u8.
    kinds = []
    for _, kind, _ in fields:
        kinds += [KINDS["u8"]] * int(kind[1:]) if kind[0] == "c" else [KINDS[kind]]
    return bytes(kinds)


def split_group(fields):
    # -> head fields, item fields ((): no group)
    if fields and fields[-1][1] == "*":
        return fields[:-1], tuple((item[0], item[1], "") for item in fields[-1][2])
    return fields, ()


def literal(data):
    return 'b"' + "".join("\\x%02x" % byte for byte in data) + '"'


def tuple_of(rows):
    return "(\n" + "".join("    %s,\n" % literal(row) for row in rows) + ")"


def tables_text(messages=schema.MESSAGES):
    place = bytearray(b"\xff" * 256)
    heads, items, flags = [], [], []
    for row, (message_id, _, direction, reliable, fields) in enumerate(messages):
        place[message_id] = row
        head, item = split_group(fields)
        heads.append(head)
        items.append(item)
        flags.append(direction | reliable << 1)
    lo, hi = schema_hash.halves(messages)
    lines = [TABLES_HEAD]
    lines += ["%s = 0x%02x" % (name, message_id) for message_id, name, _, _, _ in messages]
    lines += ["", "VERSION = %d" % schema.VERSION, "BODY_MAX = %d" % schema.BODY_MAX,
              "VALUES_MAX = %d" % schema.VALUES_MAX,
              "SCHEMA_LO = 0x%04x" % lo, "SCHEMA_HI = 0x%04x" % hi, "",
              "# id -> row; 255: no such message", "PLACE = (%s)" % wrapped(place), "",
              "# by row: bit 0 direction (1 up), bit 1 reliable", "FLAGS = %s" % literal(flags), "",
              "# by row: bytes and ints of the fixed part, and of one item of the group",
              "HEAD_BYTES = %s" % literal(sum(field_size(f[1]) for f in head) for head in heads),
              "HEAD_VALUES = %s" % literal(sum(field_values(f[1]) for f in head) for head in heads),
              "ITEM_BYTES = %s" % literal(sum(field_size(f[1]) for f in item) for item in items),
              "ITEM_VALUES = %s" % literal(sum(field_values(f[1]) for f in item) for item in items), "",
              "# by row: the kinds of the fields, and of the fields of one item",
              "# 1 u16, 2 i16, 3 u8, 4 i8, 5 u32, 6 i32, 7 p10",
              "HEAD_PLAN = %s" % tuple_of(plan(head) for head in heads), "",
              "ITEM_PLAN = %s" % tuple_of(plan(item) for item in items), "",
              "# of a PARAM_INFO by parameter: unit (8) and name (24), padded with NUL. As one literal, because",
              "# on MicroPython a letter taken out of a str may be a new object.",
              "PARAMETER_TEXT = (%s)" % wrapped(parameter_text()), ""]
    lines += ["# telemetry as CAN frames: by channel the message (0: none), its bytes' place in the body, how many;",
              "# by the low four bits of a message its first channel (255: it travels in pieces)"]
    for name, data in zip(("CAN_MESSAGES", "CAN_OFFSETS", "CAN_SIZES", "CAN_FIRST", "CAN_BODIES"), dbc.tables(messages)):
        lines.append("%s = (%s)" % (name, wrapped(data)))
    lines.append("")
    lines += ["%s = %d" % (name, value) for name, value in sorted(vars(schema).items())
              if name.startswith(("ERROR_", "PARAM_", "NVM_", "STATUS_"))]
    return "\n".join(lines) + "\n"


def parameter_text(table=parameters.PARAMETERS):
    return b"".join(unit.encode().ljust(8, b"\0") + name.encode().ljust(24, b"\0") for name, unit, *_ in table)


def told_of(messages, table, codes, optional):
    # What the core serves and a log holds in its head, as JSON takes it: dialect.py reads it.
    return {"messages": messages, "parameters": table, **codes, "optional": optional}


def schema_told():
    codes = {"states": states.NAMES, "reasons": states.REASONS, "degraded": states.DEGRADED}
    told = told_of(schema.MESSAGES, [row[:3] for row in parameters.PARAMETERS], codes, schema.OPTIONAL)
    return json.dumps(told, separators=(",", ":")).encode()


def schema_text(old=""):
    # Another zlib may deflate to other bytes: those that say the same are left as they are.
    told = schema_told()
    try:
        data = ast.literal_eval(old.split("SCHEMA_TEXT = ", 1)[1])
        if zlib.decompress(data, -15) == told:
            return TEXT_HEAD + "\nSCHEMA_TEXT = (%s)\n" % wrapped(data)
    except (IndexError, SyntaxError, ValueError, TypeError, zlib.error):
        pass
    deflater = zlib.compressobj(9, zlib.DEFLATED, -15)
    return TEXT_HEAD + "\nSCHEMA_TEXT = (%s)\n" % wrapped(deflater.compress(told) + deflater.flush())


def wrapped(data):
    return "\n" + "".join("    %s\n" % literal(data[at:at + 24]) for at in range(0, len(data), 24))


def field_text(name, kind, unit):
    if kind == "*":
        return "%s: repeated (%s)" % (name, ", ".join(field_text(*item) for item in unit))
    return "%s %s%s" % (name, kind, " (%s)" % unit if unit else "")


def messages_text(messages=schema.MESSAGES):
    lines = ["| id | message | way | body B | fields |", "|---|---|---|---|---|"]
    for message_id, name, direction, reliable, fields in messages:
        head, item = split_group(fields)
        size = "%d" % sum(field_size(f[1]) for f in head)
        if item:
            size += " + n x %d" % sum(field_size(f[1]) for f in item)
        lines.append("| %02X | %s | %s%s | %s | %s |" % (
            message_id, name, ("down", "up")[direction], ", reliable" if reliable else "", size,
            ", ".join(field_text(*field) for field in fields)))
    lo, hi = schema_hash.halves(messages)
    lines += ["", "Schema hash %04x%04x. The largest body is %d B; every message decodes to at most %d ints." % (
        hi, lo, schema.BODY_MAX, schema.VALUES_MAX)]
    return "\n".join(lines)


def page_text(page, messages=schema.MESSAGES):
    before, rest = page.split(MARK_BEGIN, 1)
    after = rest.split(MARK_END, 1)[1]
    return before + MARK_BEGIN + "\n" + messages_text(messages) + "\n" + MARK_END + after


def stale_files(write):
    # -> the derived files that differ from what the schema says; written anew if asked.
    stale = []
    for path, make in ((TABLES, lambda old: tables_text()), (PAGE, page_text), (DBC, lambda old: dbc.dbc_text()), (TEXT, schema_text)):
        old = ""
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                old = file.read()
        new = make(old)
        if new != old:
            stale.append(os.path.relpath(path, ROOT))
            if write:
                with open(path, "w", encoding="utf-8") as file:
                    file.write(new)
    return stale


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        print("usage: python -m protocol.describe [--check]", file=sys.stderr)
        return 2
    stale = stale_files(write=not check)
    for path in stale:
        print("%s: %s" % (path, "stale: run `python -m protocol.describe`" if check else "written"))
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
