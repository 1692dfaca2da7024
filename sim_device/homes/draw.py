"""Draws the homes that the project ships: this is the pen and the checks, the plans are in plans.py.

`python -m sim_device.homes [FOLDER]` writes one JSON file a plan.

A plan is drawn as an architect would: the border of the floor, inner walls 10 cm thick, doors as gaps in them with
their open leaves, furniture by its footprint at the height of the robot's sensors (legs where furniture stands on legs).
What touches a wall becomes part of the outline; what stands free becomes an obstacle. Every file is checked before it is
written. Needs shapely (the development extra); the homes themselves need nothing.
"""
import json
import math

from shapely.geometry import LineString, Point, Polygon, box
from shapely.ops import nearest_points, unary_union

WALL_M = 0.10
LEAF_M = 0.04
DISC_M = 0.17
EDGE_MIN_M = 0.02
MITRE = {"join_style": "mitre", "mitre_limit": 10}


class PlanError(Exception):
    """A plan that breaks a rule of the home format; the text names the plan and the rule."""


# One home on the drawing board. The border is given first; walls, doors and furniture are then taken away from it.
# Coordinates in metres, x right, y up. `home()` returns the dictionary that the JSON file holds, checked.
class Plan:
    def __init__(self, name, border, notes, has_furniture=True, provenance="sim_device/homes/plans.py"):
        self.name = name
        self.border = border
        self.notes = notes
        self.has_furniture = has_furniture
        self.provenance = provenance
        self.walls = []
        self.gaps = []
        self.things = []
        self.rooms = []
        self.start = None

    def wall(self, *points):
        self.walls.append(LineString(points).buffer(WALL_M / 2, cap_style="square", **MITRE))

    def door(self, hinge, latch, leaf_deg=None):
        """A gap in the wall from hinge to latch (points on the wall's middle line). The leaf, if it still hangs there,
        stands open: leaf_deg is the direction from its hinge into the room."""
        self.gaps.append(LineString((hinge, latch)).buffer(WALL_M / 2 + 0.001, cap_style="flat"))
        if leaf_deg is None:
            return
        width = math.dist(hinge, latch)
        c, s = math.cos(math.radians(leaf_deg)), math.sin(math.radians(leaf_deg))
        along = ((latch[0] - hinge[0]) / width, (latch[1] - hinge[1]) / width)
        # The leaf turns about the corner of its jamb: it stands just beside the gap, rooted in the wall.
        x, y = hinge[0] - along[0] * LEAF_M / 2, hinge[1] - along[1] * LEAF_M / 2
        end = (x + c * (width + WALL_M / 2), y + s * (width + WALL_M / 2))
        self.things.append(LineString(((x, y), end)).buffer(LEAF_M / 2, cap_style="flat"))

    def put(self, x0, y0, x1, y1):
        self.things.append(box(x0, y0, x1, y1))

    def put_turned(self, x, y, length, width, deg):
        c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
        corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        self.put_shape([(x + (c * i * length - s * j * width) / 2, y + (s * i * length + c * j * width) / 2) for i, j in corners])

    def put_round(self, x, y, radius, sides=24):
        self.put_shape(arc(x, y, radius, 0, 360 - 360 / sides, sides - 1))

    def put_shape(self, points):
        self.things.append(Polygon(points))

    def put_legs(self, x, y, length, width, leg=0.05, deg=0):
        """Four legs at the corners of a table or chair of that outer size."""
        c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            u, v = i * (length - leg) / 2, j * (width - leg) / 2
            self.put_turned(x + c * u - s * v, y + s * u + c * v, leg, leg, deg)

    def put_star(self, x, y, radius, spokes=5, spoke=0.05, deg=90):
        """The base of an office chair."""
        arms = []
        for i in range(spokes):
            turn = math.radians(deg + 360 * i / spokes)
            end = (x + radius * math.cos(turn), y + radius * math.sin(turn))
            arms.append(LineString(((x, y), end)).buffer(spoke / 2, cap_style="flat"))
        self.things.append(unary_union([*arms, Polygon(arc(x, y, 0.07, deg + 36, deg + 324, spokes - 1))]))

    def room(self, name, inside):
        """Names the room around that point; its polygon is what walls and closed doors would leave of the floor."""
        self.rooms.append((name, Point(inside)))

    def home(self):
        walls = unary_union(self.walls)
        floor = self.border.difference(walls)
        standing = walls.difference(unary_union(self.gaps)) if self.gaps else walls
        free = self.border.difference(unary_union([standing, *self.things]))
        if free.geom_type != "Polygon":  # slits and pockets that furniture cuts off are no free space of this home
            free = max(free.geoms, key=lambda part: part.area)
        outline = tidy(free.exterior.coords)
        obstacles = sorted(tidy(ring.coords) for ring in free.interiors)
        free = Polygon(outline, obstacles)
        rooms = [self._room(name, inside, floor, free) for name, inside in self.rooms]
        reach = [part for part in parts(free.buffer(-DISC_M, quad_segs=16)) if part.contains(Point(self.start))]
        x0, y0, x1, y1 = free.bounds
        home = {
            "name": self.name, "source": "drawn for this project", "licence": "MIT", "units": "m",
            "outline": outline, "obstacles": obstacles, "rooms": rooms,
            "segments_total": len(outline) + sum(map(len, obstacles)), "start": list(self.start),
            "has_furniture": self.has_furniture, "obstacle_count": len(obstacles),
            "free_area_m2": round(free.area, 2),
            "reach_area_m2": round(sum(part.buffer(DISC_M, quad_segs=16).area for part in reach), 2),
            "bbox_m": [round(x1 - x0, 3), round(y1 - y0, 3)], "rooms_source": "drawn",
            "provenance": self.provenance, "conversion": "drawn in metres, no conversion", "notes": self.notes,
        }
        check(home)
        return home

    def _room(self, name, inside, floor, free):
        polygon = next((part for part in parts(floor) if part.contains(inside)), None)
        if polygon is None:
            raise PlanError("%s: the point given for room %s lies in a wall" % (self.name, name))
        points = tidy(polygon.exterior.coords)
        # The centre must be a place in free space: where furniture covers it, the nearest that the robot can stand on.
        centre, _ = nearest_points(polygon.intersection(free.buffer(-DISC_M - 0.01)), polygon.centroid)
        return {"name": name, "centre": [round(centre.x, 3), round(centre.y, 3)], "polygon": points}


