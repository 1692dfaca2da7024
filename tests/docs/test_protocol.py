# docs/protocol.md, the half that is written by hand: its example, its layouts, its tables of codes.

import json
import re
import zlib
from array import array
from struct import Struct

from firmware_py.device import Device
from host_tools.map_file import decode_records
from protocol import frame_reader, schema
from protocol.frame_reader import FrameReader
from protocol.host_link import HostLink
from protocol.log import LogWriter
from protocol.messages import BY_NAME
from tests.docs.pages import page, rows
from tests.docs.test_memory import DeadEnd
from tests.stories.mission import drive_mission

PAGE = "docs/protocol.md"


def layouts():
    """{part: Struct} of the map's and the log's tables."""
    return {row[0].split(",")[0]: Struct(row[1]) for row in rows(PAGE, "part")}


def test_the_frame_of_the_example():
    link = HostLink()
    link.epoch = 1
    wire = bytes.fromhex(re.search(r"is `((?:[0-9a-f]{2} )+[0-9a-f]{2})`", page(PAGE))[1])
    assert wire == link.encode(BY_NAME["PING"](token=7))


def test_the_largest_frame():
    assert f"at most {frame_reader.WIRE_MAX} B on the wire" in page(PAGE)
    assert f"body 0-{schema.BODY_MAX} B" in page(PAGE)


def test_the_causes_of_loss_are_the_counters():
    fields = {field[0] for field in BY_NAME["LINK"].FIELDS} | {"stale"}
    causes = [row[0] for row in rows(PAGE, "counter")]
    assert set(causes) <= fields
    assert {name for name in fields if name.startswith("bad_")} | {"overrun", "stale"} == set(causes)


def test_the_checks_come_in_the_order_of_the_table():
    """Of a frame with several faults, the cause that is counted stands higher in the table."""
    link = HostLink()
    link.epoch = 1
    whole = link.encode(BY_NAME["PING"](token=0x101))
    causes = [row[0] for row in rows(PAGE, "counter")]
    both = bytearray(whole)
    both[6] ^= 0x40                      # LEN and with it the CRC
    counters = array("i", bytes(4 * frame_reader.COUNTERS))
    reader = FrameReader(frame_reader.DOWN, counters)
    reader.feed_from(both, 0, len(both))
    hit = [name for name, place in (("bad_length", frame_reader.BAD_LENGTH), ("bad_crc", frame_reader.BAD_CRC)) if counters[place]]
    assert hit == [min(("bad_length", "bad_crc"), key=causes.index)]


def test_the_codes_are_those_of_the_schema():
    errors = {int(row[0]) for row in rows(PAGE, "ERROR code")}
    assert errors == {value for name, value in vars(schema).items() if name.startswith("ERROR_")}
    statuses = {int(row[0]) for row in rows(PAGE, "status")}
    assert statuses == {value for name, value in vars(schema).items() if name.startswith("PARAM_")}


def test_the_map_is_laid_out_as_the_page_says():
    told = layouts()
    core = drive_mission("studio").core
    image = bytes(core.image.byte(i) for i in range(core.image.size))
    magic, vertices, chains, regions, nodes, edges = told["header"].unpack_from(image)
    assert (magic, vertices, chains) == (b"TVM2", core.vectors.used, core.vectors.chains)
    assert (regions, nodes, edges) == (core.graph.region_count, core.graph.node_count, core.graph.edge_count) and regions > 0
    records = decode_records(image)  # what is between: tests/firmware_py/test_map_image.py
    assert list(records.xs) == list(core.vectors.xs[:vertices]) and list(records.kinds) == list(core.vectors.kinds[:chains])
    at = len(image) - told["end"].size
    assert told["end"].unpack_from(image, at)[0] == zlib.crc32(image[:-4])
    assert (core.image.crc[0], core.image.crc[1]) == (zlib.crc32(image[:-4]) & 0xFFFF, zlib.crc32(image[:-4]) >> 16)


def test_the_log_is_laid_out_as_the_page_says():
    told = layouts()
    writer = LogWriter()
    data = writer.head(home="studio") + writer.record(1500, 1, b"raw frame")
    magic, size = told["head"].unpack_from(data)
    text = data[told["head"].size:told["head"].size + size]
    assert magic == b"TVSLAM1\n" and json.loads(text)["home"] == "studio"
    at = told["head"].size + size + 4
    assert told["marker"].unpack_from(data, at) == (b"\xf5TVSLAM-SYNC\r\n\x1a\n", 0, 0)
    at += told["marker"].size + 4
    assert told["record"].unpack_from(data, at) == (1, 9, 1500)
    assert data[at + told["record"].size:-4] == b"raw frame"
    assert int.from_bytes(data[-4:], "little") == zlib.crc32(data[at:-4])


# Answers of a core to what the page tells of steps and parameters.
class Heard(DeadEnd):
    def __init__(self):
        self.wire = bytearray()

    def write(self, buf, size):
        self.wire += bytes(buf[:size])


def test_steps_are_answered_as_the_page_says():
    port = Heard()
    device = Device(port, 77)
    link = HostLink()

    def ask(message):
        data = bytearray(link.encode(message))
        port.wire.clear()
        device.receive(data, len(data))
        return bytes(port.wire), [m for m in link.feed(port.wire)]

    device.hello()
    hello, = link.feed(port.wire)
    data = bytearray(link.welcome(hello))
    device.receive(data, len(data))
    step = BY_NAME["STEP"](5, 0, 0, (0,) * 8, 0, 0, ())
    first, (answer, *_) = ask(step)
    assert answer.step == 5
    again, answers = ask(step)
    assert answers == [answer] and not first.startswith(again)
    retained = [bytes(link.encode(BY_NAME["PARAM_GET"](0, 0), 1))] * 2
    said = []
    for wire in retained:
        port.wire.clear()
        device.receive(bytearray(wire), len(wire))
        said.append(bytes(port.wire))
    assert said[0] == said[1] != b""
    _, (error,) = ask(step._replace(step=9))
    assert (error.code, error.detail) == (schema.ERROR_STEP_ORDER, 6)
    data = bytearray(link.welcome(hello._replace(boot_id=1)))  # for another boot: dropped
    device.receive(data, len(data))
    assert device.link.epoch == 1 and link.epoch == 2
    link.epoch = 1
    _, (value,) = ask(BY_NAME["PARAM_SET"](0, 0, 1))
    assert value.status == schema.PARAM_LOCKED
    _, (stale,) = ask(BY_NAME["MAP_READ"](4711, 0))
    assert stale.code == schema.ERROR_STALE
