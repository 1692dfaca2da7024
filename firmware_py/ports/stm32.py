# The STM32F205 as QEMU's machine netduino2 has it: the robot link on USART2, or on the host's file by semihosting.

import gc
import micropython
from array import array

from . import rolling_viper, stm32_registers as registers

rolling_viper.accelerate()

USART = "usart2"        # the link's name where it is no path of the host

_OPEN, _WRITE, _READ = 1, 5, 6   # semihosting operations
_READ_WRITE_BINARY = 3
_COUNTS_MS = 120000     # of SysTick, at 120 MHz
_WRAP_MS = 100
_WRAP = _COUNTS_MS * _WRAP_MS
_FINE = 11520           # counts, which are 12,000 instructions of QEMU's at 8 ns
_FINE_BINS = 40
_COARSE = 240000
_BINS = 48              # the last one holds all above


class Port:
    # As unix.Port. read() returns at the end of a frame (`end_byte`), or every 100 ms; over semihosting, where the emulator
    # stands still meanwhile, only when something has come: the time limits there are the host's business.
    # begin_tick() and end_tick() stand around a step: tick_bins tells how many steps took how many counts, in bins of
    # _FINE, then of _COARSE; tick_largest the counts of the longest. Interrupts stay masked: the part's vector table
    # leads into the fault handler.

    def __init__(self):
        gc.collect()
        self.heap_code_bytes = gc.mem_alloc()   # the VM's own: the core's names and functions lie in flash
        self.heap_bytes = gc.mem_alloc() + gc.mem_free()
        self.heap_boot_bytes = 0
        self.locked = 0
        self.blocks = 0     # whether read() may wait for ever
        self.end_byte = 0
        self._handle = 0
        self._buf = None
        self._wraps = 0
        self._last = 0
        self._began = 0
        self.tick_largest = 0
        self.tick_bins = array("H", bytes(2 * _BINS))
        registers.clock_start()

    def open(self, path, buf):
        self._buf = buf
        if path == USART:
            registers.usart_open()
            return
        self.blocks = 1
        name = path.encode() + b"\0"
        self._handle = registers.semihost(_OPEN, name, _READ_WRITE_BINARY, len(name) - 1)
        if self._handle < 0:
            raise OSError(path + " cannot be opened by the emulator")

    def close(self):
        registers.clock_stop()

    def lock(self):
        gc.collect()
        self.heap_boot_bytes = gc.mem_alloc()
        self.locked = 1
        micropython.heap_lock()

    def unlock(self):
        if self.locked:
            self.locked = 0
            micropython.heap_unlock()

    def read(self, _timeout_ms):
        # -> bytes now in buf, -1 when the other end is gone or the REPL got Ctrl-C
        buf = self._buf
        if self.blocks:
            left = registers.semihost(_READ, self._handle, buf, len(buf))
            self._wraps += registers.clock_wrapped()
            return len(buf) - left if 0 <= left < len(buf) else -1
        size = registers.usart_receive(buf, len(buf), self._last, self.end_byte)
        if size:
            self._last = buf[size - 1]
        wrapped = registers.clock_wrapped()
        self._wraps += wrapped
        if (wrapped or size == 0) and registers.repl_interrupted():
            return -1
        return size

    def write(self, buf, size):
        if self.blocks:
            registers.semihost(_WRITE, self._handle, buf, size)
        else:
            registers.usart_send(buf, size)

    def wait(self, ms):
        pass    # the caller watches the clock: it wakes nobody

    def heap_used(self):
        return gc.mem_alloc()

    def begin_tick(self):
        self._began = registers.clock_value()

    def end_tick(self):
        counts = self._began - registers.clock_value()  # it counts down
        if counts < 0:
            counts += _WRAP
        if counts > self.tick_largest:
            self.tick_largest = counts
        i = counts // _FINE
        if i >= _FINE_BINS:
            i = _FINE_BINS + (counts - _FINE * _FINE_BINS) // _COARSE
        if i >= _BINS:
            i = _BINS - 1
        if self.tick_bins[i] < 0xFFFF:
            self.tick_bins[i] += 1

    def print_ticks(self):
        print("tvslam: costs", self.tick_largest, _FINE, _FINE_BINS, _COARSE, end="")
        for count in self.tick_bins:
            print("", count, end="")
        print()

    def ticks_ms(self):
        counts = registers.clock_value()
        if registers.clock_wrapped():
            self._wraps += 1
            counts = registers.clock_value()  # the first may be of before
        return (self._wraps & 0x7FFFF) * _WRAP_MS + (_WRAP - 1 - counts) // _COUNTS_MS & 0x3FFFFFF

    def random(self):
        # From the time that the REPL took to start us: differs from boot to boot as far as the host's clock does.
        return registers.clock_value() & 0xFFFF
