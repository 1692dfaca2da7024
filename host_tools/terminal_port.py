"""A serial port or pseudo-terminal opened raw, with a sentence for each way it can fail, and left as it was."""

import contextlib
import errno
import os
import select
import termios
import time
import tty

STOP, SOFT_RESET = b"\r\x03", b"\x02\x04"     # to firmware_py/ports/machine.py (Ctrl-C), then to MicroPython's REPL
STOP_S = 0.2
WHOLE_SECONDS_S = 2.0   # some file systems keep no parts of one


class PortError(Exception):
    """Its text is one sentence for the user: cause and way out."""


class PortClosed(PortError):
    """The other end went away while the port was in use."""


class TerminalPort:
    """Contract: never blocks longer than asked; nothing is written that the caller did not write."""

    def __init__(self, path):
        self.fd = -1
        try:
            fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise PortError("%s cannot be opened: %s." % (path, _reason(error))) from None
        try:
            found = termios.tcgetattr(fd)
            tty.setraw(fd, termios.TCSANOW)
        except termios.error:
            os.close(fd)
            raise PortError("%s is not a terminal: give the pty or serial port that `sim_device --tap` or "
                            "`--link` made." % path) from None
        except OSError as error:
            os.close(fd)
            raise PortError("%s cannot be set to raw: %s." % (path, _reason(error))) from None
        self._adopt(fd, path, found)

    def _adopt(self, fd, path, found=None):
        self.path = path
        self.fd = fd
        self._found = found     # the settings of the one who had it before
        self._poll = select.poll()
        self._poll.register(fd, select.POLLIN)

    @classmethod
    def wait(cls, path, seconds, say=None):
        """Open `path`, which may not exist yet: `say` gets one sentence if there is something to wait for."""
        end = time.monotonic() + seconds
        said = False
        while why := _missing(path):
            if time.monotonic() >= end:
                raise PortError("%s %s%s: start `sim_device HOME --link ... --tap %s`, or give the name "
                                "of a port that is there." % (path, why, " after %g s" % seconds if seconds else "", path))
            if not said and say is not None:
                say("Waiting for %s (at most %g s; Ctrl-C ends)." % (path, seconds))
                said = True
            time.sleep(0.1)
        return cls(path)

    def read(self, timeout_s=0.0):
        """What has come, or b"" after `timeout_s`; raises PortClosed when the other end is gone."""
        for _, event in self._poll.poll(timeout_s * 1000):
            if event & select.POLLIN:
                try:
                    data = os.read(self.fd, 65536)
                except BlockingIOError:
                    return b""
                except OSError as error:
                    raise PortClosed(self._closed(error)) from None
                if data:
                    return data
                raise PortClosed(self._closed())
            if event & (select.POLLHUP | select.POLLERR | select.POLLNVAL):
                raise PortClosed(self._closed())
        return b""

    def write(self, data):
        """As much as fits now; a full port drops the rest, as a cable would."""
        try:
            os.write(self.fd, data)
        except BlockingIOError:
            pass
        except OSError as error:
            raise PortClosed(self._closed(error)) from None

    def start_anew(self):
        try:
            start_anew(self.fd)
        except (OSError, termios.error) as error:
            raise PortClosed(self._closed(error if isinstance(error, OSError) else None)) from None

    def close(self):
        if self.fd >= 0:
            if self._found:
                with contextlib.suppress(termios.error):    # the other end is gone, and its settings with it
                    termios.tcsetattr(self.fd, termios.TCSANOW, self._found)
            os.close(self.fd)
            self.fd = -1

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _closed(self, error=None):
        # EIO is how Linux says that a pty's master side is closed: no news beside the sentence.
        detail = " (%s)" % _reason(error) if error is not None and error.errno != errno.EIO else ""
        return "%s was closed by its other end while in use%s." % (self.path, detail)


def start_anew(fd):
    """A core has one mission in a life: its last one must not be the next. What heeds none of this drops it as no frame."""
    for part in (STOP, SOFT_RESET):
        os.write(fd, part)
        time.sleep(STOP_S)
        termios.tcflush(fd, termios.TCIFLUSH)   # the old core's last words


def _missing(path):
    """Why there is nothing to open by this name yet; "" if there is."""
    if not os.path.exists(path):
        return "does not exist"
    return "is a name that an earlier robot has left (the terminal behind it is newer)" if _left_behind(path) else ""


def _left_behind(path):
    """Whether a robot that was killed has left this name, and the kernel has given the number behind it to a new terminal.

    A terminal's own times only move on: its atime and mtime with use, its ctime with its mode. The oldest of them is not before
    its birth, and not after it as long as one of them has not moved.
    """
    link = None
    try:
        while os.path.islink(path):
            link, path = path, os.path.join(os.path.dirname(path), os.readlink(path))
        if link is None or not path.startswith("/dev/pts/"):
            return False
        node = os.stat(path)
        return min(node.st_atime, node.st_mtime, node.st_ctime) > os.lstat(link).st_mtime + WHOLE_SECONDS_S
    except OSError:
        return True     # it is being replaced at this moment: to be looked at once more


def _reason(error):
    return (error.strerror or str(error)).lower()
