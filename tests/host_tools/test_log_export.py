"""`host_tools export`: what other tools read is what the log holds, of a damaged one too."""

import csv
import json
import os
import signal
import subprocess
import sys
from collections import Counter

import cantools
import pytest

from host_tools import cli
from host_tools.log_writers import CsvWriter
from protocol import schema
from protocol.can_joiner import FRAME_MAX, CanJoiner
from protocol.frame_reader import BOTH
from protocol.host_link import HostLink
from protocol.log import MAGIC, MARK, LogWriter
from protocol.messages import BY_ID
from tests.host_tools.recorded import wander
from tests.protocol.test_log import headed


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "m.tvlog"
    path.write_bytes(wander().log())
    return path


@pytest.fixture
def export(capsys):
    """The command in this process: (exit code, what it printed, what it complained of)."""
    def run(*argv):
        code = cli.main(["export", *map(str, argv)])
        return (code, *capsys.readouterr())
    return run


def messages():
    return [BY_ID[raw[3]].unpack(raw[5:-4]) for _, raw in wander().frames]


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def frames_of(path, fd):
    """The raw frames of both ways that a candump file holds."""
    heard = []
    host = HostLink(listen=BOTH, any_epoch=True, sink=lambda direction, raw: heard.append((direction, raw)))
    joiners = [CanJoiner(bytearray(FRAME_MAX), way) for way in (0, 1)]
    for line in path.read_text().splitlines():
        can_id, _, data = line.split()[2].partition("##1" if fd else "#")
        joiner = joiners[int(can_id, 16) >> 5 & 1]
        data = bytes.fromhex(data)
        size = joiner.join(int(can_id, 16), data, len(data))
        host.take(bytes(joiner.frame[:size]))
    return heard


def test_csv_has_a_table_of_each_kind_and_a_row_of_each_message(export, log, tmp_path):
    code, out, err = export(log, "--csv", tmp_path / "t")
    counts = Counter(message.NAME for message in messages())
    assert (code, err) == (0, "") and "exported        %d messages" % sum(counts.values()) in out
    assert {path.stem: len(table(path)) for path in (tmp_path / "t").iterdir()} == counts
    steps = [message for message in messages() if message.NAME == "STEP"]
    for row, step in zip(table(tmp_path / "t" / "STEP.csv"), steps, strict=True):
        assert (int(row["step"]), int(row["left"]), int(row["ir_7"])) == (step.step, step.left, step.ir[7])
        assert [tuple(item.values()) for item in json.loads(row["uwb"])] == list(step.uwb)
    data = b"".join(bytes.fromhex(row["data"]) for row in table(tmp_path / "t" / "MAP_DATA.csv"))
    assert data == wander().map_bytes


@pytest.mark.parametrize("fd", [[], ["--fd"]])
def test_candump_holds_every_frame_and_cantools_reads_its_telemetry(export, log, tmp_path, project, fd):
    path = tmp_path / "can.log"
    assert export(log, "--candump", path, *fd)[0] == 0
    assert frames_of(path, bool(fd)) == wander().frames
    if not fd:
        done = subprocess.run([sys.executable, "-m", "cantools", "decode", project / "protocol" / "tvslam.dbc"], stdin=open(path),
                              capture_output=True, text=True, timeout=60)
        assert done.returncode == 0 and cantools.__version__
        steps = sum(message.NAME == "POSE" for message in messages())
        assert done.stdout.count("heading_bam: ") >= steps > 50, done.stdout[:2000]


def test_mcap_holds_every_message_as_json(export, log, tmp_path):
    reader = pytest.importorskip("mcap.reader", reason="pip install 'tvslam[mcap]'")
    path = tmp_path / "m.mcap"
    assert export(log, "--mcap", path)[0] == 0
    with open(path, "rb") as file:
        rows = list(reader.make_reader(file).iter_messages())
    assert len(rows) == len(wander().frames)
    poses = [json.loads(row.data) for _, channel, row in rows if channel.topic == "/up/pose"]
    assert poses == [message._asdict() for message in messages() if message.NAME == "POSE"]


