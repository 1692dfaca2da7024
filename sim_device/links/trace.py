# Files that grow during a mission: the log of frames and the robot's true path.

import fcntl
import os
import stat
import struct
import time

from protocol.log import LogWriter

_FLUSH_BYTES = 65536
_KEEP_NS = 250_000_000  # what a killed mission may lose
_TRUTH = struct.Struct("<I3d")


class TraceError(Exception):
    """One sentence: which file could not be written, and why."""


# A file that is written in large pieces: what was given to add() goes to the disk every 64 KB and four times a second, by flush() and
# by close().
# A file that cannot be begun is a TraceError. A disk that refuses later ends no mission: `failure` is the sentence, what
# was written stays and is whole, and what comes from that byte on goes to the file `rest`, where one is given.
# One writer at a time: who comes second is refused before it spoils anything.
class GrowingFile:
    def __init__(self, path, rest=None):
        self.path = path
        self.bytes = 0
        self.failure = ""
        self._rest = rest
        self._held = bytearray()
        self._full = False
        self._kept_ns = time.monotonic_ns()
        try:
            self._file = open(path, "ab", buffering=0)
            _alone(self._file)
            if stat.S_ISREG(os.fstat(self._file.fileno()).st_mode):
                os.ftruncate(self._file.fileno(), 0)
        except BlockingIOError:
            raise TraceError("%s is being written by another mission: give another name" % path) from None
        except OSError as error:
            raise TraceError("%s cannot be written: %s" % (path, error.strerror or error)) from None

    def add(self, data):
        self._held += data
        now_ns = time.monotonic_ns()
        if len(self._held) >= _FLUSH_BYTES or now_ns - self._kept_ns > _KEEP_NS:
            self._kept_ns = now_ns
            self.flush()

    def flush(self):
        while self._held and not self._full:
            try:
                written = self._file.write(self._held)
            except OSError as error:
                self._refused(error)
            else:
                del self._held[:written]
                self.bytes += not self.failure and written
        if self._full:
            self._held.clear()

    def _refused(self, error):
        self.failure = self.failure or "%s is incomplete: it could not be written any further after %d bytes: %s" % (
            self.path, self.bytes, error.strerror or error)
        self._full = self._rest is None
        if self._rest is not None:
            self._file.close()
            try:
                self._file = open(self._rest, "wb", buffering=0)
            except OSError:
                self._full = True
            self._rest = None

    def close(self):
        """Writes what is held; may be called twice."""
        if not self._file.closed:
            self.flush()
            self._file.close()


def _alone(file):
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass  # this file system knows no locks


# The log of a link (protocol/log.py), time-stamped by this machine's clock. It goes to the disk at each sync marker, too.
# Its head tells this host's schema, until speaks() names that of the core whose frames these are.
class FrameLog(GrowingFile):
    def __init__(self, path, rest=None, **notes):
        super().__init__(path, rest)
        self._writer = LogWriter()
        self._notes = notes
        self._start_ns = time.monotonic_ns()
        self._head = self._writer.head(**notes)
        self.add(self._head)
        self.flush()
        if self.failure:  # a disk that takes nothing is found before the mission
            self.close()
            raise TraceError(self.failure)

    def speaks(self, dialect):
        """Another head takes the place of the one that is there; what follows it stays."""
        self.flush()
        if self.failure:
            return      # what is there stays
        try:
            with open(self.path, "rb") as file:
                if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                    raise TraceError("%s is no regular file: the log of a core of another schema needs one" % self.path)
                kept = file.read()[len(self._head):]
        except OSError as error:
            raise TraceError("%s cannot be read, which the log of a core of another schema needs: %s" % (
                self.path, error.strerror or error)) from None
        self._head = LogWriter().head(dialect, **self._notes)
        os.ftruncate(self._file.fileno(), 0)
        self.bytes = 0
        self.add(self._head + kept)
        self.flush()

    def frame(self, now_ns, direction, raw):
        """A raw frame that passed at now_ns of time.monotonic_ns()."""
        self.add(self._writer.record((now_ns - self._start_ns) // 1000, direction, raw))
        if self._writer.since_mark == 0:
            self.flush()


# The truth beside the log: u32 step, then x_m, y_m, theta_rad as float64, little-endian, after every sense.
class TruthFile(GrowingFile):
    def pose(self, step, x_m, y_m, theta_rad):
        self.add(_TRUTH.pack(step, x_m, y_m, theta_rad))
