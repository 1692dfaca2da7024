# Files that grow during a mission: the log of frames and the robot's true path.

import struct
import time

from protocol.log import LogWriter

_FLUSH_BYTES = 65536
_TRUTH = struct.Struct("<I3d")


class TraceError(Exception):
    """One sentence: which file could not be written, and why."""


# A file that is written in large pieces. Bytes given to add() are on the disk
# after the next 64 KB, flush() or close(). When the disk refuses, TraceError
# names the file; what was written before stays and is whole.
class GrowingFile:
    def __init__(self, path):
        self.path = path
        self.bytes = 0
        self._held = bytearray()
        try:
            self._file = open(path, "wb", buffering=0)
        except OSError as error:
            raise TraceError("%s cannot be written: %s" % (path, error.strerror or error)) from None

    def add(self, data):
        self._held += data
        if len(self._held) >= _FLUSH_BYTES:
            self.flush()

    def flush(self):
        try:
            while self._held:
                written = self._file.write(self._held)
                del self._held[:written]
                self.bytes += written
        except OSError as error:
            self._held.clear()
            raise TraceError("%s cannot be written any further after %d bytes: %s" % (
                self.path, self.bytes, error.strerror or error)) from None

    def close(self):
        """Writes the rest; may be called twice."""
        if self._file.closed:
            return
        try:
            self.flush()
        finally:
            self._file.close()


# The log of a link (protocol/log.py), time-stamped by this machine's clock.
class FrameLog(GrowingFile):
    def __init__(self, path, **notes):
        super().__init__(path)
        self._writer = LogWriter()
        self._start_ns = time.monotonic_ns()
        self.add(self._writer.head(**notes))
        self.flush()  # a disk that takes nothing is found before the mission

    def frame(self, now_ns, direction, raw):
        """A raw frame that passed at now_ns of time.monotonic_ns()."""
        self.add(self._writer.record((now_ns - self._start_ns) // 1000, direction, raw))


# The truth beside the log: u32 step, then x_m, y_m, theta_rad as float64, little-endian, after every sense.
class TruthFile(GrowingFile):
    def pose(self, step, x_m, y_m, theta_rad):
        self.add(_TRUTH.pack(step, x_m, y_m, theta_rad))
