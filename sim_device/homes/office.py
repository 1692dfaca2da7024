"""An office floor that stands in for the paper's Fig. 7: 458 vectors in 6 sections (the outline and five islands).

About 40 m x 16 m: offices along both fronts, two corridors joined at both ends and across, three blocks of inner rooms
between them, a column and a round pillar. The floor can be laid side by side in both directions: `office(2, 2)` is four
of them with doors between, for what grows with the size of a map.
"""
from shapely.geometry import box

from sim_device.homes.draw import Plan, arc

LONG_M, DEEP_M = 40.0, 16.0
SOUTH_M, NORTH_M = 4.6, 11.4  # the corridors' outer walls
CORE_M = (6.4, 9.7)           # between the corridors: the blocks of inner rooms
DOOR_M = 0.9
LOBBY, LOBBY_M = "lobby", 21.35  # and its middle

# A room: (name, from where its wall is, distance of its door's hinge from there). A lobby has no wall to the corridor:
# there the floors of a large building are joined.
SOUTH = (("reception", 0.0, 4.2), ("office 1", 6.0, 0.7), ("office 2", 9.1, 1.9), ("office 3", 12.4, 0.6), ("meeting room", 15.5, 2.4),
         (LOBBY, 20.4, None), ("office 4", 22.3, 0.5), ("office 5", 25.3, 1.6), ("laboratory", 28.4, 3.1), ("office 6", 33.9, 0.8),
         ("archive", 37.1, 0.5))
NORTH = (("workshop", 0.0, 4.4), ("office 7", 6.5, 0.9), ("office 8", 9.8, 0.5), ("open office", 12.8, 5.6), (LOBBY, 20.4, None),
         ("office 9", 22.3, 1.7), ("office 10", 25.5, 0.6), ("kitchen", 28.6, 1.0), ("store", 31.9, 0.4), ("lecture room", 33.9, 0.9))
# A block: (from, to, walls across it, doors); a door: (x of its hinge, towards the south corridor).
BLOCKS = ((2.1, 12.2, (4.6, 8.3), ((2.6, True), (5.9, False), (10.6, True))),
          (14.0, 24.9, (17.2, 21.1), ((15.1, False), (18.6, True), (22.9, False))),
          (26.8, 37.9, (30.1, 33.0), ((27.4, True), (31.1, False), (36.1, True))))
# Pilasters between the windows of a front: (x, width, depth).
SOUTH_PIERS = ((2.0, 0.4, 0.15), (4.0, 0.4, 0.15), (7.4, 0.4, 0.15), (10.7, 0.4, 0.15), (13.8, 0.4, 0.15), (17.1, 0.4, 0.15),
               (18.8, 0.4, 0.15), (23.7, 0.4, 0.15), (26.8, 0.4, 0.15), (30.2, 0.4, 0.15), (32.1, 0.4, 0.15), (35.4, 0.4, 0.15))
NORTH_PIERS = ((2.1, 0.4, 0.15), (4.3, 0.4, 0.15), (8.0, 0.4, 0.15), (11.2, 0.4, 0.15), (14.7, 0.4, 0.15), (16.6, 0.4, 0.15),
               (18.5, 0.4, 0.15), (23.8, 0.4, 0.15), (27.0, 0.4, 0.15), (30.2, 0.4, 0.15), (35.9, 0.4, 0.15), (38.0, 0.4, 0.15))
# What is built in: cupboards, shafts, benches, shelves, the chimney breast of the meeting room; (x, y) of two corners.
BUILT_IN = ((6.0, 3.0, 6.45, 4.0), (9.1, 0, 9.8, 0.5), (15.0, 1.2, 15.5, 2.6), (15.5, 1.8, 15.9, 3.0), (20.4, 1.5, 20.75, 2.7),
            (24.7, 3.9, 25.3, 4.6), (25.3, 1.5, 25.75, 2.9), (28.4, 0.9, 29.1, 3.2), (33.2, 1.0, 33.9, 3.4), (36.6, 0, 37.1, 0.8),
            (38.4, 1.2, 40, 1.6), (38.4, 2.6, 40, 3.0), (12.2, 7.4, 12.5, 8.4), (0, 13.0, 0.7, 14.6), (5.7, 15.2, 6.5, 16),
            (9.3, 12.8, 9.8, 14.2), (9.8, 13.2, 10.25, 14.4), (12.8, 13.7, 14.6, 13.8), (18.9, 13.4, 20.4, 13.5), (21.9, 13.0, 22.3, 14.2),
            (28.1, 12.9, 28.6, 14.1), (28.6, 13.6, 29.2, 16), (33.3, 12.8, 33.9, 15.0), (39.0, 12.6, 40, 14.8))
