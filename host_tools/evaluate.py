"""`host_tools evaluate`: the paper's section 5 again, its figures and ours side by side.

Missions run in parallel with the core in the robot's process (the same frames, the same hashes as over a pty);
each is kept in DIR/runs under the hash of its home, options and code, and is not run again while those stay.
"""

import argparse
import json
import os
import re
import sys
from dataclasses import replace

from host_tools.evaluation import ablation, growth, localisation, maps, table2
from host_tools.evaluation.pool import RunError, figures_of
from host_tools.evaluation.run import ended_well
from host_tools.evaluation.section import Plan
from host_tools.processes import signals_as_interrupt
from host_tools.progress import Progress, say
from host_tools.whole_file import whole_file
from sim_device.home import HomeError, load_home

FIGURES = {"5a": localisation.fig5a, "5b": localisation.fig5b, "6": localisation.fig6, "7": maps.fig7, "8": maps.fig8, "9": maps.fig9,
           "table2": table2.table2}
HOME, QUICK_HOME = "office_458", "flat"
SEEDS, QUICK_SEEDS = 10, 3
EXIT_OK, EXIT_NOT_FINISHED, EXIT_USAGE, EXIT_PEER = 0, 1, 2, 3


class UsageError(Exception):
    """One sentence: which argument cannot be served, and the way out."""


def add_arguments(parser):
    parser.add_argument("--figures", default=None, metavar="LIST", help="all, or some of %s, with commas between" % ", ".join(FIGURES))
    parser.add_argument("--ablation", action="store_true", help="each improvement alone, and each one left out")
    parser.add_argument("--growth", action="store_true", help="the office floor 1, 2, 4 and 8 times")
    parser.add_argument("--out", metavar="DIR", required=True,
                        help="pictures, evaluation.md, evaluation.json, and the runs, kept for the next time")
    parser.add_argument("--home", default=None, metavar="HOME", help="a home file or a shipped home (default %s)" % HOME)
    parser.add_argument("--quick", action="store_true", help="a small home (%s) and %d seeds" % (QUICK_HOME, QUICK_SEEDS))
    parser.add_argument("--seeds", type=_count, default=None, metavar="N", help="repetitions, seeds 1 to N (default %d)" % SEEDS)
    parser.add_argument("--workers", type=_count, default=os.cpu_count() or 1, metavar="N", help="missions at a time (default: one a core)")


def _count(text):
    if not re.fullmatch(r"[1-9][0-9]?", text):
        raise argparse.ArgumentTypeError("%s is not a whole number from 1 to 99" % (text or "(empty)"))
    return int(text)


def run(args):
    try:
        wanted = _wanted(args)
        plan = _plan(args)
        with signals_as_interrupt():
            return _evaluate(args, plan, wanted)
    except (UsageError, HomeError) as error:
        code, sentence = EXIT_USAGE, error
    except (RunError, growth.GrowthError) as error:
        code, sentence = EXIT_PEER, error
    except OSError as error:
        code, sentence = EXIT_USAGE, "%s cannot be written: %s." % (error.filename or args.out, (error.strerror or str(error)).lower())
    except ImportError as error:
        if (error.name or "").split(".")[0] != "matplotlib":
            raise
        code, sentence = EXIT_USAGE, "The figures need matplotlib, which is not installed: pip install 'tvslam[plot]'."
    except KeyboardInterrupt:
        code, sentence = 130, "Interrupted: what has finished is kept, the same command goes on from there."
    print("host_tools evaluate: %s" % sentence, file=sys.stderr)
    return code


def _wanted(args):
    """The makers of what was asked for, in the paper's order."""
    if args.figures is None and not args.ablation and not args.growth:
        raise UsageError("Nothing is asked for: give --figures all, --ablation or --growth.")
    names = list(FIGURES) if args.figures == "all" else (args.figures or "").split(",") if args.figures is not None else []
    for name in names:
        if name not in FIGURES:
            raise UsageError("--figures %s is unknown; use all, or some of %s." % (name or "(empty)", ", ".join(FIGURES)))
    makers = [make for name, make in FIGURES.items() if name in names]
    return makers + [ablation.ablation] * args.ablation + [growth.growth] * args.growth


def _plan(args):
    home = load_home(args.home or (QUICK_HOME if args.quick else HOME))
    folder = os.path.join(os.path.abspath(args.out), "runs")
    os.makedirs(folder, exist_ok=True)
    return Plan(os.path.abspath(home.path), tuple(range(1, (args.seeds or (QUICK_SEEDS if args.quick else SEEDS)) + 1)), folder)


def runs_for(plan, makers):
    """Every run that the figures need, the long ones first."""
    needs = {localisation.fig5a: lambda: [runs[0] for runs in plan.groups().values()], localisation.fig5b: plan.main,
             localisation.fig6: lambda: [run for runs in plan.groups().values() for run in runs], maps.fig7: list,
             maps.fig8: lambda: plan.main()[:1], maps.fig9: lambda: plan.main()[:1],
             table2.table2: lambda: [plan.main()[0], plan.beside("paper")[0], table2.without_ways(plan)],
             ablation.ablation: lambda: [run for by in ablation.runs(plan).values() for of in by.values() for run in of],
             growth.growth: lambda: growth.runs(plan)[::-1]}
    return [run for make in makers for run in needs[make]()]


def _evaluate(args, plan, makers):
    import matplotlib  # noqa: F401  before the missions, not after them

    done = figures_of(runs_for(plan, makers), plan.folder, args.workers, Progress())
    sections = [make(plan, done, args.out) for make in makers]
    _write(args, plan, sections, done)
    say("\n\n".join("\n".join([section.title, "", *section.lines, *section.notes]) for section in sections))
    unfinished = [run.name for run, figures in done.items() if not ended_well(run, figures) and run != table2.without_ways(plan)]
    if unfinished:
        print("host_tools evaluate: %d of %d missions did not finish: %s%s." % (
            len(unfinished), len(done), "; ".join(unfinished[:3]), " and others" if len(unfinished) > 3 else ""), file=sys.stderr)
    say("files           %s" % os.path.join(args.out, ""))
    return EXIT_NOT_FINISHED if unfinished else EXIT_OK


def _write(args, plan, sections, done):
    home = load_home(plan.home)
    head = ["# %s: the paper's section 5 again" % home.name, "",
            "Made by `host_tools evaluate`: %d missions, seeds %d to %d%s. Presets are named in each table." % (
                len(done), plan.seeds[0], plan.seeds[-1], ", of the quick kind" if args.quick else "")]
    lines = head
    for section in sections:
        lines += ["", "## " + section.title, "", *section.lines]
        for note in section.notes:
            lines += ["", note]
        if section.picture:
            lines += ["", "![%s](%s)" % (section.title, section.picture)]
    _text(os.path.join(args.out, "evaluation.md"), "\n".join(lines) + "\n")
    told = {"home": home.name, "seeds": plan.seeds, "quick": args.quick,
            "sections": {section.name: {key: getattr(section, key) for key in ("title", "lines", "notes", "data")} for section in sections},
            "runs": [replace(run, home=os.path.basename(run.home)).asdict() | {"key": run.key, "finished": figures["result"]["finished"]}
                     for run, figures in done.items()]}
    _text(os.path.join(args.out, "evaluation.json"), json.dumps(told, indent=1, allow_nan=False) + "\n")


def _text(path, text):
    with whole_file(path) as beside, open(beside, "w", encoding="utf-8") as file:
        file.write(text)
