# The Unix port of MicroPython: a serial port or a pty as a file, poll, a lockable heap.

import gc
import micropython
import os
import select
import termios
import time

try:
    from .rolling_viper import accelerate

    accelerate()
except (ImportError, SyntaxError, ValueError):
    pass  # a build without the emitter: slower, the same to the last bit

gc.collect()
_code = gc.mem_alloc()  # imports so far: the code lies in the heap here


_SPIN = 300   # polls of about a microsecond
_SLEEPS = 50


class PortError(Exception):
    pass


class Port:
    # open(path, buf) waits for path, then read(timeout_ms) -> bytes now in buf; write(buf, size).
    # heap_bytes, heap_code_bytes (imports), heap_boot_bytes (at lock()), heap_used(), locked.
    # Allocates until lock(), nothing after it; lock() also makes the first poll, which allocates.

    def __init__(self):
        gc.collect()
        self.heap_code_bytes = _code
        self.heap_bytes = gc.mem_alloc() + gc.mem_free()
        self.heap_boot_bytes = 0
        self.locked = 0
        self._file = None
        self._poll = select.poll()
        self._buf = None
        self._patience = 0

    def open(self, path, buf):
        self._buf = buf
        while True:
            try:
                os.stat(path)
                self._file = open(path, "r+b")
                break
            except OSError as error:
                if error.errno != 2:
                    raise PortError(path + " cannot be opened (errno " + str(error.errno) + "): give a serial port or a pty")
            time.sleep_ms(100)
        try:
            termios.setraw(self._file.fileno())
            attributes = termios.tcgetattr(self._file.fileno())
            attributes[6][6] = 0   # VMIN, VTIME: a read takes what is there
            attributes[6][5] = 0
            termios.tcsetattr(self._file.fileno(), termios.TCSANOW, attributes)
        except OSError:
            raise PortError(path + " is not a terminal: give a serial port or a pty")
        self._poll.register(self._file, select.POLLIN)

    def lock(self):
        for _ in self._poll.ipoll(0):
            pass
        gc.collect()
        self.heap_boot_bytes = gc.mem_alloc()
        self.locked = 1
        micropython.heap_lock()

    def unlock(self):
        if self.locked:
            self.locked = 0
            micropython.heap_unlock()

    def read(self, timeout_ms):
        # -> bytes now in buf, -1 when the other end is gone
        # Looks a while before it sleeps: in lockstep the next step is a fraction of a millisecond away,
        # and being woken takes as long.
        poll = self._poll
        spin = _SPIN
        if self._patience < 0:
            self._patience += 1
            spin = 0
        try:
            while spin and not self._ready(poll, 0):
                spin -= 1
                if spin == 0:
                    self._patience = -_SLEEPS  # in vain: leave the processor to the host for a while
            for _ in poll.ipoll(0 if spin else timeout_ms):
                size = self._file.readinto(self._buf)
                if size:
                    return size
                if size == 0:
                    return -1  # readable, but nothing there: hung up
        except OSError:
            return -1
        except MemoryError:
            return -1  # the OSError itself found no heap
        return 0

    def _ready(self, poll, timeout_ms):
        for _ in poll.ipoll(timeout_ms):
            return True
        return False

    def write(self, buf, size):
        try:
            self._file.write(buf, size)
        except OSError:
            pass  # gone: the next read says so
        except MemoryError:
            pass

    def wait(self, ms):
        # Less than that: sleep returns late, so the caller watches the last millisecond pass.
        if ms > 1:
            time.sleep_ms(ms - 1)

    def heap_used(self):
        return gc.mem_alloc()

    def ticks_ms(self):
        return time.ticks_ms() & 0x3FFFFFF

    def random(self):
        return os.urandom(1)[0] << 8 | os.urandom(1)[0]