VECTORS, SECTIONS = 458, 6  # the paper's figures, which one floor meets


def office(columns=1, rows=1):
    """The plan of `columns` x `rows` floors."""
    name = "office_458" if columns * rows == 1 else "office_458_x%d" % (columns * rows)
    plan = Plan(name, box(0, 0, LONG_M * columns, DEEP_M * rows), "office floor of %d m x %d m%s; every door stands open" % (
        LONG_M, DEEP_M, "" if columns * rows == 1 else ", %d by %d of them" % (columns, rows)), has_furniture=False)
    plan.start = (3.4, 5.5)
    for column in range(columns):
        for row in range(rows):
            _floor(_Pen(plan, LONG_M * column, DEEP_M * row, "" if columns * rows == 1 else " %s%d" % (chr(65 + column), row + 1)))
    for row in range(rows):
        for column in range(1, columns):
            _joint(plan, (LONG_M * column, DEEP_M * row), (0, DEEP_M), ((SOUTH_M + CORE_M[0]) / 2, (CORE_M[1] + NORTH_M) / 2))
    for column in range(columns):
        for row in range(1, rows):
            _joint(plan, (LONG_M * column, DEEP_M * row), (LONG_M, 0), (LOBBY_M,))
    return plan


# Draws one floor where it belongs on the plan: the same coordinates for each.
class _Pen:
    def __init__(self, plan, x, y, mark):
        self._plan, self._x, self._y, self._mark = plan, x, y, mark

    def at(self, point):
        return point[0] + self._x, point[1] + self._y

    def wall(self, *points):
        self._plan.wall(*map(self.at, points))

    def door(self, hinge, latch):
        self._plan.door(self.at(hinge), self.at(latch))

    def put(self, x0, y0, x1, y1):
        self._plan.put(*self.at((x0, y0)), *self.at((x1, y1)))

    def put_round(self, x, y, radius, sides):
        self._plan.put_round(*self.at((x, y)), radius, sides)

    def put_shape(self, points):
        self._plan.put_shape([self.at(point) for point in points])

    def room(self, name, inside):
        self._plan.room(name + self._mark, self.at(inside))


def _joint(plan, corner, along, doors):
    """A wall between two floors from the corner on, with a door's middle at each distance."""
    def at(distance_m):
        length = max(along)
        return corner[0] + along[0] / length * distance_m, corner[1] + along[1] / length * distance_m

    plan.wall(at(0), at(max(along)))
    for middle in doors:
        plan.door(at(middle - DOOR_M / 2), at(middle + DOOR_M / 2))


def _floor(pen):
    _front(pen, SOUTH, 0.0, SOUTH_M)
    _front(pen, NORTH, DEEP_M, NORTH_M)
    for from_x, to_x, across, doors in BLOCKS:
        _block(pen, from_x, to_x, across, doors)
    for x, width, depth in SOUTH_PIERS:
        pen.put(x - width / 2, 0, x + width / 2, depth)
    for x, width, depth in NORTH_PIERS:
        pen.put(x - width / 2, DEEP_M - depth, x + width / 2, DEEP_M)
    for corners in BUILT_IN:
        pen.put(*corners)
    pen.put_shape([(5.95, 0), *arc(5.95, 0, 1.2, 90, 180, 8)])  # the counter of the reception
    pen.put_round(16.4, 13.6, 0.3, 16)  # in the open office
    pen.put(1.6, 7.9, 2.0, 8.3)         # where the western corridors meet
    pen.room("corridor", (20, 10.5))


def _front(pen, rooms, front_y, wall_y):
    """The rooms of one side: walls between them, a wall with a door each to the corridor."""
    ends = [room[1] for room in rooms[1:]] + [LONG_M]
    for (name, x, door), end in zip(rooms, ends):
        if x:
            pen.wall((x, front_y), (x, wall_y))
        if name == LOBBY:
            continue
        pen.wall((x, wall_y), (end, wall_y))
        pen.door((x + door, wall_y), (x + door + DOOR_M, wall_y))
        pen.room(name, ((x + end) / 2, (front_y + wall_y) / 2))


def _block(pen, from_x, to_x, across, doors):
    south, north = CORE_M
    pen.wall((from_x, south), (to_x, south), (to_x, north), (from_x, north), (from_x, south))
    for x in across:
        pen.wall((x, south), (x, north))
    walls = (from_x, *across, to_x)
    for left, right, (hinge, to_south) in zip(walls, walls[1:], doors):
        y = south if to_south else north
        pen.door((hinge, y), (hinge + DOOR_M, y))
        pen.room("inner room %d" % round(left), ((left + right) / 2, (south + north) / 2))
