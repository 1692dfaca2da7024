# The README's table of figures, from whole missions:  python -m benchmarks.figures [--quick]
#
# Each home is mapped through `host_tools hil`, seeds 1 to 3, with the core in the MicroPython VM and on CPython, and once
# more without UWB. Of the seeds the worst figure is told. Missions run one after another: two at once would
# spoil the real-time factor. Exit code 0: all finished, and both targets agree; 1: not so; 2: hil refused.

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
REAL = ("vac_flat_d", "tb3_house", "giraff_c", "arch_flat_77")
SEEDS = (1, 2, 3)
# column: the options of hil that it stands for
KINDS = {
    "unix": ("--target", "unix"),
    "cpython": ("--target", "cpython"),
    "no_uwb": ("--target", "unix", "--uwb", "none"),
}
HEAD = ("home", "finished", "outline precision / recall", "position error, mean / p95", "bumps", "times real time, unix / cpython",
        "allocated after boot", "unix = cpython", "without UWB: precision / recall", "mean / p95")


def homes():
    """What to give hil, by name: the real homes where they lie beside the clone, else those that ship."""
    if REAL_HOMES.is_dir():
        return {name: str(REAL_HOMES / (name + ".json")) for name in REAL}
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
    """Whether core and core agree, step by step and in the map, on every seed."""
    pairs = zip(results["unix"], results["cpython"], strict=True)
    return all(a["hash"] == b["hash"] and None not in a["hash"].values() for a, b in pairs)


def good(results):
    return all(r["finished"] and not r["degraded"] for kind in KINDS for r in results[kind]) and same(results)


def row(name, results):
    """One home's cells."""
    told = results["unix"] + results["cpython"]
    alone = results["no_uwb"]
    everything = told + alone
    finished = sum(r["finished"] for r in everything)
    return (
        name, f"{finished} of {len(everything)}",
        _pair(told, "map.outline_precision_5cm", "map.outline_recall_5cm", min, 3),
        _pair(told, "localisation.estimate.mean_cm", "localisation.estimate.p95_cm", max, 1, " cm"),
        _n(worst(told, "time.contacts", max)),
        f"{_n(worst(results['unix'], 'time.real_time_factor', min), 0)} / {_n(worst(results['cpython'], 'time.real_time_factor', min), 0)}",
        _n(worst(results["unix"] + alone, "memory.allocated_after_boot_bytes", max), 0, " B"),
        "yes" if same(results) else "NO",
        _pair(alone, "map.outline_precision_5cm", "map.outline_recall_5cm", min, 3),
        _pair(alone, "localisation.estimate.mean_cm", "localisation.estimate.p95_cm", max, 1, " cm"),
    )


def markdown(rows):
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [HEAD, ("---",) * len(HEAD), *rows])


def _pair(results, first, second, of, digits, unit=""):
    return f"{_n(worst(results, first, of), digits)} / {_n(worst(results, second, of), digits)}{unit}"


def _n(value, digits=0, unit=""):
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def main(argv=None):
    parser = argparse.ArgumentParser(prog="python -m benchmarks.figures", description="The README's table of figures.", allow_abbrev=False)
    parser.add_argument("--quick", action="store_true", help="seed 1 only")
    seeds = SEEDS[:1] if parser.parse_args(argv).quick else SEEDS
    begun = time.monotonic()
    rows, all_good = [], True
    with tempfile.TemporaryDirectory(prefix="tvslam-") as folder:
        for name, home in homes().items():
            results = {}
            for kind, options in KINDS.items():
                results[kind] = [mission(home, seed, options, folder) for seed in seeds]
                print(f"{name} {kind}: {time.monotonic() - begun:.0f} s since the start", file=sys.stderr, flush=True)
            rows.append(row(name, results))
            all_good = good(results) and all_good
    print(markdown(rows))
    print()
    print("`python -m benchmarks.figures%s`: the worst of %s; calibrated odometry, UWB preset `paper`." % (
        " --quick" if len(seeds) == 1 else "", "seed 1" if len(seeds) == 1 else "seeds 1 to %d" % seeds[-1]))
    return 0 if all_good else 1


if __name__ == "__main__":
    sys.exit(main())
