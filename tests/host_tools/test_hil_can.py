"""Missions over CAN through the command line: the same mission as on a pty, and its frames for other people's tools."""

import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time

import cantools
import can
import numpy as np
import pytest

from host_tools.mission import POSE_FIELDS
from host_tools.mission_log import read_mission
from protocol import schema, states
from protocol.describe import DBC
from protocol.messages import BY_NAME
from tests.host_tools.test_hil_arguments import expect_refusal
from tests.host_tools.test_hil_mission import SMALL, by_command, children_of, finish, hil, wait_until_driving
from tests.host_tools.test_hil_processes import alive, wait_until
from tests.host_tools.test_result import expect_all_keys
from tests.protocol.messages import raw_frame, wire
from tests.protocol.test_can_frames import UP, cut
from tests.sim_device.can_story import running_hub
from tests.sim_device.test_can_hub import adapter

SHORT = ("--max-robot-s", "25")


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    return str(path)


def result_of(project, home, tmp_path, *argv):
    path = tmp_path / "result.json"
    code, said, err = finish(hil(project, home, *argv, "--json", str(path)))
    assert code in (0, 1), err
    result = json.loads(path.read_text())
    expect_all_keys(result)
    return result, said


@pytest.mark.parametrize("target, link", [("unix", "slcan"), ("unix", "slcan-fd"), ("cpython", "slcan")])
def test_over_can_the_mission_is_the_one_over_the_pty(project, small, tmp_path, micropython, target, link):
    pty, _ = result_of(project, small, tmp_path, "--target", "cpython", *SHORT)
    over, said = result_of(project, small, tmp_path, "--target", target, "--link", link, *SHORT)
    assert over["hash"] == pty["hash"] and over["localisation"] == pty["localisation"] and over["map"] == pty["map"]
    assert over["link"] == link and "over " + link in said
    bus = over["can"]
    assert bus["frames"] > over["link_stats"]["frames"] and bus["dropped"] == bus["lost"] == 0
    assert 0.005 < bus["bus_load"] < bus["bus_load_max"] and "busiest step" in said
    assert bus["bus_load_max"] < 0.6 or over["link_stats"]["retransmits"]     # what a busy machine has to repeat counts, too
    assert pty["can"] == dict.fromkeys(bus)
    if target == "unix":
        assert over["memory"]["heap_locked"] and over["memory"]["allocated_after_boot_bytes"] == 0


BOARD = "from firmware_py.main_board import main\nmain(open(%r, 'r+b'), can='slcan')"


@pytest.mark.parametrize("board", [False, True])
def test_on_an_adapters_port_the_core_is_found_on_its_bus(project, small, tmp_path, micropython, board):
    pty, _ = result_of(project, small, tmp_path, "--target", "cpython", *SHORT)
    with running_hub(tmp_path, "robot", "core") as (_, (robot, core)):
        argv = [micropython, "-X", "heapsize=320k", "-c", BOARD % core] if board else [sys.executable, "-m", "firmware_py", "slcan:" + core]
        child = subprocess.Popen(argv, cwd=project, stdout=subprocess.DEVNULL)
        try:
            over, _ = result_of(project, small, tmp_path, "--target", "port:" + robot, "--link", "slcan", *SHORT)
        finally:
            child.kill()
            child.wait()
    assert over["hash"] == pty["hash"] and over["can"]["frames"] is None


def poses_of(database, dump):
    """Rows (step, x, y, heading) that the parts of each POSE give, of a candump log, as others' tools read both."""
    rows, parts = [], {}
    for frame in can.LogReader(str(dump)):
        if frame.arbitration_id in database:
            message = database[frame.arbitration_id]
            parts.update(message.decode(bytes(frame.data), decode_choices=False))
            if message.name in ("FRAME_END", "POSE_FD") and parts["message"] == BY_NAME["POSE"].ID:
                rows.append([parts[name] for name in ("step", "x_um", "y_um", "heading_bam")])
    return np.array(rows)


@pytest.mark.parametrize("link", ["slcan", "slcan-fd"])
def test_cantools_reads_the_missions_own_values_from_its_candump(project, small, tmp_path, link):
    log, dump = tmp_path / "mission.log", tmp_path / "can.log"
    result_of(project, small, tmp_path, "--target", "cpython", "--link", link, "--log", str(log), "--candump", str(dump), *SHORT)
    database = cantools.database.load_file(DBC)
    rows = poses_of({message.frame_id: message for message in database.messages}, dump)
    pose = read_mission(str(log), str(tmp_path / "no truth")).pose
    assert len(rows) > 200
    picked = [POSE_FIELDS.index(name) for name in ("step", "x_m", "y_m", "heading_rad")]
    told = pose[:, picked]
    assert (rows[:, 0] == told[:, 0]).all()
    assert rows[:, 1:3] / 1e6 == pytest.approx(told[:, 1:3])
    assert np.cos(rows[:, 3] * np.pi / 32768) == pytest.approx(np.cos(told[:, 3]), abs=1e-6)


