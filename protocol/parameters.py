# Every parameter that the core takes over the link, declared once.
#
#   (name, unit, count, minimum, maximum, default)      the id is the position in this table
#
# A parameter of count n is an array of n integers. All are set before the first
# STEP; from then on they are locked, so that a log replays to the same hash.

ANCHORS_MAX = 32

PARAMETERS = (
    ("dock_x", "um", 1, -500000000, 500000000, 0),
    ("dock_y", "um", 1, -500000000, 500000000, 0),
    ("dock_heading", "BAM", 1, 0, 65535, 0),
    ("wheel_diameter", "um", 1, 20000, 200000, 72000),
    ("track", "um", 1, 80000, 600000, 235000),
    ("pulses_per_turn", "pulse", 1, 64, 4096, 508),
    ("body_radius", "mm", 1, 60, 300, 170),
    ("ir_radius", "mm", 1, 0, 300, 120),
    ("ir_bearing", "BAM", 8, -32768, 32767, 0),
    ("speed_max", "mm/s", 1, 50, 1000, 300),
    ("turn_max", "mrad/s", 1, 200, 6000, 2000),
    ("wall_gap", "mm", 1, 10, 60, 30),
    ("ir_threshold", "mm", 1, 60, 280, 160),
    ("uwb_source", "", 1, 0, 2, 0),                # 0 none, 1 signal strength (Paper eq. 3), 2 time of flight
    ("uwb_level_1m", "cdB", 1, -12000, 0, -4700),  # PL_1: received level at 1 m
    ("uwb_gamma", "1/1000", 1, 1000, 6000, 1700),
    ("uwb_sigma", "cdB", 1, 0, 2000, 10),
    ("uwb_level_min", "cdB", 1, -20000, 0, -9000),
    ("fix_distance", "mm", 1, 0, 2000, 8),         # replacement rule: position deviation
    ("fix_angle", "BAM", 1, 0, 16384, 40),         # replacement rule: heading deviation
    ("anchor_count", "", 1, 0, ANCHORS_MAX, 0),
    ("anchor_x", "mm", ANCHORS_MAX, -500000, 500000, 0),
    ("anchor_y", "mm", ANCHORS_MAX, -500000, 500000, 0),
    ("anchor_height", "mm", ANCHORS_MAX, 0, 10000, 2300),  # above the receiver
    ("mode", "", 1, 0, 1, 0),                      # 0 improved, 1 paper
    ("flags", "bits", 1, 0, 65535, 0x1FBF),         # improvements switched on: bit i is FLAGS[i]
    ("tick_ms", "ms", 1, 0, 100, 0),               # free run: a STEP waits for this grid of the core's clock; 0 lockstep
    ("nvm_bytes", "B", 1, 0, 1048576, 0),          # non-volatile memory at the robot's end; 0: none, and nothing is kept
)

# Improvements over the paper, each with a switch of its own: (name, on by default, what it does).
# Mode `paper` switches all of them off. Bit i of parameter `flags`.
FLAGS = (
    ("midpoint_heading", 1, "integrate along the heading in the middle of a tick, not at its end (eq. 1)"),
    ("wall_offset", 1, "map where the side beam hits, not where the robot's centre was (eq. 5)"),
    ("corner_intersection", 1, "intersect neighbouring lines instead of joining their ends"),
    ("closure_spread", 1, "spread the closure error along the outline"),
    ("distance_fixes", 1, "also take a fix each 1.5 m between turning points"),
    ("weighted_fixes", 1, "weigh a fix against dead reckoning by the accuracy of both, instead of replacing outright"),
    ("eq1_literal", 0, "heading rate as eq. 1 prints it, 2 (v_r - v_l) / W: it doubles the heading"),
    ("filter", 1, "an extended Kalman filter of position and heading in place of the replacement rule"),
    ("self_calibration", 1, "the filter also learns unequal wheels and the true track, and calibrates dead reckoning"),
    ("manhattan", 1, "the filter takes the heading from walls that stand square to each other, where a vote finds such"),
    ("landmarks", 1, "the filter takes walls of the outline that are met again, where fixes do not bound the error"),
    ("transmitter_gamma", 1, "where shadowing is a field of the place, learn gamma of each transmitter (eq. 3)"),
    ("kidnap", 1, "notice by UWB that the robot was set down elsewhere, find its place there, and go on (with flag filter)"),
)
