"""The plans of the homes that the project ships, each a function that draws one (see draw.py for the pen); the office has a file of
its own."""
import math

from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from sim_device.homes.draw import Plan, arc
from sim_device.homes.office import office


def studio():
    """One furnished room with a kitchen line, and a bath behind a door."""
    plan = Plan("studio", unary_union([box(0, 0, 6.2, 4.9), box(-0.1, 1.35, 0, 2.25)]),
                "furnished studio: bed, wardrobe, sofa, table with legs, two chairs, kitchen line, bath; the entrance door is shut")
    plan.start = (0.5, 1.1)
    plan.room("studio", (3, 2))
    plan.room("bath", (1, 4))
    plan.wall((0, 2.95), (1.95, 2.95), (1.95, 4.9))
    plan.door((1.95, 3.1), (1.95, 3.88), leaf_deg=176)
    # bath: shower tray with glass, toilet, basin on a cabinet
    plan.put(0, 4.0, 0.9, 4.9)
    toilet(plan, 1.4, 4.9, -90)
    plan.put(0, 3.35, 0.4, 3.82)
    # kitchen line: fridge, cupboards with cooker and sink
    plan.put(0.75, 0, 1.4, 0.65)
    plan.put(1.4, 0, 3.2, 0.6)
    # bed with its head at the right wall, nightstand, wardrobe at the bath's wall
    plan.put(4.15, 3.5, 6.2, 4.9)
    plan.put(5.8, 3.1, 6.2, 3.5)
    plan.put(2.0, 4.3, 3.6, 4.9)
    # sofa at the right wall, a round side table before it
    plan.put(5.3, 0.25, 6.2, 2.0)
    plan.put_round(4.5, 0.9, 0.22, 16)
    # dining table on four legs, its chairs
    plan.put_legs(3.0, 2.15, 1.3, 0.8, leg=0.06)
    plan.put_legs(1.9, 2.15, 0.49, 0.49, leg=0.04, deg=8)
    plan.put_legs(4.35, 2.6, 0.49, 0.49, leg=0.04, deg=40)
    return plan


def flat():
    """Five furnished rooms: hall, living room with kitchen, L-shaped bedroom, study, bath; every door stands open."""
    plan = Plan("flat", unary_union([box(0, 0, 9.0, 5.45), box(0, 5.45, 2.45, 7.7), box(2.45, 5.45, 6.65, 8.3), box(-0.1, 4.35, 0, 5.25)]),
                "furnished flat of 64 m2; doors of 0.8 m stand open, their leaves into the rooms")
    plan.start = (0.6, 4.85)
    for name, inside in (("hall", (3, 4.9)), ("living room", (2.5, 2)), ("bedroom", (7, 2)), ("bath", (1, 6.5)), ("study", (4, 7))):
        plan.room(name, inside)
    plan.wall((0, 4.25), (6.65, 4.25))
    plan.wall((5.25, 0), (5.25, 4.25))
    plan.wall((0, 5.45), (9.0, 5.45))
    plan.wall((2.45, 5.45), (2.45, 8.3))
    plan.wall((6.65, 4.25), (6.65, 8.3))
    plan.door((2.1, 4.25), (2.9, 4.25), leaf_deg=-95)
    plan.door((6.65, 5.2), (6.65, 4.4), leaf_deg=-4)
    plan.door((2.2, 5.45), (1.4, 5.45), leaf_deg=86)
    plan.door((6.2, 5.45), (5.4, 5.45), leaf_deg=78)
    # hall: shoe cupboard
    plan.put(3.6, 5.05, 4.6, 5.45)
    living_room_of_the_flat(plan)
    # bedroom: double bed, nightstands, wardrobe with a slit to the corner, dresser, ottoman
    plan.put(6.95, 1.2, 9.0, 2.85)
    plan.put(8.6, 0.8, 9.0, 1.2)
    plan.put(8.6, 2.85, 9.0, 3.25)
    plan.put(5.25, 0.4, 5.9, 2.8)
    plan.put(8.55, 3.9, 9.0, 5.0)
    plan.put_round(6.55, 3.55, 0.2, 14)
    # bath: tub, toilet, basin on a cabinet
    plan.put(0, 6.0, 0.75, 7.7)
    toilet(plan, 1.25, 7.7, -90)
    plan.put(1.98, 6.75, 2.45, 7.42)
    # study: desk on two side panels, office chair, book shelf, daybed
    plan.put(3.3, 7.65, 3.34, 8.3)
    plan.put(4.7, 7.65, 4.74, 8.3)
    plan.put_star(4.1, 7.0, 0.3)
    plan.put(2.45, 5.95, 2.85, 7.35)
    plan.put(5.7, 6.5, 6.65, 8.3)
    return plan


