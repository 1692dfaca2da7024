# Round trips of every message, CRC by both loops, frames by send() and feed(), with the heap locked.

from array import array

from protocol import codec
from protocol.crc32 import TableCrc32, crc32_into
from protocol.frame_reader import BAD_HEADER
from protocol.link import Link
from protocol.tables import (
    BODY_MAX, FLAGS, HEAD_BYTES, HEAD_PLAN, HEAD_VALUES, ITEM_BYTES, PLACE, STEP_RSP, VALUES_MAX, WELCOME,
)

problems = array("i", [0, 0])  # found, checks made


def boot(arguments):
    global body, again, values, crc, other, table, core
    body = bytearray(BODY_MAX + 8)
    again = bytearray(BODY_MAX + 8)
    values = array("i", bytes(4 * VALUES_MAX))
    crc = array("H", [0, 0])
    other = array("H", [0, 0])
    table = TableCrc32()
    core = Link(3)


def check(truth):
    problems[1] += 1
    if not truth:
        problems[0] += 1


def round_trips(seed):
    for message_id in range(256):
        row = PLACE[message_id]
        if row == 255:
            check(codec.decode_into(message_id, body, 0, 0, values) == -1)
            continue
        size = HEAD_BYTES[row]
        if ITEM_BYTES[row]:
            size += (BODY_MAX - size) // ITEM_BYTES[row] * ITEM_BYTES[row]
        for k in range(size):
            seed = (seed * 4093 + 12345) & 0x3FFFF
            body[k] = seed >> 7 & 31  # small, so that no 32-bit value leaves +-2**30
        count = codec.decode_into(message_id, body, 0, size, values)
        check(count > 0)
        items = values[HEAD_VALUES[row]] if ITEM_BYTES[row] else 0
        check(codec.encode_into(message_id, values, again, 0, items) == size)
        for k in range(size):
            if body[k] != again[k]:
                problems[0] += 1
        check(codec.decode_into(message_id, body, 0, size + 1 if ITEM_BYTES[row] != 1 else BODY_MAX + 1, values) == -1)
        crc32_into(body, 0, size, crc)
        table.into(body, 0, size, other)
        check(crc[0] == other[0] and crc[1] == other[1])


def locked():
    check(len(HEAD_PLAN) == len(FLAGS) == len(HEAD_VALUES))
    for seed in range(1, 40):
        round_trips(seed)
    core.values[0] = 1
    for step in range(300):
        core.out[0] = step
        core.out[1] = -step
        check(core.send(STEP_RSP) > 0)
        check(core.send_error(1, 2, -3) > 0)
        size = core.tx_len
        check(core.feed(core.tx, 0, size) == size and core.message_id == 0)  # our own echo
        check(core.counters[BAD_HEADER] == step + 1)
        check(core.send_hello(1, 2, 3, 4, 5, 6, 7, 8) > 0)
    check(core.send(WELCOME, 3) == 0)


def report():
    assert problems[0] == 0, "%d of %d checks failed" % (problems[0], problems[1])
    print("checks", problems[1])
