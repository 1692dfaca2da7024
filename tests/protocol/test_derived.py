# What is made from the schema is up to date, and the schema keeps its own rules.

import subprocess
import sys

import pytest

from protocol import describe, schema, schema_hash, tables

MESSAGES = schema.MESSAGES


def test_nothing_derived_is_stale():
    assert describe.stale_files(write=False) == [], "run `python -m protocol.describe`"


def test_the_check_by_hand_says_so(project):
    done = subprocess.run([sys.executable, "-m", "protocol.describe", "--check"], cwd=project, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")
    done = subprocess.run([sys.executable, "-m", "protocol.describe", "--chekc"], cwd=project, capture_output=True, text=True)
    assert done.returncode == 2 and "usage" in done.stderr


def test_a_changed_schema_makes_both_stale():
    changed = tuple(row if row[1] != "PING" else row[:4] + ((("token", "u32", ""),),) for row in MESSAGES)
    assert describe.tables_text(changed) != describe.tables_text()
    page = open(describe.PAGE, encoding="utf-8").read()
    assert describe.page_text(page, changed) != page


def change(row, name=None, kind=None, unit=None, fields=None, message_id=None):
    new = [row[0] if message_id is None else message_id, *row[1:4], row[4] if fields is None else fields]
    if name or kind or unit:
        field = row[4][0]
        new[4] = ((name or field[0], kind or field[1], unit or field[2]),) + row[4][1:]
    return tuple(new)


@pytest.mark.parametrize("name", [row[1] for row in MESSAGES])
def test_the_hash_sees_names_types_and_order_but_not_units(name):
    at = [row[1] for row in MESSAGES].index(name)

    def hashed(**changes):
        return schema_hash.schema_hash(MESSAGES[:at] + (change(MESSAGES[at], **changes),) + MESSAGES[at + 1:])

    now = schema_hash.schema_hash()
    assert hashed() == now == hashed(unit="parsec")
    fields = MESSAGES[at][4]
    others = [hashed(name="another"), hashed(kind="i8"), hashed(message_id=0x7F), hashed(fields=fields + (("more", "u8", ""),))]
    if len(fields) > 1:
        others.append(hashed(fields=fields[1:] + fields[:1]))
    assert now not in others
    assert (tables.SCHEMA_LO, tables.SCHEMA_HI) == schema_hash.halves()


def test_the_schema_keeps_its_rules():
    ids = [row[0] for row in MESSAGES]
    names = [row[1] for row in MESSAGES]
    assert len(set(ids)) == len(ids) and len(set(names)) == len(names) and ids == sorted(ids) and 0 < min(ids) and max(ids) < 256
    for _, name, direction, reliable, fields in MESSAGES:
        assert direction in (schema.DOWN, schema.UP) and reliable in (0, 1), name
        assert len({field[0] for field in fields}) == len(fields), name
        assert "*" not in [field[1] for field in fields[:-1]], name
        head, item = describe.split_group(fields)
        size, values = (sum(how(f[1]) for f in head) for how in (describe.field_size, describe.field_values))
        assert size <= schema.BODY_MAX, name
        if item:
            room = (schema.BODY_MAX - size) // sum(describe.field_size(f[1]) for f in item)
            values += 1 + room * sum(describe.field_values(f[1]) for f in item)
        assert values <= schema.VALUES_MAX, name


def test_the_handshake_never_changes():
    # By these an old host and a new core still learn of each other. If this fails, it is the schema that is wrong.
    text = schema_hash.canonical(tuple(row for row in MESSAGES if row[0] <= 4))
    assert text == (
        "01 HELLO U 0 protocol_min:u8 protocol_max:u8 schema_lo:u16 schema_hi:u16 firmware_lo:u16 firmware_hi:u16 boot_id:u16"
        " reset_cause:u8 body_max:u8 window_down:u8 window_up:u8 capabilities:u16 stores:u8 parameters:u8"
        " heap_bytes:u32 heap_used_bytes:u32 heap_code_bytes:u32\n"
        "02 WELCOME D 0 epoch:u8 boot_id:u16 schema_lo:u16 schema_hi:u16\n"
        "03 IDENTIFY D 0 section:u8 offset:u16\n"
        "04 IDENTITY U 0 section:u8 offset:u16 size:u16 data:*(byte:u8)\n")
