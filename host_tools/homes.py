"""`host_tools homes [NAME|FILE ...]`: a table of homes, and pictures of them.

Without names it lists the homes that the project ships. A home named or given
as a file is checked by the virtual robot's own loader, so what passes here can
be driven, and is sketched on the terminal. --draw DIR writes a PNG of each.
"""

import os
import shutil
import sys

from host_tools.braille import Braille, View
from sim_device.home import HomeError, home_names, load_home

EXIT_OK = 0
EXIT_USAGE = 2
SKETCH_COLUMNS = 64
SKETCH_ROWS = 18


def add_arguments(parser):
    parser.add_argument("homes", nargs="*", metavar="NAME|FILE",
                        help="a shipped home or a home file; all shipped homes if none is given")
    parser.add_argument("--draw", metavar="DIR", default=None, help="write DIR/<name>.png of each home (needs matplotlib)")
    parser.add_argument("--sketch", action="store_true", help="sketch on the terminal even when listing all homes")


def run(args):
    chosen = args.homes or list(home_names())
    homes, bad = [], 0
    for name in chosen:
        try:
            homes.append(load_home(name))
        except HomeError as error:
            print("homes: %s" % error, file=sys.stderr)
            bad = EXIT_USAGE
    if homes:
        print("\n".join(table(homes)))
    if args.homes or args.sketch:
        columns = min(SKETCH_COLUMNS, shutil.get_terminal_size((80, 24)).columns - 2)
        for home in homes:
            print("\n%s" % home.name)
            print("\n".join(sketch(home, columns, SKETCH_ROWS)))
    if args.draw is not None and homes:
        bad = draw_all(homes, args.draw) or bad
    return bad


def table(homes):
    """One line a home, under a heading."""
    head = ("home", "free m2", "size m", "vectors", "barriers", "rooms", "start m")
    lines = [head]
    for home in homes:
        xs, ys = zip(*home.outline)
        vectors = len(home.outline) + sum(len(obstacle) for obstacle in home.obstacles)
        lines.append((home.name, "%.1f" % home.free.area, "%.1f x %.1f" % (max(xs) - min(xs), max(ys) - min(ys)),
                      str(vectors), str(len(home.obstacles)), str(len(home.rooms)),
                      "%.2f, %.2f" % home.start))
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    return ["  ".join([line[0].ljust(widths[0])] + [text.rjust(width) for text, width in zip(line[1:], widths[1:])])
            for line in lines]


def sketch(home, columns, rows):
    """The home's walls in braille, the start as a dot with a ring."""
    raster = Braille(columns, rows)
    xs, ys = zip(*home.outline)
    view = View.fit(raster, (min(xs), min(ys), max(xs), max(ys)))
    view.polygon(home.outline)
    for obstacle in home.obstacles:
        view.polygon(obstacle)
    lines = raster.lines()
    start = view.cell(*home.start)
    if start is not None:
        column, row = start
        lines[row] = lines[row][:column] + "◉" + lines[row][column + 1:]
    return lines


def draw_all(homes, folder):
    """A PNG of each home; 0, or an exit code after one sentence."""
    try:
        import matplotlib
    except ImportError:
        print("homes: --draw needs matplotlib, which is not installed: pip install 'tvslam[plot]'.", file=sys.stderr)
        return EXIT_USAGE
    matplotlib.use("Agg")
    try:
        os.makedirs(folder, exist_ok=True)
        for home in homes:
            path = os.path.join(folder, home.name.replace(os.sep, "_") + ".png")
            draw(home, path)
            print("wrote %s" % path)
    except OSError as error:
        print("homes: %s cannot be written: %s." % (folder, (error.strerror or str(error)).lower()), file=sys.stderr)
        return EXIT_USAGE
    return EXIT_OK


def draw(home, path):
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Polygon

    xs, ys = zip(*home.outline)
    width, height = max(xs) - min(xs), max(ys) - min(ys)
    scale = 9.0 / max(width, height)
    figure = Figure(figsize=(max(3.0, width * scale + 1), max(3.0, height * scale + 1)), layout="constrained")
    axes = figure.add_subplot()
    axes.set_facecolor("#d9d9d9")
    axes.add_patch(Polygon(home.outline, closed=True, facecolor="white", edgecolor="black", linewidth=1.2))
    for obstacle in home.obstacles:
        axes.add_patch(Polygon(obstacle, closed=True, facecolor="#c4b59b", edgecolor="black", linewidth=1.0))
    for room in home.rooms:
        axes.annotate(room.name, room.centre, ha="center", va="center", color="#4060a0", fontsize=8)
    axes.add_patch(Circle(home.start, 0.17, fill=False, edgecolor="#c03030", linewidth=1.2))
    axes.annotate("start", home.start, ha="center", va="center", color="#c03030", fontsize=6)
    axes.set_aspect("equal")
    axes.set_xlim(min(xs) - 0.3, max(xs) + 0.3)
    axes.set_ylim(min(ys) - 0.3, max(ys) + 0.3)
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    axes.set_title("%s: %.1f m2 free, %d inside barriers, %d rooms" % (
        home.name, home.free.area, len(home.obstacles), len(home.rooms)))
    figure.savefig(path, dpi=110)
