# USART2 of the emulated part: no byte is lost, none waited for longer than it takes to come, and the core is up in no time.

import os
import statistics
import time

import pytest

from host_tools.core_process import private_pty
from host_tools.emulated_core import EmulatedPort
from host_tools.processes import Children
from host_tools.qemu import Emulator
from protocol.host_link import HostLink
from protocol.messages import BY_NAME
from tests.stm32.test_mission import elf  # noqa: F401  (a fixture)

PING, PONG, HELLO = (BY_NAME[name] for name in ("PING", "PONG", "HELLO"))
WRAP_S = 0.1    # of the part's clock, at which a read that waits returns


# One core on the emulator, greeted. `until(fits)` reads until a message fits; it fails after 10 s.
class Core:
    def __init__(self, image, over_usart):
        self.children = Children()
        master, slave = private_pty()
        self.port = EmulatedPort(master, slave)
        self.link = HostLink()
        self.emulator = Emulator(self.children, image, usart=os.ttyname(slave) if over_usart else None)
        self.emulator.boot()
        self.port.start_core(self.emulator)
        hello = self.until(lambda message: isinstance(message, HELLO))
        self.hello_s = time.monotonic() - self.emulator.power_on_s
        self.port.write(self.link.welcome(hello))

    def until(self, fits, seen=None):
        limit = time.monotonic() + 10
        while time.monotonic() < limit:
            for message in self.link.feed(self.port.read(0.1)):
                if seen is not None:
                    seen.append(message)
                if fits(message):
                    return message
        raise AssertionError("the core has not answered")

    def end(self):
        self.emulator.stop()
        self.port.close()
        with self.children:
            pass


@pytest.fixture
def core(elf):  # noqa: F811
    one = Core(elf, over_usart=True)
    yield one
    one.end()


@pytest.mark.parametrize("over_usart", [True, False])
def test_the_core_says_hello_within_three_seconds_of_power_on(elf, over_usart):  # noqa: F811
    hellos_s = []
    for _ in range(3):  # a computer that does other things is slower: the fastest counts
        one = Core(elf, over_usart)
        one.end()
        assert one.emulator.boot_s < one.hello_s
        hellos_s.append(one.hello_s)
        if one.hello_s < 3:
            return
    raise AssertionError(hellos_s)


def test_a_frame_that_the_clock_cuts_in_two_is_answered_when_its_end_comes(core):
    took_s = []
    for number in range(15):
        frame = core.link.encode(PING(number))
        core.port.write(frame[:-1])
        time.sleep(1.3 * WRAP_S)
        begun = time.monotonic()
        core.port.write(frame[-1:])
        core.until(lambda message, number=number: isinstance(message, PONG) and message[0] == number)
        took_s.append(time.monotonic() - begun)
    assert statistics.median(took_s) < 0.2 * WRAP_S, took_s  # and not at the next wrap


def test_no_byte_is_lost_while_the_core_answers(core):
    numbers = list(range(100))
    core.port.write(b"".join(core.link.encode(PING(number)) for number in numbers))  # all at once: it receives while it sends
    seen = []
    core.until(lambda message: isinstance(message, PONG) and message[0] == numbers[-1], seen)
    assert [message[0] for message in seen if isinstance(message, PONG)] == numbers
