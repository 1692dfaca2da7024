"""The first difference of a replay or a bisection, with what a firmware engineer asks next: when, in which state,
from which readings, what each side answered, and which values behind the hash were other ones.
"""

from dataclasses import dataclass

from host_tools.differences import Difference, all_fields, as_json, input_lines, robot_s, state_name, table
from host_tools.side_by_side import AHEAD_STEPS, Moment

HASHED = ("hash16",)


@dataclass
class Finding:
    difference: Difference
    moment: Moment
    deeper: list    # Differences of the same step and the next few

    @classmethod
    def of(cls, run, difference):
        """`run` stands at the difference, or one step after it; it is led on a little, to see more."""
        moment = run.now if run.now.step == difference.step else run.past
        return cls(difference, moment, run.look_deeper())

    @property
    def shown_by(self):
        """The first value behind a hash that differs, None if the answer itself shows it or nothing does."""
        if self.difference.message != "STEP_RSP" or set(self.difference.fields) - set(HASHED):
            return None
        return self.deeper[0] if self.deeper else None

    def headline(self):
        at = "step %d, %s s of the robot" % (self.difference.step, robot_s(self.difference.step))
        shown = self.shown_by
        why = "; shown by %s at step %d" % (shown.names, shown.step) if shown else ""
        return "%s: %s%s" % (at, self.difference.names, why)

    def lines(self):
        moment, answers = self.moment, self.moment.answers
        lines = ["", "STEP %d, in state %s" % (moment.step, state_name(moment.state_before)), *input_lines(moment.question), "",
                 *table("STEP_RSP", answers, all_fields(answers))]
        if self.difference.message != "STEP_RSP":
            lines += ["", *difference_table(self.difference)]
        others = [difference for difference in self.deeper if difference != self.difference]
        if not others:
            return lines + ["", "No message of this step or of the next %d shows another difference." % AHEAD_STEPS]
        for difference in others:
            lines += ["", *difference_table(difference)]
        return lines

    def as_dict(self):
        moment = self.moment
        return {**self.difference.as_dict(), "robot_s": robot_s(moment.step), "state_before": state_name(moment.state_before),
                "input": as_json(moment.question), "answers": {side: as_json(answer) for side, answer in moment.answers.items()},
                "deeper": [difference.as_dict() for difference in self.deeper]}


def difference_table(difference):
    sides = next(iter(difference.fields.values()))
    return table("%s, step %d" % (difference.message, difference.step), sides, difference.fields)
