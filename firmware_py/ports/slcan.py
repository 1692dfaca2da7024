# The core on a CAN bus, behind an adapter that speaks SLCAN (LAWICEL's text, with the CANable 2.0's letters for
# CAN FD) at the far end of another port. Thin: text to CAN frames here, these to ours in protocol/.

from protocol.can_cutter import FD_SIZES, CanCutter
from protocol.can_joiner import CanJoiner

_TEXT = const(256)
_LINES = const(288)     # two of CAN FD, thirteen of CAN 2.0A: what goes out at once
_LINE_MAX = const(134)  # letter, id 3, length, 64 bytes, CR
_STAMP = const(4)       # digits that an adapter may add to a frame
_DIGITS = b"0123456789ABCDEF"
_OPEN = b"\rC\rS6\rO\r"           # closed, 500 kbit/s, opened
_OPEN_FD = b"\rC\rS6\rY2\rO\r"    # and 2 Mbit/s for the data


class SlcanPort:
    # As unix.Port, over a Port of that kind: a frame of ours is what read() leaves in buf and write() takes.
    # Whatever else the adapter says is passed over: its answers, frames of others, half lines, noise.
    # Allocates in __init__ and open() only.

    def __init__(self, port, fd):
        self.heap_bytes = port.heap_bytes
        self.heap_code_bytes = port.heap_code_bytes
        self.heap_boot_bytes = 0
        self.locked = 0
        self._port = port
        self._cutter = CanCutter(1, fd)
        self._joiner = None
        self._text = bytearray(_TEXT)
        self._at = 0        # of _text, what has been looked at
        self._end = 0
        self._lines = bytearray(_LINES)
        self._data = bytearray(64)
        self._place = 0     # in the line that is coming; -1: it is none of ours
        self._letter = 0
        self._due = 0       # its length
        self._can_id = 0
        self._size = 0

    def open(self, path, buf):
        self._joiner = CanJoiner(buf, 0)
        self._port.open(path, self._text)
        setup = _OPEN_FD if self._cutter.fd else _OPEN
        self._port.write(setup, len(setup))

    def lock(self):
        self._port.lock()
        self.heap_boot_bytes = self._port.heap_boot_bytes
        self.locked = self._port.locked

    def unlock(self):
        self._port.unlock()
        self.locked = 0

    def read(self, timeout_ms):
        # -> bytes now in buf: one frame, or 0; -1 when the adapter is gone
        if self._at >= self._end:
            size = self._port.read(timeout_ms)
            if size <= 0:
                return size
            self._at = 0
            self._end = size
        return self._scan()

    def _scan(self):
        # Characters up to the line that completes a frame of ours. -> its size, 0 if there is none in what has come
        text = self._text
        data = self._data
        place = self._place
        at = self._at
        size = 0
        while at < self._end and size == 0:
            byte = text[at]
            at += 1
            if byte == 13 or byte == 7:     # CR ends a line, BEL is an adapter's "no"
                if place > 4 and (place == self._due or place == self._due + _STAMP):
                    size = self._joiner.join(self._can_id, data, self._size)
                place = 0
            elif place > 0:
                digit = byte - 48
                if digit > 9:
                    digit = (byte & 223) - 55
                    if digit < 10:
                        digit = 16
                if digit < 0 or digit > 15:
                    place = -1
                    continue
                if place > 4:
                    if place < self._due:
                        i = place - 5 >> 1
                        data[i] = data[i] << 4 & 240 | digit
                elif place < 4:
                    self._can_id = self._can_id << 4 & 4095 | digit
                elif digit > 8 and self._letter == 116:
                    place = -1
                    continue
                else:
                    self._size = FD_SIZES[digit]
                    self._due = 5 + 2 * self._size
                place = place + 1 if place < _LINE_MAX + _STAMP else -1
            elif place == 0:
                self._letter = byte
                self._can_id = 0
                place = 1 if byte == 116 or byte == 98 or byte == 100 else -1     # t, b, d
        self._place = place
        self._at = at
        return size

    def write(self, buf, size):
        cutter = self._cutter
        cutter.begin(buf, size)
        n = 0
        while cutter.next():
            if n + _LINE_MAX > _LINES:
                self._port.write(self._lines, n)
                n = 0
            n = self._line(n)
        if n:
            self._port.write(self._lines, n)

    def _line(self, n):
        cutter = self._cutter
        lines = self._lines
        data = cutter.data
        can_id = cutter.can_id
        lines[n] = 98 if cutter.fd else 116     # b, t
        lines[n + 1] = _DIGITS[can_id >> 8]
        lines[n + 2] = _DIGITS[can_id >> 4 & 15]
        lines[n + 3] = _DIGITS[can_id & 15]
        lines[n + 4] = _DIGITS[cutter.dlc]
        n += 5
        for i in range(cutter.size):
            lines[n] = _DIGITS[data[i] >> 4]
            lines[n + 1] = _DIGITS[data[i] & 15]
            n += 2
        lines[n] = 13
        return n + 1

    def wait(self, ms):
        self._port.wait(ms)

    def heap_used(self):
        return self._port.heap_used()

    def ticks_ms(self):
        return self._port.ticks_ms()

    def random(self):
        return self._port.random()
