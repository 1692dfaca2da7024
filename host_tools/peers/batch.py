"""All ranges and encoder steps of a mission solved at once, by the library gtsam: what no filter that looks back only can beat."""

import numpy as np

from host_tools.peers.dead_reckoning import dead_reckoning
from host_tools.peers.kalman import usable
from host_tools.peers.odometry_steps import events, pieces

LEVEL_MIN_M = 0.5   # nearer below a transmitter a slant range says little of the place
HUBER, TUKEY = 1.345, 4.685
RANGES_MAX = 8      # of a report: weaker ones add little
DOCK = (0.01, 0.01, 0.01)


def optimum(mission, rows, guess=None):
    """(len(rows), 2) positions. Raises ImportError without gtsam.

    `guess`: positions at events(mission, rows) to start from, dead reckoning where there are none.
    """
    import gtsam

    local = dead_reckoning(mission.left, mission.right, mission.geometry, mission.dock)
    every, report = events(mission, rows)
    moved, deviation = pieces(local, every)
    poses = gtsam.Values()
    for i, (x, y) in enumerate(local[every, :2] if guess is None else guess):
        poses.insert(i, gtsam.Pose2(x, y, local[every[i], 2]))
    estimators = gtsam.noiseModel.mEstimator
    # Tukey leaves out what came through walls, but finds the way from near by only.
    losses = [estimators.Tukey.Create(TUKEY)] if guess is not None else [estimators.Huber.Create(HUBER), estimators.Tukey.Create(TUKEY)]
    for loss in losses:
        graph = _odometry(gtsam, local[0], moved, deviation)
        _add_anchors(gtsam, graph, poses, mission.anchors, len(every))
        _add_ranges(gtsam, graph, mission, report, loss)
        poses = gtsam.LevenbergMarquardtOptimizer(graph, poses).optimize()
    solved = [poses.atPose2(int(i)) for i in np.searchsorted(every, rows)]
    return np.array([(pose.x(), pose.y()) for pose in solved])


def _odometry(gtsam, dock, moved, deviation):
    """The graph with the dock and the steps of the wheels."""
    graph, sigmas = gtsam.NonlinearFactorGraph(), gtsam.noiseModel.Diagonal.Sigmas
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*dock), sigmas(np.array(DOCK))))
    for i, (step, sure) in enumerate(zip(moved, deviation)):
        graph.add(gtsam.BetweenFactorPose2(i, i + 1, gtsam.Pose2(*step), sigmas(sure)))
    return graph


def _add_anchors(gtsam, graph, poses, anchors, key):
    """Where the transmitters are is known: points that may not move."""
    fixed = gtsam.noiseModel.Isotropic.Sigma(2, 1e-4)
    for i, (x, y, _) in enumerate(anchors):
        graph.add(gtsam.PriorFactorPoint2(key + i, np.array([x, y]), fixed))
        if not poses.exists(key + i):
            poses.insert(key + i, np.array([x, y]))


def _add_ranges(gtsam, graph, mission, report, loss):
    slant, variance, places = usable(mission)
    robust = gtsam.noiseModel.Robust.Create
    for i, number in enumerate(report):
        if number < 0:
            continue
        for j in np.flatnonzero(np.isfinite(variance[number]))[:RANGES_MAX]:
            level = slant[number, j] ** 2 - places[number, j, 2] ** 2
            if level < LEVEL_MIN_M ** 2:
                continue
            level = float(np.sqrt(level))
            sigma = float(np.sqrt(variance[number, j])) * slant[number, j] / level
            noise = robust(loss, gtsam.noiseModel.Isotropic.Sigma(1, sigma))
            graph.add(gtsam.RangeFactor2D(i, len(report) + int(mission.uwb_anchor[number, j]), level, noise))
