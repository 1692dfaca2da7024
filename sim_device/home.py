# A home file: read, checked, and offered as the world's truth.
#
# Format: metres, x right, y up; `outline` (outer border of the free space),
# `obstacles` (inside barriers), `rooms` (name, centre, polygon), `start` (a
# legal place for the centre of the robot's disc). Polygons are closed
# implicitly. Other keys may be there and are left alone.

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

BODY_RADIUS_M = 0.17
NAME_MAX = 100
HOMES = Path(__file__).with_name("homes")
_REQUIRED = ("name", "units", "outline", "obstacles", "rooms", "start")


class HomeError(Exception):
    """One sentence: the file, the key, what is wrong, the way out."""


@dataclass(frozen=True)
class Room:
    name: str
    centre: tuple
    polygon: tuple


# What holds of every Home that load_home returns: rings are simple, at least a
# triangle, the outline counter-clockwise and the obstacles clockwise, so that
# the free space is LEFT of every segment; obstacles lie in the outline and do
# not overlap; a disc of 0.17 m fits at `start`.
@dataclass(frozen=True)
class Home:
    name: str
    outline: tuple
    obstacles: tuple
    rooms: tuple
    start: tuple
    path: str

    @property
    def rings(self):
        return (self.outline,) + self.obstacles

    @cached_property
    def segments(self):
        """Every wall as a row (x1, y1, x2, y2), free space on its left; ring after ring."""
        rows = []
        for ring in self.rings:
            points = np.array(ring, float)
            rows.append(np.hstack((points, np.roll(points, -1, axis=0))))
        return np.vstack(rows)

    @cached_property
    def free(self):
        """The free space as a shapely Polygon: outline with the obstacles as holes."""
        from shapely.geometry import Polygon
        return Polygon(self.outline, self.obstacles)


def home_names():
    """Names of the homes that ship with the product, sorted."""
    return sorted(path.stem for path in HOMES.glob("*.json"))


def load_home(path_or_name):
    """A Home from a file, or the shipped one of that name. Raises HomeError."""
    try:
        path = _find(str(path_or_name))
    except OSError as error:  # a folder on the way that may not be entered, a name too long
        raise HomeError(f"{str(path_or_name)[:200]}: cannot be read ({error.strerror}); give a readable JSON home file.") from None
    return _Reader(path, _read_json(path)).home()


def _find(given):
    path = Path(given)
    if not given:
        raise HomeError(f"the home's name is empty; give a path, or a shipped home: {_shipped()}.")
    if path.is_file():
        return path
    if path.is_dir():
        raise HomeError(f"{given}: is a folder; give the home's JSON file in it, or a shipped home: {_shipped()}.")
    if path.suffix != ".json" and path.name == given:
        shipped = HOMES / (given + ".json")
        if shipped.is_file():
            return shipped
        raise HomeError(f"{given}: neither a file nor a home that ships with this program; give a path, or one of: {_shipped()}.")
    if path.exists():
        raise HomeError(f"{given}: is no regular file; save the home to a file of its own first.")
    raise HomeError(f"{given}: no such file; check the path, or give a shipped home: {_shipped()}.")


def _shipped():
    return ", ".join(home_names()) or "(none are installed)"


def _read_json(path):
    try:
        text = path.read_text(encoding="utf-8-sig")  # with or without the mark that some editors put first
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "not UTF-8 text"
        raise HomeError(f"{path}: cannot be read ({why}); give a readable JSON home file.") from None
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        where = f" at line {error.lineno} column {error.colno}" if hasattr(error, "lineno") else ""
        raise HomeError(f"{path}: not JSON{where}; export the home again or mend that place.") from None
    if not isinstance(data, dict):
        raise HomeError(f"{path}: holds {_kind(data)} where an object with the keys {', '.join(_REQUIRED)} is expected.")
    return data


def _kind(value):
    """What JSON calls this value."""
    kinds = {dict: "an object", list: "a list", str: "a text", bool: "true or false", type(None): "null"}
    return kinds.get(type(value), "a number")


