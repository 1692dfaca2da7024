"""Joins a real board's serial port to the virtual robot's link: hardware in the loop.

Bytes pass unchanged in both directions; frames are the two ends' business.
"""

import os
import select
import termios
import threading

import serial

from host_tools.hil_options import UsageError
from host_tools.terminal_port import PortError, TerminalPort, start_anew

BAUD = 115200
WAIT_FOR_LINK_S = 10.0


# Contract: the board's port is opened in __init__ (UsageError if it cannot be); `start` copies in a
# thread until `close`; `failure` is a sentence once an end is gone in mid-mission. `anew`: a core on a
# board with a REPL is started anew before.
class Relay:
    def __init__(self, device, link, anew=False):
        self.device, self.link, self.anew = device, link, anew
        self.failure = ""
        self._stop = threading.Event()
        self._thread = None
        try:
            self.board = serial.Serial(device, BAUD, timeout=0, write_timeout=1, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise UsageError(_why(device, error)) from None

    def start(self):
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def pause(self):
        """Until the next start()."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(2.0)
        self._stop.clear()

    def close(self):
        self.pause()
        self.board.close()

    def _run(self):
        try:
            if self.anew:
                start_anew(self.board.fileno())
            with TerminalPort.wait(self.link, WAIT_FOR_LINK_S) as robot:
                while not self._stop.is_set():
                    self._copy(robot)
        except PortError:
            pass  # the robot's end: its process says why
        except (serial.SerialException, OSError, termios.error) as error:
            self.failure = "the board's port %s was closed while in use (%s)" % (self.device, _reason(error))

    def _copy(self, robot):
        ready, _, _ = select.select([robot.fd, self.board.fileno()], [], [], 0.1)
        if robot.fd in ready:
            self.board.write(robot.read())
        if self.board.fileno() in ready:
            robot.write(self._take())

    def _take(self):
        data = os.read(self.board.fileno(), 4096)
        if not data:
            raise serial.SerialException("it was unplugged or closed at its other end")
        return data


def _why(device, error):
    if not os.path.exists(device):
        return "--target port:%s does not exist; plug the board in, or give the port that it has." % device
    if os.path.isdir(device) or not _is_terminal(device):
        return "--target port:%s is not a terminal; give a serial port." % device
    return "--target port:%s cannot be opened (%s); close what else uses it, or give another port." % (device, _reason(error))


def _is_terminal(device):
    try:
        fd = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return True  # it could not even be opened: that is the better sentence
    try:
        return os.isatty(fd)
    finally:
        os.close(fd)


def _reason(error):
    return (getattr(error, "strerror", None) or str(error)).lower()
