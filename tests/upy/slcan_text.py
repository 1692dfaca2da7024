# The core's CAN port on a line of any bytes: no exception, no allocation, the good frames come through.
# arguments: FILE FD      a stream of text; what came of it is reported as a count and a sum

from protocol.can_joiner import FRAME_MAX

from firmware_py.ports.slcan import SlcanPort

counts = [0, 0, 0, 0]
ANSWER = b"\0\x02\x25\x01\x04\x05\x0b\x07\x05\x42\x64\x6c\x80\0"


# Stands for a port: gives the stream in pieces of 1, 2, ... bytes, and counts what is written.
class Line:
    heap_bytes = heap_code_bytes = heap_boot_bytes = locked = 0

    def __init__(self, stream):
        self.stream = stream
        self.at = 0
        self.piece = 0
        self.buf = None

    def open(self, path, buf):
        self.buf = buf

    def read(self, timeout_ms):
        self.piece = self.piece % 200 + 1
        n = min(self.piece, len(self.stream) - self.at, len(self.buf))
        for i in range(n):
            self.buf[i] = self.stream[self.at + i]
        self.at += n
        return n

    def write(self, buf, size):
        counts[2] += size


def boot(arguments):
    global port, line, rx
    with open(arguments[0], "rb") as file:
        line = Line(file.read())
    port = SlcanPort(line, int(arguments[1]))
    rx = bytearray(FRAME_MAX)
    port.open("a name", rx)


def locked():
    while line.at < len(line.stream) or port._at < port._end:
        size = port.read(0)
        if size:
            counts[0] += 1
            for i in range(size):
                counts[1] = counts[1] * 31 + rx[i] & 0xFFFFF
            port.write(ANSWER, len(ANSWER))


def report():
    print(counts)
