# The command `sim_device`: the virtual robot in a home, on a pty on which a core is awaited.

import argparse
import contextlib
import os
import signal
import sys
from importlib import metadata

from protocol import parameters
from sim_device.report import JsonReport, PlainReport, ReaderGone

EXIT_FINISHED, EXIT_NOT_FINISHED, EXIT_BAD_INPUT, EXIT_PEER, EXIT_INTERRUPTED = 0, 1, 2, 3, 130
SEED_MAX = 2 ** 32 - 1
NO_NVM = "none"
FLAG_NAMES = tuple(row[0] for row in getattr(parameters, "FLAGS", ()))

EPILOG = """\
Start the core on the link by `python -m firmware_py PATH` or `micropython -X heapsize=192k -m firmware_py PATH`, and a viewer on
the tap by `host_tools monitor PATH`, in any order. Exit codes: 0 finished, 1 not finished, 2 bad arguments or a bad
home, 3 the core or a file failed, 130 interrupted."""


class InputError(Exception):
    """One sentence: which argument, what is wrong with it."""


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        """One sentence with the way out instead of the whole usage text."""
        self.exit(EXIT_BAD_INPUT, "%s: %s; see %s --help\n" % (self.prog, message, self.prog))


def arguments():
    parser = _Parser(
        prog="sim_device", allow_abbrev=False, description="The virtual robot in a home, in lockstep with a core on a pty.", epilog=EPILOG)
    add = parser.add_argument
    add("home", metavar="HOME", help="a home file, or the name of a home that ships with the project")
    link = parser.add_mutually_exclusive_group(required=True).add_argument
    link("--link", metavar="PATH", help="the name to give the pty on which the core is awaited; or a CAN bus: slcan:PORT, slcan-fd:PORT "
                                        "(an adapter's serial port), socketcan:NAME, udp")
    link("--core", metavar="MODULE:CLASS", help="in place of that: the core to run in this process, as firmware_py.device:Device")
    add("--core-folder", metavar="DIR", help="where to look for it first")
    add("--tap", metavar="PATH", action="append", default=[], help="the name of a pty for a viewer (may be given again)")
    add("--robot", metavar="TOML", help="the robot's configuration (default: the one shipped)")
    add("--uwb", default="paper", choices=("paper", "rssi_real", "tof", "tof_nlos", "none"), help="how good the UWB receiver is")
    add("--odometry", default="calibrated", choices=("calibrated", "poor"), help="how true wheels and track are")
    add("--seed", type=seed, default=1, metavar="N", help="of every random number of the robot")
    add("--mode", default="improved", choices=("improved", "paper"), help="the core's method")
    add("--set", action="append", default=[], metavar="FLAG=on|off", help="switch an improvement: " + (", ".join(FLAG_NAMES) or "none yet"))
    add("--log", metavar="FILE", help="keep every frame")
    add("--log-rest", metavar="FILE", help="where the log goes on if its disk is full")
    add("--truth", metavar="FILE", help="keep the true path: <I3d> step, x, y, theta")
    add("--map", metavar="FILE", help="keep the map that the core sends at the end")
    add("--faults", metavar="SPEC", help="what shall go wrong on the link and with the sensors, like drop=0.1,delay=20ms,"
        "cut@step=500:2s,reset@step=900,uwb=off@step=300:200; or @FILE")
    add("--keep-faults", metavar="FILE", help="keep what went wrong on the link, frame by frame, for --faults @FILE")
    add("--nvm", metavar="FILE", help="keep the robot's non-volatile memory there: what the core stored is loaded by the next one "
        "(default: for this run only; none: there is no such memory)")
    add("--realtime", action="store_true", help="free run: the core by its own clock, 50 steps a second")
    add("--max-robot-s", type=positive, default=14400.0, metavar="S", help="give up after that much robot time")
    add("--wait", type=positive, default=30.0, metavar="S", help="for the core's first word")
    add("--json-lines", action="store_true", help="events as JSON lines on stdout")
    add("--version", action="version", version="sim_device " + version())
    return parser


def version():
    try:
        return metadata.version("tvslam")
    except metadata.PackageNotFoundError:
        return "0+unknown (not installed)"


def seed(text):
    if not (text.isascii() and text.isdigit() and int(text) <= SEED_MAX):
        raise argparse.ArgumentTypeError("%s is not a whole number from 0 to %d" % (text or "(empty)", SEED_MAX))
    return int(text)


def positive(text):
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e9:
        raise argparse.ArgumentTypeError("%s is not a positive number of seconds" % text)
    return value


