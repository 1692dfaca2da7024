"""The table that a mission ends with, and a picture of lines for the terminal."""

from host_tools.braille import Braille, View
from host_tools.score import obstacle_rings

COLUMNS, ROWS = 72, 22
PICTURE_MARGIN_M = 0.2
CLOCK_MHZ = 120  # of the STM32F205


def table(result):
    """Lines of text: one a group of figures; what was not measured is a dash."""
    time, where, shape = result["time"], result["localisation"], result["map"]
    memory, tick, stats = result["memory"], result["tick"], result["link_stats"]
    outcome = "finished" if result["finished"] else "NOT finished"
    rows = [
        ("mission", "%s: %s" % (outcome, result["reason"] or "no reason given")
         + ("; degraded: " + ", ".join(result["degraded"]) if result["degraded"] else "")),
        ("home", "%s   %s, core on %s over %s, UWB %s, odometry %s, seed %d" % (
            result["home"], result["mode"], result["target"], result["link"], result["uwb"], result["odometry"], result["seed"])),
        ("time", "robot %s s   wall %s s   factor %s   path %s m   lower bound %s s   contacts %s" % (
            _n(time["robot_s"], 1), _n(time["wall_s"], 1), _factor(time["real_time_factor"]), _n(time["path_m"], 1),
            _n(time["lower_bound_s"], 1), _n(time["contacts"]))),
        ("position error", "%-16s %9s %9s %9s" % ("cm, %d stops" % where["stops"], "mean", "p95", "max")),
    ]
    for key in ("estimate", "dead_reckoning", "uwb_only", "paper_rule"):
        error = where[key]
        rows.append(("", "%-16s %9s %9s %9s" % (key, *(_n(error[k], 1) for k in ("mean_cm", "p95_cm", "max_cm")))))
    rows += [
        ("", "%-16s %9s" % ("trajectory rmse", _n(where["trajectory_rmse_cm"], 1))),
        ("map", "vectors %s   chains %s   regions %s of %s   RAM %s of %s B   stored %s B" % (
            _n(shape["vectors"]), _n(shape["chains"]), _n(shape["regions"]), _n(shape["true_rooms"]),
            _n(shape["ram_bytes"]), _n(shape["ram_capacity_bytes"]), _n(shape["stored_bytes"]))),
        ("walls in 5 cm", "%-16s %9s %9s" % ("", "precision", "recall")),
        ("", "%-16s %9s %9s" % ("outline", _n(shape["outline_precision_5cm"], 3), _n(shape["outline_recall_5cm"], 3))),
        ("", "%-16s %9s %9s" % ("all", _n(shape["precision_5cm"], 3), _n(shape["recall_5cm"], 3))),
        ("", "hausdorff p95 %s cm   free space IoU %s   closure %s -> %s cm" % (
            _n(shape["hausdorff_p95_cm"], 1), _n(shape["iou_free"], 3), _n(shape["closure_cm"]["before"], 1),
            _n(shape["closure_cm"]["after"], 1))),
        ("memory", "heap %s B, peak %s B, locked %s, allocated after boot %s B" % (
            _n(memory["heap_bytes"]), _n(memory["heap_peak_bytes"]), _yes(memory["heap_locked"]),
            _n(memory["allocated_after_boot_bytes"]))),
    ]
    if memory["flash_bytes"] is not None:
        rows.append(("", "flash %s B, static RAM %s B, stack peak %s B, up %s s after power-on" % (
            memory["flash_bytes"], _n(memory["static_ram_bytes"]), _n(memory["stack_peak_bytes"]), _n(memory["boot_s"], 2))))
    stores = ["%s %d/%d" % (name, store["used"], store["capacity"]) for name, store in memory["stores"].items()]
    rows += [("" if i else "stores", "   ".join(stores[i:i + 5])) for i in range(0, len(stores), 5)]
    rows += [
        ("tick", _tick(tick)),
        ("link", "%s frames   %s bytes   retransmits %s   dropped %s" % (
            _n(stats["frames"]), _n(stats["bytes"]), _n(stats["retransmits"]), _dropped(stats["dropped_by_cause"]))),
    ]
    rows += _storage(result["storage"]) + _free_run(result["free_run"]) + _can(result["can"])
    rows.append(("hash", "steps %s   map %s" % (_n(result["hash"]["steps"]), _n(result["hash"]["map"]))))
    return ["%-15s %s" % row for row in rows]


