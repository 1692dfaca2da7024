"""All ranges and encoder steps of a mission solved at once, by the library gtsam: what no filter that looks back only can beat."""

import numpy as np

from host_tools.peers.dead_reckoning import dead_reckoning
from host_tools.peers.kalman import usable
from host_tools.peers.odometry_steps import events, pieces

LEVEL_MIN_M = 0.5   # nearer below a transmitter a slant range says little of the place
HUBER, TUKEY = 1.345, 4.685  # standard deviations of such a mean
RANGES_MAX = 8      # of a report: weaker ones add little
TOGETHER = 5        # reports, half a second of them, that make one pose: far faster than one by one, and as good to 1 mm
DOCK = (0.01, 0.01, 0.01)


def optimum(mission, rows, guess=None):
    """(len(rows), 2) positions. Raises ImportError without gtsam.

    `guess`: positions at events(mission, rows) to start from, dead reckoning where there are none.
    """
    import gtsam

    local = dead_reckoning(mission.left, mission.right, mission.geometry, mission.dock)
    every, report = events(mission, rows)
    near = local[every, :2] if guess is None else guess
    kept = np.flatnonzero(np.isin(every, rows) | (np.arange(len(every)) % TOGETHER == 0))
    ranges = _gathered(mission, report, near, kept)
    every = every[kept]
    moved, deviation = pieces(local, every)
    poses = gtsam.Values()
    for i, (x, y) in enumerate(near[kept]):
        poses.insert(i, gtsam.Pose2(x, y, local[every[i], 2]))
    estimators = gtsam.noiseModel.mEstimator
    # Tukey leaves out what came through walls, but finds the way from near by only.
    losses = [estimators.Tukey.Create(TUKEY)] if guess is not None else [estimators.Huber.Create(HUBER), estimators.Tukey.Create(TUKEY)]
    for loss in losses:
        graph = _odometry(gtsam, local[0], moved, deviation)
        _add_anchors(gtsam, graph, poses, mission.anchors, len(every))
        _add_ranges(gtsam, graph, ranges, len(every), loss)
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


def _gathered(mission, report, near, kept):
    """[(pose, anchor, level range, deviation)]: of each transmitter the mean of what was heard since the pose before, each range
    taken along to the pose by how much nearer or farther `near` says that the robot has come."""
    slant, variance, places = usable(mission)
    known = np.flatnonzero(report >= 0)
    i, j = np.nonzero(np.isfinite(variance[report[known], :RANGES_MAX]))
    event, number = known[i], report[known[i]]
    place, height = places[number, j, :2], places[number, j, 2]
    pose = np.searchsorted(kept, event)
    event, number, j, place, height, pose = (each[pose < len(kept)] for each in (event, number, j, place, height, pose))
    level = np.sqrt(np.maximum(slant[number, j] ** 2 - height ** 2, 0))
    good = level >= LEVEL_MIN_M
    event, number, j, place, pose, level = (each[good] for each in (event, number, j, place, pose, level))
    weight = (level / slant[number, j]) ** 2 / variance[number, j]
    level = level + _distance(near[kept[pose]], place) - _distance(near[event], place)
    pair, of = np.unique(np.column_stack([pose, mission.uwb_anchor[number, j]]), axis=0, return_inverse=True)
    total = np.bincount(of.ravel(), weight)
    mean = np.bincount(of.ravel(), weight * level) / total
    return [(int(a), int(b), float(c), float(d)) for (a, b), c, d in zip(pair, mean, total ** -0.5) if c > 0]


def _distance(a, b):
    return np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1])


def _add_ranges(gtsam, graph, ranges, first_anchor, loss):
    robust, isotropic = gtsam.noiseModel.Robust.Create, gtsam.noiseModel.Isotropic.Sigma
    for pose, anchor, level, sigma in ranges:
        graph.add(gtsam.RangeFactor2D(pose, first_anchor + anchor, level, robust(loss, isotropic(1, sigma))))
