# A CAN frame as SLCAN's text has it: parsed, ranked for the arbitration, and how long it keeps the bus.

import re
from dataclasses import dataclass
from functools import lru_cache

NOMINAL_BIT_S = 1 / 500_000
DATA_BIT_S = 1 / 2_000_000      # of frames that switch the rate
LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)  # by DLC

# letter: extended id, CAN FD, switches the rate, remote
KINDS = {b"t": (0, 0, 0, 0), b"T": (1, 0, 0, 0), b"r": (0, 0, 0, 1), b"R": (1, 0, 0, 1),
         b"d": (0, 1, 0, 0), b"D": (1, 1, 0, 0), b"b": (0, 1, 1, 0), b"B": (1, 1, 1, 0)}
_HEX = rb"[0-9A-Fa-f]"     # of a letter the case tells how long the id is, of a digit it does not matter
_LINE = re.compile(rb"(?:([trdb])([0-7]%(x)b{2})|([TRDB])([01]%(x)b{7}))(%(x)b)((?:%(x)b{2})*)" % {b"x": _HEX})


# `line` is the text without its end; `rank`: the lowest wins the bus; `bus_s`: for how long it keeps it.
@dataclass(frozen=True, slots=True)
class CanFrame:
    line: bytes
    rank: int
    bus_s: float

    def candump(self):
        """As `candump -L` writes it: id#data, of CAN FD id##flags data."""
        letter = self.line[:1]
        extended, fd, fast, remote = KINDS[letter]
        text = self.line.decode().upper()
        size = 9 if extended else 4
        can_id, data = text[1:size], text[size + 1:]
        if remote:
            return "%s#R" % can_id
        return "%s##%d%s" % (can_id, fast, data) if fd else "%s#%s" % (can_id, data)


def parse(line):
    """The frame of that line, None if it is none."""
    match = _LINE.fullmatch(line)
    if match is None:
        return None
    short, short_id, long, long_id, dlc, data = match.groups()
    letter = line[:1]
    extended, fd, fast, remote = KINDS[letter]
    dlc = int(dlc, 16)
    size = LENGTHS[dlc]
    if dlc > 8 and not fd or len(data) != (0 if remote else 2 * size):
        return None
    can_id = int(long_id if extended else short_id, 16)
    # Bit by bit on the bus: of two with the same 11 bits in front, the one of 11 bits wins.
    rank = (can_id >> 18) << 19 | 1 << 18 | can_id & 0x3FFFF if extended else can_id << 19
    return CanFrame(line, rank, bus_s(0 if remote else size, extended, fd, fast))


@lru_cache(maxsize=None)
def bus_s(size, extended, fd, fast):
    """The longest that a frame of so many bytes keeps the bus: with every stuff bit that there can be."""
    if not fd:
        stuffed = (54 if extended else 34) + 8 * size       # SOF to CRC
        return (stuffed + (stuffed - 1) // 4 + 13) * NOMINAL_BIT_S
    nominal = 36 if extended else 17                        # SOF to BRS
    data = 5 + 8 * size                                     # ESI, DLC, data
    crc = 21 if size > 16 else 17
    fixed = 4 + crc + (4 + crc) // 4 + 1                    # stuff count and CRC, with their fixed stuff bits
    slow = nominal + (nominal - 1) // 4 + 13
    return slow * NOMINAL_BIT_S + (data + data // 4 + fixed) * (DATA_BIT_S if fast else NOMINAL_BIT_S)
