# One SLCAN adapter: its pty, and the text on it (LAWICEL's; for CAN FD the letters of the CANable 2.0).

import re

from sim_device.links.can_frame import KINDS, parse
from sim_device.links.pty import Pty

BACKLOG_BYTES = 1 << 16
LINE_MAX = 141      # B, id of 8, length, 64 bytes; with CR. What is longer is noise
VERSION, SERIAL = b"V1013", b"NTVSL"
_FAULT = re.compile(rb"!([a-z]{1,8})=([0-9]{1,10}(?:\.[0-9]{1,6})?)")


# A controller of the bus behind a pty. Commands are answered with CR or BEL as real adapters do it; a frame that the
# controller took is not answered, one that it did not take gets BEL. Whatever the text, it never raises.
# `dropped`: frames whose reader did not keep up, as an adapter's buffer overflows. Beyond LAWICEL's: `!NAME=VALUE` brings a
# fault about (can_bus.py), and is answered with `!`.
class SlcanAdapter:
    def __init__(self, path, bus):
        self.path = path
        self.pty = Pty(path, BACKLOG_BYTES)
        self.controller = bus.attach(path)
        self.dropped = 0
        self._bus = bus
        self._text = b""    # the line that is coming
        self._lines = []
        self._out = []

    @property
    def waiting(self):
        """Whether there are lines that have not been looked at."""
        return bool(self._lines)

    @property
    def present(self):
        return self.pty.present

    def fileno(self):
        return self.pty.fileno()

    def receive(self):
        """What has come on the pty; False when nobody has it open any more."""
        data = self.pty.read()
        if data is None:
            self._gone()
            return False
        *lines, self._text = (self._text + data).split(b"\r")
        self._lines += lines
        if len(self._text) > LINE_MAX:
            self._text = b"?"   # no line of ours, whatever follows
        return True

    def act(self, now_s, patient):
        """Takes lines up to the first frame that would find the queue full; `patient`: it may be tried again."""
        taken = 0
        controller = self.controller
        for line in self._lines:
            if line[:1] in KINDS:
                if patient and controller.open and not controller.full_for and len(controller.queue) >= controller.queue_max:
                    break
                frame = parse(line)
                if frame is None or not self._bus.offer(controller, frame, now_s):
                    self._out.append(b"\a")
            elif line:
                self._out.append(self._fault(line, now_s) if line[:1] == b"!" else self._command(line))
            taken += 1
        del self._lines[:taken]
        return taken

    def _command(self, line):
        letter, controller = line[:1], self.controller
        if letter in (b"O", b"L") and len(line) == 1 and not controller.open:
            controller.open = True
            controller.listens_only = letter == b"L"
        elif line == b"C":
            self._bus.close(controller)
        elif line == b"V":
            return VERSION + b"\r"
        elif line == b"N":
            return SERIAL + b"\r"
        elif line == b"F":
            return b"F%02X\r" % (len(controller.queue) >= controller.queue_max)
        elif controller.open or line not in (b"S6", b"Y2", b"Z0", b"M0", b"A1"):
            return b"\a"    # this bus has 500 kbit/s, 2 Mbit/s for data, and no time stamps
        return b"\r"

    def _fault(self, line, now_s):
        asked = _FAULT.fullmatch(line)
        done = asked and self._bus.worsen(self.controller, asked[1].decode(), float(asked[2]), now_s)
        return b"!\r" if done else b"\a"

    def deliver(self, frame):
        self._out += (frame.line, b"\r")

    def flush(self):
        if self._out:
            data, self._out = b"".join(self._out), []
            if not self.pty.write(data):
                self.dropped += data.count(b"\r")
        elif self.pty.waiting:
            self.pty.flush()

    def _gone(self):
        self._bus.close(self.controller)
        self._text = b""
        self._lines.clear()
        self._out.clear()
        self.pty.forget()

    def close(self):
        self.pty.close()
