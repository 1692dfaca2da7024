# The 256 states of the eight infrared sensors (Paper Table 1, eq. 4) as one table.

# Bits of an entry: where the barriers are ...
FRONT = 1       # I1 (0 deg) or I3 (-18)
RIGHT = 2       # I4 (-40), I5 (-65) or I6 (-90)
LEFT = 4        # I2 (+60)
REAR = 8        # I8 (180)
ENCLOSED = 16   # all four
# ... and, from bit 5 up, what the table asks for.
FREE = 0        # nothing near
KEEP = 1        # wall on the right only: follow it
TURN_LEFT = 2   # barrier in front: convex corner
TURN_RIGHT = 3  # right-hand wall just passed (only I7, -120 deg, sees it): concave corner
ENCLOSED_TURN = 4

_HYSTERESIS_TICKS = const(3)

# Entry S - 1 belongs to state S; tests/firmware_py/test_ir_state.py recomputes it from the rule above.
STATES = (
    b"\x00\x08\x60\x68\x22\x2a\x22\x2a\x22\x2a\x22\x2a\x22\x2a\x22\x2a"
    b"\x22\x2a\x22\x2a\x22\x2a\x22\x2a\x22\x2a\x22\x2a\x22\x2a\x22\x2a"
    b"\x41\x49\x41\x49\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b"
    b"\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b"
    b"\x04\x0c\x64\x6c\x26\x2e\x26\x2e\x26\x2e\x26\x2e\x26\x2e\x26\x2e"
    b"\x26\x2e\x26\x2e\x26\x2e\x26\x2e\x26\x2e\x26\x2e\x26\x2e\x26\x2e"
    b"\x45\x4d\x45\x4d\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f"
    b"\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f"
    b"\x41\x49\x41\x49\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b"
    b"\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b"
    b"\x41\x49\x41\x49\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b"
    b"\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b\x43\x4b"
    b"\x45\x4d\x45\x4d\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f"
    b"\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f"
    b"\x45\x4d\x45\x4d\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f"
    b"\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f\x47\x9f"
)


class IrState:
    # state: 0..255, that is S - 1 of Paper eq. 4 read as Table 1 fixes it:
    # S = 1 + sum(I_j 2^(8-j)), I_8 the least significant bit.
    # action, sides: of the table, taken over once they stood for three ticks.

    def __init__(self):
        self.state = 0
        self.action = FREE
        self.sides = 0
        self.threshold_mm = 160
        self._pending = 0
        self._ticks = 0

    def update(self, ranges_mm):
        state = 0
        threshold_mm = self.threshold_mm
        for mm in ranges_mm:
            state <<= 1
            if mm < threshold_mm:
                state |= 1
        self.state = state
        entry = STATES[state]
        if entry != self._pending:
            self._pending = entry
            self._ticks = 1
        elif self._ticks < _HYSTERESIS_TICKS:
            self._ticks += 1
        if self._ticks == _HYSTERESIS_TICKS:
            self.action = entry >> 5
            self.sides = entry & 31
