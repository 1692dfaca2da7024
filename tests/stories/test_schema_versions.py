# Old and new versions together, each a real process: a mission between the two is the one that equals have, or both hashes, the message
# and the field that differ are named. Beside it a tap, a log, and its replay.

import contextlib
import json
import subprocess
import sys
import time

import pytest

from host_tools import cli
from host_tools.mission_log import read_mission
from host_tools.monitor_foreign import plain_lines, sections
from host_tools.monitor_session import MonitorSession
from host_tools.terminal_port import TerminalPort
from protocol import schema_pull
from protocol.dialect import OURS
from sim_device.config import load_robot
from sim_device.links.peer_errors import PeerError
from sim_device.links.pty import Pty
from sim_device.links.tap import Taps
from sim_device.links.trace import FrameLog
from sim_device.nvm import Nvm
from sim_device.session import STEP_S, Session
from sim_device.virtual_robot import VirtualRobot
from tests.sim_device.faulty_mission import Outcome, Told, Truth, calm, home_of
from tests.stories.other_schema import ROOT, version

STEPS = 200
ENDS_S = 10


@pytest.fixture(scope="module")
def versions(tmp_path_factory):
    made = {}

    def of(name):
        if name not in made:
            made[name] = version(name, tmp_path_factory.mktemp(name))
        return made[name]
    return of


@contextlib.contextmanager
def core(folder, path, vm=(sys.executable,)):
    process = subprocess.Popen([*vm, "-m", "firmware_py", path], cwd=folder, stdout=subprocess.DEVNULL)
    try:
        yield
        process.wait(ENDS_S)
    finally:
        process.kill()
        process.wait()


def drive(folder, tmp_path, vm=(sys.executable,), tap=None, nvm=None):
    """A mission of this host with the core of that folder: an Outcome, which has what was said of the schema."""
    truth, told, link = Truth(), Told(), str(tmp_path / "link")
    with contextlib.ExitStack() as stack:
        log = stack.enter_context(contextlib.closing(FrameLog(str(tmp_path / "log"), home="studio")))
        pty = Pty(link)
        stack.enter_context(core(folder, link, vm))
        stack.callback(pty.close)   # first: the core ends by it
        taps = stack.enter_context(contextlib.closing(Taps([tap] if tap else [])))
        robot = VirtualRobot(home_of("studio"), load_robot(), 1)
        session = Session(pty, taps, robot, told, log, truth, max_robot_s=(STEPS + 0.5) * STEP_S, nvm=nvm)
        session.run(ENDS_S)
        outcome = Outcome(session, truth, pty, [], told)
        outcome.said = [fields["text"] for name, fields in told if name == "schema"]
        if tap:
            outcome.monitor = watched(tap, taps)
        return outcome


def watched(tap, taps):
    """A monitor that comes when all is over: what the tap tells a late viewer."""
    port = TerminalPort(tap)
    with port, pytest.MonkeyPatch.context() as patch:
        patch.setattr(schema_pull, "_KNOWN", {OURS.hash: OURS})     # as in a process of its own
        now_s = time.monotonic() + 1
        monitor = MonitorSession(port, clock=lambda: now_s)
        for _ in range(200):
            now_s += 0.1
            taps.service(now_s)
            monitor.pump()
    return monitor


@pytest.mark.parametrize(("name", "differs"), [
    ("longer", "(1 message differs: POSE)"), ("wider", "(4 messages differ: POSE, STATUS_RSP, STEP, STEP_RSP)"),
    ("renumbered", "(its parameters differ)"),
])
def test_a_core_of_another_version_maps_as_ours(name, differs, versions, tmp_path):
    outcome = drive(versions(name), tmp_path)
    assert len(outcome.said) == 1 and outcome.said[0].endswith("this host %08x: adapted %s" % (OURS.hash, differs))
    assert outcome.same_as(calm(steps=STEPS))


def test_a_core_from_before_the_memory_is_not_told_of_it(versions, tmp_path):
    outcome = drive(versions("forgetful"), tmp_path, nvm=Nvm())
    assert outcome.same_as(calm(steps=STEPS)) and "adapted (2 messages differ: NVM, NVM_DONE)" in outcome.said[0]
    figures = outcome.session.storage.figures()
    assert (figures["kept"], figures["reads"], figures["found"]) == (None, 0, [])
    assert "keeps nothing" in outcome.session.storage.sentences()[0]


def test_in_micropython_with_messages_under_other_ids(versions, micropython, tmp_path):
    outcome = drive(versions("moved"), tmp_path, (micropython, "-X", "heapsize=4m"))
    assert outcome.said[0].endswith("(4 messages differ: MEMORY, STEP, STEP_RSP, VECTOR)")
    assert outcome.same_as(calm(steps=STEPS))


def test_what_no_host_has_met_is_on_the_tap_and_in_the_log(versions, tmp_path, capsys):
    outcome = drive(versions("reordered"), tmp_path, tap=str(tmp_path / "tap"))
    assert outcome.same_as(calm(steps=STEPS))
    link, state = outcome.monitor.link, outcome.monitor.state
    tables = dict((title.split("  ")[0], rows) for title, rows in sections(link))
    assert tables["LIDAR"] == [("range_mm", "512 mm", ""), ("x", "-40 x 5 mm", ""), ("state", state.state_name, "")]
    assert tables["POSE"] == [("spare", "-3", "")], "of a known message what is new in it"
    assert any("LIDAR" in line and "512 mm" in line for line in plain_lines(link))
    pose = outcome.session.peer.newest[OURS.by_name["POSE"]]
    assert state.pose == pose and pose.x_um != 0

    mission = read_mission(str(tmp_path / "log"), "")
    assert len(mission.step) == STEPS and mission.pose[-1][1:3] == pytest.approx((pose.x_um / 1e6, pose.y_um / 1e6))
    assert cli.main(["replay", str(tmp_path / "log"), "--target", "cpython"]) == 0
    assert "equal: %d answers" % STEPS in capsys.readouterr().out


def test_a_field_without_which_nobody_drives_is_named(versions, tmp_path):
    with pytest.raises(PeerError) as refused:
        drive(versions("without"), tmp_path)
    sentence = str(refused.value)
    assert "STEP_RSP.left_mm_s (i16, mm/s) is needed by this host, and the core has no such field" in sentence
    assert "%08x" % OURS.hash in sentence and sentence.endswith("update the older of the two")


# Which host, its exit code, and what it says of this core.
@pytest.mark.parametrize(("name", "code", "words"), [
    ("longer", 1, "adapted (1 message differs: POSE)"),
    ("reordered", 3, "POSE.spare (i8) is needed by this host, and the core has no such field"),
])
def test_a_host_of_another_version_with_our_core(name, code, words, versions, tmp_path):
    link, map_path = str(tmp_path / "link"), tmp_path / "map.bin"
    host = [sys.executable, "-m", "sim_device", "studio", "--link", link, "--map", str(map_path), "--max-robot-s",
            str((STEPS + 0.5) * STEP_S), "--json-lines"]
    with core(ROOT, link):
        done = subprocess.run(host, cwd=versions(name), capture_output=True, text=True, timeout=60)
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == code and any(words in event.get("text", event.get("sentence", "")) for event in events)
    assert "Traceback" not in done.stderr
    if code == 1:
        ours, status = calm(steps=STEPS), events[-1]["status"]
        assert map_path.read_bytes() == ours.map_bytes
        assert tuple(status[key] for key in ("steps_lo", "steps_hi", "map_lo", "map_hi")) == ours.hashes
