# The image by hand: the line that `flash` ends with starts it, and mpremote finds its REPL while the core waits on USART2.

import re
import shlex
import subprocess
import sys
import time

import pytest

from host_tools.cli import main
from host_tools.terminal_port import TerminalPort
from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from tests.stm32.conftest import without
from tests.stm32.test_mission import HEAP

SERVE = "import tvslam; tvslam.main('usart2')"


@pytest.fixture
def ports(stm32_tools_here, capsys):
    """REPL and link of an emulator that was started by the words of `flash`."""
    try:
        import mpremote  # noqa: F401
    except ImportError:
        without("no mpremote: pip install 'tvslam[board]'")
    assert main(["flash", "--target", "stm32", "--heap", HEAP]) == 0
    line = re.search(r"^run +(qemu-system-arm .*)$", capsys.readouterr().out, re.M)[1]
    qemu = subprocess.Popen(shlex.split(line), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield [re.search(r"redirected to (\S+) ", qemu.stdout.readline())[1] for _ in range(2)]
    finally:
        qemu.kill()
        qemu.wait()
        qemu.stdout.close()


def mpremote(port, *words):
    done = subprocess.run([sys.executable, "-m", "mpremote", "connect", port, "exec", *words], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.strip()


def says_hello(link_port):
    with TerminalPort(link_port) as port:
        link, limit = HostLink(), time.monotonic() + 3
        while time.monotonic() < limit:
            if any(isinstance(message, BY_NAME["HELLO"]) for message in link.feed(port.read(0.1))):
                return True
    return False


def test_the_repl_answers_while_the_core_waits_and_starts_it_again(ports):
    repl, link = ports
    assert mpremote(repl, "print(6 * 7)") == "42"
    for _ in range(2):
        mpremote(repl, "--no-follow", SERVE)
        assert says_hello(link)
        assert main(["budget", "--target", "port:" + link]) == 0
        assert mpremote(repl, "import gc; gc.collect(); print(gc.mem_alloc() > 0)") == "True"  # it has ended the core
        assert not says_hello(link)
