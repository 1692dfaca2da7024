# The robot's non-volatile memory, as flash is: erased by the unit to ones, programmed once where it is erased, torn by a loss of power.

import errno
import fcntl
import os
import random

from protocol.schema import NVM_UNIT

SIZE = 16384            # two slots of the largest map that the core holds
OK, OUT_OF_RANGE, NOT_ERASED = 0, 1, 2


class NvmError(Exception):
    """One sentence: what is wrong with the file that stands for the memory."""


# `size` bytes, all erased at first; or the file `path`, made where there is none, which then holds every byte that was written when
# the call returns. Each operation gives a status. `power`: numbers of bytes, counted over all that are ever programmed or erased,
# at which the power is lost, told by lose_power(number): that byte is torn, of a unit that was being erased any bit. What
# follows is not done; `off` until somebody switches it on() again.
class Nvm:
    def __init__(self, size=SIZE, path=None, power=(), seed=1, lose_power=lambda number: None):
        self.size = size
        self.path = path
        self.lose_power = lose_power
        self.off = False
        self.written = self.erases = self.programs = self.reads = 0
        self.power = sorted(power)  # those to come
        self._random = random.Random("%d power" % seed)
        self._file = _opened(path, size) if path else None
        self._bytes = bytearray(_content(self._file, path, size) if path else b"\xff" * size)

    def read(self, address, size):
        """(status, bytes)"""
        if not 0 <= address <= address + size <= self.size:
            return OUT_OF_RANGE, b""
        self.reads += 1
        return OK, bytes(self._bytes[address:address + size])

    def erase(self, address):
        if address % NVM_UNIT or not 0 <= address < self.size:
            return OUT_OF_RANGE
        self.erases += 1
        cut = self._count(NVM_UNIT)
        self._put(address, self._random.randbytes(NVM_UNIT) if cut is not None else b"\xff" * NVM_UNIT)
        return OK

    def program(self, address, data):
        end = address + len(data)
        if not 0 <= address <= end <= self.size:
            return OUT_OF_RANGE
        if any(byte != 255 for byte in self._bytes[address:end]):
            return NOT_ERASED
        self.programs += 1
        cut = self._count(len(data))
        self._put(address, data if cut is None else data[:cut] + bytes((data[cut] | self._random.getrandbits(8),)))
        return OK

    def on(self):
        self.off = False

    def close(self):
        if self._file is not None:
            self._file.close()

    def _count(self, size):
        """How many of these bytes are whole when the power is lost; None where it is not."""
        before, self.written = self.written, self.written + size
        while self.power and self.power[0] < self.written:
            number = self.power.pop(0)
            if number >= before:
                self.written = number + 1
                self.off = True
                self.lose_power(number)
                return number - before
        return None

    def _put(self, address, data):
        self._bytes[address:address + len(data)] = data
        if self._file is None:
            return
        try:
            if os.pwrite(self._file.fileno(), data, address) != len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise NvmError("--nvm %s cannot be written any further (%s): the map is not kept; make room, or give another file" % (
                self.path, _reason(error))) from None


def _opened(path, size):
    try:
        file = open(path, "r+b" if os.path.lexists(path) else "x+b", buffering=0)
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        return file
    except BlockingIOError:
        raise NvmError("--nvm %s is another mission's memory at this moment; give another name" % path) from None
    except OSError as error:
        raise NvmError("--nvm %s cannot be opened for writing (%s); give the name of a file" % (path, _reason(error))) from None


def _content(file, path, size):
    try:
        there = os.fstat(file.fileno()).st_size
        if there == 0:
            _fill(file, size)
        data = os.pread(file.fileno(), size + 1, 0)
    except OSError as error:
        file.close()
        raise NvmError("--nvm %s cannot be used (%s); give the name of a file where there is room" % (path, _reason(error))) from None
    if len(data) != size:
        file.close()
        raise NvmError("--nvm %s holds %d bytes, and this robot's memory %d: it is no memory of this robot; give another name" % (
            path, max(there, len(data)), size))
    return data


def _fill(file, size):
    """A new memory, erased; or none."""
    try:
        if os.pwrite(file.fileno(), b"\xff" * size, 0) != size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    except OSError:
        file.truncate(0)
        raise


def _reason(error):
    return (error.strerror or str(error)).lower()
