# The hub as the adapters that python-can and the core take it for, and missions over a bus on which things go wrong.

import io
import json
import os
import random
import signal
import subprocess
import sys
import time

import can
import pytest

from sim_device.faults import parse
from sim_device.links.slcan_adapter import LINE_MAX
from sim_device.links.trace import GrowingFile
from tests.sim_device.can_story import mission, running_hub
from tests.sim_device.lockstep import PROJECT

DEAD_S = 10


def adapter(path, **options):
    """python-can's own SLCAN bus, as anybody would open it."""
    return can.Bus(interface="slcan", channel=path, bitrate=500_000, sleep_after_open=0, **options)


def until(true, what):
    end_s = time.monotonic() + DEAD_S
    while not true():
        assert time.monotonic() < end_s, what
        time.sleep(0.01)


def answers(fd, text):
    """What an adapter answers to a line."""
    os.write(fd, text)
    said = b""
    while not said.endswith((b"\r", b"\a")):
        said += os.read(fd, 100)
    return said


def test_python_can_on_three_adapters_of_one_bus(tmp_path):
    dump = GrowingFile(str(tmp_path / "dump"))
    with running_hub(tmp_path, "a", "b", "c", candump=dump) as (hub, paths):
        a, b, c = [adapter(path) for path in paths]
        until(lambda: all(one.open for one in hub.bus.controllers), "all three have opened their channel")
        sent = [can.Message(arbitration_id=0x100 + i, data=bytes(range(i % 9)), is_extended_id=False) for i in range(50)]
        sent.append(can.Message(arbitration_id=0x1ABCDEF0, data=b"xyz", is_extended_id=True))
        sent.append(can.Message(arbitration_id=0x2A0, is_fd=True, bitrate_switch=True, data=bytes(48), is_extended_id=False))
        for message in sent:
            a.send(message)
        for bus in (b, c):
            for message in sent:
                got = bus.recv(5)
                assert got is not None and got.equals(message, timestamp_delta=None, check_direction=False, check_channel=False)
        assert a.recv(0.05) is None, "nobody hears himself"
        for bus in (a, b, c):
            bus.shutdown()
    dump.close()
    text = (tmp_path / "dump").read_text()
    lines = text.splitlines()
    assert len(lines) == len(sent) and lines[-1].endswith("can0 2A0##1" + "00" * 48)
    read = list(can.CanutilsLogReader(io.StringIO(text)))
    assert [(m.arbitration_id, bytes(m.data)) for m in read] == [(m.arbitration_id, bytes(m.data)) for m in sent]


def test_an_adapter_answers_as_lawicels_manual_says(tmp_path):
    with running_hub(tmp_path, "a", "b") as (hub, (path, _)):
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
        assert answers(fd, b"t2410\r") == b"\a", "the channel is closed"
        assert [answers(fd, line + b"\r") for line in (b"C", b"S6", b"Y2", b"O")] == [b"\r"] * 4
        assert [answers(fd, line + b"\r") for line in (b"O", b"S6", b"S5", b"q", b"t9990", b"t24191")] == [b"\a"] * 6
        assert answers(fd, b"V\r").startswith(b"V") and answers(fd, b"N\r").startswith(b"N") and answers(fd, b"F\r") == b"F00\r"
        assert answers(fd, b"C\r") == b"\r" and answers(fd, b"t2410\r") == b"\a"
        os.close(fd)


def test_random_bytes_harm_neither_the_adapter_nor_the_others(tmp_path):
    rng = random.Random(11)
    with running_hub(tmp_path, "noise", "b", "c") as (hub, (path, b_path, c_path)):
        b, c = adapter(b_path), adapter(c_path)
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
        for i in range(300):
            os.write(fd, rng.randbytes(700) if i & 1 else bytes(rng.choices(b"tTdDbBrR0123456789ABCDEF\rOCS6", k=700)))
            if i % 10 == 0:
                os.set_blocking(fd, False)
                try:
                    os.read(fd, 65536)
                except BlockingIOError:
                    pass
                os.set_blocking(fd, True)
        message = can.Message(arbitration_id=0x123, data=b"still", is_extended_id=False)
        until(lambda: b.send(message) or any(got.data == b"still" for got in iter(lambda: c.recv(0.1), None)), "it still carries frames")
        assert len(hub.adapters[0]._text) <= LINE_MAX + 4096
        os.close(fd)
        b.shutdown()
        c.shutdown()


