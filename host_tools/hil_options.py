"""The arguments of `hil`, and what is wrong with them in one sentence each, before anything starts."""

import argparse
import contextlib
import fcntl
import os
import re
import stat

from host_tools.core_process import DEFAULT_HEAP, DEFAULT_HEAPS, heap_size

SLCAN = ("slcan", "slcan-fd")
UWB = ("paper", "rssi_real", "tof", "tof_nlos", "none")
ODOMETRY = ("calibrated", "poor")
MODES = ("improved", "paper")
STM32_HEAP_MAX = 112 << 10  # of 128 KB RAM, beside the stack
STM32_HEAP_ENOUGH = 25 << 10  # with which the core boots, and then allocates nothing
SEED_MAX = 2 ** 32 - 1


NO_NVM = "none"


class UsageError(Exception):
    """Its text is one sentence: what is wrong and the way out."""


def add_arguments(parser):
    parser.add_argument("home", metavar="HOME", help="a home file, or the name of a home that ships with the project")
    parser.add_argument("--target", default="unix", help="where the core runs: unix (default), cpython, stm32 (emulated), port:DEV")
    parser.add_argument("--link", default="pty", help="pty (default); on stm32 also semihost, on cpython also memory; on each "
                        "a CAN bus: slcan, slcan-fd, socketcan:NAME, udp")
    parser.add_argument("--mode", default="improved", help="improved (default) or paper: every improvement off")
    parser.add_argument("--uwb", default="paper", help="error of the UWB receiver: %s" % ", ".join(UWB))
    parser.add_argument("--odometry", default="calibrated", help="error of the wheels: %s" % ", ".join(ODOMETRY))
    parser.add_argument("--seed", default="1", help="seed of every error and of the stops (default 1)")
    parser.add_argument("--heap", default=None, help="heap of the MicroPython VM (default 192k on unix, 27k on stm32)")
    parser.add_argument("--realtime", action="store_true", help="free run: the core by its own clock, 50 steps a second")
    parser.add_argument("--max-robot-s", metavar="S", default=None,
                        help="end the mission after that much robot time (default 14400, four hours)")
    parser.add_argument("--log", metavar="FILE", help="keep the log of every frame")
    parser.add_argument("--candump", metavar="FILE", help="with a CAN link: keep every CAN frame, as candump -L does")
    parser.add_argument("--json", metavar="FILE", help="write the result file")
    parser.add_argument("--out", metavar="DIR", help="write map.geojson, map.bin, map.png, *.tum and result.json")
    parser.add_argument("--set", metavar="FLAG=on|off", action="append", default=[], help="switch one improvement")
    parser.add_argument("--robot", metavar="ROBOT.toml", help="the robot's configuration")
    parser.add_argument("--faults", metavar="SPEC", help="what shall go wrong on the link and with the sensors, like drop=0.1,flip=0.01,"
                        "delay=20ms,cut@step=500:2s,reset@step=900,uwb=off@step=300:200; or @FILE")
    parser.add_argument("--keep-faults", metavar="FILE", help="keep what went wrong on the link, frame by frame, for --faults @FILE")
    parser.add_argument("--nvm", metavar="FILE", help="keep the robot's non-volatile memory there: what the core stored, the next mission "
                        "loads and goes on from (default: for this mission only; none: there is no such memory)")
    # Named by the contract, built later: taken here so that they are refused with a sentence of their own.
    parser.add_argument("--task", default="map", help="map")
    parser.add_argument("--passes", default="1", help="1")
    parser.add_argument("--then", metavar="HOME2", help="not built yet")


