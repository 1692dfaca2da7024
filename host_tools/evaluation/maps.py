"""Figs. 7, 8 and 9: the floor, the map built of it, and the map with its topology."""

import json
import os

from shapely.geometry import Polygon

from host_tools.evaluation import published
from host_tools.evaluation.section import Section, canvas, number, save, table
from host_tools.picture import OUTLINE, PATH
from sim_device.home import load_home

SECTION_COLORS = ("#111827", "#c2410c", "#2563eb", "#15803d", "#a855f7", "#a16207", "#0891b2", "#be185d")
ROOM_TEXT = "#6b7280"
REGION_COLORS = ("#fde68a", "#bfdbfe", "#bbf7d0", "#fecaca", "#ddd6fe", "#fbcfe8", "#a5f3fc", "#e5e7eb")
TOPOLOGY = {"vectors": "vectors", "regions": "regions", "true_rooms": "rooms of the home", "turning_nodes": "turning nodes",
            "edges": "edges"}
TRUE_WALL = "#c7ccd1"


def fig7(plan, done, folder):
    """The map used: its vectors, in sections that hang together."""
    home = load_home(plan.home)
    count = sum(map(len, home.rings))
    papers = ("the paper, Fig. 7(b): " + published.HOME, str(published.VECTORS), str(published.SECTIONS))
    lines = table(("map used", "vectors", "sections"), [papers, (home.name, str(count), str(len(home.rings)))])
    section = Section("7", "Fig. 7: the map used", lines, {"home": home.name, "vectors": count, "sections": len(home.rings)}, "fig7.png")
    figure, axes = _floor(home)
    for i, ring in enumerate(home.rings):
        axes.plot(*zip(*ring, ring[0]), color=SECTION_COLORS[i % len(SECTION_COLORS)], linewidth=1.2, marker=".", markersize=2)
    axes.set_title("%s: %d vectors in %d sections" % (home.name, count, len(home.rings)), fontsize=9)
    save(figure, os.path.join(folder, section.picture))
    return section


def fig8(plan, done, folder):
    """The map built against the real one."""
    home, run = load_home(plan.home), plan.main()[0]
    figures = done[run]["result"]
    mapped = figures["map"]
    rows = [("vectors", str(published.VECTORS), number(mapped["vectors"], "%d")),
            ("precision, walls within 5 cm", "-", number(mapped["precision_5cm"], "%.3f")),
            ("recall, walls within 5 cm", "some regions are unexplored", number(mapped["recall_5cm"], "%.3f")),
            ("free space, intersection over union", "-", number(mapped["iou_free"], "%.3f")),
            ("mission", "-", "finished" if figures["finished"] else "not finished: " + figures["reason"])]
    section = Section("8", "Fig. 8: the constructed map and the real environment",
                      table(("", "the paper", "%s, %s" % (home.name, _preset(run))), rows), mapped, "fig8.png")
    figure, axes = _floor(home)
    for i, ring in enumerate(home.rings):
        axes.plot(*zip(*ring, ring[0]), color=TRUE_WALL, linewidth=3.5, label=None if i else "real")
    _vectors(axes, features(plan, run))
    _legend(axes)
    save(figure, os.path.join(folder, section.picture))
    return section


def fig9(plan, done, folder):
    """The topological-vector map: regions, turning nodes and edges over the vectors, as far as the core has them."""
    home, run = load_home(plan.home), plan.main()[0]
    mapped = done[run]["result"]["map"]
    rows = [(label, number(mapped[key], "%d")) for key, label in TOPOLOGY.items()]
    notes = [] if mapped["regions"] else ["The core of this evaluation built no regions: the map has vectors only."]
    lines = table(("", "%s, %s" % (home.name, _preset(run))), rows)
    section = Section("9", "Fig. 9: the topological-vector map", lines, mapped, "fig9.png", notes)
    figure, axes = _floor(home)
    drawn = features(plan, run)
    regions = [each for each in drawn if each["geometry"]["type"] == "Polygon"]
    for i, each in enumerate(regions):
        corners = each["geometry"]["coordinates"][0]
        axes.fill(*zip(*corners), color=REGION_COLORS[i % len(REGION_COLORS)], alpha=0.7, zorder=1, label=None if i else "region")
        axes.text(*_middle(corners), str(i + 1), fontsize=8, color=ROOM_TEXT, ha="center", va="center", zorder=2)
    _vectors(axes, drawn)
    edges = [each["geometry"]["coordinates"] for each in drawn if each["properties"].get("kind") == "edge"]
    nodes = [each["geometry"]["coordinates"][:2] for each in drawn if each["geometry"]["type"] == "Point"]
    for i, each in enumerate(edges):
        axes.plot(*zip(*each), color=PATH, linewidth=0.8, zorder=5, label=None if i else "edge")
    if nodes:
        axes.plot(*zip(*nodes), "o", color=PATH, markeredgecolor="white", markersize=4.5, zorder=6, label="turning node")
    _legend(axes)
    save(figure, os.path.join(folder, section.picture))
    return section


def features(plan, run):
    """Those of the run's map.geojson; none for a mission without a map."""
    try:
        with open(os.path.join(plan.folder, run.key, "map.geojson"), encoding="utf-8") as file:
            return json.load(file)["features"]
    except FileNotFoundError:
        return []


def _preset(run):
    return "%s, UWB %s, odometry %s, seed %d" % (run.mode, run.uwb, run.odometry, run.seed)


def _vectors(axes, drawn):
    label = "built"
    for each in drawn:
        if each["geometry"]["type"] == "LineString" and each["properties"].get("kind") != "edge":
            axes.plot(*zip(*each["geometry"]["coordinates"]), color=OUTLINE, linewidth=1.1, zorder=4, label=label)
            label = None


def _legend(axes):
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=4)


def _middle(corners):
    place = Polygon(corners).buffer(0).representative_point()
    return place.x, place.y


def _floor(home):
    xs, ys = zip(*home.outline)
    wide, high = max(xs) - min(xs), max(ys) - min(ys)
    figure, axes = canvas(10.0, min(max(10.0 * high / wide + 0.8, 3.0), 14.0))
    axes.set_aspect("equal")
    axes.set_xlabel("metres", fontsize=8)
    return figure, axes
