"""Dead reckoning cut into pieces: how far the robot went between two rows, in its own frame, and how sure that is."""

import numpy as np

ALONG_M = 0.010      # standard deviations after one metre, growing with the root of the way
ACROSS_M = 0.005
HEADING_RAD = 0.006
TURN_RAD = 0.010     # after a turn of one radian, likewise
FLOOR = 1e-5


def pieces(local, rows):
    """((n, 3) forward, left, turn from each row to the next; (n, 3) standard deviations of each)."""
    poses = local[rows]
    step = np.diff(poses, axis=0)
    cos, sin = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
    moved = np.column_stack([cos * step[:, 0] + sin * step[:, 1], cos * step[:, 1] - sin * step[:, 0], step[:, 2]])
    way, turn = np.sqrt(np.hypot(step[:, 0], step[:, 1])), np.sqrt(np.abs(step[:, 2]))
    return moved, np.column_stack([ALONG_M * way, ACROSS_M * way, np.hypot(HEADING_RAD * way, TURN_RAD * turn)]) + FLOOR


def events(mission, rows):
    """Rows at which something is known or asked, ascending: (rows, report of each or -1)."""
    every = np.unique(np.concatenate([[0], mission.uwb_row, rows]))
    report = np.searchsorted(mission.uwb_row, every)
    here = np.minimum(report, max(len(mission.uwb_row) - 1, 0))
    known = mission.uwb_row[here] == every if len(mission.uwb_row) else np.zeros(len(every), bool)
    return every, np.where(known, here, -1)
