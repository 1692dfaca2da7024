# The core in the robot's own process, at the far end of a link in memory: every frame
# passes as on a line, and no time is lost on the way. The core is named, not imported:
# `module:class` of something made from a port and a boot number that has receive(buf, size)
# and hello(), and answers by port.write(buf, size), as firmware_py.device:Device.

import importlib
import sys
import time

from sim_device.links.peer import PeerError
from sim_device.links.pty import LinkError

BOOT_ID = 1


# Stands in for a Pty towards Peer. Whatever the core raises
# is a PeerError of one sentence.
class MemoryLink:
    path = name = "the link in memory"
    dropped = 0

    def __init__(self, core, folder=None):
        self._out = bytearray()
        self._core = _named(core, folder)(_Port(self._out), BOOT_ID)
        self._core.hello()

    def read(self, timeout_ms=0):
        if not self._out:
            time.sleep(timeout_ms / 1000)
        data = bytes(self._out)
        self._out.clear()
        return data

    def write(self, data):
        held = bytearray(data)
        try:
            self._core.receive(held, len(held))
        except Exception as error:
            raise PeerError("the core failed: %s: %s" % (type(error).__name__, error)) from error
        return True

    def flush(self):
        return True

    def close(self):
        pass


# What the core sees of it. No clock: there is no free run over this link.
class _Port:
    heap_bytes = heap_boot_bytes = heap_code_bytes = locked = 0  # CPython has no heap of its own to measure

    def __init__(self, out):
        self._out = out

    def write(self, buf, size):
        self._out += memoryview(buf)[:size]

    def heap_used(self):
        return 0

    def ticks_ms(self):
        return 0


def _named(core, folder):
    module, _, name = core.partition(":")
    if folder:
        sys.path.insert(0, folder)
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise LinkError("--core %s cannot be had (%s): give module:class, like firmware_py.device:Device" % (core, error)) from None
