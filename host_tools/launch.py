"""Command lines of the two peers: how the core and the virtual robot are started."""

import importlib.util
import os
import sys

from host_tools.core_process import CoreError, command, packages_folder
from host_tools.hil_options import NO_NVM, UsageError, heap_bytes
from host_tools.qemu import EmulatorError

CORE = "firmware_py.device:Device"  # by name: it runs in another process


def core_command(target, heap, link):
    """(argv, folder to run in) of the core."""
    try:
        return command(target, heap, link), packages_folder()
    except CoreError as error:
        raise UsageError(str(error)) from None


def stm32_image(heap, say, mark=""):
    """The firmware image for the emulator, built where it is not kept already. `mark` as for linker.link."""
    from host_tools.stm32_image import ImageError, image  # here: the other targets need none of it
    try:
        return image(heap_bytes(heap), progress=say, mark=mark)
    except ImageError as error:
        sentence = "\n".join([*error.lines, str(error)])
        raise (UsageError if error.code == 2 else EmulatorError)(sentence) from None


def robot_command(args, home_path, link, log, truth):
    """(argv, folder to run in) of the virtual robot. A log whose disk is full goes on beside the truth, for the scores."""
    joined = ["--link", link]
    if args.link == "memory":
        joined = ["--core", CORE, "--core-folder", getattr(args, "core_folder", None) or packages_folder()]
    argv = [sys.executable, "-m", "sim_device", home_path, *joined, "--uwb", args.uwb, "--odometry", args.odometry,
            "--seed", str(args.seed), "--mode", args.mode, "--log", log, "--truth", truth, "--json-lines"]
    if args.log:
        argv += ["--log-rest", rest_of_log(truth)]
    if args.robot:
        argv += ["--robot", os.path.abspath(args.robot)]
    if args.realtime:
        argv.append("--realtime")
    if args.max_robot_s is not None:
        argv += ["--max-robot-s", args.max_robot_s]
    if args.faults is not None:
        argv += ["--faults", "@" + os.path.abspath(args.faults[1:]) if args.faults.startswith("@") else args.faults]
    if args.keep_faults:
        argv += ["--keep-faults", os.path.abspath(args.keep_faults)]
    if args.nvm:
        argv += ["--nvm", args.nvm if args.nvm == NO_NVM else os.path.abspath(args.nvm)]
    for setting in args.set:
        argv += ["--set", setting]
    return argv, _robot_folder()


def rest_of_log(truth):
    return os.path.join(os.path.dirname(truth), "rest.log")


def _robot_folder():
    """The folder that holds sim_device, found without importing it: it is for another process."""
    spec = importlib.util.find_spec("sim_device")
    return os.path.dirname(os.path.abspath(list(spec.submodule_search_locations)[0]))