def settings(options, told):
    """The parameters that the command line sets, over those that the robot has: {name: [ints]}."""
    rows = {row[0]: row for row in parameters.PARAMETERS}
    flags = told.get("flags", [rows["flags"][5]])[0]
    for setting in options.set:
        name, _, value = setting.partition("=")
        if name not in FLAG_NAMES:
            raise InputError("--set %s: there is no flag %s; there are: %s" % (setting, name, ", ".join(FLAG_NAMES) or "none yet"))
        if value not in ("on", "off"):
            raise InputError("--set %s: give %s=on or %s=off" % (setting, name, name))
        bit = 1 << FLAG_NAMES.index(name)
        flags = flags | bit if value == "on" else flags & ~bit
    return {"mode": [1 if options.mode == "paper" else 0], "flags": [flags]}


def check_names(options):
    """One name, one file: a tap would otherwise take the link's place, a log the truth's or even the home's."""
    if not options.link and not options.core:
        raise InputError("--link is empty: give the name that the core shall open")
    if options.core and options.realtime:
        raise InputError("--realtime does not go with --core, which has no clock of its own: give --link and start the core on it")
    faults = options.faults[1:] if options.faults and options.faults.startswith("@") else None
    read = (("the home", options.home), ("--robot", options.robot), ("--faults", faults))
    taken = {_place(path): what for what, path in read if path and os.path.isfile(path)}
    named = [("--" + what.replace("_", "-"), getattr(options, what)) for what in ("link", "log", "log_rest", "truth", "map")]
    named += [("--keep-faults", options.keep_faults), ("--nvm", options.nvm if options.nvm != NO_NVM else None)]
    for what, path in named + [("--tap", path) for path in options.tap]:
        if path and (other := taken.setdefault(_place(path), what)) is not what:
            raise InputError("%s %s: %s has that name already, give another" % (what, path, other))
    if len(set(options.tap)) < len(options.tap):
        raise InputError("--tap: two taps have one name, give another")


def _place(path):
    """The name itself, however its folder is spelt: a link may be there already and point anywhere."""
    return os.path.join(os.path.realpath(os.path.dirname(path)), os.path.basename(path))


