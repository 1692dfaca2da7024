"""Whole missions through the command line: the virtual robot and the core as processes of their own."""

import contextlib
import json
from collections import Counter
import os
import pty
import random
import resource
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty

import numpy as np
import pytest

from host_tools.export import FILES
from tests.host_tools.test_hil_processes import alive, wait_until
from tests.host_tools.test_result import expect_all_keys

SHIPPED = "studio"
# An L-shaped room with a column near the way, small enough for a mission of a minute of robot time.
SMALL = {"name": "small", "units": "m", "outline": [[0, 0], [3.2, 0], [3.2, 1.6], [1.8, 1.6], [1.8, 2.6], [0, 2.6]],
         "obstacles": [[[1.1, 0.9], [1.3, 0.9], [1.3, 1.1], [1.1, 1.1]]], "rooms": [], "start": [0.5, 1.5]}


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    return str(path)


def hil(project, *argv, **options):
    """The command as a process; what it says goes to files, so that a test can look while it runs."""
    out, err = tempfile.TemporaryFile(), tempfile.TemporaryFile()
    process = subprocess.Popen([sys.executable, "-m", "host_tools", "hil", *argv], cwd=project, stdout=out, stderr=err,
                               start_new_session=True, **options)
    process.said = lambda: tuple(os.pread(file.fileno(), 1 << 20, 0).decode() for file in (out, err))
    return process


def finish(process, seconds=100):
    process.wait(seconds)
    out, err = process.said()
    assert "Traceback" not in out + err, out + err
    return process.returncode, out, err


def wait_until_driving(process):
    """The first line of progress has been shown, and a second of the mission has passed."""
    wait_until(lambda: "robot " in process.said()[1], 60)
    time.sleep(1.2)


def children_of(pid):
    with open("/proc/%d/task/%d/children" % (pid, pid)) as file:
        return [int(word) for word in file.read().split()]


@pytest.fixture
def underway(project, tmp_path, small):
    """A mission in real time that has begun, its result file and the processes it started."""
    result = tmp_path / "r.json"
    process = hil(project, small, "--target", "cpython", "--realtime", "--json", str(result))
    wait_until_driving(process)
    children = children_of(process.pid)
    assert len(children) == 2
    yield process, result, children
    process.kill()
    process.wait()
    wait_until(lambda: not any(map(alive, children)))


def by_command(children, word):
    for pid in children:
        with open("/proc/%d/cmdline" % pid) as file:
            if word in file.read():
                return pid
    raise AssertionError("no child runs %s" % word)


def test_a_mission_is_run_scored_and_kept(project, tmp_path):
    out, kept = tmp_path / "out", tmp_path / "deep" / "r.json"
    code, said, _ = finish(hil(project, SHIPPED, "--target", "cpython", "--out", str(out), "--json", str(kept)))
    result = json.loads(kept.read_text())
    expect_all_keys(result)
    assert code == 0 and result["finished"] is True, result["reason"]
    assert json.loads((out / "result.json").read_text()) == result
    assert {path.name for path in out.iterdir()} == set(FILES)
    assert (result["home"], result["target"], result["seed"]) == (SHIPPED, "cpython", 1)
    assert result["map"]["stored_bytes"] == (out / "map.bin").stat().st_size
    assert result["map"]["outline_precision_5cm"] > 0.9 and result["map"]["outline_recall_5cm"] > 0.9
    collection = json.loads((out / "map.geojson").read_text())
    kinds = Counter(feature["properties"]["kind"] for feature in collection["features"])
    assert kinds["outline"] + kinds["barrier"] == result["map"]["vectors"] > 4
    assert (kinds["region"], kinds["node"], kinds["edge"]) == tuple(result["map"][key] for key in ("regions", "turning_nodes", "edges"))
    estimate, truth = (np.loadtxt(out / name) for name in ("estimate.tum", "truth.tum"))
    assert estimate.shape == truth.shape and np.diff(estimate[:, 0]) == pytest.approx(0.1)
    rmse = 100 * np.sqrt(np.mean(np.sum((estimate[:, 1:3] - truth[:, 1:3]) ** 2, axis=1)))
    assert rmse == pytest.approx(result["localisation"]["trajectory_rmse_cm"], rel=1e-3)
    path = np.sum(np.hypot(*np.diff(truth[:, 1:3], axis=0).T))
    assert path == pytest.approx(result["time"]["path_m"], rel=0.03)
    assert "finished" in said and result["hash"]["steps"] in said


