"""map.png: the true walls, the mapped vectors, the path as the robot believed it, the dock."""

import os
import warnings

from host_tools.result import pose_column
from host_tools.map_file import KIND_OUTLINE
from host_tools.score import obstacle_rings

WALL, FLOOR, FURNITURE = "#b9bec4", "#fbfaf7", "#eceef0"
OUTLINE, BARRIER, PATH, DOCK = "#c2410c", "#0f766e", "#3b82f6", "#15803d"
GATE, WAY = "#7c3aed", "#57534e"
REGIONS = ("#bfdbfe", "#fde68a", "#bbf7d0", "#fbcfe8", "#ddd6fe", "#fed7aa", "#a5f3fc", "#e7e5e4")
WIDE_IN, LEFT_IN, RIGHT_IN, TOP_IN, BOTTOM_IN = 9.0, 0.5, 0.2, 0.95, 0.85


def draw_mission(path, home, mission, vector_map, result):
    """Raises ImportError without matplotlib: the caller says how to get it."""
    # Its font cache may lie in a folder that cannot be written; no display is needed.
    os.environ.setdefault("MPLBACKEND", "Agg")
    from matplotlib.figure import Figure

    width_m, height_m = _extent(home.outline)
    drawn = WIDE_IN - LEFT_IN - RIGHT_IN
    high = min(max(drawn * height_m / width_m, 2.5), 14.0) + TOP_IN + BOTTOM_IN
    figure = Figure(figsize=(WIDE_IN, high), dpi=130, facecolor="white")
    axes = figure.add_axes([LEFT_IN / WIDE_IN, BOTTOM_IN / high, drawn / WIDE_IN, 1 - (TOP_IN + BOTTOM_IN) / high])
    _truth(axes, home)
    _estimate(axes, mission, vector_map)
    if vector_map is not None:
        _graph(axes, vector_map)
    axes.plot(*home.start, marker="o", markersize=7, color=DOCK, markeredgecolor="white", linestyle="none", label="dock", zorder=6)
    axes.set_aspect("equal")
    axes.margins(0.03)
    axes.tick_params(labelsize=8, colors="#6b7280", length=2)
    axes.set_xlabel("metres", fontsize=8, color="#6b7280")
    for spine in axes.spines.values():
        spine.set_color("#d1d5db")
    left = LEFT_IN / WIDE_IN
    figure.text(left, 1 - 0.3 / high, home.name, fontsize=14, weight="bold", color="#111827", verticalalignment="center")
    figure.text(left, 1 - 0.48 / high, _subtitle(result), fontsize=8.5, color="#4b5563", verticalalignment="top")
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=6, fontsize=8, frameon=False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # a box stands for a letter of the name that no font has
        figure.savefig(path)


def _extent(outline):
    xs, ys = [p[0] for p in outline], [p[1] for p in outline]
    return max(max(xs) - min(xs), 0.1), max(max(ys) - min(ys), 0.1)


def _truth(axes, home):
    axes.fill(*zip(*home.outline), facecolor=FLOOR, edgecolor=WALL, linewidth=4, joinstyle="round", zorder=1, label="true walls")
    for ring in obstacle_rings(home):
        axes.fill(*zip(*ring), facecolor=FURNITURE, edgecolor=WALL, linewidth=3, joinstyle="round", zorder=1)


def _estimate(axes, mission, vector_map):
    if len(mission.pose):
        axes.plot(pose_column(mission, "x_m"), pose_column(mission, "y_m"), color=PATH, linewidth=0.8, alpha=0.7,
                  zorder=2, label="path, estimated")
    labels = set()
    for chain in vector_map.chains if vector_map is not None else ():
        kind = "mapped " + chain.kind_name
        color = OUTLINE if chain.kind == KIND_OUTLINE else BARRIER
        xy = chain.xy if not chain.closed else [*chain.xy, chain.xy[0]]
        axes.plot(*zip(*xy), color=color, linewidth=1.5, marker=".", markersize=4, zorder=4,
                  label=None if kind in labels else kind)
        labels.add(kind)


def _graph(axes, vector_map):
    for region in vector_map.region_list:
        for polygon in [] if region.polygon.is_empty else [region.polygon]:
            axes.fill(*polygon.exterior.xy, color=REGIONS[region.number % len(REGIONS)], alpha=0.35, linewidth=0, zorder=1.5)
        if region.gate:
            axes.plot(*zip(*region.gate), color=GATE, linewidth=2, zorder=5, label="gate" if region.number == 1 else None)
    for number, edge in enumerate(vector_map.edge_list):
        axes.plot(*zip(*(vector_map.node_list[n] for n in edge.nodes)), color=WAY, linewidth=0.6, zorder=3, label=None if number else "way")
    if vector_map.node_list:
        axes.plot(*zip(*vector_map.node_list), color=WAY, marker="o", markersize=2.5, linestyle="none", zorder=5, label="turning node")


def _subtitle(result):
    parts = [result["mode"], "core on " + result["target"], "UWB " + result["uwb"], "odometry " + result["odometry"],
             "seed %d" % result["seed"]]
    figures = []
    if result["map"]["outline_precision_5cm"] is not None and result["map"]["outline_recall_5cm"] is not None:
        figures.append("outline within 5 cm: precision %.3f, recall %.3f"
                       % (result["map"]["outline_precision_5cm"], result["map"]["outline_recall_5cm"]))
    if result["map"]["vectors"] is not None:
        figures.append("%d vectors" % result["map"]["vectors"])
    if result["localisation"]["estimate"]["mean_cm"] is not None:
        figures.append("mean error %.1f cm" % result["localisation"]["estimate"]["mean_cm"])
    if result["time"]["robot_s"] is not None:
        figures.append("%.0f s of robot time" % result["time"]["robot_s"])
    if not result["finished"]:
        figures.insert(0, "NOT FINISHED: " + result["reason"])
    return " · ".join(parts) + "\n" + " · ".join(figures)
