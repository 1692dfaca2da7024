"""Figs. 5(a), 5(b) and 6: how far off the robot believes itself to be."""

import os

import numpy as np

from host_tools.evaluation import published
from host_tools.evaluation.run import ended_well
from host_tools.evaluation.section import METHODS, NINE, Section, canvas, good, mean, number, save, table

COLORS = {"estimate": "#c2410c", "paper_rule": "#6b7280", "ekf": "#2563eb", "ukf": "#0891b2", "batch": "#15803d", "uwb_only": "#a855f7",
          "dead_reckoning": "#a16207"}
PAPER_COLOR = "#111827"
AN_HOUR = "Seed 1 and mode paper are whole missions, at most four hours of robot time; the other runs are ended after one hour."


def fig5a(plan, done, folder):
    """20 random stops of one mission."""
    groups = {name: done[runs[0]] for name, runs in plan.groups().items()}
    rows = [("the paper, Fig. 5(a)", "-", "under %.0f" % published.WITHIN_CM, "yes")]
    for name, figures in groups.items():
        error = [value for value in figures["stops"]["error_cm"]["estimate"] if value is not None]
        rows.append((name, number(mean(error)), number(max(error, default=None)),
                     "yes" if error and max(error) <= published.WITHIN_CM else "no"))
    lines = table(("seed %d" % plan.seeds[0], "mean cm", "largest cm", "all 20 within 8 cm"), rows)
    data = {name: figures["stops"] for name, figures in groups.items()}
    section = Section("5a", "Fig. 5(a): error at 20 random stops", lines, data, "fig5a.png", [AN_HOUR])
    figure, axes = canvas()
    for name, color in zip(list(groups)[:2], (COLORS["estimate"], COLORS["paper_rule"])):
        error = [np.nan if value is None else value for value in groups[name]["stops"]["error_cm"]["estimate"]]
        axes.plot(range(1, len(error) + 1), error, "o-", color=color, linewidth=1, markersize=4, label=name)
    axes.axhline(published.WITHIN_CM, color=PAPER_COLOR, linewidth=1, linestyle="--", label="the paper: all within 8 cm")
    _finish(axes, "stop", "position error in cm", 20)
    save(figure, os.path.join(folder, section.picture))
    return section


def fig5b(plan, done, folder):
    """The deviation at 20 places that every repetition passes."""
    runs = [run for run in plan.main() if ended_well(run, done[run])]
    places = np.array(done[plan.main()[-1]]["stops"]["true_xy"])
    tracks = [np.load(os.path.join(plan.folder, run.key, "track.npy")) for run in runs]
    deviation = deviations_cm(places, tracks) if len(runs) > 1 else np.full(len(places), np.nan)
    known = deviation[np.isfinite(deviation)]
    ours = (number(float(known.mean()) if len(known) else None), number(float(known.max()) if len(known) else None))
    lines = table(("%d repetitions" % len(runs), "deviation cm, mean of 20 stops", "largest"),
                  [("the paper, Fig. 5(b)", "about %.0f" % published.MEAN_CM, "-"), ("improved, UWB paper, odometry calibrated", *ours)])
    data = {"repetitions": len(runs), "places": places.tolist(), "deviation_cm": [None if np.isnan(v) else float(v) for v in deviation]}
    section = Section("5b", "Fig. 5(b): standard deviation over the repetitions, stop by stop", lines, data, "fig5b.png")
    figure, axes = canvas()
    axes.plot(range(1, len(deviation) + 1), deviation, "o-", color=COLORS["estimate"], linewidth=1, markersize=4,
              label="improved, UWB paper, odometry calibrated")
    axes.axhline(published.MEAN_CM, color=PAPER_COLOR, linewidth=1, linestyle="--", label="the paper: about 5 cm")
    _finish(axes, "stop", "standard deviation in cm", len(deviation))
    save(figure, os.path.join(folder, section.picture))
    return section


def deviations_cm(places, tracks, near_m=0.3):
    """At each place the root mean square distance of the errors from their mean; NaN where fewer than two runs came near.

    A track is (n, 4): estimated and true x, y.
    """
    found = np.full(len(places), np.nan)
    for i, place in enumerate(places):
        errors = []
        for track in tracks:
            away = np.hypot(track[:, 2] - place[0], track[:, 3] - place[1])
            if len(away) and away.min() <= near_m:
                errors.append(track[away.argmin(), :2] - track[away.argmin(), 2:])
        if len(errors) > 1:
            found[i] = 100 * np.sqrt(np.sum(np.var(np.array(errors, float), axis=0, ddof=1)))
    return found


def fig6(plan, done, folder):
    """Each run's mean error over its 20 stops, by method."""
    groups = {name: good(runs, done) for name, runs in plan.groups().items()}
    means = {name: {method: [mean(each["stops"]["error_cm"].get(method) or []) for each in runs] for method in METHODS}
             for name, runs in groups.items()}
    head = ("mean error, cm", *("%s (%d run%s)" % (name, len(runs), "s" * (len(runs) != 1)) for name, runs in groups.items()))
    rows = [("the paper's combined method", "5.0", *["-"] * (len(groups) - 1))]
    rows += [(label, *(number(mean(by_method[method])) for by_method in means.values())) for method, label in METHODS.items()]
    notes = [AN_HOUR] + missing_peers([done[run] for runs in plan.groups().values() for run in runs])
    title = "Fig. 6: mean position error over %d runs" % len(plan.main()[:NINE])
    section = Section("6", title, table(head, rows), means, "fig6.png", notes)
    figure, axes = canvas()
    main = next(iter(means.values()))
    for method, label in METHODS.items():
        values = [np.nan if value is None else value for value in main[method]]
        if not np.isnan(values).all():
            # Two filters that agree lie on each other: the later one is dashed.
            style = "o--" if method == "ukf" else "o-"
            axes.plot(range(1, len(values) + 1), values, style, color=COLORS[method], linewidth=1, markersize=4,
                      label="%s (%.1f cm)" % (label, mean(main[method])))
    axes.axhline(published.MEAN_CM, color=PAPER_COLOR, linewidth=1, linestyle="--", label="the paper's method (5 cm)")
    axes.set_yscale("log")
    _finish(axes, "run", "mean error of 20 stops in cm", max(len(each) for each in main.values()), columns=3)
    save(figure, os.path.join(folder, section.picture))
    return section


def missing_peers(figures):
    """One sentence for each library that was not there."""
    methods = {}
    for each in figures:
        for method, library in each["missing"].items():
            methods.setdefault(library, set()).add(METHODS[method].split(" (")[0])
    return ["%s is not installed, so %s not measured: pip install 'tvslam[evaluate]' gets it." % (
        library, " and ".join(sorted(names)) + (" were" if len(names) > 1 else " was")) for library, names in sorted(methods.items())]


def _finish(axes, across, up, count, columns=2):
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set_xlabel(across, fontsize=9)
    axes.set_ylabel(up, fontsize=9)
    axes.set_xticks(range(1, max(count, 1) + 1))
    if axes.get_yscale() == "log":
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.set_ylim(bottom=0)
    axes.grid(axis="y", color="#e5e7eb", linewidth=0.6)
    axes.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=columns)
