# python-can's buses: an SLCAN adapter on a serial port or a pty, the kernel's CAN, CAN over UDP multicast.

import contextlib
import importlib.util
import os
import re
import select
import time
from collections import deque

import can
import serial
from can.interfaces.slcan import slcanBus

from sim_device.links.pty import LinkError

BITRATE, DATA_BITRATE = 500_000, 2_000_000
UDP_GROUP = "239.74.163.2"
WAIT_S = 10.0   # for an adapter's name to appear
SPIN_S = 0.0004
SLEEPS = 50
KINDS = ("slcan-fd", "slcan", "socketcan", "udp")


# python-can's SLCAN bus. It reads byte by byte and writes a frame at a time, each a system call, which in lockstep costs
# more than the step: here whatever has come is taken at once, and the frames within `with together()` leave at once.
class Adapter(slcanBus):
    def __init__(self, *args, **options):
        self._came = deque()
        self._held = None
        self._patience = 0
        super().__init__(*args, sleep_after_open=0, **options)

    @contextlib.contextmanager
    def together(self):
        self._held = []
        try:
            yield
            self.serialPortOrig.write("".join(self._held).encode())
        finally:
            self._held = None

    def tell(self, line):
        self._write(line)

    def told(self, line, wait_s):
        """Whether the adapter answers to this line with `!`. What it says before is lost."""
        self._write(line)
        end_s = time.monotonic() + wait_s
        while time.monotonic() < end_s:
            if self._read(0.05) == "!":
                return True
        return False

    def _write(self, string):
        if self._held is None:
            super()._write(string)
        else:
            self._held.append(string + "\r")

    def _read(self, timeout):
        if not self._came:
            self._fill(timeout)
        return self._came.popleft() if self._came else None

    def _fill(self, timeout):
        if not self._ready(timeout):
            return
        data = os.read(self.fileno(), 4096)
        if not data:
            raise can.CanOperationError("the adapter has gone")
        *lines, self._buffer = re.split(rb"[\r\a]", self._buffer + data)
        if len(self._buffer) > 4096:
            self._buffer = bytearray()  # no adapter has lines like that
        self._came.extend([line.decode("ascii", "replace") for line in lines if line])

    def _ready(self, timeout):
        fds = [self.fileno()]
        if self._patience < 0 or not timeout:
            self._patience += self._patience < 0
            return select.select(fds, [], [], timeout)[0]
        end_s = time.perf_counter() + SPIN_S  # as links/pty.py: looks a while before it sleeps
        while not select.select(fds, [], [], 0)[0]:
            if time.perf_counter() > end_s:
                self._patience = -SLEEPS
                return select.select(fds, [], [], timeout)[0]
            os.sched_yield()
        return True


def open_bus(kind, channel, wait_s=WAIT_S):
    """python-can's bus of that kind. LinkError, one sentence, where it cannot be had."""
    if kind not in KINDS or not channel and kind != "udp":
        raise LinkError("%s is no CAN bus: give slcan:PORT, slcan-fd:PORT, socketcan:NAME or udp" % (kind + (":" if kind in KINDS else "")))
    if kind in ("slcan", "slcan-fd"):
        return _open_adapter(channel, kind == "slcan-fd", wait_s)
    try:
        if kind == "udp":
            if importlib.util.find_spec("msgpack") is None:
                raise LinkError("udp needs the package msgpack, which is not here: pip install 'tvslam[udp]', or use slcan")
            return can.Bus(interface="udp_multicast", channel=channel or UDP_GROUP, hop_limit=0)  # 0: it stays on this machine
        return can.Bus(interface="socketcan", channel=channel)
    except (can.CanError, OSError, ImportError, ValueError) as error:
        raise LinkError("%s: this machine has no such CAN bus (%s); slcan needs none of it" % (
            kind + (":" + channel if channel else ""), str(error).rstrip("."))) from None


def _open_adapter(path, fd, wait_s):
    end_s = time.monotonic() + wait_s
    while not os.path.exists(path) and time.monotonic() < end_s:
        time.sleep(0.01)
    rate = {"timing": can.BitTimingFd.from_sample_point(80_000_000, BITRATE, 80.0, DATA_BITRATE, 80.0)} if fd else {"bitrate": BITRATE}
    try:
        return Adapter(path, **rate)
    except (can.CanError, serial.SerialException, OSError, ValueError) as error:
        number = getattr(error.__cause__ or error, "errno", None)
        raise LinkError("%s is no CAN adapter that can be opened (%s): give the serial port of one that speaks SLCAN" % (
            path, os.strerror(number).lower() if number else error)) from None
