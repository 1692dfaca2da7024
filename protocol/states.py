# The states of the core's mission, as STEP_RSP.state carries them.
# The diagram with every guard is docs/architecture.md.

BOOT = 0            # waiting for the host and its parameters
INIT = 1
FIND_WALL = 2
ALIGN = 3
FOLLOW = 4
CORNER_IN = 5       # barrier in front: convex point
CORNER_OUT = 6      # right-hand wall lost: concave point
CLOSE_CHECK = 7
SELECT = 8
GOTO = 9
FOLLOW_ISLAND = 10
SWEEP = 11
BUILD = 12
BUMP = 13
FAILED = 14         # ended without a closed outline; STATUS_RSP.reason says why
DONE = 15
STUCK = 16
LOST = 17           # set down elsewhere: UWB contradicts what dead reckoning says
SAVE = 18           # what is mapped goes into the non-volatile memory

NAMES = (
    "BOOT", "INIT", "FIND_WALL", "ALIGN", "FOLLOW", "CORNER_IN", "CORNER_OUT", "CLOSE_CHECK", "SELECT",
    "GOTO", "FOLLOW_ISLAND", "SWEEP", "BUILD", "BUMP", "FAILED", "DONE", "STUCK", "LOST", "SAVE",
)

# STATUS_RSP.degraded, bit by bit: the store that ran full, the sensor that cannot be believed, the map that is not kept
DEGRADED = ("vectors", "chains", "topology", "search", "encoder", "infrared", "ultrasonic", "uwb", "storage")

# STATUS_RSP.reason
REASON_NONE = 0
REASON_CLOSED = 1           # the outline closed on itself
REASON_NO_WALL = 2          # nothing to follow within reach
REASON_STORE_FULL = 3       # ended in good order with what fits
REASON_STUCK = 4            # boxed in, backing off did not help
REASON_TOO_LONG = 5         # path limit without a closed outline
REASON_LOST = 6             # set down elsewhere, and UWB does not tell where

REASONS = (
    "running", "outline closed", "no wall found within reach", "a store is full", "stuck: no way out found",
    "path limit reached without a closed outline", "set down elsewhere, and UWB does not tell where",
)
