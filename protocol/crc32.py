# The ordinary zlib CRC-32 without an int over 30 bits.
#
#   crc32_into(buf, start, end, out)    out: array "H" of 2, gets the low and the high half
#
# A 32-bit int is a heap object on a 32-bit MicroPython, so that a 32-bit CRC cannot
# run with the heap locked. Three loops do the same; the first that the runtime has is
# crc32_into: C on CPython, machine code (crc32_viper.py), or bytecode with TableCrc32.

import sys
from array import array

from protocol.crc32_tables import T0, T1, T2, T3


class TableCrc32:
    # The portable loop. The register is split 8 + 24, so that a byte takes 21 bytecodes (two halves
    # with 16-entry tables: 52), for a table of 1 KB of RAM, made once here. into() allocates nothing.

    def __init__(self):
        self.low = T0
        self.rest = array("i", bytes(1024))  # the upper 24 bits of each entry
        for i in range(256):
            self.rest[i] = T1[i] | T2[i] << 8 | T3[i] << 16

    def into(self, buf, start, end, out):
        # i and j hold the index of this byte and of the next in turn: that is why two bytes make a turn.
        if start >= end:
            out[0] = 0
            out[1] = 0
            return
        low = self.low
        rest = self.rest
        register = 0xFFFFFF
        i = buf[start] ^ 255
        start += 1
        last = end - 1
        while start < last:
            j = (register ^ low[i]) & 255 ^ buf[start]
            register = register >> 8 ^ rest[i]
            i = (register ^ low[j]) & 255 ^ buf[start + 1]
            register = register >> 8 ^ rest[j]
            start += 2
        if start < end:
            j = (register ^ low[i]) & 255 ^ buf[start]
            register = register >> 8 ^ rest[i]
            i = j
        j = register & 255 ^ low[i]
        register = register >> 8 ^ rest[i]
        out[0] = (j | (register & 255) << 8) ^ 65535
        out[1] = register >> 8 ^ 65535


if sys.implementation.name == "micropython":
    try:
        from protocol.crc32_viper import crc32_into
    except (ImportError, SyntaxError, ValueError):  # a port without the emitter, or .mpy of another machine
        _TABLE = TableCrc32()

        def crc32_into(buf, start, end, out):
            _TABLE.into(buf, start, end, out)
else:
    from zlib import crc32 as _crc32

    def crc32_into(buf, start, end, out):
        value = _crc32(memoryview(buf)[start:end])
        out[0] = value & 0xFFFF
        out[1] = value >> 16
