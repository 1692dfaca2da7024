"""`host_tools robot-drawing`: the sensor mounting as an SVG, from the robot's configuration file.

The picture of the paper's Fig. 4. It is made from the same TOML file that the
virtual robot and the core's parameters are made from, so it cannot tell another
story; `--check FILE` fails when a drawing is not what the configuration gives.
"""

import importlib.util
import math
import os
import sys
import tomllib
from xml.sax.saxutils import escape

EXIT_OK = 0
EXIT_STALE = 1
EXIT_USAGE = 2

PX_PER_M = 1000.0
MARGIN_M = 0.05
# How far and how wide a beam is drawn, metres and degrees half angle: what such parts see (the
# ultrasonic one sees 3 m, cut short here).
BEAMS = {"infrared": (0.04, 0.30, 1.5), "ultrasonic": (0.02, 0.42, 15.0)}
COLOURS = {"infrared": "#c23b22", "ultrasonic": "#2f6fb3", "uwb": "#3a8f3a"}
LABEL_M = {"infrared": 0.335, "ultrasonic": 0.45}
TABLE_PX = 470


class DrawingError(Exception):
    """One sentence: the file, the key, the way out."""


def add_arguments(parser):
    parser.add_argument("--robot", metavar="ROBOT.toml", default=None, help="the configuration (default: the shipped robot)")
    parser.add_argument("--out", metavar="FILE.svg", default="docs/robot.svg", help="the drawing to write (default docs/robot.svg)")
    parser.add_argument("--check", metavar="FILE.svg", default=None,
                        help="write nothing; exit 1 if FILE.svg is not what the configuration gives")


def run(args):
    try:
        text = svg(read_robot(args.robot or shipped_robot()))
        if args.check is not None:
            return check(args.check, text)
        os.makedirs(os.path.dirname(os.path.abspath(args.out)), exist_ok=True)
        with open(args.out, "w", encoding="utf-8") as file:
            file.write(text)
    except DrawingError as error:
        print("robot-drawing: %s" % error, file=sys.stderr)
        return EXIT_USAGE
    except OSError as error:
        print("robot-drawing: %s: %s." % (error.filename, (error.strerror or str(error)).lower()), file=sys.stderr)
        return EXIT_USAGE
    print("wrote %s" % args.out)
    return EXIT_OK


def check(path, text):
    with open(path, encoding="utf-8") as file:
        if file.read() == text:
            return EXIT_OK
    print("robot-drawing: %s is stale: run `host_tools robot-drawing --out %s`." % (path, path), file=sys.stderr)
    return EXIT_STALE


def shipped_robot():
    """The configuration beside the virtual robot, found without importing it."""
    spec = importlib.util.find_spec("sim_device")
    if spec is None or not spec.submodule_search_locations:
        raise DrawingError("The package sim_device is not installed: give the configuration with --robot.")
    return os.path.join(list(spec.submodule_search_locations)[0], "robot.toml")


def read_robot(path):
    """The parts of the configuration that the drawing shows, checked."""
    try:
        with open(path, "rb") as file:
            data = tomllib.load(file)
    except OSError as error:
        raise DrawingError("%s cannot be read: %s." % (path, (error.strerror or str(error)).lower())) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DrawingError("%s is not TOML: %s." % (path, error)) from None
    robot = {
        "name": str(data.get("name", "robot")),
        "radius_m": _number(path, data, "body", "radius_m"),
        "wheel_m": _number(path, data, "drive", "wheel_diameter_m"),
        "track_m": _number(path, data, "drive", "track_m"),
        "pulses": _number(path, data, "drive", "pulses_per_turn"),
        "speed_m_s": _number(path, data, "limits", "speed_m_s"),
        "turn_rad_s": _number(path, data, "limits", "turn_rad_s"),
        "sensors": [],
    }
    sensors = data.get("sensor")
    if not isinstance(sensors, list) or not sensors:
        raise DrawingError("%s: [[sensor]] is missing: give one table for each sensor." % path)
    for i, sensor in enumerate(sensors):
        where = "sensor[%d]" % i
        table = {where: sensor if isinstance(sensor, dict) else {}}
        robot["sensors"].append({
            "name": str(table[where].get("name", where)), "kind": str(table[where].get("kind", "")),
            "part": str(table[where].get("part", "")), "bearing_deg": _number(path, table, where, "bearing_deg"),
            "radius_m": _number(path, table, where, "radius_m")})
    return robot


def _number(path, data, table, key):
    value = data.get(table, {}).get(key) if isinstance(data.get(table, {}), dict) else None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise DrawingError("%s: %s in [%s] is missing or not a number." % (path, key, table))
    return value


def svg(robot):
    """The whole drawing as text; ahead is up, left is left."""
    reach_m = max([robot["radius_m"]] + [s["radius_m"] + LABEL_M.get(s["kind"], 0.0) for s in robot["sensors"]]) + MARGIN_M
    size = 2 * reach_m * PX_PER_M
    paper = _Paper(reach_m)
    paper.add('<rect width="100%%" height="100%%" fill="white"/>')
    _draw_body(paper, robot)
    for sensor in robot["sensors"]:
        _draw_beam(paper, sensor)
    for sensor in robot["sensors"]:
        _draw_sensor(paper, sensor)
    _draw_table(paper, robot, size)
    return ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %.0f %.0f" font-family="sans-serif" font-size="17">\n'
            '<title>Sensor mounting of the %s, from above</title>\n%s\n</svg>\n' % (
                size + TABLE_PX, size, escape(robot["name"]), "\n".join(paper.lines)))


