# The core in the robot's process: named, not imported; what it says and how it fails comes through as on a line.

import sys

import pytest

from protocol.host_link import HostLink
from sim_device import cli
from sim_device.links.memory import MemoryLink
from sim_device.links.peer_errors import PeerError
from sim_device.links.pty import LinkError

CORE = "firmware_py.device:Device"


def test_the_core_says_hello_and_is_answered():
    link, host = MemoryLink(CORE), HostLink()
    (hello,) = host.feed(link.read(10))
    assert type(hello).__name__ == "HELLO" and link.read(0) == b""
    link.write(host.welcome(hello))
    assert link.flush() and not link.dropped


def test_a_core_that_is_none_is_named():
    for core in ("firmware_py.device", "no_such_package:Core", "firmware_py.device:Devise", ":Device", ""):
        with pytest.raises(LinkError, match="--core.*give module:class"):
            MemoryLink(core)


@pytest.mark.parametrize("core", ["os:getcwd", "array:array", "math:pi", "types:SimpleNamespace"])
def test_what_is_no_core_is_refused_in_one_sentence(core, capsys):
    assert cli.main(["studio", "--core", core]) == cli.EXIT_BAD_INPUT
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and "--core %s cannot be had" % core in said[0] and "give module:class" in said[0]


@pytest.fixture
def broken(tmp_path):
    (tmp_path / "broken_core.py").write_text(
        "class Core:\n    def __init__(self, port, boot_id):\n        self.greeted = 3 // (3 - boot_id)\n"
        "    def greet(self):\n        self.greeted = 3 // self.greeted\n"
        "    def receive(self, buf, size):\n        raise ZeroDivisionError('by nothing')\n")
    yield str(tmp_path)
    sys.path.remove(str(tmp_path))
    del sys.modules["broken_core"]


def test_what_the_core_raises_is_one_sentence(broken):
    link = MemoryLink("broken_core:Core", broken)
    with pytest.raises(PeerError, match="the core failed: ZeroDivisionError: by nothing"):
        link.write(b"\0")
    link._core.greeted = 0
    with pytest.raises(PeerError, match="the core failed: ZeroDivisionError"):
        link.read(0)
    link.restart()
    with pytest.raises(PeerError, match="the core failed: ZeroDivisionError"):
        link.restart()


def test_the_command_drives_a_mission_without_a_pty(capsys):
    assert cli.main(["studio", "--core", CORE, "--max-robot-s", "2"]) == cli.EXIT_NOT_FINISHED
    assert "2.0 s of robot time" in capsys.readouterr().err


@pytest.mark.parametrize("argv, words", [
    (["studio", "--core", CORE, "--realtime"], "--realtime does not go with --core"),
    (["studio", "--core", "firmware_py.device:None_"], "cannot be had"),
])
def test_what_cannot_be_served_is_refused(argv, words, capsys):
    assert cli.main(argv) == cli.EXIT_BAD_INPUT
    assert words in capsys.readouterr().err


def test_link_or_core_but_not_both(capsys):
    for argv in (["studio"], ["studio", "--core", CORE, "--link", "x"]):
        with pytest.raises(SystemExit) as ended:
            cli.main(argv)
        assert ended.value.code == cli.EXIT_BAD_INPUT
