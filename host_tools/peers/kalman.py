"""Textbook Kalman filters over (x, y, heading) on the same sensor stream, by the library filterpy: extended and unscented.

Each UWB report updates with its ranges, between them the encoders predict. What errs by a fixed
field of the place is no independent noise: its variance is raised.
"""

import numpy as np

from host_tools.peers.dead_reckoning import dead_reckoning
from host_tools.peers.odometry_steps import events, pieces
from host_tools.peers.uwb_only import SOURCE_STRENGTH, ranges_m

RANGES_MAX = 6      # the strongest of a report
GATE = 4.0          # standard deviations
SHADOW_DB = 1.0     # a model at least so wide means shadowing, which stays the same from report to report ...
SHADOW = 30.0       # ... for about that many of them, and that walls are on the way of all but the strongest
STRONG_CDB = -6400  # the range at which a clear path is that weak is 10 m


def extended(mission, rows):
    """(len(rows), 2) positions. Raises ImportError without filterpy."""
    from filterpy.kalman import ExtendedKalmanFilter

    class Filter(ExtendedKalmanFilter):
        def predict_x(self, u=0):
            self.x = move(self.x, u)

    kalman = Filter(3, RANGES_MAX)
    return _run(mission, rows, kalman, _extended_predict, _extended_update)


def unscented(mission, rows):
    """(len(rows), 2) positions. Raises ImportError without filterpy."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    kalman = UnscentedKalmanFilter(3, RANGES_MAX, 1.0, hx=distances, fx=_unscented_move, points=MerweScaledSigmaPoints(3, 0.5, 2.0, 0.0))
    return _run(mission, rows, kalman, _unscented_predict, _unscented_update)


def move(pose, moved):
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return np.array([pose[0] + cos * moved[0] - sin * moved[1], pose[1] + sin * moved[0] + cos * moved[1], pose[2] + moved[2]])


def distances(pose, places):
    return np.sqrt((places[:, 0] - pose[0]) ** 2 + (places[:, 1] - pose[1]) ** 2 + places[:, 2] ** 2)


def usable(mission):
    """(slant range, variance, place of the transmitter) by report and record; infinite variance where it must not be used."""
    model = mission.uwb_model
    slant, deviation = ranges_m(mission.uwb_strength_cdb, mission.uwb_range_mm, model)
    known = (mission.uwb_anchor >= 0) & (mission.uwb_anchor < len(mission.anchors))
    shadowed = model["source"] == SOURCE_STRENGTH and model["sigma_db"] >= SHADOW_DB
    if shadowed:
        known &= mission.uwb_strength_cdb >= STRONG_CDB
    variance = np.where(known, deviation ** 2, np.inf) * (SHADOW if shadowed else 1.0)
    return slant, variance, mission.anchors[np.where(known, mission.uwb_anchor, 0)] if len(mission.anchors) else None


def _run(mission, rows, kalman, predict, update):
    local = dead_reckoning(mission.left, mission.right, mission.geometry, mission.dock)
    every, report = events(mission, rows)
    moved, deviation = pieces(local, every)
    slant, variance, places = usable(mission)
    kalman.x, kalman.P = local[0].copy(), np.diag([1e-4, 1e-4, 1e-4])
    at = np.zeros((len(every), 2))
    for i, number in enumerate(report):
        if i:
            predict(kalman, moved[i - 1], deviation[i - 1])
        if number >= 0:
            good = np.flatnonzero(np.isfinite(variance[number]))[:RANGES_MAX]
            # A path through several walls is longer than its model says: what does not fit is left out.
            innovation = slant[number, good] - distances(kalman.x, places[number, good])
            expected = variance[number, good] + kalman.P[0, 0] + kalman.P[1, 1]
            good = good[innovation ** 2 <= GATE ** 2 * expected]
            if len(good):
                update(kalman, slant[number, good], variance[number, good], places[number, good])
        at[i] = kalman.x[:2]
    return at[np.searchsorted(every, rows)]


def _extended_predict(kalman, moved, deviation):
    cos, sin = np.cos(kalman.x[2]), np.sin(kalman.x[2])
    kalman.F = np.array([[1, 0, -sin * moved[0] - cos * moved[1]], [0, 1, cos * moved[0] - sin * moved[1]], [0, 0, 1]])
    kalman.Q = _noise(cos, sin, deviation)
    kalman.predict(moved)


def _extended_update(kalman, slant, variance, places):
    def slopes(pose):
        away = pose[:2] - places[:, :2]
        return np.column_stack([away / distances(pose, places)[:, None], np.zeros(len(places))])

    kalman.update(slant, slopes, lambda pose: distances(pose, places), R=np.diag(variance))


def _unscented_move(pose, dt, moved):
    return move(pose, moved)


def _unscented_predict(kalman, moved, deviation):
    kalman.Q = _noise(np.cos(kalman.x[2]), np.sin(kalman.x[2]), deviation)
    kalman.predict(moved=moved)


def _unscented_update(kalman, slant, variance, places):
    kalman.update(slant, R=np.diag(variance), places=places)


def _noise(cos, sin, deviation):
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    return turn @ np.diag(deviation ** 2) @ turn.T
