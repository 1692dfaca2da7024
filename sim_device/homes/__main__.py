"""`python -m sim_device.homes [FOLDER]` draws every plan again and writes one JSON file each."""
import sys
from pathlib import Path

from sim_device.homes.draw import PlanError, as_text
from sim_device.homes.plans import PLANS


def main(arguments):
    folder = Path(arguments[0]) if arguments else Path(__file__).parent
    for plan in PLANS:
        home = plan().home()
        (folder / (home["name"] + ".json")).write_text(as_text(home), encoding="utf-8")
        print("%-14s %4d vectors  %2d obstacles  %5.1f m2 free  %d rooms" % (
            home["name"], home["segments_total"], home["obstacle_count"], home["free_area_m2"], len(home["rooms"])))


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except (PlanError, OSError) as error:
        sys.exit("homes: %s" % error)
