# The 256 states of Paper Table 1, recomputed from the rule in words.

from array import array

import pytest

from firmware_py.collection.ir_state import (
    ENCLOSED, ENCLOSED_TURN, FREE, FRONT, KEEP, LEFT, REAR, RIGHT, STATES, TURN_LEFT, TURN_RIGHT, IrState,
)  # fmt: skip

NEAR, FAR, THRESHOLD = 100, 999, 160


def entry(i1, i2, i3, i4, i5, i6, i7, i8):
    front, right, left, rear = i1 or i3, i4 or i5 or i6, i2, i8
    sides = FRONT * front | RIGHT * right | LEFT * left | REAR * rear
    if front and right and left and rear:
        return sides | ENCLOSED | ENCLOSED_TURN << 5
    action = TURN_LEFT if front else KEEP if right else TURN_RIGHT if i7 else FREE
    return sides | action << 5


def signals(state):
    return [state >> (7 - j) & 1 for j in range(8)]


def test_the_table_is_what_the_rule_makes():
    assert STATES == bytes(entry(*signals(state)) for state in range(256))


@pytest.mark.parametrize("rows, state", [
    ("00000000", 1), ("00000001", 2), ("00000010", 3), ("00000011", 4), ("00000100", 5), ("11111111", 256),
])  # fmt: skip
def test_the_numbers_of_the_papers_table_1(rows, state):
    ir = IrState()
    ir.threshold_mm = THRESHOLD
    ir.update(array("h", [NEAR if bit == "1" else FAR for bit in rows]))
    assert ir.state + 1 == state


def test_an_action_stands_three_ticks_before_it_counts():
    ir = IrState()
    ir.threshold_mm = THRESHOLD
    wall = array("h", [NEAR] + [FAR] * 7)
    nothing = array("h", [FAR] * 8)
    for seen, action in [(wall, FREE), (wall, FREE), (wall, TURN_LEFT), (nothing, TURN_LEFT), (wall, TURN_LEFT), (nothing, TURN_LEFT),
                         (nothing, TURN_LEFT), (nothing, FREE)]:  # fmt: skip
        ir.update(seen)
        assert ir.action == action
