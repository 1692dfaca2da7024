# CPython on a POSIX machine: a serial port or a pty by descriptor. There is no heap to lock or to count.

import os
import select
import termios
import time
import tty


_SPIN = 300
_SLEEPS = 50


class PortError(Exception):
    pass


class Port:
    # As unix.Port; heap figures are 0, locked stays 0.

    def __init__(self):
        self.heap_code_bytes = 0
        self.heap_bytes = 0
        self.heap_boot_bytes = 0
        self.locked = 0
        self._fd = -1
        self._poll = select.poll()
        self._view = None
        self._patience = 0

    def open(self, path, buf):
        self._view = memoryview(buf)
        while True:
            try:
                self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
                break
            except FileNotFoundError:
                time.sleep(0.1)
            except OSError as error:
                raise PortError("%s cannot be opened (%s): give a serial port or a pty" % (path, error.strerror)) from None
        try:
            tty.setraw(self._fd)
        except termios.error:
            raise PortError("%s is not a terminal: give a serial port or a pty" % path) from None
        self._poll.register(self._fd, select.POLLIN)

    def lock(self):
        pass

    def unlock(self):
        pass

    def read(self, timeout_ms):
        # -> bytes now in buf, -1 when the other end is gone
        try:
            poll = self._poll.poll
            spin = _SPIN  # as unix.Port: looks a while before it sleeps, unless that was in vain
            if self._patience < 0:
                self._patience += 1
                spin = 0
            while spin and not poll(0):
                os.sched_yield()
                spin -= 1
                if not spin:
                    self._patience = -_SLEEPS
            if not spin and not poll(timeout_ms):
                return 0
            size = os.readv(self._fd, [self._view])
            return size if size else -1
        except OSError:
            return -1

    def write(self, buf, size):
        try:
            os.write(self._fd, memoryview(buf)[:size])
        except OSError:
            pass  # gone: the next read says so

    def wait(self, ms):
        # Less than that: sleep returns late, so the caller watches the last millisecond pass.
        if ms > 1:
            time.sleep((ms - 1) / 1000)

    def heap_used(self):
        return 0

    def ticks_ms(self):
        return time.monotonic_ns() // 1000000 & 0x3FFFFFF

    def random(self):
        return int.from_bytes(os.urandom(2), "little")
