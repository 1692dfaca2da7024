# A bus of adapters inside a test, and a mission of real processes over it.

import contextlib
import subprocess
import sys
import threading

from protocol.messages import BY_NAME
from sim_device.can_hub import CanHub
from tests.sim_device.lockstep import PROJECT, messages, read_log

STEP_RSP = BY_NAME["STEP_RSP"]


@contextlib.contextmanager
def running_hub(folder, *names, candump=None):
    """A hub in a thread of its own: (hub, the adapters' names)."""
    paths = [str(folder / name) for name in names]
    hub = CanHub(paths, candump=candump)
    stop = threading.Event()
    thread = threading.Thread(target=hub.run, args=(stop.is_set,), daemon=True)
    thread.start()
    try:
        yield hub, paths
    finally:
        stop.set()
        thread.join(10)
        alive = thread.is_alive()
        hub.close()
        assert not alive, "the hub hangs"


def mission(folder, link, hub_of, robot_s, *argv):
    """A core and the virtual robot over a hub, to which hub_of(hub, the robot's process) does what it likes: the mission's STEP_RSPs."""
    folder.mkdir()
    with running_hub(folder, "robot", "core") as (hub, (robot, core)):
        log = folder / "log"
        robot_argv = [sys.executable, "-m", "sim_device", "studio", "--link", "%s:%s" % (link, robot), "--log", str(log),
                      "--max-robot-s", str(robot_s), *argv]
        core_argv = [sys.executable, "-m", "firmware_py", "%s:%s" % (link, core)]
        with subprocess.Popen(core_argv, cwd=PROJECT, stdout=subprocess.DEVNULL) as child:
            try:
                sim = subprocess.Popen(robot_argv, cwd=PROJECT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
                hub_of(hub, sim)
                out, err = sim.communicate(timeout=100)
            finally:
                child.kill()
    assert sim.returncode == 1, (out, err)  # the time limit
    _, records = read_log(log)
    return [message for message in messages(records) if type(message) is STEP_RSP]