# Counts SIGINT, SIGTERM and SIGHUP instead of dying of them, while inside `with`.
class Signals(contextlib.AbstractContextManager):
    def __init__(self):
        self.count = 0
        self._before = {}

    def __enter__(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            self._before[number] = signal.signal(number, self._came)
        return self

    def __exit__(self, *_):
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _came(self, number, frame):
        self.count += 1

    def __call__(self):
        return self.count


def main(argv=None):
    options = arguments().parse_args(argv)
    report = JsonReport() if options.json_lines else PlainReport()
    with Signals() as signals:
        try:
            return mission(options, report, signals)
        except ReaderGone:
            # Nobody is left to tell. Stdout stays shut, or the interpreter would complain at its end.
            sys.stdout = None
            return EXIT_INTERRUPTED


def open_link(options):
    """What joins the robot to the core. Each is imported where it is used: python-can alone takes a tenth of a second."""
    if options.core:
        from sim_device.links.memory import MemoryLink
        return MemoryLink(options.core, options.core_folder)
    if options.link == "udp" or options.link.startswith(("slcan:", "slcan-fd:", "socketcan:", "udp:")):
        from sim_device.links.can import CanLink
        return CanLink(options.link)
    from sim_device.links.pty import Pty
    return Pty(options.link)


def incomplete(files):
    """Which of the closed files a full disk cut short, and where."""
    return "; ".join(file.failure for file in files if file.failure)


def check_faults(plan, link, options):
    """That there is what they shall befall."""
    if plan.power and options.nvm == NO_NVM:
        raise InputError("--faults power@byte=%d: there is no memory to write with --nvm none; leave out one of the two" % plan.power[0])
    if plan.of_the_bus and not hasattr(link, "worsen"):
        raise InputError("--faults: loss, full, busy and busoff are faults of a CAN bus, and %s is none; use hil --link slcan, or "
                         "leave them out" % (options.link or options.core))


def made_worse(link, plan, options, tell, kept):
    """The link with the faults of the plan: those of CAN frames happen on the bus, by the same seed. tell(byte, here): a reset."""
    from sim_device.faults import plain
    from sim_device.links.faulty import FaultyLink
    restart = getattr(link, "restart", None)    # else somebody else must do it

    def note(item):
        if kept:
            kept.add((item + "\n").encode())

    def reset(byte):
        tell(byte, restart is not None)
        if restart is not None:
            restart()
    if plan.of_the_bus:
        link.worsen([("seed", options.seed), *plan.bus.items()])
        for kind, chance in plan.bus.items():
            note("%s=%s" % (kind, plain(chance)))
    return FaultyLink(link, plan, options.seed, reset, note) if plan.of_the_link else link


def why_reset(step, byte):
    if byte is None:
        return "Fault: the core is reset at step %d." % step
    return "Fault: the power is lost at step %d, while byte %d of the non-volatile memory is written." % (step, byte)


def missed(link, robot, nvm):
    """The faults that never came, as the mission was over before."""
    power = ["power@byte=%d" % number for number in (nvm.power if nvm else ())]
    return [item for part in (link, robot) for item in getattr(part, "missed", list)()] + power


def mission(options, report, signals):
    # Imported here: --version and a wrong argument need none of it.
    from protocol.dialect import SchemaError
    from sim_device.config import RobotError, load_robot
    from sim_device.faults import FaultError, parse
    from sim_device.home import HomeError, load_home
    from sim_device.links.peer_errors import PeerError
    from sim_device.links.pty import LinkError
    from sim_device.links.tap import Taps
    from sim_device.links.trace import FrameLog, GrowingFile, TraceError, TruthFile
    from sim_device.nvm import Nvm, NvmError
    from sim_device.sensors.faulty import FaultySensors
    from sim_device.session import Session
    from sim_device.virtual_robot import VirtualRobot

    session, blames, files = None, "input", []
    try:
        check_names(options)
        with contextlib.ExitStack() as stack:
            home = load_home(options.home)
            robot = VirtualRobot(home, load_robot(options.robot), options.seed, options.uwb, options.odometry)
            plan = parse(options.faults or "")
            if plan.sensors:
                robot = FaultySensors(robot, plan.sensors, options.seed)
            told = settings(options, robot.parameters())
            notes = {key: getattr(options, key) for key in ("seed", "uwb", "odometry", "mode")}

            def grows(kind, path, **more):
                files.append(stack.enter_context(contextlib.closing(kind(path, **more))))
                return files[-1]

            link = stack.enter_context(contextlib.closing(open_link(options)))
            check_faults(plan, link, options)
            taps = stack.enter_context(contextlib.closing(Taps(options.tap)))
            nvm = None
            if options.nvm != NO_NVM:
                nvm = stack.enter_context(contextlib.closing(Nvm(path=options.nvm, power=plan.power, seed=options.seed)))
            # Nothing is refused any more: now the files of an earlier mission are emptied, and its log the last of them.
            truth = options.truth and grows(TruthFile, options.truth)
            keep = options.map and grows(GrowingFile, options.map)
            kept = options.keep_faults and grows(GrowingFile, options.keep_faults)
            log = options.log and grows(FrameLog, options.log, rest=options.log_rest, home=home.name, **notes)
            link = made_worse(link, plan, options, lambda byte, here: report.event(
                "reset", step=session.now, byte=byte, here=here, text=why_reset(session.now, byte)), kept)
            if nvm is not None:
                nvm.lose_power = getattr(link, "lose_power", nvm.lose_power)
            session = Session(link, taps, robot, report, log or None, truth or None, told, options.realtime, options.max_robot_s, signals,
                              nvm)
            report.event("ready", home=home.name, link=options.link or options.core, pty=link.name, taps=options.tap, seed=options.seed)
            end = session.run(options.wait)
            if keep and session.map_bytes is not None:
                keep.add(session.map_bytes)
    except (HomeError, RobotError, LinkError, FaultError, InputError, TraceError) as error:
        code, sentence = EXIT_BAD_INPUT, str(error)
    except NvmError as error:
        code, sentence, blames = EXIT_PEER if session else EXIT_BAD_INPUT, str(error), "file"
    except (PeerError, SchemaError) as error:
        code, sentence, blames = EXIT_PEER, str(error), "core"
    else:
        code = EXIT_INTERRUPTED if end["reason"] == "interrupted" else EXIT_FINISHED if end["finished"] else EXIT_NOT_FINISHED
        code = EXIT_PEER if incomplete(files) else code
        report.event("end", exit=code, incomplete=incomplete(files), missed=missed(link, robot, nvm), **end)
        return code
    # A mission that broke off still tells how far it came.
    report.error(sentence, code, blames=blames, incomplete=incomplete(files), **(session.summary(sentence) if session else {}))
    return code
