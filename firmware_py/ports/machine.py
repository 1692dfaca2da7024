# A board that MicroPython runs on, by MicroPython's own library: the link is the board's USB (stdin and stdout,
# where its REPL is, too) or any stream, as machine.UART is one. It has run on the Unix port only, not on silicon.

import gc
import micropython
import os
import select
import sys
import time

try:
    from .rolling_viper import accelerate

    accelerate()
except (ImportError, SyntaxError, ValueError):
    pass  # a build without the emitter: slower, the same to the last bit

gc.collect()
_code = gc.mem_alloc()  # imports so far: the code lies in the heap here

# Ends the core, where a frame would begin: none begins like that. To a REPL it is: stop, leave the raw mode, start anew.
_END = b"\r\x03\x02\x04"
_CTRL_C = const(3)


class Port:
    # As unix.Port. open(stream, buf): a stream that can be polled, or None for stdin and stdout. read() is -1 once
    # _END has come; from stdin its first two bytes, Ctrl-C, will do: USB damages none, and the rest is for the REPL.
    # A serial line can make up two bytes, hardly four. close() gives Ctrl-C back to the REPL.

    def __init__(self):
        self.heap_code_bytes = _code
        self.heap_bytes = gc.mem_alloc() + gc.mem_free()
        self.heap_boot_bytes = 0
        self.locked = 0
        self.is_repl = False
        self._source = None
        self._sink = None
        self._buf = None
        self._byte = bytearray(1)
        self._poll = select.poll()
        self._end_bytes = len(_END)
        self._matched = 0   # bytes of _END so far; -1: inside a frame

    def open(self, stream, buf):
        self._buf = buf
        self._source = stream
        self._sink = stream
        if stream is None:
            self.is_repl = True
            self._end_bytes = 2
            self._source = sys.stdin.buffer
            self._sink = sys.stdout.buffer
            micropython.kbd_intr(-1)  # frames hold every byte
        self._poll.register(self._source, select.POLLIN)

    def close(self):
        if self.is_repl:
            micropython.kbd_intr(_CTRL_C)

    def restart(self):
        # Told to end on a line of its own: there is no REPL at its other end that could start the core anew.
        if not self.is_repl:
            from machine import soft_reset
            soft_reset()

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
        # -> bytes now in buf, -1 when the core is to end
        # One by one: a board's stdin has no other way to take what is there and no more.
        buf = self._buf
        byte = self._byte
        poll = self._poll
        n = 0
        while n < len(buf):
            ready = False
            for _ in poll.ipoll(0 if n else timeout_ms):
                ready = True
            if not ready:
                return n
            size = self._source.readinto(byte)
            if not size:
                return -1 if size == 0 else n
            buf[n] = byte[0]
            n += 1
            if self._ends(byte[0]):
                return -1
        return n

    def _ends(self, byte):
        if byte == 0:
            self._matched = 0
        elif self._matched >= 0:
            self._matched = self._matched + 1 if byte == _END[self._matched] else -1
        return self._matched == self._end_bytes

    def write(self, buf, size):
        self._sink.write(buf, size)

    def wait(self, ms):
        # As unix.Port: the caller watches the last millisecond pass.
        if ms > 1:
            time.sleep_ms(ms - 1)

    def heap_used(self):
        return gc.mem_alloc()

    def ticks_ms(self):
        return time.ticks_ms() & 0x3FFFFFF

    def random(self):
        if hasattr(os, "urandom"):
            return os.urandom(1)[0] << 8 | os.urandom(1)[0]
        return time.ticks_us() & 0xFFFF  # no generator on this board: how long it took to come here