def test_the_same_seed_gives_the_same_mission_and_another_another(project, small, tmp_path):
    results = []
    for number, seed in enumerate((3, 3, 4)):
        path = tmp_path / ("%d.json" % number)
        finish(hil(project, small, "--target", "cpython", "--seed", str(seed), "--json", str(path)))
        results.append(json.loads(path.read_text()))
    first, again, other = results
    assert first["hash"] == again["hash"] and first["localisation"] == again["localisation"] and first["map"] == again["map"]
    assert first["hash"]["steps"] != other["hash"]["steps"]


def test_in_micropython_with_its_heap_locked_the_mission_is_the_same(project, small, tmp_path, micropython):
    results = []
    for target in ("unix", "cpython"):
        path = tmp_path / (target + ".json")
        code, _, err = finish(hil(project, small, "--target", target, "--json", str(path)))
        assert code == 0, err
        results.append(json.loads(path.read_text()))
    unix, cpython = results
    assert unix["hash"] == cpython["hash"] and unix["localisation"] == cpython["localisation"]
    memory = unix["memory"]
    assert memory["heap_locked"] is True and memory["allocated_after_boot_bytes"] == 0
    assert 0 < memory["heap_peak_bytes"] < memory["heap_bytes"] <= 192 * 1024
    assert cpython["memory"]["heap_bytes"] is None


@pytest.mark.parametrize("heap", ["12k", "40k"])
def test_a_heap_too_small_is_said_in_one_sentence(project, small, tmp_path, micropython, heap):
    kept = tmp_path / "r.json"
    code, _, err = finish(hil(project, small, "--target", "unix", "--heap", heap, "--json", str(kept)))
    assert code == 3
    sentence = [line for line in err.splitlines() if line.startswith("host_tools hil:")]
    assert len(sentence) == 1 and "heap" in sentence[0]
    result = json.loads(kept.read_text())
    expect_all_keys(result)
    assert result["finished"] is False and result["reason"] in sentence[0]


def test_ctrl_c_ends_it_cleanly_with_what_there_is(underway):
    process, kept, children = underway
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to us, not to the children in their own sessions
    code, said, err = finish(process, 30)
    assert code == 1 and "nterrupted" in err
    assert not any(map(alive, children))
    result = json.loads(kept.read_text())
    expect_all_keys(result)
    assert result["finished"] is False and result["reason"] == "interrupted"
    assert result["time"]["robot_s"] > 1 and result["localisation"]["estimate"]["mean_cm"] is not None
    assert "NOT finished" in said


def test_a_core_that_dies_is_named(underway):
    process, kept, children = underway
    os.kill(by_command(children, "firmware_py"), signal.SIGKILL)
    code, _, err = finish(process, 30)
    assert code == 3 and "core" in err.splitlines()[-1]
    assert not any(map(alive, children))
    assert json.loads(kept.read_text())["finished"] is False


