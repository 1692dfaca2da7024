"""All ranges and encoder steps of a mission solved at once, by the library gtsam: what no filter that looks back only can beat."""

import numpy as np

from host_tools.peers.dead_reckoning import dead_reckoning
from host_tools.peers.kalman import extended, usable
from host_tools.peers.odometry_steps import events, pieces

LEVEL_MIN_M = 0.5   # nearer below a transmitter a slant range says little of the place
HUBER = 1.345
DOCK = (0.01, 0.01, 0.01)


def optimum(mission, rows):
    """(len(rows), 2) positions. Raises ImportError without gtsam, or without filterpy, whose track it starts from."""
    import gtsam

    local = dead_reckoning(mission.left, mission.right, mission.geometry, mission.dock)
    every, report = events(mission, rows)
    moved, deviation = pieces(local, every)
    graph, first = gtsam.NonlinearFactorGraph(), gtsam.Values()
    sigmas = gtsam.noiseModel.Diagonal.Sigmas
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*local[0]), sigmas(np.array(DOCK))))
    _add_anchors(gtsam, graph, first, mission.anchors, len(every))
    for i, (step, sure) in enumerate(zip(moved, deviation)):
        graph.add(gtsam.BetweenFactorPose2(i, i + 1, gtsam.Pose2(*step), sigmas(sure)))
    _add_ranges(gtsam, graph, mission, report)
    guess = extended(mission, every)
    for i, (x, y) in enumerate(guess):
        first.insert(i, gtsam.Pose2(x, y, local[every[i], 2]))
    solved = gtsam.LevenbergMarquardtOptimizer(graph, first).optimize()
    poses = [solved.atPose2(int(i)) for i in np.searchsorted(every, rows)]
    return np.array([(pose.x(), pose.y()) for pose in poses])


def _add_anchors(gtsam, graph, first, anchors, key):
    """Where the transmitters are is known: points that may not move."""
    fixed = gtsam.noiseModel.Isotropic.Sigma(2, 1e-4)
    for i, (x, y, _) in enumerate(anchors):
        graph.add(gtsam.PriorFactorPoint2(key + i, np.array([x, y]), fixed))
        first.insert(key + i, np.array([x, y]))


def _add_ranges(gtsam, graph, mission, report):
    slant, variance, places = usable(mission)
    robust = gtsam.noiseModel.Robust.Create
    huber = gtsam.noiseModel.mEstimator.Huber.Create(HUBER)
    for i, number in enumerate(report):
        if number < 0:
            continue
        for j in np.flatnonzero(np.isfinite(variance[number])):
            level = slant[number, j] ** 2 - places[number, j, 2] ** 2
            if level < LEVEL_MIN_M ** 2:
                continue
            level = float(np.sqrt(level))
            sigma = float(np.sqrt(variance[number, j])) * slant[number, j] / level
            noise = robust(huber, gtsam.noiseModel.Isotropic.Sigma(1, sigma))
            graph.add(gtsam.RangeFactor2D(i, len(report) + int(mission.uwb_anchor[number, j]), level, noise))
