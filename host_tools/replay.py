"""`host_tools replay LOG`: a recorded mission once more, through a fresh core, step by step against the log.

Exit code 0 if every answer, the hash and the map are those of the log (as far as it is sound), 1 if not,
2 on bad arguments or a log that cannot be replayed, 3 when the core failed.
"""

import os
import sys
import time

from host_tools import core_process
from host_tools.core_process import CoreError
from host_tools.differences import at_the_end, robot_s
from host_tools.finding import Finding, difference_table
from host_tools.hil_options import UsageError, check_file
from host_tools.mission import STEP_S, hashes
from host_tools.processes import signals_as_interrupt
from host_tools.progress import Progress, say
from host_tools.recording import LogUnusable, Recording
from host_tools.side_by_side import LOG, SideBySide, progress_text
from host_tools.whole_file import write_result
from protocol.messages import BY_NAME

EXIT_EQUAL, EXIT_DIFFERENT, EXIT_USAGE = 0, 1, 2
PROGRESS_S = 1.0    # a replay that is over by then needs no progress
NO_HASH = {"steps": None, "map": None}


def add_arguments(parser):
    parser.add_argument("log", metavar="LOG", help="a log that `hil --log` has written")
    core_process.add_arguments(parser)
    parser.add_argument("--json", metavar="FILE", default=None, help="also write the result to FILE")


def run(args):
    def replayed(recording):
        with core_process.running_core(args.target, args.heap, args.link, anew=True) as port:
            return replay(recording, args.target, port, Progress())
    return answered("replay", args, replayed)


def answered(command, args, compare):
    """Exit code of a command that compares a recording with cores: compare(recording) -> (result, lines for people)."""
    try:
        check_json(args.json, args.log)
        with signals_as_interrupt():
            result, lines = compare(Recording(args.log))
    except (UsageError, LogUnusable) as error:
        print("%s: %s" % (command, error), file=sys.stderr)
        return EXIT_USAGE
    except CoreError as error:
        print("%s: %s" % (command, error), file=sys.stderr)
        return error.code
    written = write_json(command, args.json, result)    # first: whoever reads the lines may go before their end
    say("\n".join(lines))
    if not written:
        return EXIT_USAGE
    return EXIT_EQUAL if result["equal"] else EXIT_DIFFERENT


def replay(recording, target, port, progress):
    """(the result as JSON takes it, the same as lines for people)"""
    run = SideBySide(recording, {target: port}, with_log=True)
    telemetry, seconds = lead(run, progress, lambda: run.apart is not None)
    figures = speed(run, seconds)
    finding = Finding.of(run, run.apart) if run.apart is not None else None
    end = status = None
    if finding is None:
        status = run.finish()[target]
        telemetry = telemetry or run.telemetry_apart
        end = _end(recording, run, target, status)
    result = {
        "log": recording.path, "target": target, "equal": finding is None and end is None, **figures,
        "hash": hashes(status._asdict()) if status else NO_HASH,
        "log_hash": hashes(recording.status) if recording.status else NO_HASH, "damage": recording.damage or None,
        "telemetry_messages": run.telemetry, "telemetry_difference": telemetry and telemetry.as_dict(),
        "first_difference": finding.as_dict() if finding else end and end.as_dict()}
    return result, _lines(result, recording, finding, end, telemetry)


def lead(run, progress, over):
    """Step by step to the log's end, or until over(): (the first Difference in telemetry, seconds)."""
    telemetry = None
    begin = time.monotonic()
    try:
        while run.advance():
            telemetry = telemetry or run.telemetry_apart
            seconds = time.monotonic() - begin
            if seconds > PROGRESS_S:
                progress.text(progress_text(run, seconds))
            if over():
                break
    finally:
        progress.clear()
    return telemetry, time.monotonic() - begin


def speed(run, seconds):
    return {"steps": run.steps, "robot_s": robot_s(run.steps), "seconds": round(seconds, 3), "steps_per_s": round(run.steps / seconds, 1)}


def speed_text(result):
    return "%d steps, %.1f s of the robot, in %.1f s: %.0f steps/s, %.0f times real time" % (
        result["steps"], result["robot_s"], result["seconds"], result["steps_per_s"], result["steps_per_s"] * STEP_S)


def _end(recording, run, target, status):
    """What the core says when all is done, and its map, against the log's, as far as it has them."""
    if recording.status is None:
        return None
    statuses = {LOG: BY_NAME["STATUS_RSP"](**recording.status), target: status}
    maps = {LOG: recording.map_bytes, target: run.cores[0].map_bytes()} if recording.map_bytes is not None else {}
    return at_the_end(status.step, statuses, maps)


def _lines(result, recording, finding, end, telemetry):
    rows = [("replayed", "%s on %s" % (result["log"], result["target"])), ("", speed_text(result)),
            ("hash", hash_text(result["hash"])), ("hash of the log", hash_text(result["log_hash"]))]
    rows += [] if finding else log_rows(recording, result["steps"])
    if finding is None and telemetry is not None:
        rows.append(("telemetry", "differs first at step %d: %s" % (telemetry.step, telemetry.names)))
    if finding is None and end is None:
        checked = ["%d answers" % result["steps"], "%d messages of telemetry" % result["telemetry_messages"] if telemetry is None else "",
                   "the map of %d bytes" % len(recording.map_bytes) if recording.map_bytes is not None else ""]
        rows.append(("result", "equal: " + ", ".join(part for part in checked if part)))
    else:
        rows.append(("result", "different at " + (finding.headline() if finding else "the end: " + end.names)))
    return ["%-15s %s" % row for row in rows] + (finding.lines() if finding else difference_table(end) if end else [])


def log_rows(recording, steps):
    """What a log that was replayed to its end did not hold."""
    if recording.damage:
        return [("damaged log", "%s; replayed up to there" % recording.damage)]
    return [] if recording.over else [("log", "it ends at step %d, before its mission did" % steps)]


def hash_text(hash_):
    return "steps %s   map %s" % (hash_["steps"] or "-", hash_["map"] or "-")


def check_json(path, log=None):
    """Before the run: nobody waits for a result that cannot be kept."""
    if path is None:
        return
    if log is not None and os.path.realpath(path) == os.path.realpath(log):
        raise UsageError("--json %s is the log, which would be overwritten; give another name." % path)
    check_file("--json", path)


def write_json(command, path, result):
    """False, and a sentence, where it cannot be written."""
    if path is None:
        return True
    try:
        write_result(path, result)
    except OSError as error:
        print("%s: %s cannot be written: %s." % (command, path, (error.strerror or str(error)).lower()), file=sys.stderr)
        return False
    return True
