# What the tests of the protocol share: messages of every kind as hypothesis
# strategies, and frames made and broken without the code under test.

import random
import zlib

import numpy as np
from hypothesis import strategies as st

from protocol import schema
from protocol.messages import BY_ID

RANGES = {
    "u8": (0, 255), "i8": (-128, 127), "u16": (0, 65535), "i16": (-32768, 32767),
    "u32": (0, 2**30 - 1), "i32": (1 - 2**30, 2**30 - 1), "p10": (0, 1023),
}
CHUNK = 1 << 16
SIZES = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "p10": 10}
EPOCH_FREE = (0x01, 0x02, 0x03, 0x04)


def value_of(kind):
    if kind == "p10":
        return st.tuples(*[edged(0, 1023)] * 8)
    if kind[0] == "c":
        size = int(kind[1:])
        return st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=size)
    return edged(*RANGES[kind])


def edged(low, high):
    return st.one_of(st.sampled_from((low, high)), st.integers(low, high))


def size_of(kind):
    return int(kind[1:]) if kind[0] == "c" else SIZES[kind]


@st.composite
def message_of(draw, row):
    message_id, _, _, _, fields = row
    kind_of = BY_ID[message_id]
    parts = []
    for _, kind, unit in fields:
        if kind != "*":
            parts.append(draw(value_of(kind)))
            continue
        head = sum(size_of(f[1]) for f in fields[:-1])
        room = (schema.BODY_MAX - head) // sum(size_of(f[1]) for f in unit)
        if [f[1] for f in unit] == ["u8"]:
            parts.append(draw(st.binary(max_size=room)))
        else:
            parts.append(tuple(draw(st.lists(st.tuples(*[value_of(f[1]) for f in unit]), max_size=room))))
    return kind_of(*parts)


def messages(direction=None):
    rows = [row for row in schema.MESSAGES if direction is None or row[2] == direction]
    return st.one_of([message_of(row) for row in rows])


def raw_frame(message_id, body, ctl, seq=0, ack=0, length=None, crc=None):
    # The decoded frame by the letter of docs/protocol.md; wrong where the test wants it wrong.
    raw = bytes((ctl, seq, ack, message_id, len(body) + 9 if length is None else length)) + body
    return raw + (zlib.crc32(raw) if crc is None else crc).to_bytes(4, "little")


def cobs_by_definition(data):
    # Cheshire and Baker, straight from the paper: oracle for protocol/cobs.py.
    out, block = bytearray(), bytearray()
    for byte in data + b"\0":
        if byte:
            block.append(byte)
            assert len(block) < 254
        else:
            out += bytes((len(block) + 1,)) + block
            block = bytearray()
    return bytes(out)


def wire(raw):
    return b"\0" + cobs_by_definition(raw) + b"\0"


def some_body(rng, row):
    # A random body that decodes: for streams too long for hypothesis.
    body = b""
    for _, kind, unit in row[4]:
        if kind == "*":
            size = sum(size_of(f[1]) for f in unit)
            for _ in range(rng.randint(0, min(4, (schema.BODY_MAX - len(body)) // size))):
                body += rng.randbytes(size)
        elif kind in ("u32", "i32"):
            body += rng.randint(0, 2**30 - 1).to_bytes(4, "little")
        else:
            body += bytes(rng.choice((0, 0, rng.randrange(256))) for _ in range(size_of(kind)))
    return body


def some_frame(rng, direction=0, epoch=1, seq=0):
    row = rng.choice([row for row in schema.MESSAGES if row[2] == direction and row[0] not in EPOCH_FREE])
    return raw_frame(row[0], some_body(rng, row), schema.VERSION | direction << 2 | epoch << 5, seq)


def corrupted(rng, data):
    # One fault of a kind that a line makes. May leave the bytes as they were.
    data = bytearray(data)
    kind = rng.randrange(7)
    at = rng.randrange(len(data))
    if kind == 0:
        data[at] ^= 1 << rng.randrange(8)
    elif kind == 1:
        for _ in range(rng.randint(2, 8)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    elif kind == 2:
        end = min(len(data), at + rng.randint(1, 6))
        data[at:end] = rng.randbytes(end - at)
    elif kind == 3:
        del data[at:at + rng.randint(1, 4)]
    elif kind == 4:
        data[at:at] = rng.randbytes(rng.randint(1, 4))
    elif kind == 5:
        data[at] = 0
    else:
        other = rng.randrange(len(data))
        data[at], data[other] = data[other], data[at]
    return bytes(data)


def seeded(seed):
    print("seed", seed)  # pytest shows it when the test fails
    return random.Random(seed)


def random_chunks(seed, count):
    """bytearrays of 64 KB. Each third has small numbers only: more delimiters, and COBS that holds."""
    draw = np.random.default_rng(seed)
    for number in range(count):
        yield bytearray(draw.integers(0, 32 if number % 3 == 1 else 256, CHUNK, np.uint8).tobytes())
