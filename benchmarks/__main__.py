# What a step costs, one line a figure:  make bench
#
# A mission in the furnished studio is driven once in this process; its sensor
# stream is then replayed through the core alone, on CPython and in the MicroPython VM.
# Wall-clock figures of the machine it runs on: compare them only with each other.

import platform
import subprocess
import sys
import tempfile
import time
from array import array
from pathlib import Path

from firmware_py.pipeline import Tvslam
from protocol import states
from protocol.parameters import PARAMETERS
from protocol.schema import VALUES_MAX
from sim_device.config import load_robot
from sim_device.home import load_home
from sim_device.virtual_robot import VirtualRobot

HOME = "studio"
TICK_US = 20_000
PROJECT = Path(__file__).resolve().parent.parent
REPLAY = PROJECT / "benchmarks" / "replay_core.py"


def recorded_mission():
    """(parameters, ticks) of one mission, and what robot and core cost a step while it ran."""
    robot = VirtualRobot(load_home(HOME), load_robot(), seed=1)
    core = Tvslam()
    numbers = {parameter[0]: number for number, parameter in enumerate(PARAMETERS)}
    parameters = [(numbers[name], i, value) for name, values in robot.parameters().items() for i, value in enumerate(values)]
    for parameter in parameters:
        core.set_parameter(*parameter)
    core.begin()
    values = array("i", bytes(4 * VALUES_MAX))
    ticks = []
    robot_ns = core_ns = 0
    while core.state not in (states.DONE, states.FAILED) and robot.tick < 180_000:
        values[0] = robot.tick
        a = time.perf_counter_ns()
        robot.sense(values)
        b = time.perf_counter_ns()
        core.step(values)
        c = time.perf_counter_ns()
        robot.drive(core.left_mm_s, core.right_mm_s)
        robot_ns += time.perf_counter_ns() - c + b - a
        core_ns += c - b
        ticks.append(values.tobytes())
    return parameters, ticks, robot_ns / 1000 / len(ticks), core_ns / 1000 / len(ticks)


def write_stream(path, parameters, ticks):
    head = array("i", [len(parameters), len(ticks), VALUES_MAX])
    for parameter in parameters:
        head.extend(parameter)
    path.write_bytes(head.tobytes() + b"".join(ticks))


def replayed(command, stream):
    """Mean and worst us a step of the core alone."""
    run = subprocess.run([*command, str(REPLAY), str(stream)], cwd=PROJECT, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"{command[0]} ended with {run.returncode}: {run.stdout.strip()} {run.stderr.strip()}")
    return [int(number) for number in run.stdout.split()]


def line(what, value, unit):
    print(f"{what:<48}{value:>10.1f} {unit}")


def main():
    print(f"{HOME}, seed 1, Python {platform.python_version()} on {platform.machine()}")
    parameters, ticks, robot_us, core_us = recorded_mission()
    line("mission", len(ticks) * TICK_US / 1e6, "s of robot time")
    line("virtual robot, a tick", robot_us, "us")
    line("core on CPython, a step, beside the robot", core_us, "us")
    line("both in one process", TICK_US / (robot_us + core_us), "times real time")
    micropython = Path(sys.executable).parent / "micropython"
    with tempfile.TemporaryDirectory() as folder:
        stream = Path(folder) / "stream"
        write_stream(stream, parameters, ticks)
        for name, command in [("CPython", [sys.executable]), ("MicroPython, 192k, locked", [str(micropython), "-X", "heapsize=192k"])]:
            mean, worst = replayed(command, stream)
            line(f"core alone on {name}, a step", mean / 10, "us")
            line("    the slowest step", worst, "us")


if __name__ == "__main__":
    main()
