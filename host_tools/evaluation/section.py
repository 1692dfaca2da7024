"""One figure or table of the evaluation: its numbers, its lines of markdown, its picture; and the plan of runs they come from."""

import os
import warnings
from dataclasses import dataclass, field

from host_tools.evaluation.run import HOUR_S, MAX_ROBOT_S, Run, ended_well

# (uwb, odometry); the first is the paper's own premise.
PRESETS = (("paper", "calibrated"), ("tof", "poor"), ("rssi_real", "poor"))
BESIDE = 10    # one run of another mode or preset for so many main ones
NINE = 9       # runs of Fig. 6
METHODS = {"estimate": "this core", "paper_rule": "paper's rule", "ekf": "EKF (filterpy)", "ukf": "UKF (filterpy)",
           "batch": "batch optimum (gtsam)", "uwb_only": "UWB alone", "dead_reckoning": "dead reckoning"}


# What is run: `home` the path of the home file, `seeds` of the main runs.
@dataclass(frozen=True)
class Plan:
    home: str
    seeds: tuple
    folder: str = ""

    def main(self):
        """The main runs, by seed: the first to its end, its repetitions for an hour."""
        return [Run(self.home, seed=seed, peers=i < NINE, max_robot_s=HOUR_S if i else MAX_ROBOT_S) for i, seed in enumerate(self.seeds)]

    def beside(self, mode="improved", preset=PRESETS[0]):
        """Runs of another mode or preset. Mode paper drives the same way: its peers would tell the same once more, but its map is told."""
        few, improved = max(1, len(self.seeds) // BESIDE), mode == "improved"
        return [Run(self.home, mode, *preset, seed=seed, peers=improved, max_robot_s=HOUR_S if improved else MAX_ROBOT_S)
                for seed in self.seeds[:few]]

    def groups(self):
        """{what a column is called: its runs}"""
        first = preset_name(*PRESETS[0])
        named = {"improved, " + first: self.main()[:NINE], "mode paper, " + first: self.beside("paper")}
        return named | {"improved, " + preset_name(*preset): self.beside(preset=preset) for preset in PRESETS[1:]}


def preset_name(uwb, odometry):
    return "UWB %s, odometry %s" % (uwb, odometry)


@dataclass
class Section:
    name: str
    title: str
    lines: list
    data: dict
    picture: str = ""
    notes: list = field(default_factory=list)


def good(runs, done):
    """The figures of those that ended well."""
    return [done[run] for run in runs if ended_well(run, done[run])]


def mean(values):
    values = [value for value in values if value is not None]
    return sum(values) / len(values) if values else None


def number(value, form="%.1f"):
    """As a table has it; a dash where nothing was measured."""
    return "-" if value is None else form % value


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def canvas(wide_in=8.0, high_in=4.2):
    """(figure, axes). Raises ImportError without matplotlib."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(wide_in, high_in), dpi=120, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8, colors="#4b5563")
    return figure, axes


def save(figure, path):
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")
        figure.savefig(path)
