"""The other methods on the same stream: filters, the batch optimum, the occupancy grid."""

import builtins
import math

import numpy as np
import pytest

from host_tools.mission_log import read_mission
from host_tools.peers import batch, kalman, occupancy
from host_tools.result import stops
from host_tools.score import HomeTruth
from sim_device.home import Home
from tests.host_tools.synthetic_mission import SyntheticMission

SQUARE = Home("square", ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), (), (), (1.0, 1.0), "")


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    return read_mission(*SyntheticMission(source=1).finish().save(tmp_path_factory.mktemp("mission")))


@pytest.mark.parametrize("track, library", [(kalman.extended, "filterpy"), (kalman.unscented, "filterpy"), (batch.optimum, "gtsam")])
def test_a_method_finds_the_way(mission, track, library):
    pytest.importorskip(library)
    rows, _, actual = stops(mission, 1)
    away = track(mission, rows) - actual
    assert np.hypot(away[:, 0], away[:, 1]).max() < 0.03


@pytest.mark.parametrize("track, library", [(kalman.extended, "filterpy"), (kalman.unscented, "filterpy"), (batch.optimum, "gtsam")])
def test_without_its_library_it_says_so(mission, track, library, monkeypatch):
    found = builtins.__import__

    def without(name, *rest, **more):
        if name.split(".")[0] == library:
            raise ImportError(name=library)
        return found(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError):
        track(mission, np.array([0]))


class Seen:
    """A robot in the square's middle that turns once: every beam's reading is that of a wall 20 cm from its sensor, or of none."""

    def __init__(self, wall_mm):
        count = 72
        self.step = np.arange(count)
        self.pose = np.zeros((count, 10))
        self.pose[:, 0], self.pose[:, 1:3] = self.step, (2.0, 1.5)
        self.pose[:, 3] = np.arange(count) * 2 * math.pi / count
        counts = np.interp(wall_mm, occupancy.CURVE_MM, occupancy.CURVE_COUNTS)
        self.ir = np.full((count, 8), round(float(counts)))

    def parameter(self, name, index=0):
        return {"ir_radius": 120, "ir_bearing": index * 8192}[name]


def test_the_grid_holds_what_the_beams_hit_and_frees_what_they_passed():
    grid = occupancy.built(Seen(200), SQUARE.free.bounds)
    cells = grid.occupied()
    away = np.hypot(cells[:, 0] - 2.0, cells[:, 1] - 1.5)
    assert len(cells) > 20 and (abs(away - 0.32) < 0.06).all()
    assert grid.bytes == 80 * 60 and (grid.log_odds < 0).sum() > 20
    assert not len(occupancy.built(Seen(400), SQUARE.free.bounds).occupied())


def test_the_grid_is_scored_as_the_vectors_are():
    truth = HomeTruth(SQUARE)
    grid = occupancy.Grid(SQUARE.free.bounds)
    assert occupancy.scores(grid, truth) == {"bytes": 4800, "precision_5cm": None, "recall_5cm": None}
    along = np.arange(0.01, 4.0, 0.02)
    for _ in range(3):
        grid.add(np.column_stack([along, np.full(len(along), 0.01)]), occupancy.HIT)  # the wall at y = 0
    figures = occupancy.scores(grid, truth)
    assert figures["precision_5cm"] == 1.0 and figures["recall_5cm"] == pytest.approx(4 / 14, abs=0.02)


def test_the_full_sweep_is_at_least_the_floor_by_the_lanes_width():
    truth = HomeTruth(SQUARE)
    lanes_s = truth.centres.area / occupancy.LANE_M / 0.3
    assert lanes_s * 0.9 < occupancy.sweep_s(truth, 0.3, 2.0) < lanes_s * 1.4
    assert occupancy.sweep_s(truth, 0.3, 1.0) > occupancy.sweep_s(truth, 0.3, 2.0) > occupancy.sweep_s(truth, 0.6, 2.0)
