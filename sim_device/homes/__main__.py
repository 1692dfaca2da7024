"""`python -m sim_device.homes [FOLDER]` draws every plan again and writes one JSON file each.

`--floors COLUMNSxROWS` in place of that: the office floor laid side by side so many times.
"""
import argparse
import re
import sys
from pathlib import Path

from sim_device.homes.draw import PlanError, as_text
from sim_device.homes.office import office
from sim_device.homes.plans import PLANS


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m sim_device.homes", allow_abbrev=False, description="Draw the homes of this project.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent, help="where the files go (default: where they ship)")
    parser.add_argument("--floors", type=floors, metavar="COLUMNSxROWS", help="only the office floor, laid side by side so many times")
    options = parser.parse_args(arguments)
    plans = [plan() for plan in PLANS] if options.floors is None else [office(*options.floors)]
    for plan in plans:
        home = plan.home()
        (options.folder / (home["name"] + ".json")).write_text(as_text(home), encoding="utf-8")
        print("%-14s %4d vectors  %2d obstacles  %5.1f m2 free  %d rooms" % (
            home["name"], home["segments_total"], home["obstacle_count"], home["free_area_m2"], len(home["rooms"])))


def floors(text):
    if not re.fullmatch(r"[1-9]x[1-9]", text):
        raise argparse.ArgumentTypeError("%s is not two numbers from 1 to 9 like 2x2" % (text or "(empty)"))
    return int(text[0]), int(text[2])


if __name__ == "__main__":
    try:
        main()
    except (PlanError, OSError) as error:
        sys.exit("homes: %s" % error)
