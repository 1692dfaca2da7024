# A pseudo-terminal of our own with a name that others can wait for.

import contextlib
import errno
import os
import select
import tempfile
import time
import tty

BACKLOG_BYTES = 4096
SPIN_S = 0.0004
SLEEPS = 50


class LinkError(Exception):
    """One sentence: what is wrong with the link's name, or what the far end did."""


# Owns the master end of a pty; `path` is a symbolic link to its slave end, which
# somebody else opens. Never blocks. Nobody there yet: read() gives b"" and
# `present` is False. Bytes that the far end does not take are kept, up to
# backlog_bytes; beyond that whole writes are dropped, counted in `dropped`: never half a frame.
class Pty:
    resetting = False   # the core is being started anew: that nobody is there is no failure
    clock = staticmethod(time.monotonic)

    def __init__(self, path, backlog_bytes=BACKLOG_BYTES):
        self.path = path
        self.dropped = 0
        self._backlog_bytes = backlog_bytes
        self._backlog = bytearray()
        self._patience = 0
        self._master, slave = os.openpty()
        try:
            tty.setraw(slave)  # the settings stay as long as the master is open
            self.name = os.ttyname(slave)
            os.set_blocking(self._master, False)
            self._poll = select.poll()
            self._poll.register(self._master, select.POLLIN)
            _point(path, self.name)
        except BaseException:
            os.close(self._master)
            raise
        finally:
            os.close(slave)

    @property
    def waiting(self):
        """Bytes that the far end has not taken."""
        return len(self._backlog)

    @property
    def present(self):
        """Whether somebody has the far end open now."""
        events = self._poll.poll(0)
        return not (events and events[0][1] & select.POLLHUP)

    def speaks(self, dialect):
        """The core's schema: bytes pass whatever they say."""

    def fileno(self):
        """Of our end, to wait for several at once."""
        return self._master

    def read(self, timeout_ms=0):
        """What has come, waiting for the first byte up to the timeout; b"" if nothing did, None if nobody is there."""
        if timeout_ms:
            self._wait(timeout_ms)
        try:
            return os.read(self._master, 4096)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno == errno.EIO:
                return None
            raise

    def _wait(self, timeout_ms):
        # In lockstep the answer is a fraction of a millisecond away: falling asleep for it, and being
        # woken, takes as long as the answer itself. So look for it a while before going to sleep; but
        # where that was in vain, on a busy machine, leave the processor to whom we wait for the next times.
        poll = self._poll.poll
        if self._patience < 0:
            self._patience += 1
            poll(timeout_ms)
            return
        end_s = time.perf_counter() + SPIN_S
        while not poll(0):
            if time.perf_counter() > end_s:
                self._patience = -SLEEPS
                poll(timeout_ms)
                return
            os.sched_yield()

    def write(self, data):
        """Sends, or keeps for later; False if these bytes had to be dropped."""
        if self._backlog and not self.flush():
            if len(self._backlog) + len(data) > self._backlog_bytes:
                self.dropped += 1
                return False
            self._backlog += data
            return True
        sent = self._send(data)
        if sent < len(data):
            self._backlog += data[sent:]
        return True

    def flush(self):
        """True when nothing is left to send."""
        if self._backlog:
            del self._backlog[:self._send(self._backlog)]
        return not self._backlog

    def forget(self):
        """Drops what waits to be sent: whoever it was meant for has gone."""
        self._backlog.clear()

    def drain(self, patience_s):
        """Waits until the far end, if anybody has it open, has read everything: what is unread when we close is lost."""
        if not self.present:
            return
        end_s = time.monotonic() + patience_s
        with contextlib.suppress(OSError):
            slave = os.open(self.name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            unread = select.poll()
            unread.register(slave, select.POLLIN)
            try:
                # poll() waits for what the kernel still carries from one end to the other; FIONREAD does not count that.
                while time.monotonic() < end_s and (not self.flush() or unread.poll(0)):
                    time.sleep(0.005)
            finally:
                os.close(slave)

    def _send(self, data):
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0
        except OSError as error:
            if error.errno == errno.EIO:
                return len(data)
            raise

    def close(self):
        """Removes the name, unless somebody else has taken it over; may be called twice."""
        if self._master < 0:
            return
        try:
            if os.readlink(self.path) == self.name:
                os.unlink(self.path)
        except OSError:
            pass
        os.close(self._master)
        self._master = -1


def _point(path, target):
    """Makes or replaces the symbolic link, in one step: who waits for the name never sees a half-made one."""
    folder = os.path.dirname(os.path.abspath(path))
    try:
        if os.path.lexists(path) and not os.path.islink(path):
            raise LinkError("%s exists and is not a symbolic link: it will not be replaced; give another name" % path)
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".link", dir=folder) as beside:
            os.symlink(target, os.path.join(beside, "link"))
            os.replace(os.path.join(beside, "link"), path)
    except OSError as error:
        raise LinkError("the link %s cannot be made: %s" % (path, error.strerror or error)) from None
