"""`host_tools hil HOME`: one mission of the core against the virtual robot, scored and kept.

Exit code 0 exactly when the mission finished, 1 when it did not, 2 on bad arguments or a bad
home, 3 when a peer failed or the disk did not take the whole log. The result file is written in each case but 2.
"""

import os
import sys
import tempfile
from dataclasses import replace

from host_tools import export, report
from host_tools import result as scoring
from host_tools.hil_options import UsageError, add_arguments, check, check_log, check_places
from host_tools.launch import core_command, rest_of_log
from host_tools.mission_log import LogError, read_mission
from host_tools.mission_run import run_mission
from host_tools.processes import signals_as_interrupt
from host_tools.progress import Progress, say
from host_tools.qemu import qemu_command
from host_tools.score import HomeTruth
from sim_device.home import HomeError, load_home

__all__ = ("add_arguments", "run")


def run(args):
    try:
        check(args)
        home = load_home(args.home)
        check_places(args, home.path, export.FILES)
        if args.target == "stm32":
            qemu_command()
        elif not args.target.startswith("port:"):
            core_command(args.target, args.heap, "")  # is there an interpreter for it?
        with signals_as_interrupt(), _folder() as folder:
            return _mission(args, home, folder)
    except (UsageError, HomeError) as error:
        say("host_tools hil: %s" % error, sys.stderr)
        return 2


def _folder():
    """For the link and what only the scores need; gone after the mission."""
    try:
        return tempfile.TemporaryDirectory(prefix="tvslam-")
    except OSError as error:
        raise UsageError("no temporary folder can be made (%s); set TMPDIR to a folder that can be written."
                         % (error.strerror or str(error)).lower()) from None


def _mission(args, home, folder):
    log = os.path.abspath(args.log) if args.log else os.path.join(folder, "mission.log")
    truth_path = os.path.join(folder, "truth.bin")
    check_log(log)
    outcome = run_mission(args, os.path.abspath(home.path), folder, log, truth_path, Progress())
    if outcome.exit_code == 2:
        raise UsageError(outcome.sentence)
    result, mission, vector_map, notes = _evaluate(args, home, log, truth_path, outcome)
    try:
        if args.out:
            notes += export.write_all(args.out, home, mission, vector_map, result)
        if args.json:
            export.write_result(args.json, result)
    except OSError as error:  # it could be written before the mission: the disk is full, or the folder has gone
        why = "%s could not be written: %s" % (error.filename or "the result", (error.strerror or str(error)).lower())
        outcome = replace(outcome, exit_code=2, sentence=why)
    _say(args, home, result, vector_map, notes, kept=outcome.exit_code != 2)
    if outcome.exit_code in (2, 3):
        say("host_tools hil: %s" % outcome.sentence, sys.stderr)
    if outcome.incomplete:
        say("host_tools hil: %s" % outcome.incomplete, sys.stderr)
    if outcome.exit_code in (2, 3) or outcome.incomplete:
        return outcome.exit_code if outcome.exit_code == 2 else 3
    return 0 if result["finished"] else 1


def _evaluate(args, home, log, truth_path, outcome):
    result = scoring.empty_result(home.name, vars(args))
    result["map"]["true_rooms"] = len(home.rooms)
    mission = vector_map = None
    notes = []
    try:
        mission = read_mission(log if outcome.began else os.devnull, truth_path, rest_of_log(truth_path))
        if mission.damaged:
            notes.append("The log %s." % mission.damaged)
        vector_map, why_not = scoring.mission_map(mission)
        scoring.evaluate(result, mission, HomeTruth(home), vector_map, outcome.end, len(home.rooms))
        if why_not:
            notes.append("No map to score: %s." % why_not)
    except LogError as error:
        notes.append(str(error))
    result["tick"] |= outcome.tick
    result["memory"] |= outcome.memory
    notes += filter(None, [scoring.can_bus(result, outcome.can)])
    if outcome.exit_code == 3 or outcome.interrupted:
        result["finished"], result["reason"] = False, outcome.sentence
    elif outcome.incomplete:
        result["finished"], result["reason"] = outcome.end["finished"], outcome.end["reason"]
    elif not result["finished"] and result["reason"] in ("", "running"):
        result["reason"] = outcome.sentence or outcome.end.get("reason") or "ended before the mission did"
    return result, mission, vector_map, notes


def _say(args, home, result, vector_map, notes, kept):
    if vector_map is not None:
        say("\n".join(report.picture(home, vector_map)))
    say("\n".join(report.table(result)))
    for note in notes:
        say(note, sys.stderr)
    if args.out and kept:
        say("files           %s" % os.path.join(args.out, ""))