def check(args):
    """Raise UsageError for the first argument that cannot be served; make the numbers numbers."""
    _not_built(args)
    _one_of(args.mode, "--mode", MODES)
    _one_of(args.uwb, "--uwb", UWB)
    _one_of(args.odometry, "--odometry", ODOMETRY)
    if not re.fullmatch(r"[0-9]{1,10}", args.seed) or int(args.seed) > SEED_MAX:
        raise UsageError("--seed %s is not a whole number from 0 to %d." % (args.seed, SEED_MAX))
    args.seed = int(args.seed)
    args.heap = DEFAULT_HEAPS.get(args.target, DEFAULT_HEAP) if args.heap is None else args.heap
    try:
        heap_size(args.heap)
    except argparse.ArgumentTypeError as error:
        raise UsageError("--heap %s." % error) from None
    if args.target == "stm32" and heap_bytes(args.heap) > STM32_HEAP_MAX:
        raise UsageError("--heap %s does not fit the STM32F205's 128 KB of RAM; give at most %dk." % (args.heap, STM32_HEAP_MAX >> 10))
    _check_time(args)
    for setting in args.set:
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*=(on|off)", setting):
            raise UsageError("--set %s is not FLAG=on or FLAG=off." % setting)
    if args.robot and not os.path.isfile(args.robot):
        raise UsageError("--robot %s is not a file; give a robot configuration in TOML." % args.robot)


def _check_time(args):
    if args.realtime and args.link == "semihost":
        raise UsageError("--realtime does not go with --link semihost, where the core's clock stands still until a STEP comes; "
                         "use --link pty.")
    if args.realtime and args.link == "memory":
        raise UsageError("--realtime does not go with --link memory, where robot and core take turns; use --link pty.")
    if args.max_robot_s is None:
        return
    if not re.fullmatch(r"[0-9]{1,6}(\.[0-9]{1,3})?", args.max_robot_s) or not float(args.max_robot_s):
        raise UsageError("--max-robot-s %s is not a number of seconds above 0; give one like 120." % args.max_robot_s)


def heap_bytes(text):
    return int(text.rstrip("kKmM")) << {"k": 10, "m": 20}.get(text[-1].lower(), 0)


def _not_built(args):
    if args.target not in ("unix", "cpython", "stm32") and not re.fullmatch(r"port:.+", args.target):
        raise UsageError("--target %s is unknown; use unix, cpython, stm32 or port:DEV (a board's serial port)." % args.target)
    if args.link == "semihost" and args.target != "stm32":
        raise UsageError("--link semihost is the emulator's: it goes with --target stm32; use pty.")
    if args.link == "memory" and args.target != "cpython":
        raise UsageError("--link memory has the core in the robot's own process: it goes with --target cpython; use pty.")
    if args.link not in ("pty", "semihost", "memory") and not is_can(args.link):
        raise UsageError("--link %s is unknown; use pty, slcan, slcan-fd, socketcan:NAME or udp, with --target stm32 also semihost, "
                         "with --target cpython also memory." % args.link)
    _check_can(args)
    if args.task == "clean":
        raise UsageError("--task clean is not built yet; use map.")
    if args.task != "map":
        raise UsageError("--task %s is unknown; use map." % args.task)
    if args.passes != "1":
        raise UsageError("--passes %s is not built yet; use 1." % args.passes)
    if args.then is not None:
        raise UsageError("--then is not built yet; run one home at a time.")


def is_can(link):
    return link in SLCAN or link == "udp" or link.startswith("socketcan:")


def _check_can(args):
    if args.candump and not is_can(args.link):
        raise UsageError("--candump keeps the frames of a CAN bus, and --link %s is none; use --link slcan, or --log." % args.link)
    if not is_can(args.link):
        return
    if args.target.startswith("port:") and args.link in SLCAN:  # an adapter, with the core on its bus
        if args.candump:
            raise UsageError("--candump is for the bus of `hil` itself; on an adapter's bus use candump, or --log.")
        if not os.path.exists(args.target[len("port:"):]):
            raise UsageError("--target %s: there is no such port, and so no CAN adapter on it; give the serial port of one that speaks "
                             "SLCAN." % args.target)
        return
    if args.target.startswith("port:"):
        raise UsageError("--link %s does not go with --target %s; use --link slcan where that is a CAN adapter, --link pty where it is "
                         "the core's own port." % (args.link, args.target))
    network = args.link.removeprefix("socketcan:")
    if network != args.link and not os.path.isdir(os.path.join("/sys/class/net", network or "?")):
        raise UsageError("--link %s: this machine has no such network (`ip link` lists them); --link slcan needs none." % args.link)


