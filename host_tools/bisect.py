"""`host_tools bisect LOG --targets unix,stm32`: one recorded mission on several cores in lockstep, up to the first difference.

Exit code 0 if they agree to the end of the log, 1 if not, 2 on bad arguments or a log that cannot be
replayed, 3 when one of the cores failed.
"""

import argparse
import contextlib

from host_tools import core_process
from host_tools.differences import at_the_end
from host_tools.finding import Finding, difference_table
from host_tools.mission import hashes
from host_tools.progress import Progress
from host_tools.replay import answered, hash_text, lead, log_rows, speed, speed_text
from host_tools.side_by_side import SideBySide


def add_arguments(parser):
    parser.add_argument("log", metavar="LOG", help="a log that `hil --log` has written")
    parser.add_argument("--targets", type=target_list, default="unix,stm32", metavar="A,B",
                        help="two or more of %s (default unix,stm32)" % core_process.TARGETS.replace(" or ", ", "))
    core_process.add_machine_arguments(parser)
    parser.add_argument("--json", metavar="FILE", default=None, help="also write the result to FILE")


def target_list(text):
    targets = text.split(",")
    if len(targets) < 2 or not all(targets):
        raise argparse.ArgumentTypeError("'%s' names no two targets: give them with a comma between, as in unix,stm32" % text)
    return targets


def run(args):
    def bisected(recording):
        with contextlib.ExitStack() as cores:
            ports = {name: cores.enter_context(_core(target, args)) for name, target in named(args.targets).items()}
            return bisect(recording, ports, Progress())
    return answered("bisect", args, bisected)


def named(targets):
    """{name: target}: the same target twice is two cores, which tells whether it agrees with itself."""
    return {target if target not in targets[:i] else "%s #%d" % (target, targets[:i].count(target) + 1): target
            for i, target in enumerate(targets)}


def _core(target, args):
    """--heap and --link are the emulated part's, where there is one among the targets."""
    emulated = "stm32" in args.targets
    heap = args.heap if not emulated or target == "stm32" else None
    return core_process.running_core(target, heap, args.link if target == "stm32" or not emulated else None, anew=True)


def bisect(recording, ports, progress):
    """(the result as JSON takes it, the same as lines for people)"""
    run = SideBySide(recording, ports, with_log=False)
    telemetry, seconds = lead(run, progress, lambda: run.apart is not None or run.telemetry_apart is not None)
    figures = speed(run, seconds)
    first, end, statuses, maps = telemetry or run.apart, None, {}, {}
    if first is None:
        statuses = run.finish()
        first = run.telemetry_apart
    finding = Finding.of(run, first) if first is not None else None
    if finding is None:
        maps = {core.name: core.map_bytes() for core in run.cores}
        end = at_the_end(run.now.step, statuses, maps)
    result = {"log": recording.path, "targets": list(ports), "equal": finding is None and end is None, **figures,
              "hash": {name: hashes(status._asdict()) for name, status in statuses.items()}, "damage": recording.damage or None,
              "telemetry_messages": run.telemetry, "first_difference": finding.as_dict() if finding else end and end.as_dict()}
    return result, _lines(result, recording, finding, end, any(maps.values()))


def _lines(result, recording, finding, end, mapped):
    rows = [("replayed", "%s on %s side by side" % (result["log"], ", ".join(result["targets"]))), ("", speed_text(result))]
    rows += [("hash", "%s   %s" % (hash_text(hash_), name)) for name, hash_ in result["hash"].items()]
    rows += [] if finding else log_rows(recording, result["steps"])
    if finding is None and end is None:
        rows.append(("result", "no difference in %d answers, %d messages of telemetry%s" % (
            result["steps"], result["telemetry_messages"], " and the map" if mapped else "; there is no map yet")))
    else:
        rows.append(("first difference", finding.headline() if finding else "the end: " + end.names))
    return ["%-15s %s" % row for row in rows] + (finding.lines() if finding else difference_table(end) if end else [])
