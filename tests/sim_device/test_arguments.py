# What the command line of sim_device cannot serve: one sentence, and no file of an earlier mission is touched.

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sim_device.home import load_home
from tests.sim_device.lockstep import PROJECT


@pytest.mark.parametrize("arguments, sentence", [
    (("nowhere", "--link", "{d}/r"), "nowhere: neither a file nor a home"),
    (("studio", "--link", "{d}/file"), "exists and is not a symbolic link"),
    (("studio", "--link", "{d}/file/r"), "cannot be made: "),
    (("studio", "--link", "{d}/r", "--tap", "{d}/r"), "--link has that name already"),
    (("studio", "--link", "{d}/r", "--tap", "{d}/t", "--tap", "{d}/t"), "two taps have one name"),
    (("studio", "--link", "{d}/r", "--log", "{d}/none/log"), "cannot be written: No such file"),
    (("studio", "--link", "{d}/r", "--log", "/dev/full"), "No space left"),
    (("studio", "--link", "{d}/r", "--log", "{d}/file", "--truth", "{d}/none/truth"), "cannot be written: No such file"),
    (("studio", "--link", "{d}/r", "--log", "{d}/file", "--nvm", "{d}/home.json"), "home.json"),
    (("studio", "--link", "{d}/r", "--log", "{d}/file", "--faults", "loss=0.1"), "faults of a CAN bus"),
    (("studio", "--link", "{d}/r", "--log", "{d}/file", "--faults", "@{d}/file"), "--faults has that name already"),
    (("studio", "--link", "{d}/r", "--set", "nonsense=on"), "there is no flag nonsense"),
    (("studio", "--link", "{d}/r", "--robot", "{d}/none.toml"), "none.toml"),
    (("studio", "--link", "{d}/r", "--max-robot-s", "-1"), "--max-robot-s"),
    (("studio",), "--link"),
    (("studio", "--link", ""), "--link is empty"),
    (("studio", "--link", "{d}/r", "--seed", "-1"), "--seed: -1 is not a whole number from 0 to 4294967295"),
    (("studio", "--link", "{d}/r", "--uwb", "gps"), "--uwb"),
    (("studio", "--link", "{d}/r", "--wait", "long"), "long is not a positive number of seconds"),
    (("{d}/home.json", "--link", "{d}/r", "--log", "{d}/home.json"), "the home has that name already"),
    (("studio", "--link", "{d}/r", "--robot", "{d}/file", "--map", "{d}/file"), "--robot has that name already"),
])
def test_bad_input_is_one_sentence(tmp_path, arguments, sentence):
    (tmp_path / "file").write_text("precious")
    home = load_home("studio").path
    (tmp_path / "home.json").write_bytes(Path(home).read_bytes())
    command = [sys.executable, "-m", "sim_device", *(part.format(d=tmp_path) for part in arguments)]
    done = subprocess.run(command, cwd=PROJECT, capture_output=True, text=True, timeout=30, env={**os.environ, "COLUMNS": "200"})
    assert done.returncode == 2
    said = done.stderr.splitlines()
    assert len(said) == 1 and sentence in said[0] and said[0].startswith("sim_device: "), done.stderr
    assert (tmp_path / "home.json").read_bytes() == Path(home).read_bytes()
    assert (tmp_path / "file").read_text() == "precious"
    assert not os.path.lexists(tmp_path / "r")


def test_version():
    done = subprocess.run([sys.executable, "-m", "sim_device", "--version"], cwd=PROJECT, capture_output=True, text=True, timeout=30)
    assert done.returncode == 0 and done.stdout.startswith("sim_device ")