def test_the_command_cantools_decodes_the_candump(project, small, tmp_path):
    dump = tmp_path / "can.log"
    result_of(project, small, tmp_path, "--target", "cpython", "--link", "slcan", "--candump", str(dump), "--max-robot-s", "2")
    with open(dump) as file:
        argv = [sys.executable, "-m", "cantools", "decode", "--single-line", DBC]
        done = subprocess.run(argv, stdin=file, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "POSE_1(step: " in done.stdout and "state: FIND_WALL" in done.stdout and "SCHEMA(" in done.stdout
    assert len(done.stdout.splitlines()) == len(dump.read_text().splitlines())


def test_the_monitor_of_cantools_shows_what_the_core_says(tmp_path):
    pose = BY_NAME["POSE"](*[1234567, -7654321] + [0] * 5 + [states.NAMES.index("FOLLOW")] + [0] * 6)
    frames = cut(wire(raw_frame(pose.ID, pose.pack(), schema.VERSION | 4)), UP, 0)
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 60, 120, 0, 0))
    with running_hub(tmp_path, "core", "monitor") as (_, (core, monitor)):
        argv = [sys.executable, "-m", "cantools", "monitor", "-i", "slcan", "-c", monitor, DBC]
        shown, sender = b"", adapter(core)
        size = {"TERM": "xterm", "LINES": "60", "COLUMNS": "120"}  # curses believes these two before it asks the terminal
        with subprocess.Popen(argv, stdin=slave, stdout=slave, stderr=slave, env={**os.environ, **size}) as process:
            try:
                end_s = time.monotonic() + 30
                while not (b"FOLLOW" in shown and b"1234567" in shown) and time.monotonic() < end_s:
                    for can_id, data in frames:
                        sender.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))
                    while select.select([master], [], [], 0.2)[0]:
                        shown += os.read(master, 65536)
            finally:
                process.kill()
                sender.shutdown()
    os.close(slave)
    os.close(master)
    assert b"FOLLOW" in shown and b"1234567" in shown and b"-7654321" in shown


@pytest.mark.parametrize("argv, words", [
    (["--link", "udp", "--target", "port:/dev/ttyACM9"], ("--link udp", "port:/dev/ttyACM9", "--link slcan", "--link pty")),
    (["--faults", "busoff@step=9", "--target", "cpython"], ("busoff", "a CAN bus", "--link slcan")),
    (["--link", "socketcan:no_such_can"], ("socketcan:no_such_can", "no such network", "slcan")),
    (["--link", "socketcan:"], ("socketcan:", "no such network")),
    (["--candump", "x.log"], ("--candump", "pty", "slcan")),
    (["--candump", "x.log", "--link", "slcan", "--target", "port:/dev/ttyACM9"], ("--candump", "adapter")),
    (["--link", "slcan", "--target", "port:/dev/there-is-no-such-port"], ("/dev/there-is-no-such-port", "no CAN adapter")),
])
def test_what_a_can_link_cannot_serve_is_one_sentence(small, capsys, argv, words):
    expect_refusal(capsys, [small, *argv], *words)


def test_a_candump_never_takes_the_place_of_another_file(small, tmp_path, capsys):
    both = str(tmp_path / "both")
    expect_refusal(capsys, [small, "--link", "slcan", "--candump", small], "--candump", "the home")
    expect_refusal(capsys, [small, "--link", "slcan", "--candump", both, "--log", both], "--candump", "--log")
    expect_refusal(capsys, [small, "--link", "slcan", "--candump", str(tmp_path)], "--candump", "folder")


def test_a_bus_that_would_be_too_slow_is_said_and_its_faults_change_nothing(project, small, tmp_path):
    good, _ = result_of(project, small, tmp_path, "--target", "cpython", "--link", "memory", "--max-robot-s", "5")
    path = tmp_path / "busy.json"
    code, _, err = finish(hil(project, small, "--target", "cpython", "--link", "slcan", "--max-robot-s", "5", "--json", str(path),
                              "--faults", "busy=0.9,loss=0.005,busoff@step=50:50ms"))
    busy = json.loads(path.read_text())
    assert code == 1 and busy["hash"] == good["hash"] and busy["can"]["lost"] > 0
    assert busy["can"]["bus_load_max"] > 1 and re.search(r"50 steps a second.* (busy for \d+ %|of 500 kbit/s for \d+ ms)", err)


def test_a_full_disk_under_the_candump_is_named_and_ends_no_mission(project, small, tmp_path):
    path = tmp_path / "result.json"
    full = ("--candump", "/dev/full", "--json", str(path))
    code, _, err = finish(hil(project, small, "--target", "cpython", "--link", "slcan", *full, *SHORT))
    assert code == 3 and re.search("/dev/full is incomplete: .* after 0 bytes: No space left", err.splitlines()[-1])
    result = json.loads(path.read_text())
    assert result["time"]["robot_s"] == 25 and result["hash"]["steps"] and result["can"]["frames"]


@pytest.mark.parametrize("command, words", [("can_hub", "CAN"), ("firmware_py", "core"), ("--truth", "virtual robot")])
def test_who_dies_on_the_bus_is_named_and_nobody_is_left(project, small, command, words):
    process = hil(project, small, "--target", "cpython", "--link", "slcan", "--realtime")
    wait_until_driving(process)
    children = children_of(process.pid)
    assert len(children) == 3
    os.kill(by_command(children, command), signal.SIGKILL)
    code, _, err = finish(process, 30)
    assert code == 3 and words in err.splitlines()[-1] and "Traceback" not in err
    wait_until(lambda: not any(map(alive, children)))


def test_an_interrupted_mission_still_tells_what_its_bus_carried(project, small, tmp_path):
    path = tmp_path / "result.json"
    process = hil(project, small, "--target", "cpython", "--link", "slcan", "--realtime", "--json", str(path))
    wait_until_driving(process)
    os.killpg(process.pid, signal.SIGINT)
    code, _, err = finish(process, 30)
    result = json.loads(path.read_text())
    assert code == 1 and result["reason"] == "interrupted" and "Traceback" not in err
    assert result["can"]["frames"] > 0 and result["can"]["bus_load"] > 0
