# The host's end of the link, on CPython's own struct and zlib.
#
#   link = HostLink()
#   port.write(link.encode(STEP(...)))            a message (messages.py) -> the bytes for the wire
#   for message in link.feed(port.read()): ...    named tuples, in order, good ones only
#   for message, ctl, seq, ack in link.take(port.read()): ...       the same with their headers
#   link.encode(STEP(...), seq)                   a question that is to be taken once, in its turn: host_window.py
#
# Host only.

import zlib
from array import array

from protocol import schema
from protocol.dialect import HANDSHAKE_MAX, OURS
from protocol.frame_reader import (
    BAD_ID, BAD_VALUE, COUNTERS, STALE, UP, FrameReader,
)
from protocol.messages import BY_ID, BY_NAME, MessageError, pack_p10
from protocol.schema_pull import known
from protocol.translation import Translation

COUNTER_NAMES = tuple(field[0] for field in BY_NAME["LINK"].FIELDS) + ("stale",)
RELIABLE = 8            # in CTL

_BYTES = tuple(bytes((n,)) for n in range(256))
_HANDSHAKE = {number: kind for number, kind in BY_ID.items() if number <= HANDSHAKE_MAX}
_HELLO_ID = BY_NAME["HELLO"].ID
_STEP = BY_NAME["STEP"]
_STEP_HEAD = _STEP._HEAD.pack
_STEP_ITEM = _STEP._ITEM.pack


def stuff(raw):
    # COBS of less than 254 bytes: each run up to a zero gets its length plus one in front.
    return b"".join([_BYTES[len(part) + 1] + part for part in raw.split(b"\0")])