def test_who_goes_is_off_the_bus_and_may_come_again(tmp_path):
    with running_hub(tmp_path, "a", "b") as (hub, (path_a, path_b)):
        a = adapter(path_a)
        for _ in range(3):
            b = adapter(path_b)
            until(lambda: all(one.open for one in hub.bus.controllers), "both are there")
            a.send(can.Message(arbitration_id=1, data=b"hi", is_extended_id=False))
            assert b.recv(5).data == b"hi"
            b.shutdown()
            until(lambda: not hub.bus.controllers[1].open, "it has gone")
        a.shutdown()


def test_by_hand_it_tells_what_it_counted_and_what_is_wrong(tmp_path):
    argv = [sys.executable, "-m", "sim_device.can_hub"]
    process = subprocess.Popen([*argv, str(tmp_path / "a"), str(tmp_path / "b")], cwd=PROJECT, stdout=subprocess.PIPE, text=True)
    until((tmp_path / "b").exists, "its names are there")
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=20)
    assert process.returncode == 0 and json.loads(out) == {
        "event": "bus", "frames": 0, "busy_s": 0.0, "lost": 0, "refused": 0, "step_s_max": 0.0, "dropped": 0, "incomplete": ""}
    assert not (tmp_path / "a").exists()
    (tmp_path / "taken").write_text("mine")
    one = str(tmp_path / "one")
    for more, words in (([str(tmp_path / "taken")], "taken"), ([one, one], "one name"), ([one, "--candump", str(tmp_path)], "written"),
                        ([one, "--uplink", "ethernet"], "ethernet is no CAN bus"), ([one, "--uplink", "socketcan:"], "no CAN bus")):
        done = subprocess.run([*argv, *more], cwd=PROJECT, capture_output=True, text=True, timeout=20)
        assert done.returncode == 2 and words in done.stderr and len(done.stderr.splitlines()) == 1
    assert (tmp_path / "taken").read_text() == "mine"


def quiet(hub, sim):
    pass


def lossy(hub, sim):
    hub.bus.faults.loss = 0.02
    sim.wait(60)
    assert hub.bus.lost > 5


def troubled(hub, sim):
    """The core's controller goes bus-off, the robot's finds its queue full, again and again."""
    robot, core = hub.bus.controllers
    while sim.poll() is None:
        hub.bus.bus_off(core, time.monotonic(), 0.05)
        time.sleep(0.2)
        robot.full_for = 7
        time.sleep(0.2)
    assert robot.refused + core.refused > 0


def by_faults(hub, sim):
    """What the text of --faults brings about."""
    robot, core = hub.bus.controllers
    done, worsen = [], hub.bus.worsen
    hub.bus.worsen = lambda by, what, value, now_s: done.append((what, value)) or worsen(by, what, value, now_s)
    sim.wait(60)
    assert done == [("seed", 1.0), ("loss", 0.01), ("full", 0.02), ("busy", 0.4), ("busoff", 0.0), ("busoff", 0.06), ("busoff", 0.0),
                    ("jam", 0.06)]
    assert core.off_until_s > robot.off_until_s == 0.0 and hub.bus.lost > 0 and robot.refused and core.refused


FAULTS = "loss=0.01, full=0.02, busy=0.4, drop@up=50, busoff@step=40, busoff@step=80:60ms, busoff@step=110, full@step=140:60ms"


@pytest.mark.parametrize("link", ["slcan", "slcan-fd"])
@pytest.mark.parametrize("trouble, argv", [(lossy, ()), (troubled, ()), (by_faults, ("--faults", FAULTS))])
def test_a_mission_over_a_bad_bus_is_the_same_mission(tmp_path, link, trouble, argv):
    good = mission(tmp_path / "good", link, quiet, 4)
    kept = tmp_path / "kept"
    bad = mission(tmp_path / "bad", link, trouble, 4, *argv, *(("--keep-faults", str(kept)) if argv else ()))
    assert len(set(good)) == 200 and list(dict.fromkeys(bad)) == list(dict.fromkeys(good))
    if argv:
        assert parse(kept.read_text()) == parse(FAULTS), "what was kept brings the same about again"
