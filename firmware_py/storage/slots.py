# Two slots of a non-volatile memory: whatever is cut off at whatever byte, the last whole record is in one of them.

from array import array

from protocol.crc32 import crc32_into
from protocol.crc32_tables import T0, T1, T2, T3
from protocol.tables import (
    NVM_DAMAGED, NVM_ERASE, NVM_EXPLORED, NVM_FAILED, NVM_FOREIGN, NVM_KEPT, NVM_NOTHING, NVM_PIECE, NVM_PROGRAM, NVM_READ,
    NVM_TOO_SMALL, NVM_UNIT,
)

_MAGIC = b"TVNV"
_HEAD = const(18)           # magic, layout u16, sequence u16, size u16, CRC-32 of the data, CRC-32 of these
_SUMMED = const(14)
_PATIENCE = const(2000)     # ticks in which nobody has served the memory

# phases
_NEW = const(0)             # nothing was asked yet
_HEADS = const(1)
_LOAD = const(2)
_IDLE = const(3)
_ERASE = const(4)
_DATA = const(5)
_COMMIT = const(6)


class Slots:
    # The memory is at the other end of the link, and the core only answers: so it is asked by answers. exchange(values, out) takes a
    # NVM_DONE (in place: out may be values) and leaves the next NVM in out, -> how many bytes of data it carries. The first ones,
    # before the mission, look for the newest whole record and load it: `found` then, which begin() tells. save() each tick until True
    # writes a new one.
    # `kept` tells what became of it, in the bits of protocol/schema.py: a record that does not fit is not kept, the one before it stays.
    # ready: there is a memory, and it has been looked at.
    #
    # A slot is half of the memory, whole units of it: the commit record, and from byte 64 on the data. The slot that is not in force
    # is erased, then programmed, and its commit record comes last; so the other one is in force until that very byte. Newer is the
    # one of the higher sequence, modulo 2**16. Allocates in __init__ only.

    def __init__(self, record, parameters):
        self.ready = False
        self.found = False
        self.kept = 0
        self.crc = array("H", bytes(4))
        self._record = record
        self._parameters = parameters
        self._heads = [bytearray(_HEAD), bytearray(_HEAD)]
        self._sum = array("H", bytes(4))
        self._slot_bytes = 0
        self._phase = _NEW
        self._slot = 1          # the one that is read, written, or in force
        self._sequence = 0
        self._fits = True       # what is loaded, into the stores
        self._at = 0            # byte of the data, or of the slot that is erased
        self._request = 0       # of the operation that is out; 0: none
        self._number = 0        # of the last one
        self._summed = 0        # bytes of data whose sum is in crc
        self._ticks = 0

    def save(self):
        # What the record takes now, into the other slot. -> True when it is there, or cannot be
        if self._phase == _IDLE:
            if self._ticks:
                self._ticks = 0
                return True
            self._record.take()
            if NVM_PIECE + self._record.size > self._slot_bytes:
                self.kept |= NVM_TOO_SMALL
                return True
            self.kept &= ~NVM_TOO_SMALL
            self._slot = 1 - self._slot
            self._at = 0
            self._phase = _ERASE
        self._ticks += 1
        if self._ticks > _PATIENCE:
            self._give_up()
        return False

    def lost(self):
        # Whether what was last to be kept is not.
        return self.kept & (NVM_TOO_SMALL | NVM_FAILED) != 0

    def begin(self):
        # The mission does. What is not loaded by now will not be: its place is taken. -> whether there is something to go on from
        if _NEW < self._phase < _IDLE:
            self._give_up()
        return self.found

    def _give_up(self):
        self.kept |= NVM_FAILED
        self.ready = False
        if self._phase >= _ERASE:
            self._slot = 1 - self._slot
        elif self._phase != _IDLE:
            self._record.drop()
        self._phase = _IDLE
        self._request = 0

    def exchange(self, values, out):
        if self._phase == _NEW:
            self._slot_bytes = 0 if self._parameters.locked else self._parameters.of("nvm_bytes") // (2 * NVM_UNIT) * NVM_UNIT
            self._phase = _HEADS if self._slot_bytes else _IDLE
            self._slot = 0
        elif self._request and values[0] == self._request:
            self._request = 0
            if values[1]:
                self._give_up()
            else:
                self._take(values)
        return self._tell(out)

    def _take(self, values):
        # What was asked for is done.
        if self._phase == _HEADS:
            head = self._heads[self._slot]
            for i in range(_HEAD):
                head[i] = values[3 + i] if i < values[2] else 0
            if self._slot == 0:
                self._slot = 1
            else:
                self._heed(0)
                self._heed(1)
                self._choose()
        elif self._phase == _LOAD:
            self._load(values)
        elif self._phase == _ERASE:
            self._at += NVM_UNIT
            if self._at >= NVM_PIECE + self._record.size:
                self._at = self._summed = 0
                self.crc[0] = self.crc[1] = 65535
                self._phase = _DATA
        elif self._phase == _DATA:
            self._at += self._piece()
            if self._at == self._record.size:
                self._seal()
                self._phase = _COMMIT
        elif self._phase == _COMMIT:
            self._sequence = self._sequence + 1 & 0xFFFF
            self.kept = NVM_KEPT | (NVM_EXPLORED if self._record.explored() else 0)
            self._phase = _IDLE

    def _heed(self, slot):
        # A head that counts keeps its magic; the first byte of all others is 0.
        head = self._heads[slot]
        blank = True
        whole = True
        for i in range(_HEAD):
            blank = blank and head[i] == 255
        for i in range(4):
            whole = whole and head[i] == _MAGIC[i]
        crc32_into(head, 0, _SUMMED, self._sum)
        if whole and _word(head, 14) == self._sum[0] and _word(head, 16) == self._sum[1]:
            if _word(head, 4) == self._record.LAYOUT and _word(head, 8) <= self._slot_bytes - NVM_PIECE:
                return
            self.kept |= NVM_FOREIGN
        elif not blank:
            self.kept |= NVM_DAMAGED
        head[0] = 0

    def _choose(self):
        # The newest that counts; what is said of the others has been said.
        old = self._heads[0]
        new = self._heads[1]
        self._slot = 1
        if not new[0] or old[0] and (_word(new, 6) - _word(old, 6) & 0xFFFF) > 32767:
            new = old
            self._slot = 0
        if new[0]:
            self._phase = _LOAD
            if not self._sequence:
                self._sequence = _word(new, 6)
            self._record.size = _word(new, 8)
            self._at = 0
            self._fits = True
            self.crc[0] = self.crc[1] = 65535
        else:
            self._slot = 1  # the first to be written is slot 0
            self._phase = _IDLE
            self.ready = True

    def _load(self, values):
        n = min(values[2], self._piece())
        self._add(values, 3, n)
        i = 0
        while i < n and self._fits:
            self._fits = self._record.put(self._at + i, values[3 + i])
            i += 1
        self._at += n
        if n and self._at < self._record.size:
            return
        head = self._heads[self._slot]
        whole = n > 0 and self.crc[0] ^ 65535 == _word(head, 10) and self.crc[1] ^ 65535 == _word(head, 12)
        if whole and self._fits:
            self._sequence = _word(head, 6)
            self._record.apply()
            self.kept |= NVM_KEPT | (NVM_EXPLORED if self._record.explored() else 0)
            self.found = self.ready = True
            self._phase = _IDLE
            return
        self.kept |= NVM_FOREIGN if whole else NVM_DAMAGED
        head[0] = 0
        self._record.drop()
        self._choose()

    def _seal(self):
        # The commit record of what was programmed.
        head = self._heads[self._slot]
        for i in range(4):
            head[i] = _MAGIC[i]
        _put_word(head, 4, self._record.LAYOUT)
        _put_word(head, 6, self._sequence + 1 & 0xFFFF)
        _put_word(head, 8, self._record.size)
        _put_word(head, 10, self.crc[0] ^ 65535)
        _put_word(head, 12, self.crc[1] ^ 65535)
        crc32_into(head, 0, _SUMMED, self._sum)
        _put_word(head, 14, self._sum[0])
        _put_word(head, 16, self._sum[1])

    def _piece(self):
        return min(NVM_PIECE, self._record.size - self._at)

    def _add(self, values, first, n):
        # n more bytes of the data, for its sum.
        low = self.crc[0]
        high = self.crc[1]
        for i in range(first, first + n):
            k = (low ^ values[i]) & 255
            low = (low >> 8 | (high & 255) << 8) ^ (T0[k] | T1[k] << 8)
            high = high >> 8 ^ (T2[k] | T3[k] << 8)
        self.crc[0] = low
        self.crc[1] = high

    def _tell(self, out):
        # The operation that is due; the same once more if nobody has answered it.
        phase = self._phase
        if not self._request and phase != _IDLE:
            self._number = self._number % 65535 + 1
            self._request = self._number
        out[0] = self._request
        out[1] = NVM_NOTHING
        out[2] = self.kept
        out[3] = self._slot * self._slot_bytes
        out[4] = _HEAD
        out[5] = 0
        if phase == _IDLE:
            out[3] = 0
            out[4] = _word(self._heads[self._slot], 8) if self.kept & NVM_KEPT else 0
        elif phase < _ERASE:
            out[1] = NVM_READ
            if phase == _LOAD:
                out[3] += NVM_PIECE + self._at
                out[4] = self._piece()
        elif phase == _ERASE:
            out[1] = NVM_ERASE
            out[3] += self._at
            out[4] = NVM_UNIT
        else:
            out[1] = NVM_PROGRAM
            if phase == _DATA:
                out[3] += NVM_PIECE + self._at
                out[4] = self._piece()
            out[5] = out[4]
            self._fill(out)
        return out[5]

    def _fill(self, out):
        n = out[5]
        if self._phase == _COMMIT:
            head = self._heads[self._slot]
            for i in range(n):
                out[6 + i] = head[i]
            return
        record = self._record
        at = self._at - 6
        for i in range(6, 6 + n):
            out[i] = record.byte(at + i)
        if self._summed == self._at:  # else it is told once more
            self._summed += n
            self._add(out, 6, n)


def _word(buf, i):
    return buf[i] | buf[i + 1] << 8


def _put_word(buf, i, value):
    buf[i] = value & 255
    buf[i + 1] = value >> 8
