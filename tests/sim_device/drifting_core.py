# The core on CPython with a clock of its own that runs fast or slow, or jumps:
#
#   python tests/sim_device/drifting_core.py PATH --rate 1.01 --jump-ms 70 --jump-at-s 3

import argparse
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))

from firmware_py import main as firmware  # noqa: E402
from firmware_py.ports.host import Port  # noqa: E402


class DriftingPort(Port):
    rate, jump_ms, jump_at_s, start_s = 1.0, 0.0, float("inf"), time.monotonic()

    def ticks_ms(self):
        passed_s = time.monotonic() - self.start_s
        return int(passed_s * 1000 * self.rate + (self.jump_ms if passed_s > self.jump_at_s else 0)) & 0x3FFFFFF


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("path")
    for name in ("rate", "jump-ms", "jump-at-s"):
        parser.add_argument("--" + name, type=float)
    for name, value in vars(parser.parse_args()).items():
        if name != "path" and value is not None:
            setattr(DriftingPort, name, value)
    firmware.Port = DriftingPort
    return firmware.main(sys.argv[1])


if __name__ == "__main__":
    sys.exit(main())