def _tick(tick):
    """In instructions where they are counted: there the time is the emulator's, of no meaning for the part."""
    if tick["instructions_max"] is None:
        return "%s ticks   p50 %s us   p99 %s us   max %s us" % tuple(_n(tick[key], 0) for key in ("count", "p50_us", "p99_us", "max_us"))
    p99, most = tick["instructions_p99"], tick["instructions_max"]
    return "%s ticks   p99 %d k, max %d k instructions: %.1f and %.1f ms at %d MHz with one cycle an instruction" % (
        _n(tick["count"]), round(p99 / 1000), round(most / 1000), p99 / CLOCK_MHZ / 1000, most / CLOCK_MHZ / 1000, CLOCK_MHZ)


def _storage(figures):
    if not figures["nvm_bytes"]:
        return []
    loaded = [one["loaded"] for one in figures["found"] or [] if one["loaded"]]
    return [("storage", "loaded: %s   kept: %s   %d B in %d pieces and %d erases, of a memory of %d B   restarts %s" % (
        loaded[-1] if loaded else "nothing", figures["kept"] or "nothing", figures["written_bytes"], figures["programs"],
        figures["erases"], figures["nvm_bytes"], _n(figures["restarts"])))]


def _free_run(figures):
    if figures["drift_ppm"] is None:
        return []
    return [("free run", "core %s ticks late, worst %s ms   host %s answers late, %s ticks missed   drift %s ppm, residual %s ms" % (
        _n(figures["core_late_ticks"]), _n(figures["core_late_ms"]), figures["late_answers"], figures["missed_ticks"],
        _n(figures["drift_ppm"], 0), _n(figures["residual_ms"], 2)))]


def _can(figures):
    if figures["frames"] is None:
        return []
    load, busiest = (_n(figures[key] and 100 * figures[key], 1) for key in ("bus_load", "bus_load_max"))
    return [("CAN bus", "%d frames   load %s %%, busiest step %s %% of 500 kbit/s at 50 steps/s   lost %d, refused %d, dropped %d" % (
        figures["frames"], load, busiest, figures["lost"], figures["refused"], figures["dropped"]))]


def picture(home, vector_map):
    """The corners of the true walls as dots, the mapped vectors as lines, and a line that says so."""
    xs, ys = [p[0] for p in home.outline], [p[1] for p in home.outline]
    raster = Braille(COLUMNS, ROWS)
    view = View.fit(raster, (min(xs) - PICTURE_MARGIN_M, min(ys) - PICTURE_MARGIN_M,
                             max(xs) + PICTURE_MARGIN_M, max(ys) + PICTURE_MARGIN_M))
    for ring in [home.outline, *obstacle_rings(home)]:
        for x, y in ring:
            view.dot(x, y)
    for x0, y0, x1, y1 in vector_map.vectors():
        view.line(x0, y0, x1, y1)
    return [line.replace("\u2800", " ").rstrip() for line in raster.lines()] + ["lines: the map   dots: corners of the true walls", ""]


def _n(value, digits=None):
    """A figure as text; a dash where there is none."""
    if value is None:
        return "-"
    return str(value) if digits is None else "%.*f" % (digits, value)


def _factor(value):
    """A whole number tells too little of what is near real time."""
    return _n(value, 1 if value is not None and value < 10 else 0)


def _yes(value):
    return "-" if value is None else "yes" if value else "no"


def _dropped(by_cause):
    some = ["%s %s" % item for item in sorted(by_cause.items()) if item[1]]
    return ", ".join(some) if some else "none" if by_cause else "-"
