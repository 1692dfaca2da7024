# Fuzzed: the schema that a core tells of itself. It is understood, or refused with one sentence; what is understood can be
# told on, reads any frame without raising, and is translated to ours or says what differs.

import json
import zlib

from protocol.dialect import BITS, OURS, SchemaError, dialect_of, from_text
from protocol.messages import MessageError
from protocol.translation import Translation
from tests.fuzz.file_targets import one_sentence

PACKED, PLAIN = 0, 1
SIZES = (0, 1, 9, 40, 96)


def schema(data):
    try:
        dialect = from_text(data[1:], OURS.hash) if data[:1] == bytes((PACKED,)) else dialect_of(json.loads(data[1:]))
    except SchemaError as error:
        return one_sentence(error)
    except (ValueError, RecursionError):
        return None     # no JSON: its reader is not ours
    again = dialect_of(json.loads(json.dumps(dialect.told())))
    assert again.hash == dialect.hash
    reads = Translation(dialect).reads
    for kind in [*dialect.by_id.values(), *reads.values()]:
        for size in SIZES:
            try:
                kind.unpack(bytes(range(size)))
            except MessageError as error:
                one_sentence(error)
    return None


def schema_seeds():
    told = OURS.told()
    few = {**told, "messages": [told["messages"][at] for at in (0, 1, 2, 3, 9, 10)], "parameters": list(told["parameters"])[:2]}
    other = {**few, "messages": [[0x44, "OTHER", 1, True, [["x_um", "i32", "um"], ["name", "c8", ""]]]]}
    packer = zlib.compressobj(9, wbits=BITS)
    plain = [json.dumps(part, default=list).encode() for part in (few, other, {**few, "messages": []}, {"messages": [], "parameters": []})]
    return [*(bytes((PLAIN,)) + text for text in plain), bytes((PLAIN,)) + b"[" * 3000, bytes((PACKED,)) + OURS.data,
            bytes((PACKED,)) + packer.compress(plain[0]) + packer.flush()]
