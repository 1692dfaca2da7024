# Fuzzed: what comes from a file or a command line. It is taken, or refused with one sentence of the reader's own error.

import json
import os
import tempfile
import zlib

from host_tools.mission_log import LogError as NoMission
from host_tools.mission_log import read_mission
from host_tools.recording import LogUnusable, Recording
from protocol import schema
from protocol.log import MAGIC, LogError, LogReader, LogWriter
from protocol.messages import BY_NAME
from sim_device.faults import FaultError, parse
from sim_device.home import HomeError, home_names, load_home

ROOM = {"name": "room", "units": "m", "outline": [[0, 0], [3, 0], [3, 2], [0, 2]],
        "obstacles": [[[1, 1], [1.2, 1], [1.2, 1.2], [1, 1.2]]],
        "rooms": [{"name": "all", "centre": [1, 1], "polygon": [[0, 0], [3, 0], [3, 2]]}], "start": [0.5, 0.5]}
PLAIN, EDITED, HEADED = 0, 1, 2
_FOLDER = tempfile.TemporaryDirectory(prefix="tvslam-fuzz-")


def kept(data, name):
    path = os.path.join(_FOLDER.name, name)
    with open(path, "wb") as file:
        file.write(data)
    return path


def one_sentence(error):
    assert str(error) and "\n" not in str(error) and len(str(error)) < 600, "no sentence: %r" % str(error)


def home(data):
    try:
        found = load_home(kept(data, "home.json"))
    except HomeError as error:
        return one_sentence(error)
    assert found.free.area > 0 and len(found.segments) == sum(map(len, found.rings))


def home_seeds():
    one = json.dumps(ROOM).encode()
    texts = [one, b"\xef\xbb\xbf" + one, json.dumps({**ROOM, "obstacles": [], "rooms": []}).encode(), b"[]", b"{}",
             json.dumps({**ROOM, "start": [1e300, -1e-300], "name": "\u00e9"}).encode()]
    for name in home_names():
        with open(load_home(name).path, "rb") as file:
            whole = json.load(file)
        texts.append(json.dumps({**whole, "obstacles": whole["obstacles"][:2], "rooms": whole["rooms"][:1]}).encode())
    return texts


def _frame(number, kind, *fields):
    body = BY_NAME[kind](*fields).pack()
    raw = bytes((0x29 | BY_NAME[kind].DIRECTION << 2, number & 255, 0, BY_NAME[kind].ID, len(body) + 9)) + body
    return BY_NAME[kind].DIRECTION, raw + zlib.crc32(raw).to_bytes(4, "little")


def _sound_log():
    """(bytes, [(end of the record, direction, frame)]) of a short mission with a marker every ten frames."""
    hello = [1, 1, 0, 0, 1, 2, 7, 0, 96, 4, 2, 0, 2, 2, 99, 9, 9]
    rows = [_frame(0, "HELLO", *hello), _frame(1, "PARAM_SET", 0, 0, 1), _frame(1, "PARAM_VALUE", 0, 0, 0, 1)]
    for step in range(1, 13):
        rows.append(_frame(step + 1, "STEP", step, 1, 1, (9,) * 8, 0, 0, ()))
        rows.append(_frame(step + 1, "STEP_RSP", step, 1, 1, 2, 0, 77))
    writer = LogWriter()
    data, ends = writer.head(), []
    for number, (direction, raw) in enumerate(rows):
        data += writer.record(number * 1000, direction, raw)
        ends.append((len(data), direction, raw))
        if number % 10 == 9:
            data += writer.marker()
    return data, ends


SOUND, ENDS = _sound_log()
HEAD = len(LogWriter().head())


def log(data):
    mode, rest = data[:1], data[1:]
    if mode == bytes((EDITED,)):
        return _edited(rest)
    if mode == bytes((HEADED,)):
        head = MAGIC + len(rest).to_bytes(4, "little") + rest
        rest = head + zlib.crc32(head).to_bytes(4, "little") + SOUND[HEAD - len(LogWriter().marker()):]
    _read(rest, 64 + len(rest) % 97)
    _used(rest)


def _edited(edits):
    """Two bytes of place, what to do there, with what, and again: what is before the first of them comes back."""
    damaged, first = bytearray(SOUND), len(SOUND)
    for at in range(0, len(edits) - 3, 4):
        place = HEAD + int.from_bytes(edits[at:at + 2], "little") % (len(SOUND) - HEAD)
        what, byte = edits[at + 2] % 4, edits[at + 3]
        first = min(first, place)
        if what == 0:
            damaged[place:place + 1] = bytes((byte,))
        elif what == 1:
            del damaged[place:place + 1 + byte]
        elif what == 2:
            damaged[place:place] = bytes((byte,)) * (1 + byte % 5)
        else:
            damaged[place:place] = SOUND[place - byte:place]
    whole = [(direction, raw) for end, direction, raw in ENDS if end <= first]
    reader, found = _read(bytes(damaged), 64 + 7 * len(edits))
    assert [(record.direction, record.frame) for record in found[:len(whole)]] == whole, "sound records were lost"
    assert bytes(damaged) == SOUND[:len(damaged)] or reader.damage, "damage that nobody tells"
    if len(edits) // 4 % 4 == 1:    # it takes ten times as long
        _used(bytes(damaged))


def _read(data, size):
    reader, found = LogReader(), []
    try:
        for at in range(0, len(data), size):
            found += reader.feed(data[at:at + size])
    except LogError as error:
        one_sentence(error)
        return reader, found
    assert reader.lost >= 0 and reader.damaged >= 0 and reader.left_over <= len(data) and "\n" not in reader.damage
    return reader, found


def _used(data):
    path = kept(data, "m.tvlog")
    try:
        recording = Recording(path)
        steps = [tick.question.step for tick in recording.ticks() if tick.question.NAME == "STEP"]
        assert all(b == (a + 1) & (1 << 30) - 1 for a, b in zip(steps, steps[1:])), "steps out of their row"
        assert recording.status is None or "finished" in recording.status
    except LogUnusable as error:
        one_sentence(error)
    try:
        read_mission(path, path + ".none")
    except NoMission as error:
        one_sentence(error)


def log_seeds():
    told = {"messages": schema.MESSAGES, "parameters": [["mode"]], "version": 1}
    edits = [b"", b"\0\0\0\1", b"\x40\0\1\x20", b"\x80\1\2\7\x10\0\3\xf0", b"\xff\xff\1\xff"]
    return [bytes((PLAIN,)) + SOUND, bytes((PLAIN,)) + SOUND[:-9], *(bytes((EDITED,)) + edit for edit in edits),
            bytes((HEADED,)) + json.dumps(told).encode(), bytes((HEADED,)) + b'{"messages":[],"parameters":[]}']


def faults(data):
    text = data.decode("utf-8", "replace").lstrip("@")  # no file of this machine
    try:
        plan = parse(text)
    except FaultError as error:
        return one_sentence(error)
    assert all(0 < chance <= 1 for chance in plan.chances.values()) and plan.delay_s >= 0
    assert all(fault.first <= fault.end for fault in plan.sensors)


def fault_seeds():
    return [b"drop=0.2,flip=0.02,dup=0.1,reorder=0.1", b"delay=20ms:0.3,cut@step=500:2s\nreset@step=900 # x",
            b"flip@up=40:97,delay@down=7:20ms", b"uwb=off,infrared=stuck@step=300:200", b"drop@down=12,dup@up=40", b"power@byte=123"]