def _one_of(value, name, allowed):
    if value not in allowed:
        raise UsageError("%s %s is unknown; use %s." % (name, value, ", ".join(allowed)))


def check_places(args, home_path, out_files):
    """Folders are made, files are tried for writing, before the mission: nobody waits for a result that cannot be kept."""
    _check_names(args, home_path, out_files)
    if args.out:
        _check_folder(args.out)
        for name in out_files:
            if os.path.isdir(os.path.join(args.out, name)):
                raise UsageError("--out %s holds a folder %s where a file of that name goes; give another folder." % (args.out, name))
    for name, path in _files(args):
        check_file(name, path)
    if args.log and os.path.exists(args.log) and not os.path.isfile(args.log):
        raise UsageError("--log %s is no regular file, but the log is read back for the scores; give a file's name." % args.log)


def _check_names(args, home_path, out_files):
    """A result must not take the place of what it was made from."""
    taken = {os.path.realpath(path): what for what, path in (
        ("the home", home_path), ("--robot", args.robot), ("--faults", faults_file(args.faults))) if path}
    files = _files(args)
    written = files + [("--out", os.path.join(args.out, file)) for file in out_files if args.out]
    for name, path in written:
        other = taken.get(os.path.realpath(path))
        if name == "--out" and other == "--json" and os.path.basename(path) == "result.json":
            continue  # it is the result file, both times
        if other is not None:
            raise UsageError("%s %s is the file of %s, which would be overwritten; give another name." % (name, path, other))
        if name != "--out":
            taken[os.path.realpath(path)] = name


def faults_file(spec):
    """The file that --faults names, or None."""
    return spec[1:] if spec and spec.startswith("@") else None


def _files(args):
    """[(option, path)] of the files that the mission writes."""
    named = (("--json", args.json), ("--log", args.log), ("--candump", args.candump), ("--keep-faults", args.keep_faults),
             ("--nvm", args.nvm if args.nvm != NO_NVM else None))
    return [(name, path) for name, path in named if path]


def _check_folder(path):
    if os.path.lexists(path) and not os.path.isdir(path):
        raise UsageError("--out %s is not a folder; give another name, or remove it." % path)
    try:
        os.makedirs(path, exist_ok=True)
        probe = os.path.join(path, ".write-test-%d" % os.getpid())
        with open(probe, "wb"):
            pass
        os.unlink(probe)
    except OSError as error:
        raise UsageError("--out %s cannot be written (%s); give a folder of your own." % (path, _reason(error))) from None


def check_file(name, path):
    """UsageError where a file of that name could not be written."""
    if os.path.isdir(path):
        raise UsageError("%s %s is a folder; give the name of a file." % (name, path))
    new = not os.path.lexists(path)
    try:
        os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
        with open(path, "ab"):
            pass
        if new and stat.S_ISREG(os.stat(path).st_mode):
            os.unlink(path)
    except OSError as error:
        raise UsageError("%s %s cannot be written (%s); give another place." % (name, path, _reason(error))) from None


def check_log(log):
    """One that is being written is another mission's. What else is there stays until the robot has nothing to refuse any more."""
    with contextlib.suppress(FileNotFoundError), open(log, "r+b") as file:
        if _locked_elsewhere(file):
            raise UsageError("--log %s is being written by another mission; give another name." % log)


def _locked_elsewhere(file):
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        pass  # a file system without locks
    return False


def _reason(error):
    return (error.strerror or str(error)).lower()