def living_room_of_the_flat(plan):
    # kitchen in the corner: cupboards, fridge
    plan.put(0, 0, 2.4, 0.6)
    plan.put(0, 0.6, 0.6, 1.7)
    plan.put(0, 1.7, 0.66, 2.35)
    # dining table on legs with four chairs, one of them pulled out and turned
    plan.put_legs(1.75, 2.1, 1.4, 0.85, leg=0.07)
    plan.put_legs(1.4, 3.0, 0.49, 0.49, leg=0.04)
    plan.put_legs(2.42, 1.2, 0.49, 0.49, leg=0.04, deg=35)
    # sofa, coffee table, armchair, television board, plant in the corner
    plan.put(4.3, 0.85, 5.25, 2.65)
    plan.put_turned(3.55, 1.65, 0.55, 0.95, 0)
    plan.put_turned(3.75, 3.25, 0.72, 0.76, 24)
    plan.put(3.2, 0, 4.25, 0.38)
    plan.put_round(4.97, 0.22, 0.16, 12)


def slanted_house():
    """Walls that are not at right angles: a slanted front with a corridor square to it, a bay window, a round tower."""
    slant = math.degrees(math.atan2(-1.6, 2.0))  # the corridor's direction, square to the slanted front
    border = unary_union([
        Polygon(((0, 0), (9.6, 0), (9.6, 7.4), (1.6, 7.4), (0, 5.4))),
        Polygon(((1.5, 0.01), (1.5, 0), (2.1, -0.8), (3.7, -0.8), (4.3, 0), (4.3, 0.01))),
        Polygon(arc(9.3, 7.1, 1.6, 0, 355, 71)),
    ])
    plan = Plan("slanted_house", border, "bay window, round tower at a corner, corridor and rooms with slanted walls; doors open")
    c, s = math.cos(math.radians(slant)), math.sin(math.radians(slant))

    def at(along, aside):  # the corridor's own frame: metres from the middle of the slanted front, metres to the left
        return (0.8 + c * along - s * aside, 6.4 + s * along + c * aside)

    plan.start = tuple(round(v, 3) for v in at(0.5, 0.0))
    half, end = 0.65, 5.6
    plan.wall(at(-0.2, -half), at(end, -half), at(end, half), at(-0.2, half))
    plan.wall(at(end, -half), (at(end, -half)[0], 0))
    plan.wall(at(end, half), (9.6, at(end, half)[1]))
    bath_x = 4.3
    bath_along = (bath_x - 0.8 + s * half) / c
    plan.wall(at(bath_along, half), (bath_x, 7.4))
    plan.door(at(2.1, -half), at(1.3, -half), leaf_deg=slant - 85)       # to the living room
    plan.door(at(2.6, half), at(3.4, half), leaf_deg=slant + 100)        # to the bath
    plan.door(at(end - 0.15, half), at(end - 0.95, half), leaf_deg=slant + 75)   # to the kitchen
    plan.door(at(end, -0.4), at(end, 0.4), leaf_deg=slant - 10)          # to the bedroom
    for name, inside in (("corridor", at(2, 0)), ("living room", (2, 1)), ("bath", (3.9, 6.8)), ("kitchen", (8, 5)), ("bedroom", (8, 1))):
        plan.room(name, inside)
    # living room: corner sofa, table of five sides, book shelf square to the slanted wall
    plan.put_shape(((0, 0.3), (0.9, 0.3), (0.9, 2.0), (1.2, 2.0), (1.2, 2.9), (0, 2.9)))
    plan.put_shape(arc(2.5, 1.5, 0.4, 90, 378, 4))
    plan.put_turned(*at(3.6, -half - 0.2), 1.2, 0.4, slant)
    # bath: corner shower, basin
    plan.put_shape([(4.25, 7.4), *arc(4.25, 7.4, 0.95, 180, 270, 8)])
    plan.put(2.55, 7.05, 3.1, 7.4)
    # kitchen: cupboards along the wall, a round table in the tower, an island counter at an angle
    plan.put(4.9, 6.8, 7.2, 7.4)
    plan.put_round(9.35, 7.1, 0.45, 28)
    plan.put_turned(7.3, 5.3, 1.3, 0.6, 20)
    # bedroom: bed with its head at the right wall, nightstand, wardrobe
    plan.put(7.6, 1.0, 9.6, 2.6)
    plan.put(9.15, 0.55, 9.6, 1.0)
    plan.put(5.6, 0, 7.0, 0.6)
    return plan


def fig3_barriers():
    """The paper's Fig. 3: triangle, rectangle, another polygon and a circle, all free-standing in one room."""
    plan = Plan("fig3_barriers", box(0, 0, 6.4, 5.2), "the four kinds of inside barrier of the paper's Fig. 3", has_furniture=False)
    plan.start = (0.6, 0.5)
    plan.room("room", (3.2, 2.6))
    plan.put_shape(((1.2, 3.3), (2.2, 3.3), (1.7, 4.2)))
    plan.put(4.1, 3.3, 5.2, 4.0)
    plan.put_shape(((1.2, 1.5), (1.6, 1.1), (2.2, 1.2), (2.4, 1.7), (1.9, 2.1), (1.3, 2.0)))
    plan.put_round(4.6, 1.6, 0.4, 32)
    return plan


def toilet(plan, x, y, deg):
    """A toilet with its back at (x, y), looking along deg: a box with a round front."""
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    shape = [(-0.02, 0.19), (-0.02, -0.19), *arc(0.36, 0, 0.19, -90, 90, 8)]
    plan.put_shape([(x + c * u - s * v, y + s * u + c * v) for u, v in shape])


PLANS = (studio, flat, slanted_house, fig3_barriers, office)
