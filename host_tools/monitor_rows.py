"""The monitor's state as rows of text and runs of a picture: pure, the same for every kind of terminal.

A row is (label, text, mood), mood one of "", "good", "warn", "bad", "dim". A picture
is a list of lines, a line a list of (text, kind) runs, kind one of "blank", "wall",
"path", "robot", "anchor", "beam", "body".
"""

import itertools
import math

from host_tools.braille import Braille, View

_BLOCKS = " ▏▎▍▌▋▊▉█"
_ARROWS = "→↗↑↖←↙↓↘"
_BLANK = 0x2800
# What the map is made of: full, these refuse, and the mission is the poorer for it. All others replace the oldest by design.
_REFUSE_WHEN_FULL = ("vectors", "chains", "regions", "nodes", "edges")
_LINK_FAULTS = ("bad_cobs", "bad_crc", "bad_length", "bad_header", "bad_id", "bad_value", "overrun")


def bar(used, capacity, width):
    """A bar of `width` characters, in eighths; full is full only at capacity."""
    if capacity <= 0 or width <= 0:
        return "·" * max(0, width)
    eighths = min(8 * width, max(0, 8 * width * used // capacity))
    whole, rest = divmod(eighths, 8)
    return ("█" * whole + (_BLOCKS[rest] if rest else "")).ljust(width, "·")


def number(value):
    """1234567 as 1,234,567."""
    return "{:,}".format(value)


def mission_rows(state):
    pose = state.pose
    name = state.state_name
    mood = {"DONE": "good", "FAILED": "bad", "LOST": "bad", "STUCK": "warn", "BUMP": "warn"}.get(name, "")
    rows = [("state", name, mood), ("robot time", "%.1f s, step %s" % (state.robot_s, number(state.steps)), "")]
    if pose is None:
        rows.append(("pose", "not heard yet", "dim"))
    else:
        rows += [
            ("pose", "x %.3f m  y %.3f m  heading %.1f°" % (
                pose.x_um * 1e-6, pose.y_um * 1e-6, math.degrees(state.heading_rad())), ""),
            ("odometry", "x %.3f m  y %.3f m  heading %.1f°" % (
                pose.odometry_x_um * 1e-6, pose.odometry_y_um * 1e-6,
                pose.odometry_heading_bam * 360 / 65536), "dim"),
            ("path", "%.2f m" % (pose.path_mm / 1000), ""),
            ("points", number(pose.points), ""),
            ("vectors", number(pose.vectors), ""),
            ("fixes", number(pose.fixes), ""),
            ("bumps", number(pose.bumps), "warn" if pose.bumps else ""),
        ]
    if state.degraded:
        rows.append(("degraded", ", ".join(state.degraded), "warn"))
    if state.answer is not None:
        rows.append(("wheels", "left %d  right %d mm/s" % (state.answer.left_mm_s, state.answer.right_mm_s), ""))
    if state.error is not None:
        rows.append(("last ERROR", "code %d on message 0x%02x, detail %d" % (
            state.error.code, state.error.message_id, state.error.detail), "warn"))
    return rows


def store_rows(state, width=16):
    """Every store of the core: a bar, used of capacity, bytes, and what was replaced or lost for want of room."""
    rows, fixed, fixed_bytes = [], 0, 0
    for index in sorted(state.stores):
        store = state.stores[index]
        used, capacity = store.used, store.capacity
        if store.record_bytes == 1 and used == capacity:
            # A buffer of fixed size: its bar would always be full.
            fixed, fixed_bytes = fixed + 1, fixed_bytes + capacity
            continue
        text = "%s %*d/%d" % (bar(used, capacity, width), len(str(capacity)), used, capacity)
        text += "  %s B" % number(capacity * store.record_bytes)
        mood = ""
        if store.lost:
            refuses = store.name in _REFUSE_WHEN_FULL
            text += "  %s %s" % (number(store.lost), "lost" if refuses else "replaced")
            mood = "warn" if refuses else ""
        rows.append((store.name or "store %d" % index, text, mood))
    if fixed:
        rows.append(("buffers", "%d of fixed size, %s B" % (fixed, number(fixed_bytes)), ""))
    return rows or [("stores", "not heard yet", "dim")]


def memory_rows(state, width=16):
    memory = state.memory
    if memory is None:
        return [("memory", "not heard yet", "dim")]
    used, total, after = memory.heap_used_bytes, memory.heap_bytes, memory.allocated_after_boot_bytes
    rows = [("heap", "%s %s of %s B" % (bar(used, total, width), number(used), number(total)), "")] if total else [
        ("heap", "not limited on this target", "dim")]
    return rows + [
        ("heap locked", "yes" if memory.heap_locked else "no", "good" if memory.heap_locked else "warn"),
        ("after boot", "%s B allocated" % number(after), "bad" if after else "good"),
    ]


def link_rows(state, tap=None):
    """The core's own counters, then what this monitor's reader met on the tap (HostLink.counts())."""
    rows = []
    link = state.link
    if link is None:
        rows.append(("core's link", "not heard yet", "dim"))
    else:
        rows += [
            ("frames in", "%s, %s B" % (number(link.frames_in), number(link.bytes_in)), ""),
            ("frames out", "%s, %s B" % (number(link.frames_out), number(link.bytes_out)), ""),
            ("repeated", "%s steps, %s telemetry dropped" % (
                number(link.duplicates), number(link.telemetry_dropped)), ""),
        ]
        faults = ["%s %d" % (name.replace("bad_", ""), getattr(link, name)) for name in _LINK_FAULTS if getattr(link, name)]
        rows.append(("bad frames", ", ".join(faults) or "none", "warn" if faults else "good"))
    if tap is not None:
        bad = sum(tap[cause] for cause in _LINK_FAULTS)
        rows.append(("tap", "%s frames, %s B%s" % (number(tap["frames_in"]), number(tap["bytes_in"]), (
            ", %d cut or damaged" % bad if bad else "")), "dim"))
    return rows


def infrared_rows(state):
    """The state of Table 1 and the eight readings: 10-bit counts, near is high."""
    code = state.ir_state
    rows = [("state", "not heard yet", "dim") if code is None else
            ("state", "S%d  %s" % (code + 1, format(code, "08b")), "")]
    if state.step is None:
        return rows + [("readings", "not heard yet", "dim")]
    for j, count in enumerate(state.step.ir):
        near = code is not None and code >> (7 - j) & 1  # Table 1: I8 is the least significant bit
        rows.append(("I%d %+4.0f°" % (j + 1, state.ir_bearings_deg[j]), "%s %4d" % (
            bar(count, 1023, 10), count), "warn" if near else ""))
    sound = state.step.ultrasonic_mm
    bumps = state.step.bump
    rows.append(("ultrasonic", {0: "no new reading", 65535: "no echo"}.get(sound, "%d mm" % sound), ""))
    rows.append(("bumper", format(bumps, "08b") if bumps else "free", "warn" if bumps else ""))
    return rows


def infrared_picture(state, columns=21, rows=10):
    """The robot from above, ahead is up, with a beam per sensor: its length follows the reading."""
    raster = Braille(columns, rows)
    scale = raster.height / 0.9     # 0.9 m from top to bottom
    beams = Braille(columns, rows)
    x0, y0 = raster.width / 2 - 0.5, raster.height / 2 - 0.5
    for i in range(48):
        angle = i * math.tau / 48
        raster.dot(round(x0 + 0.17 * scale * math.cos(angle)), round(y0 + 0.17 * scale * math.sin(angle)))
    raster.line(x0, y0, x0, y0 + 0.10 * scale)
    readings = state.step.ir if state.step else ()
    for bearing_deg, count in zip(state.ir_bearings_deg, readings):
        angle = math.radians(90 + bearing_deg)
        near, far = 0.12, 0.12 + beam_m(count)
        beams.line(x0 + near * scale * math.cos(angle), y0 + near * scale * math.sin(angle),
                   x0 + far * scale * math.cos(angle), y0 + far * scale * math.sin(angle))
    return _runs(((beams, "beam"), (raster, "body")))


def beam_m(count):
    """About how far a reading looks, for drawing only: the usual 4-30 cm part gives 13 V cm / distance at 3.3 V full scale."""
    return min(0.30, 0.13 * 310 / max(count, 1))


def map_picture(state, columns, rows, zoom=1.0):
    """Walls, path, anchors and the robot's arrow; zoomed in, the view follows the robot."""
    walls, path = Braille(columns, rows), Braille(columns, rows)
    centre = state.position_m() if zoom > 1.0 else None
    view = View.fit(walls, state.bounds_m(), zoom, centre)
    trail = View.fit(path, state.bounds_m(), zoom, centre)
    for x0, y0, x1, y1 in state.walls_m():
        view.line(x0, y0, x1, y1)
    for x_m, y_m in state.path_m:
        trail.dot(x_m, y_m)
    marks = {}
    for index in sorted(state.anchors):
        if index < state.anchor_count:
            marks[view.cell(state.anchors[index][0] / 1000, state.anchors[index][1] / 1000)] = ("△", "anchor")
    robot = state.position_m()
    if robot is not None:
        marks[view.cell(*robot)] = (_ARROWS[round(state.heading_rad() / math.tau * 8) % 8], "robot")
    marks.pop(None, None)   # outside the picture
    return _runs(((walls, "wall"), (path, "path")), marks)


def _runs(layers, marks=None):
    """Two layers (raster, kind) as one picture: dots add up, the first layer with a dot names the kind."""
    marks = marks or {}
    kinds = [kind for _, kind in layers]
    picture = []
    for row, cells in enumerate(zip(*(raster.cells() for raster, _ in layers))):
        dots = [a | b for a, b in zip(*cells)]
        names = [kinds[0] if a else kinds[1] if b else "blank" for a, b in zip(*cells)]
        text = [chr(_BLANK + cell) if cell else " " for cell in dots]
        for (column, mark_row), (mark, kind) in marks.items():
            if mark_row == row:
                text[column], names[column] = mark, kind
        picture.append([("".join(text[start:end]), name) for name, start, end in _groups(names)])
    return picture


def _groups(names):
    """Runs of equal names as (name, start, end)."""
    start = 0
    for name, group in itertools.groupby(names):
        end = start + len(list(group))
        yield name, start, end
        start = end


def plain_line(state):
    """All that matters in one line, for pipes and logs."""
    parts = ["%8.1f s" % state.robot_s, "%-13s" % state.state_name]
    pose = state.pose
    if pose is not None:
        parts.append("x %7.3f y %7.3f m %6.1f°" % (
            pose.x_um * 1e-6, pose.y_um * 1e-6, math.degrees(state.heading_rad())))
        parts.append("path %.1f m  points %d  vectors %d  fixes %d  bumps %d" % (
            pose.path_mm / 1000, pose.points, pose.vectors, pose.fixes, pose.bumps))
    if state.ir_state is not None:
        parts.append("ir %s" % format(state.ir_state, "08b"))
    if state.degraded:
        parts.append("degraded: %s" % ", ".join(state.degraded))
    if state.memory is not None and state.memory.heap_bytes:
        parts.append("heap %s of %s B%s" % (
            number(state.memory.heap_used_bytes), number(state.memory.heap_bytes),
            " locked" if state.memory.heap_locked else ""))
    return "  ".join(parts)


def summary(state):
    """One sentence on where the mission stands."""
    if state.pose is None and state.state is None:
        return "nothing of a mission was heard"
    text = "%s after %.1f s of robot time" % (state.state_name, state.robot_s)
    if state.pose is not None:
        text += ", %.1f m of path, %d points, %d vectors, %d bumps" % (
            state.pose.path_mm / 1000, state.pose.points, state.pose.vectors, state.pose.bumps)
    return text
