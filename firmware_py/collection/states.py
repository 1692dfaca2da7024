# The states that the mission goes through, with the numbers of protocol/states.py.

INIT = 1
FIND_WALL = 2
ALIGN = 3
FOLLOW = 4
CORNER_IN = 5
CORNER_OUT = 6
CLOSE_CHECK = 7
SELECT = 8
GOTO = 9
SWEEP = 11
BUILD = 12
BUMP = 13
FAILED = 14
DONE = 15
STUCK = 16
LOST = 17
SAVE = 18

# and why it ended
REASON_CLOSED = 1
REASON_NO_WALL = 2
REASON_STORE_FULL = 3
REASON_STUCK = 4
REASON_TOO_LONG = 5
REASON_LOST = 6