def parts(shape):
    return list(getattr(shape, "geoms", [shape]))


def arc(x, y, radius, from_deg, to_deg, chords):
    """Points on an arc, both ends included."""
    turns = [math.radians(from_deg + (to_deg - from_deg) * i / chords) for i in range(chords + 1)]
    return [(x + radius * math.cos(t), y + radius * math.sin(t)) for t in turns]


def tidy(ring):
    """A ring in whole millimetres, counter-clockwise from its lowest leftmost vertex, without vertices on a straight line
    and without edges under 2 cm (where two walls meet at an odd angle)."""
    points = [[round(x, 3), round(y, 3)] for x, y in list(Polygon(ring).normalize().exterior.coords)[:-1]]
    if not Polygon(points).exterior.is_ccw:
        points.reverse()
    i = 0
    while i < len(points):
        before, here, after = points[i - 1], points[i], points[(i + 1) % len(points)]
        cross = (here[0] - before[0]) * (after[1] - before[1]) - (here[1] - before[1]) * (after[0] - before[0])
        if math.dist(here, after) < EDGE_MIN_M or abs(cross) < 0.0015 * math.dist(before, after):
            del points[i]
            i = max(i - 2, 0)
        else:
            i += 1
    first = points.index(min(points, key=lambda p: (p[1], p[0])))
    return points[first:] + points[:first]


def check(home):
    """The rules of the format. Raises PlanError with the first that is broken."""
    name, free = home["name"], Polygon(home["outline"], home["obstacles"])

    def must(holds, rule):
        if not holds:
            raise PlanError("%s: %s" % (name, rule))

    outline = Polygon(home["outline"])
    shapes = [Polygon(points) for points in home["obstacles"]]
    for ring in [outline, *shapes]:
        must(ring.is_valid, "a polygon crosses itself")
        must(ring.exterior.is_ccw, "a polygon runs clockwise")
        points = list(ring.exterior.coords)
        must(all(math.dist(p, q) >= EDGE_MIN_M for p, q in zip(points, points[1:])), "an edge is under 2 cm")
    must(free.is_valid, "the obstacles do not leave a valid free space")
    for i, shape in enumerate(shapes):
        must(outline.contains_properly(shape), "an obstacle touches or leaves the outline")
        must(all(shape.disjoint(other) for other in shapes[:i]), "two obstacles touch")
    region = parts(free.buffer(-DISC_M, quad_segs=16))
    must(len(region) == 1, "the disc's free region is in %d pieces: %s" % (
        len(region), [tuple(round(v, 2) for v in (part.representative_point().coords[0])) for part in region]))
    must(region[0].contains(Point(home["start"])), "the start is too near to a wall")
    for room in home["rooms"]:
        must(region[0].contains(Point(room["centre"])), "the centre of %s is no place for the robot" % room["name"])


def as_text(home):
    return json.dumps(home, separators=(",", ":")) + "\n"
