"""The runs of an evaluation, several at a time, each in a process of its own; what an earlier evaluation has is not run again."""

import json
import os
import sys
import time

from host_tools.core_process import packages_folder
from host_tools.evaluation.run import kept
from host_tools.processes import Children
from host_tools.whole_file import write_result

LOOK_S = 0.1


class RunError(Exception):
    """One sentence: which run gave no figures, and why."""


def figures_of(runs, folder, workers, progress):
    """{run: figures}. Whatever happens, no process is left; what is finished is kept."""
    runs, folder = list(dict.fromkeys(runs)), os.path.abspath(folder)
    done = {run: figures for run in runs if (figures := kept(folder, run)) is not None}
    if done:
        progress.note("%d of %d runs are there from before." % (len(done), len(runs)))
    waiting, working = [run for run in runs if run not in done], []
    with Children() as children:
        while waiting or working:
            while waiting and len(working) < workers:
                working.append(_Worker(waiting.pop(0), folder, children))
            for worker in [worker for worker in working if worker.child.poll() is not None]:
                working.remove(worker)
                children.children.remove(worker.child)
                done[worker.run] = worker.figures(folder)
            progress.text(_line(len(done), len(runs), working))
            time.sleep(LOOK_S)
    progress.clear()
    return {run: done[run] for run in runs}


class _Worker:
    def __init__(self, run, folder, children):
        self.run = run
        self.robot_s = 0.0
        place = os.path.join(folder, run.key)
        os.makedirs(place, exist_ok=True)
        write_result(os.path.join(place, "run.json"), run.asdict())
        self.child = children.start(run.name, [sys.executable, "-m", "host_tools.evaluation.worker", place],
                                    on_line=self._take, cwd=packages_folder())

    def _take(self, text):
        try:
            self.robot_s = json.loads(text)["robot_s"]
        except (ValueError, KeyError, TypeError):
            pass  # not for us

    def figures(self, folder):
        figures = kept(folder, self.run) if self.child.popen.returncode == 0 else None
        if figures is None:
            said = self.child.text().splitlines()
            raise RunError("The run %s gave no figures: %s." % (
                self.run.name, said[-1].rstrip(".") if said else "its process ended with code %s" % self.child.popen.returncode))
        return figures


def _line(done, total, working):
    now = "   ".join("%s: %d s" % (worker.run.name, worker.robot_s or 0) for worker in working)
    return "%d of %d runs   %s" % (done, total, now)