def test_a_full_disk_under_the_log_is_named_and_what_there_is_is_kept(project, small, tmp_path):
    log, kept = tmp_path / "mission.log", tmp_path / "r.json"
    limit = (100_000, 100_000)  # bytes that a file of ours may have: as a disk that fills up
    process = hil(project, small, "--target", "cpython", "--log", str(log), "--json", str(kept),
                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
    code, _, err = finish(process)
    assert code == 3 and str(log) + " is incomplete: it could not be written any further after 100000 bytes" in err.splitlines()[-1]
    result = json.loads(kept.read_text())
    expect_all_keys(result)
    assert result["reason"] == "outline closed" and result["time"]["wall_s"] > 0 and result["time"]["path_m"] > 0


@pytest.mark.parametrize("words, seeds", [
    (("--target", "cpython", "--link", "memory"), (1,)), (("--target", "unix"), (2,)),
    pytest.param(("--target", "unix", "--link", "slcan"), range(3, 23), marks=pytest.mark.soak)])
def test_a_killed_mission_leaves_a_log_that_replays_to_its_end(project, small, tmp_path, words, seeds, record_count):
    kills = lost = 0
    for seed in seeds:
        log, kept = tmp_path / ("%d.tvlog" % seed), tmp_path / "r.json"
        enough = random.Random(seed).randrange(20_000, 120_000)   # bytes: a moment that does not depend on the machine's load
        process = hil(project, small, *words, "--seed", str(seed), "--log", str(log))
        wait_until(lambda log=log, enough=enough: log.exists() and log.stat().st_size > enough, 60)
        size = log.stat().st_size
        process.kill()
        process.wait()
        done = subprocess.run([sys.executable, "-m", "host_tools", "replay", str(log), "--target", "unix", "--json", str(kept)],
                              cwd=project, capture_output=True, text=True, timeout=100)
        result = json.loads(kept.read_text())
        assert done.returncode == 0 and result["equal"], done.stdout + done.stderr
        assert result["damage"] is None or "breaks off" in result["damage"]
        assert result["steps"] > (size - 20_000) / 300, "most of the file are steps"
        kills += 1
        lost += not result["equal"]
    record_count("missions killed, their logs replayed", kills, lost)


def test_a_robot_that_dies_is_named(underway):
    process, kept, children = underway
    os.kill(by_command(children, "sim_device"), signal.SIGKILL)
    code, _, err = finish(process, 30)
    assert code == 3 and "virtual robot" in err.splitlines()[-1]
    assert not any(map(alive, children))
    assert json.loads(kept.read_text())["reason"] in err


def test_no_process_is_left_when_hil_itself_is_killed(underway):
    process, _, children = underway
    process.kill()
    wait_until(lambda: not any(map(alive, children)))


# A board on a serial port: the core in a process of its own behind a second pty, bytes carried between the two.
@contextlib.contextmanager
def board(project):
    (ours, port), (far, core_end) = pty.openpty(), pty.openpty()
    for end in (port, core_end):
        tty.setraw(end)
    core = subprocess.Popen([sys.executable, "-m", "firmware_py", os.ttyname(core_end)], cwd=project, stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)
    stop = threading.Event()

    def carry():
        while not stop.is_set():
            for fd in select.select([ours, far], [], [], 0.05)[0]:
                os.write(far if fd == ours else ours, os.read(fd, 4096))

    wire = threading.Thread(target=carry, daemon=True)
    wire.start()

    def unplug():
        stop.set()
        wire.join()
        for fd in (ours, port):
            with contextlib.suppress(OSError):
                os.close(fd)

    try:
        yield os.ttyname(port), unplug
    finally:
        unplug()
        core.kill()
        core.wait()
        os.close(far)
        os.close(core_end)


def test_a_core_on_a_serial_port_gives_the_same_hashes(project, small, tmp_path):
    path = tmp_path / "board.json"
    with board(project) as (port, _):
        code, _, err = finish(hil(project, small, "--target", "port:" + port, "--json", str(path)))
    assert code == 0, err
    over_port = json.loads(path.read_text())
    finish(hil(project, small, "--target", "cpython", "--json", str(path)))
    assert over_port["hash"] == json.loads(path.read_text())["hash"]
    assert over_port["target"] == "port:" + port


def test_a_board_that_is_unplugged_in_use_is_named(project, small):
    with board(project) as (port, unplug):
        process = hil(project, small, "--target", "port:" + port, "--realtime")
        wait_until_driving(process)
        begin = time.monotonic()
        unplug()
        code, _, err = finish(process, 30)
    assert code == 3 and port in err.splitlines()[-1]
    assert time.monotonic() - begin < 15


def test_a_board_that_speaks_something_else_is_named_by_its_port(project, small):
    far, near = pty.openpty()
    tty.setraw(near)
    os.set_blocking(far, False)
    port = os.ttyname(near)
    process = hil(project, small, "--target", "port:" + port)
    while process.poll() is None:
        with contextlib.suppress(BlockingIOError):
            os.write(far, b">>> some other program\r\n")
        time.sleep(0.005)
    code, _, err = finish(process)
    os.close(far)
    os.close(near)
    assert code == 3 and port in err.splitlines()[-1] and "no frame" in err.splitlines()[-1]
    assert "/link" not in err
