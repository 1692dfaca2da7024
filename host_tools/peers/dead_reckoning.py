"""The encoders alone, with the nominal geometry: Paper eq. 1 and 2 with the midpoint heading."""

import numpy as np


def dead_reckoning(left, right, geometry, dock):
    """Poses (n, 3) x_m, y_m, heading_rad after each step, from pulses per step.

    `geometry` is (wheel_diameter_m, track_m, pulses_per_turn), `dock` the pose before the first step.
    """
    diameter, track, pulses = geometry
    metres = np.pi * diameter / pulses
    left, right = np.asarray(left, float) * metres, np.asarray(right, float) * metres
    turn = (right - left) / track
    heading = dock[2] + np.cumsum(turn)
    middle = heading - turn / 2
    forward = (left + right) / 2
    return np.column_stack([dock[0] + np.cumsum(forward * np.cos(middle)),
                            dock[1] + np.cumsum(forward * np.sin(middle)), heading])
