# What IDENTIFY asks for in pieces: the version, and the schema, by which a host of another version knows what we say.

from protocol.schema_text import SCHEMA_TEXT

VERSION = b"tvslam 0.1.0"

_SECTION_VERSION = const(1)
_SECTION_SCHEMA = const(4)
_PIECE = const(64)


def identity_piece(section, offset, out):
    # Fills an IDENTITY. -> how many bytes are in it, 0 at the end and of a section that there is not.
    text = VERSION if section == _SECTION_VERSION else SCHEMA_TEXT
    size = len(text) if section == _SECTION_VERSION or section == _SECTION_SCHEMA else 0
    n = size - offset if offset < size else 0
    if n > _PIECE:
        n = _PIECE
    out[0] = section
    out[1] = offset
    out[2] = size
    out[3] = n
    for i in range(n):
        out[4 + i] = text[offset + i]
    return n