class _Paper:
    """SVG elements, with places in the robot's frame: x ahead, y left, metres."""

    def __init__(self, reach_m):
        self.lines = []
        self._middle = reach_m * PX_PER_M

    def add(self, element, *values):
        self.lines.append(element % values)

    def at(self, x_m, y_m):
        return self._middle - y_m * PX_PER_M, self._middle - x_m * PX_PER_M

    def polar(self, radius_m, bearing_deg, offset_m=0.0):
        angle = math.radians(bearing_deg)
        return self.at((radius_m + offset_m) * math.cos(angle), (radius_m + offset_m) * math.sin(angle))


def _draw_beam(paper, sensor):
    if sensor["kind"] not in BEAMS:
        return
    near, far, half_deg = BEAMS[sensor["kind"]]
    bearing, radius = sensor["bearing_deg"], sensor["radius_m"]
    angle = math.radians(bearing)
    corners = []
    for side, distance in ((1, near), (1, far), (-1, far), (-1, near)):
        beam = angle + side * math.radians(half_deg)
        corners.append("%.1f,%.1f" % paper.at(radius * math.cos(angle) + distance * math.cos(beam),
                                              radius * math.sin(angle) + distance * math.sin(beam)))
    paper.add('<polygon points="%s" fill="%s" fill-opacity="0.22" stroke="%s" stroke-opacity="0.5"/>',
              " ".join(corners), COLOURS[sensor["kind"]], COLOURS[sensor["kind"]])


def _draw_body(paper, robot):
    x, y = paper.at(0, 0)
    paper.add('<circle cx="%.1f" cy="%.1f" r="%.1f" fill="#eeeeee" stroke="black" stroke-width="3"/>',
              x, y, robot["radius_m"] * PX_PER_M)
    wheel, width = robot["wheel_m"] * PX_PER_M, 20
    for side in (1, -1):
        wx, wy = paper.at(0, side * robot["track_m"] / 2)
        paper.add('<rect x="%.1f" y="%.1f" width="%d" height="%.1f" rx="4" fill="#444444"/>',
                  wx - width / 2, wy - wheel / 2, width, wheel)
    (lx, ly), (rx, _) = paper.at(0, robot["track_m"] / 2), paper.at(0, -robot["track_m"] / 2)
    paper.add('<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" stroke="#444444" stroke-dasharray="6 5"/>', lx, ly, rx, ly)
    paper.add('<text x="%.1f" y="%.1f" text-anchor="middle" fill="#222222">track %.0f mm</text>', x, y + 62, robot["track_m"] * 1000)
    tip = paper.at(robot["radius_m"] * 0.45, 0)
    paper.add('<path d="M %.1f %.1f L %.1f %.1f M %.1f %.1f l -9 16 M %.1f %.1f l 9 16" stroke="black" stroke-width="2.5"/>',
              x, y, tip[0], tip[1], tip[0], tip[1], tip[0], tip[1])


def _draw_sensor(paper, sensor):
    colour = COLOURS.get(sensor["kind"], "#777777")
    x, y = paper.polar(sensor["radius_m"], sensor["bearing_deg"])
    paper.add('<circle cx="%.1f" cy="%.1f" r="7" fill="%s" stroke="black"/>', x, y, colour)
    lx, ly = paper.polar(sensor["radius_m"], sensor["bearing_deg"], LABEL_M.get(sensor["kind"], -0.035))
    paper.add('<text x="%.1f" y="%.1f" text-anchor="middle" font-weight="bold" fill="%s">%s</text>',
              lx, ly + 6, colour, escape(sensor["name"]))


def _draw_table(paper, robot, size):
    rows = [(robot["name"], True), ("seen from above, ahead is up, bearings left positive", False), ("", False),
            ("body: disc of %.0f mm" % (2000 * robot["radius_m"]), False),
            ("wheels %.0f mm, track %.0f mm, %d pulses a turn" % (
                1000 * robot["wheel_m"], 1000 * robot["track_m"], robot["pulses"]), False),
            ("at most %.2f m/s and %.1f rad/s" % (robot["speed_m_s"], robot["turn_rad_s"]), False), ("", False)]
    parts = dict.fromkeys(sensor["part"] for sensor in robot["sensors"])
    for part in parts:
        rows.append((part, True))
        for sensor in robot["sensors"]:
            if sensor["part"] == part:
                rows.append(("%s  %s, bearing %+g°, radius %.0f mm" % (
                    sensor["name"], sensor["kind"], sensor["bearing_deg"], 1000 * sensor["radius_m"]), False))
        rows.append(("", False))
    for i, (text, heading) in enumerate(rows):
        if text:
            paper.add('<text x="%.1f" y="%d"%s>%s</text>', size + 10, 60 + 26 * i,
                      ' font-weight="bold"' if heading else "", escape(text))
