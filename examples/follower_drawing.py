# Draws what the wall follower decides in one place: a wall on the right, another one ahead.
# The hits go through the core's own HitRing and Follower; the picture in docs/ is this one.
#
#   python examples/follower_drawing.py [FILE.svg]        default docs/follower.svg

import math
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(PROJECT))

from firmware_py.collection.follower import LINEAR, Follower  # noqa: E402
from firmware_py.storage.hit_ring import HitRing  # noqa: E402

HITS_MM = [(x, -205) for x in range(-200, 251, 50)] + [(255, y) for y in range(-180, 241, 50)]
WINDOW_BAM = 3641       # 20 degrees, as in FOLLOW
WIDTH, HEIGHT, FAN_MM = 700, 640, 118


def decided():
    """The follower after one look, and the heading that it chose, in degrees."""
    ring = HitRing()
    for x_mm, y_mm in HITS_MM:
        ring.add(x_mm, y_mm, 0)
    follower = Follower(ring)
    follower.look(0, 0, 0, WINDOW_BAM)
    heading = follower.solve()
    follower._scan(follower.disc_mm, LINEAR)  # its sectors again: solve() tried a narrower disc last
    return follower, degrees(heading)


def degrees(bam):
    return bam * 360 / 65536


def place(distance_mm, bearing):
    """A point of the drawing: ahead is up, left is left."""
    a = math.radians(bearing)
    return 350 - distance_mm * math.sin(a), 330 - distance_mm * math.cos(a)


def line(a, b, colour, width=1, more=""):
    return f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" stroke="{colour}" stroke-width="{width}" {more}/>'


def circle(at, radius, style):
    return f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius}" {style}/>'


def text(x, y, words, size=14, more=""):
    return f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" {more}>{words}</text>'


def marker(name, size, path, x, y, colour):
    return (f'<marker id="{name}" markerWidth="{size}" markerHeight="{size}" refX="{x}" refY="{y}" orient="auto">'
            f'<path d="{path}" fill="{colour}"/></marker>')


def arc(radius_mm, start, end):
    """The way along a circle from one bearing to another, counter-clockwise."""
    (x0, y0), (x1, y1) = place(radius_mm, start), place(radius_mm, end)
    return f"M {x0:.1f} {y0:.1f} A {radius_mm} {radius_mm} 0 {int(end - start > 180)} 0 {x1:.1f} {y1:.1f}"


def drawing():
    follower, heading = decided()
    reference = degrees(follower.reference_bearing)
    centre = place(0, 0)
    parts = [circle(centre, follower.disc_mm, 'fill="none" stroke="#999" stroke-dasharray="5 5"'),
             circle(centre, follower.body_mm, 'fill="#eef1f6" stroke="#445"')]
    for i in range(follower.near):
        at = place(follower.near_mm[i], degrees(follower.near_bearing[i]))
        half = degrees(follower._blocks[i])
        if half > 0:
            bearing = degrees(follower.near_bearing[i])
            fan = arc(FAN_MM, bearing - half, bearing + half)
            parts.append(f'<path d="{fan} L {centre[0]} {centre[1]} Z" fill="#c23b22" opacity="0.06"/>')
        parts.append(circle(at, 4, 'fill="#c23b22"'))
    nearest = place(follower.reference_mm, reference)
    parts += [
        circle(nearest, 9, 'fill="none" stroke="#2f6fb3" stroke-width="2"'), line(centre, nearest, "#2f6fb3", 1.5),
        f'<path d="{arc(60, reference, heading)}" fill="none" stroke="#2f6fb3" stroke-width="2" marker-end="url(#tip)"/>',
        line(centre, place(150, 0), "#999", 1.5, 'stroke-dasharray="4 4"'),
        line(centre, place(150, heading), "#167a3e", 4, 'marker-end="url(#go)"'),
        text(570, 300, "wall followed", 15, 'fill="#c23b22"'), text(420, 62, "wall ahead", 15, 'fill="#c23b22"'),
        text(570, 355, "reference: the nearest", 15, 'fill="#2f6fb3"'), text(570, 374, "hit on the right", 15, 'fill="#2f6fb3"'),
        text(20, 572, f"Body {follower.body_mm} mm, disc {follower.disc_mm} mm (dashed). Red: the headings that some hit blocks."),
        text(20, 594, f"Blue: the scan from the reference, counter-clockwise. Green: the first free heading, {heading:.0f} degrees left."),
        text(20, 624, "Made by examples/follower_drawing.py from the core's own code.", 13, 'fill="#666"'),
    ]
    tips = marker("tip", 9, "M0 0 L8 4 L0 8 Z", 5, 4, "#2f6fb3") + marker("go", 5, "M0 0 L4 2 L0 4 Z", 2, 2, "#167a3e")
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH + 60} {HEIGHT}" font-family="sans-serif">\n'
            f'<defs>{tips}</defs>\n<rect width="{WIDTH + 60}" height="{HEIGHT}" fill="white"/>\n')
    return head + "\n".join(parts) + "\n</svg>\n"


if __name__ == "__main__":
    Path(sys.argv[1] if len(sys.argv) > 1 else PROJECT / "docs" / "follower.svg").write_text(drawing(), encoding="utf-8")
