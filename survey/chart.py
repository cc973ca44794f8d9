"""The work-precision chart as a figure: one panel per work, one line per method or peer."""

import matplotlib.pyplot as plt

# Okabe and Ito's colours that show as lines
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999", "#5D3A9B", "#8C6D31")
MARKERS = "osD^v<>ph*"


def draw(records, scene, name, path):
    """Draw the records of `survey precision` to `path`: lower left is better."""
    works = list(dict.fromkeys(record.work for record in records))
    runs = list(dict.fromkeys((record.method, record.peer) for record in records))
    figure, panels = plt.subplots(1, len(works), figsize=(4.6 * len(works), 4.6), sharey=True, layout="constrained")
    for axes, work in zip(panels if len(works) > 1 else [panels], works, strict=True):
        for (method, peer), marker, colour in zip(runs, MARKERS, COLOURS, strict=False):
            own = [r for r in records if (r.work, r.method, r.peer) == (work, method, peer)]
            seconds, errors = [r.seconds_per_point for r in own], [max(r.error, 1e-17) for r in own]
            style = {"ls": "--" if peer else "-", "lw": 2.5 if method == "auto" else 1.2}
            wrong = sum(r.wrong_verdicts for r in own)
            label = (method or f"{peer} (peer)") + (f", {wrong} wrong verdicts" if wrong else "")
            axes.loglog(seconds, errors, marker=marker, ms=4, color=colour, label=label, **style)
        axes.set(title=work, xlabel="seconds per point, one thread")
        axes.grid(alpha=0.3)
    (panels if len(works) == 1 else panels[0]).set_ylabel(f"largest error of the {name}, relative to 1 + |value|")
    (panels if len(works) == 1 else panels[-1]).legend(fontsize=8)
    figure.suptitle(f"{scene}: error against time (lower left is better)")
    figure.savefig(path, dpi=150)
    plt.close(figure)