class HostLink:
    # feed() never raises on wire input; what it drops is in `counters`, by cause (counts() names them).
    # encode() raises MessageError for a message that its schema does not allow.
    #
    # Handshake: answer every HELLO with welcome(hello). A new boot id opens a new epoch (1, 2, 3, 1, ...), and
    # so does reopen(), other than the one that the core is in; frames of any other are dropped from then on.
    #
    # `ack` is what the frames say of the answers that came; who repeats questions keeps it (Window.ack).
    #
    # A tap listens: HostLink(listen=BOTH, any_epoch=True), and meets each core by itself. `sink(direction, raw)`, if given, sees every
    # sound frame of both directions as decoded bytes, headers and CRC included: what a log keeps.
    #
    # meet(hello) looks at the schema that this core speaks. One that is not known is to be pulled (schema_pull.py) and adopted; until
    # then nothing but the handshake is taken. Where it is not ours, `translation` stands between the two, and all messages are ours
    # all the same; what it brings that ours has no place for is in `foreign`, the newest of each name, and how often in `foreign_counts`.

    def __init__(self, listen=UP, any_epoch=False, sink=None):
        self.counters = array("i", bytes(4 * COUNTERS))
        self.reader = FrameReader(listen, self.counters)
        self.epoch = 0          # 0: nobody welcomed yet
        self.boot_id = None
        self.ack = 0
        self._seq = 0           # of what is not repeated
        self.dialect = OURS
        self.translation = None
        self.foreign = {}
        self.foreign_counts = {}
        self._kinds = BY_ID
        self._any_epoch = any_epoch
        self._sink = sink

    def meet(self, hello):
        # -> whether its schema is known
        dialect = known(hello)
        if dialect is None:
            self._kinds = _HANDSHAKE
        elif dialect is not self.dialect or self._kinds is _HANDSHAKE:
            self.adopt(dialect)
        return dialect is not None

    def adopt(self, dialect):
        self.dialect = dialect
        self.foreign, self.foreign_counts = {}, {}
        self.translation = None if dialect is OURS else Translation(dialect, heard=self._heard)
        self._kinds = BY_ID if dialect is OURS else self.translation.reads

    def flaw(self, names):
        # -> why these messages cannot pass between this core and us, "" if they can
        return self.translation.flaw(names) if self.translation is not None else ""

    def parameter(self, name, index, value):
        # -> the core's number of what is to be told; None if it need not be told: Translation.parameter
        return OURS.numbers[name] if self.translation is None else self.translation.parameter(name, index, value)

    @property
    def names(self):
        # of states, reasons and degraded bits, by the numbers in messages
        return OURS.codes if self.translation is None else self.translation.names

    def _heard(self, message):
        self.foreign[message.NAME] = message
        self.foreign_counts[message.NAME] = self.foreign_counts.get(message.NAME, 0) + 1

    def feed(self, data):
        # -> the list of messages that these bytes complete
        return [told[0] for told in self.take(data)]

    def take(self, data):
        messages = []
        buf = bytearray(data)
        reader = self.reader
        at, end = 0, len(buf)
        while at < end:
            at = reader.feed_from(buf, at, end)
            if reader.ready:
                message = self._receive()
                if message is not None:
                    messages.append((message, reader.ctl, reader.seq, reader.ack))
        return messages

    def encode(self, message, seq=None):
        if self.translation is not None and message.ID > HANDSHAKE_MAX:
            message_id, body = self.translation.write(message)
            return self._frame(message_id, body, seq, message.DIRECTION)
        return self._frame(message.ID, message.pack(), seq, message.DIRECTION)

    def encode_step(self, values, seq=None):
        # STEP from the flat layout (array or list), the hot path of the virtual robot: see codec.py.
        if self.translation is not None:
            return self.encode(_STEP.from_values(values), seq)
        body = _STEP_HEAD(values[0], values[1], values[2], pack_p10(values[3:11]), values[11], values[12])
        items = values[13]
        if items:
            body += b"".join([_STEP_ITEM(*values[at:at + 3]) for at in range(14, 14 + 3 * items, 3)])
        if len(body) > schema.BODY_MAX or values[0] >= 1 << 30:
            raise MessageError("STEP: %d UWB records or step %d are too many" % (items, values[0]))
        return self._frame(_STEP.ID, body, seq)

    def welcome(self, hello):
        # -> the bytes that answer this HELLO
        if hello.boot_id != self.boot_id:
            self.boot_id = hello.boot_id
            return self.reopen(hello.capabilities & 3)
        return self.invitation()

    def reopen(self, taken=0):
        # A new epoch for the same boot, but not `taken`, which the core is in.
        self.epoch = self.epoch % 3 + 1
        if self.epoch == taken:
            self.epoch = self.epoch % 3 + 1
        self.ack = self._seq = 0
        return self.invitation()

    def invitation(self):
        # WELCOME once more
        return self.encode(BY_NAME["WELCOME"](self.epoch, self.boot_id, OURS.hash & 0xFFFF, OURS.hash >> 16))

    def refusal(self, hello):
        # -> None, or the sentence that says why this core cannot be worked with
        if not hello.protocol_min <= schema.VERSION <= hello.protocol_max:
            return "the core speaks link versions %d to %d, this host speaks %d: update the older of the two" % (
                hello.protocol_min, hello.protocol_max, schema.VERSION)
        return None

    def counts(self):
        return dict(zip(COUNTER_NAMES, self.counters, strict=True))

    def _frame(self, message_id, body, seq, direction=schema.DOWN):
        ctl = schema.VERSION | direction << 2 | (self.epoch << 5 if message_id > HANDSHAKE_MAX else 0)
        if seq is None:
            if message_id > HANDSHAKE_MAX:
                self._seq = self._seq + 1 & 255
            seq = self._seq
        else:
            ctl |= RELIABLE
        raw = bytes((ctl, seq, self.ack, message_id, len(body) + 9)) + body
        raw += zlib.crc32(raw).to_bytes(4, "little")
        if self._sink is not None:
            self._sink(ctl >> 2 & 1, raw)
        wire = b"\0" + stuff(raw) + b"\0"
        self.reader.count_out(len(wire))
        return wire

    def _receive(self):
        reader = self.reader
        message_id = reader.message_id
        body_start, body_end = reader.body_start, reader.body_end
        if self._sink is not None:
            self._sink(reader.ctl >> 2 & 1, bytes(reader.body[body_start - 5:body_end + 4]))
        if not self._any_epoch and reader.ctl >> 5 & 3 != (
                self.epoch if message_id > HANDSHAKE_MAX or message_id == 0 else 0):
            return reader.count(STALE)
        kind = self._kinds.get(message_id)
        if kind is None or kind.DIRECTION != reader.ctl >> 2 & 1:
            return reader.count(BAD_ID) if self._kinds is not _HANDSHAKE else None
        try:
            message = kind.unpack(bytes(reader.body[body_start:body_end]))
        except MessageError:
            return reader.count(BAD_VALUE)
        if message_id == _HELLO_ID and self._any_epoch:
            self.meet(message)      # a tap: what comes next is said by this core
        return message
