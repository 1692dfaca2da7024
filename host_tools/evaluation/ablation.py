"""What each improvement is worth: by itself over the paper's mode, and left out of the whole."""

from host_tools.evaluation.run import Run
from host_tools.evaluation.section import PRESETS, Section, mean, number, preset_name, table
from protocol.parameters import FLAGS

IMPROVEMENTS = tuple(row[0] for row in FLAGS if row[1])
FEW = 3
WHOLE, NONE = "all on (improved)", "all off (paper)"


def variants():
    """{what a row is called: (mode, settings)}"""
    named = {WHOLE: ("improved", ()), NONE: ("paper", ())}
    named |= {"only %s" % flag: ("paper", (flag + "=on",)) for flag in IMPROVEMENTS}
    return named | {"without %s" % flag: ("improved", (flag + "=off",)) for flag in IMPROVEMENTS}


def runs(plan):
    return {name: {preset: [Run(plan.home, mode, *preset, seed=seed, settings=settings, peers=False) for seed in plan.seeds[:FEW]]
                   for preset in PRESETS[:2]} for name, (mode, settings) in variants().items()}


def ablation(plan, done, folder):
    head, rows, data = ["flags"], [], {}
    for preset in PRESETS[:2]:
        head += ["%s: error cm" % preset_name(*preset), "precision", "recall", "robot s", "finished"]
    for name, by_preset in runs(plan).items():
        row, data[name] = [name], {}
        for preset, of in by_preset.items():
            figures = summary([done[run]["result"] for run in of])
            data[name][preset_name(*preset)] = figures
            row += [number(figures["mean_cm"]), number(figures["precision_5cm"], "%.3f"), number(figures["recall_5cm"], "%.3f"),
                    number(figures["robot_s"], "%.0f"), "%d of %d" % (figures["finished"], figures["runs"])]
        rows.append(row)
    title = "Ablation: each improvement alone, and each one left out (mean of %d seeds)" % len(plan.seeds[:FEW])
    return Section("ablation", title, table(head, rows), data)


def summary(results):
    """Means over the missions; those that did not finish count, too: a map that is not whole is what the flag is worth."""
    return {"runs": len(results), "finished": sum(each["finished"] for each in results),
            "mean_cm": mean([each["localisation"]["estimate"]["mean_cm"] for each in results]),
            "precision_5cm": mean([each["map"]["precision_5cm"] for each in results]),
            "recall_5cm": mean([each["map"]["recall_5cm"] for each in results]),
            "robot_s": mean([each["time"]["robot_s"] for each in results])}