def _short(value):
    """A wrong value as it may stand in a sentence."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


# Checks one parsed file key by key; the first fault raises HomeError.
class _Reader:
    def __init__(self, path, data):
        self.path = path
        self.data = data

    def home(self):
        for key in _REQUIRED:
            if key not in self.data:
                self._fail(key, "is missing", "add it (a home needs " + ", ".join(_REQUIRED) + ")")
        self._name(self.data["name"], "name", "give the home a name")
        if self.data["units"] != "m":
            self._fail("units", f"is {_short(self.data['units'])}", 'convert all coordinates to metres and say "m"')
        outline = self._ring(self.data["outline"], "outline", ccw=True)
        obstacles = tuple(self._ring(ring, f"obstacles[{i}]", ccw=False)
                          for i, ring in enumerate(self._list(self.data["obstacles"], "obstacles")))
        rooms = tuple(self._room(room, f"rooms[{i}]")
                      for i, room in enumerate(self._list(self.data["rooms"], "rooms")))
        start = self._point(self.data["start"], "start")
        home = Home(self.data["name"], outline, obstacles, rooms, start, str(self.path))
        self._check_obstacles(home)
        self._check_start(home)
        return home

    def _fail(self, key, what, way_out):
        raise HomeError(f"{self.path}: '{key}' {what}; {way_out}.")

    def _name(self, value, key, way_out):
        """A name goes into tables, pictures and names of files: one line that any terminal can show."""
        if not isinstance(value, str) or not value:
            self._fail(key, f"is {_kind(value)} instead of a text" if value != "" else "is empty", way_out)
        if len(value) > NAME_MAX or not value.isprintable():
            self._fail(key, "is too long or holds a control character", f"{way_out} of at most {NAME_MAX} letters")

    def _list(self, value, key):
        if not isinstance(value, list):
            self._fail(key, f"is {_kind(value)}", "give a list, [] if there are none")
        return value

    def _point(self, value, key):
        ok = isinstance(value, list) and len(value) == 2 and all(
            isinstance(v, (int, float)) and not isinstance(v, bool) for v in value)
        if not ok:
            self._fail(key, "is not a pair of numbers", "give [x, y] in metres")
        if not all(abs(v) < 1e300 and math.isfinite(v) for v in value):
            self._fail(key, f"holds a coordinate that is not finite: {_short(value)}", "give finite numbers in metres")
        if not all(abs(v) <= 500 for v in value):
            self._fail(key, f"lies over 500 m from the origin: {value}", "move the home near the origin, in metres")
        return (float(value[0]), float(value[1]))

    def _ring(self, value, key, ccw):
        from shapely.geometry import Polygon
        from shapely.validation import explain_validity
        points = [self._point(p, f"{key}[{i}]") for i, p in enumerate(self._list(value, key))]
        if len(points) > 1 and points[0] == points[-1]:
            points.pop()  # closed explicitly, as GeoJSON does
        if len(set(points)) < 3:
            self._fail(key, f"has {len(set(points))} different vertices", "a polygon needs at least 3")
        for i, point in enumerate(points):
            if point == points[i - 1]:
                self._fail(key, f"repeats the vertex {list(point)}", "remove the copy")
        polygon = Polygon(points)
        if not polygon.is_valid:
            self._fail(key, f"crosses or touches itself ({explain_validity(polygon)})", "untangle it into a simple polygon")
        if polygon.area < 1e-6:
            self._fail(key, "encloses no area", "give its vertices in order round the border")
        if polygon.exterior.is_ccw != ccw:
            points.reverse()
        return tuple(points)

    def _room(self, value, key):
        if not isinstance(value, dict):
            self._fail(key, "is not an object", "give name, centre and polygon")
        for part in ("name", "centre", "polygon"):
            if part not in value:
                self._fail(f"{key}.{part}", "is missing", "give each room a name, a centre and a polygon")
        self._name(value["name"], f"{key}.name", "give the room a name")
        centre = self._point(value["centre"], f"{key}.centre")
        # Room polygons are approximate by the format: read, never judged.
        polygon = tuple(self._point(p, f"{key}.polygon[{i}]")
                        for i, p in enumerate(self._list(value["polygon"], f"{key}.polygon")))
        return Room(value["name"], centre, polygon)

    def _check_obstacles(self, home):
        from shapely.geometry import Polygon
        from shapely.strtree import STRtree
        outer = Polygon(home.outline)
        shapes = [Polygon(ring) for ring in home.obstacles]
        for i, shape in enumerate(shapes):
            if not outer.contains(shape):
                where = "lies outside" if not outer.intersects(shape) else "reaches through"
                self._fail(f"obstacles[{i}]", f"{where} the outline",
                           "move it inside, or make it part of the outline")
        tree = STRtree(shapes) if shapes else None
        for i, shape in enumerate(shapes):
            for j in sorted(int(j) for j in tree.query(shape, "intersects")):
                if j > i and shape.intersection(shapes[j]).area > 1e-9:
                    self._fail(f"obstacles[{i}]", f"overlaps obstacles[{j}]", "join the two into one polygon")
        if not home.free.is_valid:
            self._fail("obstacles", "touch the outline or one another along an edge",
                       "leave a gap, or join what touches into one polygon")

    def _check_start(self, home):
        from shapely.geometry import Point
        start = Point(home.start)
        if not home.free.contains(start):
            self._fail("start", f"{list(home.start)} lies inside a wall, an obstacle or outside the home",
                       "give a place in the free space")
        gap = home.free.boundary.distance(start)
        if gap < BODY_RADIUS_M - 1e-9:
            self._fail("start", f"{list(home.start)} is {gap:.3f} m from a wall, nearer than the robot's radius of "
                       f"{BODY_RADIUS_M} m", "move it into the open")
