# The whole product in one process and forty lines: a home, the virtual robot, the
# core, and the map that comes out. No link, no files.
#
#   python examples/mission_in_one_process.py [HOME] [SEED]

import sys
from array import array
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from firmware_py.pipeline import Tvslam  # noqa: E402
from protocol import states  # noqa: E402
from protocol.parameters import PARAMETERS  # noqa: E402
from protocol.schema import VALUES_MAX  # noqa: E402
from sim_device.config import RobotError, load_robot  # noqa: E402
from sim_device.home import HomeError, load_home  # noqa: E402
from sim_device.virtual_robot import VirtualRobot  # noqa: E402


def main(home_name="studio", seed=1):
    robot = VirtualRobot(load_home(home_name), load_robot(), int(seed))
    core = Tvslam()
    numbers = {parameter[0]: number for number, parameter in enumerate(PARAMETERS)}
    for name, values in robot.parameters().items():
        for index, value in enumerate(values):
            core.set_parameter(numbers[name], index, value)
    core.begin()

    values = array("i", bytes(4 * VALUES_MAX))
    while core.state not in (states.DONE, states.FAILED) and robot.tick < 180_000:  # an hour
        values[0] = robot.tick
        robot.sense(values)
        core.step(values)
        robot.drive(core.left_mm_s, core.right_mm_s)

    print(f"{home_name}: {states.NAMES[core.state]} after {robot.tick * 0.02:.0f} s and {robot.path_m:.1f} m, {robot.contacts} bumps")
    store = core.vectors
    print(f"{store.used} vectors of {store.RECORD_BYTES} bytes in {store.chains} chains; the first, in metres:")
    for i in range(min(8, store.used)):
        print(f"  ({store.xs[i] * 0.005:7.3f}, {store.ys[i] * 0.005:7.3f})  sigma {store.sigmas[i]} mm")
    return 0 if core.state == states.DONE else 1


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:3]))
    except (HomeError, RobotError) as error:
        sys.exit(str(error))
