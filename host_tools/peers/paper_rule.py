"""The paper's own combination: dead reckoning, replaced by the UWB fix at turning points (Paper section 2).

At each turning point the fix replaces the position if they differ by more than a threshold. A
range-only receiver sees no heading: the direction between the last two fixes is compared with the
direction of the local path between the same two places, if they lie over 0.5 m apart.
"""

import math

import numpy as np

CHORD_MIN_M = 0.5


def paper_rule(local, turns, fixes, thresholds, dock):
    """Corrected poses (n, 3) at every step.

    `local` are the dead-reckoned poses (n, 3); `turns` row numbers of turning points, ascending;
    `fixes` (len(turns), 2) the UWB position at each, NaN if none; `thresholds` (metres, radians).
    """
    if not len(local):
        return np.zeros((0, 3))
    out, begin = np.array(local, float), 0
    correction = (0.0, dock[0], dock[1], dock[0], dock[1])  # rotation about, and from: local place -> global place
    last = None
    for row, fix in zip(turns, np.asarray(fixes, float).reshape(-1, 2)):
        out[begin:row] = _apply(correction, local[begin:row])
        begin = row
        if not np.isfinite(fix).all():
            continue
        here = local[row]
        x, y, _ = _apply(correction, local[row:row + 1])[0]
        rotation = correction[0]
        if last is not None:
            rotation = _new_rotation(rotation, last, (here, fix), thresholds[1])
        if math.hypot(fix[0] - x, fix[1] - y) > thresholds[0]:
            x, y = fix
        correction = (rotation, here[0], here[1], x, y)
        last = (here, fix)
    out[begin:] = _apply(correction, local[begin:])
    return out


def _new_rotation(rotation, last, now, threshold_rad):
    (local_a, fix_a), (local_b, fix_b) = last, now
    if math.hypot(fix_b[0] - fix_a[0], fix_b[1] - fix_a[1]) <= CHORD_MIN_M:
        return rotation
    if math.hypot(local_b[0] - local_a[0], local_b[1] - local_a[1]) <= CHORD_MIN_M:
        return rotation
    seen = math.atan2(fix_b[1] - fix_a[1], fix_b[0] - fix_a[0])
    believed = math.atan2(local_b[1] - local_a[1], local_b[0] - local_a[0])
    change = math.remainder(seen - believed - rotation, 2 * math.pi)
    return rotation + change if abs(change) > threshold_rad else rotation


def _apply(correction, poses):
    rotation, from_x, from_y, to_x, to_y = correction
    dx, dy = poses[:, 0] - from_x, poses[:, 1] - from_y
    cos, sin = math.cos(rotation), math.sin(rotation)
    return np.column_stack([to_x + cos * dx - sin * dy, to_y + sin * dx + cos * dy, poses[:, 2] + rotation])
