"""Cores led through one recorded mission in lockstep, compared with one another or with the log itself."""

from typing import NamedTuple

from host_tools.differences import between, between_lists, between_same, robot_s, same, state_name
from host_tools.lockstep import LockstepCore

LOG = "log"
AHEAD_STEPS = 5     # every kind of telemetry has its turn in so many
HASHES = ("steps_lo", "steps_hi", "map_lo", "map_hi")


# One step as it went: the STEP, the mission's state before it, {side: STEP_RSP}.
class Moment(NamedTuple):
    question: object
    state_before: int
    answers: dict

    @property
    def step(self):
        return self.question.step

    @property
    def state(self):
        return next(iter(self.answers.values())).state


# Contract: `advance` runs one step on every core and leaves `now`, `past` (the Moment before), apart and telemetry_apart
# (a Difference or None; the telemetry is that of `past`). Where `with_log`, the log is a side, too, but nothing is
# said of telemetry that it has not. Failures are CoreErrors.
class SideBySide:
    def __init__(self, recording, ports, with_log):
        self.recording = recording
        self.cores = [LockstepCore(name, port) for name, port in ports.items()]
        self.with_log = with_log
        self.steps = 0
        self.telemetry = 0      # messages compared
        self.asked = 0          # questions that are no steps
        self.now = self.past = None
        self.apart = self.telemetry_apart = None
        self._others = []       # [{side: answer}] of what was asked since the last step
        self._told = []         # the log's telemetry after `now`
        self._heard = {}        # {side: telemetry} compared last
        self._ticks = recording.ticks()
        for core in self.cores:
            core.handshake()
        for tick in recording.before:
            self._ask(tick)

    def advance(self):
        """False at the end of the log."""
        tick = next(self._ticks, None)
        while tick is not None and tick.question.NAME != "STEP":
            self._ask(tick)
            tick = next(self._ticks, None)
        if tick is None:
            self.apart = self._between_steps(self.now.step if self.now else 0)
            return False
        for core in self.cores:
            core.send(tick.question)
        answers, heard = {LOG: tick.answer} if self.with_log and tick.answer is not None else {}, {}
        for core in self.cores:
            answers[core.name], heard[core.name] = core.answer(tick.question)
        self.telemetry_apart = self._compare_telemetry(heard)
        self.past, self.now = self.now, Moment(tick.question, self.now.state if self.now else 0, answers)
        self.apart = self._between_steps(self.now.step) or between(self.now.step, answers)
        self._told = tick.telemetry
        self.steps += 1
        return True

    def _ask(self, tick):
        """What is no STEP; its answers are compared with the next step's."""
        self.asked += 1
        if tick.question.NAME == "PARAM_SET" and self.now is None:
            for core in self.cores:
                core.tell(tick.question)
            return
        answers = {LOG: tick.answer} if self.with_log and tick.answer is not None else {}
        for core in self.cores:
            answers[core.name] = core.ask_reliably(tick.question)
        self._others.append(answers)

    def _between_steps(self, step):
        found = (between_lists(step, {side: [answer] for side, answer in answers.items()}, "answer") for answers in self._others)
        first = next((difference for difference in found if difference is not None), None)
        self._others = []
        return first

    def finish(self):
        """{side: STATUS_RSP} of the cores. What the last step still told comes before it, and is compared, too."""
        statuses = {core.name: core.status() for core in self.cores}
        self.telemetry_apart = self._compare_telemetry({core.name: core.heard for core in self.cores})
        self._forget()
        return statuses

    def look_deeper(self):
        """After a difference: the messages of this step and of the next ones on which the sides do not agree."""
        step = self.now.step
        statuses = self.finish()
        told = self._heard
        found = [between(step, statuses, HASHES)]
        for records in zip(*(core.stores() for core in self.cores)):
            found.append(between(step, dict(zip(statuses, records))))
        self._forget()
        ahead = 0
        while ahead < AHEAD_STEPS and self.advance():
            ahead += 1
            told = _joined(told, self._heard)
        if ahead:
            self.finish()
            told = _joined(told, self._heard)
        found += [between(step, there) for there in same(told)] if len(told) > 1 else []
        return [difference for difference in found if difference is not None]

    def _forget(self):
        self._told = []
        for core in self.cores:
            core.heard = []

    def _compare_telemetry(self, heard):
        if self.with_log:
            heard = {LOG: self._told, **heard}
        self._heard = heard
        if self.now is None:
            return None
        if not self.with_log:
            self.telemetry += len(next(iter(heard.values())))
            return between_lists(self.now.step, heard)
        self.telemetry += len(same(heard))
        return between_same(self.now.step, heard)


def _joined(told, more):
    return {side: told[side] + more[side] for side in told}


def progress_text(run, seconds):
    step = run.now.step
    return "robot %8.1f s  step %7d  %3.0f %% of the log  %6.0f steps/s  %s" % (
        robot_s(step), step, 100 * run.recording.share, run.steps / max(seconds, 1e-9), state_name(run.now.state))