def test_a_damaged_log_gives_what_is_sound_and_says_where_it_is_not(export, log, tmp_path):
    data = bytearray(log.read_bytes())
    hit = data.index(MARK, data.index(MARK) + 1) + 3000
    data[hit] ^= 4
    log.write_bytes(data[:-3])
    code, out, err = export(log, "--csv", tmp_path / "t")
    assert code == 0 and "is damaged from byte " in err and " of them lost; what is sound was exported" in err
    assert hit - 300 < int(err.split("from byte ")[1].split(" ")[0]) <= hit
    rows = table(tmp_path / "t" / "STEP.csv")
    assert 0.4 * len(wander()._ticks) < len(rows) < len(wander()._ticks)
    log.write_bytes(data[:hit])
    assert "breaks off at byte" in export(log, "--candump", tmp_path / "c")[2]


def test_a_log_of_another_schema_is_read_by_its_own(export, log, tmp_path):
    told = [row for row in schema.MESSAGES if row[1] != "STEP"] + [(0x10, "STROLL", 0, 1, (("pace", "u32", ""),))]
    data = log.read_bytes()
    end = data.index(LogWriter().marker()[:16])
    head = LogWriter().head(messages=told)
    log.write_bytes(head[:head.index(MARK)] + data[end:])
    code, _, err = export(log, "--csv", tmp_path / "t")
    assert code == 0 and "are no messages of its own schema" in err     # the STEPs: none has four bytes
    assert (tmp_path / "t" / "POSE.csv").exists() and not (tmp_path / "t" / "STEP.csv").exists()
    code, _, err = export(log, "--candump", tmp_path / "c")
    assert code == 2 and "another schema" in err and not (tmp_path / "c").exists()


@pytest.mark.parametrize("data, word", [
    (b"", "ends within its head"), (b"hello", "no log of a TVSLAM link"), (MAGIC, "ends within its head"),
    (headed(b'{"messages": [["x"]], "parameters": []}'), "not understood"),
    (headed(b'{"messages": [[1, "../x", 0, true, [["a", "u9", ""]]]], "parameters": []}'), "not understood"),
])  # fmt: skip
def test_what_is_no_log(export, log, tmp_path, data, word):
    log.write_bytes(data)
    code, _, err = export(log, "--csv", tmp_path / "t")
    assert code == 2 and word in err and err.count("\n") == 1


def test_a_table_of_another_log_is_not_left_beside_those_of_this_one(export, log, tmp_path):
    (tmp_path / "t").mkdir()
    for name in ("STEP.csv", "MAP_READ.csv", "notes.csv"):
        (tmp_path / "t" / name).write_text("of another log")
    assert export(log, "--csv", tmp_path / "t")[0] == 0
    assert {path.name for path in (tmp_path / "t").iterdir()} == {*(message.NAME + ".csv" for message in messages()), "notes.csv"}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_an_export_that_is_ended_leaves_nothing_half_done(number, export, log, tmp_path, monkeypatch):
    before, adding = signal.signal(number, lambda *_: None), CsvWriter.add

    def add(writer, record, message):
        adding(writer, record, message)
        if message.NAME == "POSE":
            os.kill(os.getpid(), number)
    monkeypatch.setattr(CsvWriter, "add", add)
    try:
        assert export(log, "--csv", tmp_path / "t")[0] == 130
    finally:
        signal.signal(number, before)
    assert os.listdir(tmp_path / "t") == []


def test_bad_arguments_are_one_sentence_each(export, log, tmp_path):
    for words, sentence in (([log], "nothing to write"), ([log, "--candump", log], "would be overwritten"),
                            ([log, "--candump", tmp_path], "is a folder"), ([log, "--csv", __file__], "is no folder"),
                            ([tmp_path / "no", "--csv", tmp_path / "t"], "cannot be read"),
                            ([log, "--candump", "/dev/full"], "/dev/full could not be written: no space left"),
                            ([log, "--mcap", "/dev/full"], "/dev/full could not be written: no space left"),
                            ([log, "--candump", tmp_path / "t", "--mcap", tmp_path / "t"], "that of --candump"),
                            ([log, "--fd", "--csv", tmp_path / "t"], "give --candump")):
        code, _, err = export(*words)
        assert code == 2 and sentence in err.lower() and err.count("\n") == 1, (words, err)
