# The core in the robot's own process, at the far end of a link in memory: every frame
# passes as on a line, and no time is lost on the way. The core is named, not imported:
# `module:class` of something made from a port and a boot number that has receive(buf, size) and
# greet(), which says HELLO twice a second until it is answered, and answers by port.write(buf, size), as firmware_py.device:Device.

import contextlib
import importlib
import sys

from sim_device.links.peer_errors import PeerError
from sim_device.links.pty import LinkError

BOOT_ID = 1
NO_CORE = "--core %s cannot be had (%s): give module:class, like firmware_py.device:Device"


# Stands in for a Pty towards Peer. Its time is its own: it passes where somebody waits for what does not come,
# and at once. Whatever the core raises is a PeerError of one sentence.
class MemoryLink:
    path = name = "the link in memory"
    dropped = 0
    resetting = False

    def __init__(self, core, folder=None):
        self._out = bytearray()
        self._make = _named(core, folder)
        self._now_s = 0.0
        self._boots = BOOT_ID - 1
        try:
            self.restart()
        except PeerError as error:
            raise LinkError(NO_CORE % (core, error)) from None

    def restart(self):
        """Another core in place of this one, as after a reset."""
        self._boots += 1
        self._out.clear()
        with _in_one_sentence():
            self._core = self._make(_Port(self._out, self.clock), self._boots)
            self._core.greet()

    def speaks(self, dialect):
        """As a Pty's."""

    def clock(self):
        return self._now_s

    def read(self, timeout_ms=0):
        if not self._out:
            self._now_s += timeout_ms / 1000
            with _in_one_sentence():
                self._core.greet()
        data = bytes(self._out)
        self._out.clear()
        return data

    def write(self, data):
        held = bytearray(data)
        with _in_one_sentence():
            self._core.receive(held, len(held))
        return True

    def flush(self):
        return True

    def close(self):
        pass


# What the core sees of it. There is no free run over this link: its clock does not pace anything.
class _Port:
    heap_bytes = heap_boot_bytes = heap_code_bytes = locked = 0  # CPython has no heap of its own to measure

    def __init__(self, out, clock):
        self._out = out
        self._clock = clock

    def write(self, buf, size):
        self._out += memoryview(buf)[:size]

    def heap_used(self):
        return 0

    def ticks_ms(self):
        return int(self._clock() * 1000) & 0x3FFFFFF


@contextlib.contextmanager
def _in_one_sentence():
    """Whatever the core's code raises."""
    try:
        yield
    except Exception as error:
        raise PeerError("the core failed: %s: %s" % (type(error).__name__, error)) from error


def _named(core, folder):
    module, _, name = core.partition(":")
    if folder:
        sys.path.insert(0, folder)
    try:
        return getattr(importlib.import_module(module), name)
    except Exception as error:  # the module's own, too
        raise LinkError(NO_CORE % (core, error)) from None
