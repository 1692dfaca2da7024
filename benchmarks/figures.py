# The README's table of figures, from whole missions:  python -m benchmarks.figures [--quick]
#
# Each home is mapped through `host_tools hil`, seeds 1 to 3, with the core in the MicroPython VM: with UWB preset `paper`, with
# time of flight and poor odometry, with published signal strengths and poor odometry; and once more on CPython, for the hashes.
# Of the seeds the worst figure is told. `--stm32`: seed 1 on the emulated part, too. Missions run one after another: two at
# once would spoil the real-time factor. Exit code 0: all finished, and all targets agree; 1: not so; 2: hil refused.

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sim_device.home import home_names

PROJECT = Path(__file__).resolve().parent.parent
REAL_HOMES = PROJECT.parent / "shared" / "homes"
SEEDS = (1, 2, 3)
POOR = ("--odometry", "poor")
# column: the options of hil that it stands for
KINDS = {
    "unix": ("--target", "unix"),
    "cpython": ("--target", "cpython", "--link", "memory"),
    "tof": ("--target", "unix", "--uwb", "tof", *POOR),
    "rssi": ("--target", "unix", "--uwb", "rssi_real", *POOR),
}
STM32 = ("--target", "stm32", "--link", "semihost", "--heap", "27k")
HEAD = ("home", "finished", "error, mean: paper", "tof, poor", "rssi_real, poor", "walls, precision / recall: paper", "tof, poor",
        "free space IoU", "regions / rooms", "bumps", "robot time / lower bound", "times real time", "allocated after boot", "same hashes")


def homes():
    """What to give hil, by name: the real homes where they lie beside the clone, else those that ship."""
    if REAL_HOMES.is_dir():
        return {path.stem: str(path) for path in sorted(REAL_HOMES.glob("*.json"))}
    return {name: name for name in home_names()}


def mission(home, seed, options, folder):
    """The result file of one mission. Leaves where hil refuses to run it."""
    file = Path(folder) / "result.json"
    file.unlink(missing_ok=True)
    command = [sys.executable, "-m", "host_tools", "hil", home, "--seed", str(seed), "--json", str(file), *options]
    run = subprocess.run(command, cwd=PROJECT, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if not file.exists():
        print(run.stderr.strip() or f"hil ended with {run.returncode} and wrote no result", file=sys.stderr)
        sys.exit(2)
    return json.loads(file.read_text())


def worst(results, path, of):
    """The worst of these results' figures at `path` ("map.recall_5cm"), by min or max; None if one was not measured."""
    found = []
    for value in results:
        for key in path.split("."):
            value = value[key]
        found.append(value)
    return None if None in found else of(found)


def same(results):
    """Whether the targets agree, step by step and in the map, on every seed that they ran."""
    pairs = [pair for kind in ("cpython", "stm32") if kind in results for pair in zip(results["unix"], results[kind])]
    return all(a["hash"] == b["hash"] and None not in a["hash"].values() for a, b in pairs)


def good(results):
    return all(r["finished"] and not r["degraded"] for kind in results.values() for r in kind) and same(results)


def row(name, results):
    """One home's cells."""
    told, everything = results["unix"], [r for kind in results.values() for r in kind]
    finished = sum(r["finished"] for r in everything)
    regions = [r["map"]["regions"] for r in told]
    return (
        name, f"{finished} of {len(everything)}",
        *(_n(worst(results[kind], "localisation.estimate.mean_cm", max), 1, " cm") for kind in ("unix", "tof", "rssi")),
        *(_pair(results[kind], "map.precision_5cm", "map.recall_5cm", min, 3) for kind in ("unix", "tof")),
        _n(worst(told, "map.iou_free", min), 3),
        "%s / %s" % ("-" if None in regions else "-".join(map(str, sorted({min(regions), max(regions)}))),
                     _n(told[0]["map"]["true_rooms"])),
        _n(worst(told, "time.contacts", max)), _ratio(told), _n(worst(told, "time.real_time_factor", min)),
        _n(worst(told, "memory.allocated_after_boot_bytes", max), 0, " B"),
        "yes" if same(results) else "NO",
    )


def _ratio(results):
    times = [(r["time"]["robot_s"], r["time"]["lower_bound_s"]) for r in results]
    return "-" if any(None in pair for pair in times) else "%.2f" % max(robot / bound for robot, bound in times)


def markdown(rows):
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [HEAD, ("---",) * len(HEAD), *rows])


def _pair(results, first, second, of, digits, unit=""):
    return f"{_n(worst(results, first, of), digits)} / {_n(worst(results, second, of), digits)}{unit}"


def _n(value, digits=0, unit=""):
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def main(argv=None):
    parser = argparse.ArgumentParser(prog="python -m benchmarks.figures", description="The README's table of figures.", allow_abbrev=False)
    parser.add_argument("--quick", action="store_true", help="seed 1 only")
    parser.add_argument("--stm32", action="store_true", help="seed 1 on the emulated part as well")
    parser.add_argument("homes", nargs="*", metavar="HOME", help="only these")
    args = parser.parse_args(argv)
    seeds = SEEDS[:1] if args.quick else SEEDS
    begun = time.monotonic()
    rows, all_good = [], True
    with tempfile.TemporaryDirectory(prefix="tvslam-") as folder:
        for name, home in homes().items():
            if args.homes and name not in args.homes:
                continue
            results = {}
            for kind, options in (KINDS | ({"stm32": STM32} if args.stm32 else {})).items():
                results[kind] = [mission(home, seed, options, folder) for seed in (seeds[:1] if kind == "stm32" else seeds)]
                print(f"{name} {kind}: {time.monotonic() - begun:.0f} s since the start", file=sys.stderr, flush=True)
            rows.append(row(name, results))
            all_good = good(results) and all_good
    print(markdown(rows))
    print()
    print("`python -m benchmarks.figures%s%s%s`: the worst of %s; where no preset is named, `paper` and calibrated odometry." % (
        " --quick" if args.quick else "", " --stm32" if args.stm32 else "", "".join(" " + name for name in args.homes),
        "seed 1" if args.quick else "seeds 1 to %d" % seeds[-1]))
    return 0 if all_good else 1


if __name__ == "__main__":
    sys.exit(main())
