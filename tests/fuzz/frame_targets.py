# Fuzzed: what comes off a wire or a bus. No byte of it may raise, whatever is accepted has the right check sum, and it does
# not matter in which pieces it comes.
#
# The first byte of an input says how to take the rest: as it stands, or as the decoded frames that a fuzzer would
# otherwise never give the right check sum.

import zlib

from firmware_py.ports.slcan import SlcanPort
from protocol import schema
from protocol.can_joiner import FRAME_MAX, CanJoiner
from protocol.can_cutter import CanCutter
from protocol.frame_reader import BYTES_IN, BOTH
from protocol.host_link import HostLink, stuff
from protocol.link import Link
from protocol.messages import BY_ID, BY_NAME
from sim_device.links.can_frame import parse

BOOT_ID = 7
PLAIN, FRAMED = 0, 1


def sealed(ctl, seq, ack, message_id, body):
    raw = bytes((ctl, seq, ack, message_id, len(body) + 9)) + body
    return b"\0" + stuff(raw + zlib.crc32(raw).to_bytes(4, "little")) + b"\0"


def stream_of(data):
    """The bytes of the wire that this input means."""
    if data[:1] != bytes((FRAMED,)):
        return data[1:]
    wire, at = b"", 1
    while at + 4 < len(data):
        size = min(data[at] % 97, len(data) - at - 5)
        wire += sealed(*data[at + 1:at + 5], data[at + 5:at + 5 + size])
        at += 5 + size
    return wire


def frames(data):
    stream = stream_of(data)
    cut = data[-1] % 50 + 1 if data else 1
    _host(stream, cut)
    whole, said = Link(BOOT_ID), b""
    for start in range(0, len(stream), 256):
        said += _fed(whole, bytearray(stream[start:start + 256]))
    pieces, said_again = Link(BOOT_ID), b""
    for byte in stream:
        if pieces.feed_byte(byte):
            said_again += _answered(pieces)
    assert said == said_again and list(whole.counters) == list(pieces.counters), "it matters in which pieces it comes"
    host = HostLink(any_epoch=True)
    heard = host.take(said)
    assert len(heard) == said.count(b"\0") // 2, "what the core says is not sound"


def _host(stream, cut):
    passed = []
    host = HostLink(listen=BOTH, any_epoch=True, sink=lambda direction, raw: passed.append(raw))
    whole = host.feed(stream)
    for raw in passed:
        assert zlib.crc32(raw[:-4]) == int.from_bytes(raw[-4:], "little") and len(raw) == raw[4], "accepted wrong"
    for message in whole:
        kind = type(message)
        message = kind.unpack(message.pack())    # text that is no ASCII has become question marks
        assert kind.unpack(message.pack()) == message
        flat = message.values()
        assert len(flat) <= schema.VALUES_MAX and kind.from_values(flat) == message
    again = HostLink(listen=BOTH, any_epoch=True)
    assert [m for at in range(0, len(stream), cut) for m in again.feed(stream[at:at + cut])] == whole
    assert host.counters[BYTES_IN] == len(stream) == again.counters[BYTES_IN] and host.counts() == again.counts()


def _fed(link, buf):
    said, at = b"", 0
    while at < len(buf):
        at = link.feed(buf, at, len(buf))
        said += _answered(link)
    return said


def _answered(link):
    """As a device does: every question gets an answer of its own kind."""
    if link.message_id > 4:
        link.send_error(1, link.message_id, 0)
    return bytes(link.tx[:link.tx_len])


def frame_seeds():
    welcome = (1, 0, 0, BY_NAME["WELCOME"].ID, BY_NAME["WELCOME"](1, BOOT_ID, 0, 0).pack())
    bodies = [(0x29, 1, 0, kind.ID, bytes(kind._HEAD.size)) for kind in BY_ID.values() if kind.DIRECTION == schema.DOWN]
    told = [(0x25, 1, 0, kind.ID, bytes(kind._HEAD.size)) for kind in BY_ID.values() if kind.DIRECTION == schema.UP]
    seeds = [bytes((FRAMED,)) + b"".join(bytes((len(body), ctl, seq, ack, number)) + body for ctl, seq, ack, number, body in (welcome, row))
             for row in bodies + told]
    return [*seeds, bytes((PLAIN,)) + b"".join(sealed(*row) for row in (welcome, *bodies)), b"\0\0\0", b"\0" + bytes(range(256))]


def can(data):
    """Two bytes of id, one of length, so many of data, and again; to a core and to a host."""
    for direction in (schema.DOWN, schema.UP):
        frame = bytearray(FRAME_MAX)
        joiner = CanJoiner(frame, direction)
        host = HostLink(listen=BOTH, any_epoch=True)
        at = 0
        while at + 3 <= len(data):
            size = min(data[at + 2] % 65, len(data) - at - 3)
            joined = joiner.join((data[at] << 8 | data[at + 1]) & 2047, data[at + 3:at + 3 + size].ljust(8, b"\0"), size)
            at += 3 + size
            assert 0 <= joined <= FRAME_MAX and 0 <= joiner.broken <= 65535
            if joined:
                assert frame[0] == 0 == frame[joined - 1] and not any(byte == 0 for byte in frame[1:joined - 1])
                host.take(bytes(frame[:joined]))


def can_seeds():
    return [b"".join(can_id.to_bytes(2, "big") + bytes((len(body),)) + body for can_id, body in _cut(message_id, fd))
            for message_id in BY_ID for fd in (0, 1)]


def _cut(message_id, fd):
    kind = BY_ID[message_id]
    wire = sealed(0x21 | kind.DIRECTION << 2, 1, 1, message_id, bytes(kind._HEAD.size))
    cutter = CanCutter(kind.DIRECTION, fd)
    cutter.begin(wire, len(wire))
    frames_ = []
    while cutter.next():
        frames_.append((cutter.can_id, bytes(cutter.data[:cutter.size])))
    return frames_


# The far end of the core's CAN port is the input, in pieces.
class Line:
    heap_bytes = heap_code_bytes = heap_boot_bytes = locked = 0

    def __init__(self, comes, piece):
        self.comes, self.piece = comes, piece

    def open(self, path, buf):
        self.buf = buf

    def read(self, timeout_ms):
        data, self.comes = self.comes[:self.piece], self.comes[self.piece:]
        self.buf[:len(data)] = data
        return len(data)

    def write(self, buf, size):
        pass


def slcan(data):
    found = []
    for piece in (256, 1 + data[0] % 9 if data else 1):
        line = Line(data[1:], piece)
        port, buf = SlcanPort(line, 0), bytearray(256)
        port.open("", buf)
        read = []
        while line.comes or port._at < port._end:
            size = port.read(0)
            assert 0 <= size <= FRAME_MAX
            if size:
                read.append(bytes(buf[:size]))
        found.append(read)
    assert found[0] == found[1], "it matters in which pieces it comes"
    for text in data[1:].split(b"\r"):
        frame = parse(text)
        if frame is not None:
            frame.candump()


def slcan_seeds():
    def text(frames_, letter):
        sizes = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
        return "".join("%s%03X%X%s\r" % (letter, can_id, sizes.index(len(body)), body.hex().upper()) for can_id, body in frames_).encode()
    down = [number for number, kind in BY_ID.items() if kind.DIRECTION == schema.DOWN]
    return [b"\0" + text(_cut(number, fd), "tb"[fd]) for number in down for fd in (0, 1)] + [b"\3\r\7t2\rT00000001811\rr1000\r"]
