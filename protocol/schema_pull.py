# A schema on its way through the link, in pieces: IDENTIFY section 4 with an offset, answered by IDENTITY. Sans-I/O, host only.
#
#   pull = SchemaPull(hello)
#   while not pull.whole: pull.take(answer to pull.question() for which pull.fits(answer))
#   dialect = pull.dialect()
#
# What was learnt stays known in this process, by its hash.

from protocol.dialect import OURS, SchemaError, from_text
from protocol.messages import BY_NAME

SECTION = 4
PIECE_BYTES = 64
TEXT_MAX = 1 << 15
KNOWN_MAX = 64

_IDENTIFY, _IDENTITY = BY_NAME["IDENTIFY"], BY_NAME["IDENTITY"]
_KNOWN = {OURS.hash: OURS}


def hash_of(hello):
    return hello.schema_lo | hello.schema_hi << 16


def known(hello):
    """The Dialect of the core that said this, None if it must be asked for."""
    return _KNOWN.get(hash_of(hello))


def piece(data, offset):
    """The answer of whoever has this text."""
    return _IDENTITY(SECTION, offset, len(data), data[offset:offset + PIECE_BYTES])


# SchemaError where what comes cannot be a schema.
class SchemaPull:
    def __init__(self, hello):
        self.hash = hash_of(hello)
        self._data = b""
        self._size = None

    @property
    def whole(self):
        return self._size is not None and len(self._data) >= self._size

    def question(self):
        return _IDENTIFY(SECTION, len(self._data))

    def fits(self, identity):
        return identity.section == SECTION and identity.offset == len(self._data)

    def take(self, identity):
        if not 0 < identity.size <= TEXT_MAX or not identity.data or self._size not in (None, identity.size):
            raise SchemaError("the core's message schema is %08x, this host's is %08x, and the core does not tell its own: update the "
                              "older of the two" % (self.hash, OURS.hash))
        self._size = identity.size
        self._data += identity.data

    def dialect(self):
        dialect = from_text(self._data[:self._size], self.hash)
        if len(_KNOWN) < KNOWN_MAX:
            _KNOWN[self.hash] = dialect
        return dialect
