"""What hil tells and keeps of a mission, whoever listens and whatever was there before."""

import fcntl
import io
import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time

import pytest

from host_tools import cli
from host_tools.mission_run import Outcome
from host_tools.processes import signals_as_interrupt
from host_tools.progress import Progress
from protocol import states
from tests.host_tools.synthetic_mission import SyntheticMission
from tests.host_tools.test_result import room_map

HOME = "studio"
INCOMPLETE = "mission.log is incomplete"


@pytest.fixture
def told(monkeypatch, tmp_path):
    """told(outcome, *argv, state=, writes=) -> (exit code, result): hil's, of a mission that another has driven."""
    def run(outcome, *argv, state=states.DONE, writes=True):
        def mission(args, home_path, folder, log, truth, progress):
            if writes:
                for path, data in zip((log, truth), (story.log, story.truth), strict=True):
                    with open(path, "wb") as file:
                        file.write(data)
            outcome.began = writes
            return outcome

        story = SyntheticMission().finish(room_map(), state=state)
        monkeypatch.setattr("host_tools.hil.run_mission", mission)
        kept = tmp_path / "r.json"
        code = cli.main(["hil", HOME, "--target", "cpython", "--json", str(kept), *argv])
        return code, json.loads(kept.read_text()) if kept.exists() else None
    return run


def test_an_old_log_is_not_scored_for_a_mission_that_never_began(told, tmp_path, capsys):
    log, _ = SyntheticMission().finish(room_map()).save(tmp_path)
    before = log.read_bytes()
    code, result = told(Outcome(3, "the core failed"), "--log", str(log), writes=False)
    assert (code, result["finished"], result["reason"]) == (3, False, "the core failed")
    assert result["time"]["robot_s"] is None and result["map"]["vectors"] is None
    assert log.read_bytes() == before and "ended before its first frame" in capsys.readouterr().err


def test_an_incomplete_log_is_told_of_beside_a_result_that_could_not_be_kept(told, tmp_path, monkeypatch, capsys):
    gone = tmp_path / "gone" / "r.json"
    monkeypatch.setattr("host_tools.export.write_result", lambda path, result: open(gone, "w"))
    code, _ = told(Outcome(0, end={"incomplete": INCOMPLETE, "finished": True, "reason": "outline closed"}))
    said = capsys.readouterr().err
    assert code == 2 and str(gone) + " could not be written" in said and INCOMPLETE in said


def test_a_terminal_without_such_letters_gets_the_table(told, monkeypatch):
    paper = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(paper, encoding="ascii"))
    code, _ = told(Outcome(0))
    sys.stdout.flush()
    assert code == 0 and b"????" in paper.getvalue() and b"outline closed" in paper.getvalue()


@pytest.mark.parametrize("state, expected", [(states.DONE, 0), (states.BUILD, 1)])
def test_a_reader_that_goes_away_changes_neither_exit_code_nor_result(told, monkeypatch, state, expected):
    end, pipe = os.pipe()
    os.close(end)
    with open(pipe, "w") as nobody:
        monkeypatch.setattr("sys.stdout", nobody)
        code, result = told(Outcome(0, end={"reason": "robot time limit"}), state=state)
    assert code == expected and result["finished"] is (expected == 0)
    assert result["reason"] == ("robot time limit" if expected else "outline closed")


def test_progress_on_a_terminal_that_is_closed_goes_nowhere():
    near, far = pty.openpty()
    with open(far, "w") as terminal:
        progress = Progress(terminal)
        progress.text("robot 1.0 s")
        os.close(near)
        progress.text("robot 2.0 s")
        progress.note("It goes on.")
        progress.text("robot 3.0 s")
        progress.clear()


def test_a_terminal_says_only_once_that_it_was_closed():
    with signals_as_interrupt():
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGHUP)
            time.sleep(5)
        os.kill(os.getpid(), signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) == signal.SIG_DFL


def test_an_interrupt_while_a_command_is_loaded_is_no_traceback(monkeypatch, capsys):
    def interrupted(name):
        raise KeyboardInterrupt
    monkeypatch.setattr("importlib.import_module", interrupted)
    assert cli.main(["homes"]) == 130 and capsys.readouterr().err == "host_tools: interrupted\n"


def test_a_closed_terminal_ends_a_mission_that_is_kept(project, tmp_path):
    near, far = pty.openpty()
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-m", "host_tools", "hil", HOME, "--target", "cpython", "--link", "memory", "--json", str(tmp_path / "r.json")],
        cwd=project, stdin=far, stdout=far, stderr=far, start_new_session=True, env={**os.environ, "TMPDIR": str(scratch)},
        preexec_fn=lambda: fcntl.ioctl(far, termios.TIOCSCTTY, 0))
    os.close(far)
    try:
        assert select.select([near], [], [], 60)[0], "the first progress"
        os.close(near)
        assert process.wait(60) == 1
    finally:
        process.kill()
        process.wait()
    assert json.loads((tmp_path / "r.json").read_text())["reason"] == "interrupted"
    assert not any(scratch.iterdir())
