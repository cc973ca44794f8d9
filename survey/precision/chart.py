"""The work-precision chart as a figure: one panel per work, one line per method or peer, and the
machine's limit.
"""

from functools import partial
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np

# Colours, mostly Okabe and Ito's, and markers: the same in every chart, and those of methods that
# are named in few.
STYLES = {
    "auto": ("#D55E00", "o"), "dop853": ("#0072B2", "s"), "rk4": ("#009E73", "D"), "taylor": ("#CC79A7", "^"),
    "taylor16": ("#CC79A7", "^"), "magnus6": ("#5D3A9B", "v"), "CyRK": ("#E69F00", "P"), "diffrax": ("#56B4E9", "*"),
    "heyoka": ("#000000", "X"), "scipy": ("#999999", "<"),
}  # fmt: skip
OTHERS = (("#8C6D31", ">"), ("#CC79A7", "v"), ("#5D3A9B", "^"), ("#0072B2", "D"), ("#009E73", "s"))
LEAST_ERROR = 1e-17  # a logarithmic axis has no zero
MOST_PANELS = 5  # in a row
SMALL, PLAIN = 17, 11  # characters in an inch of small text, and of plain text


def draw(records, machine, scene, name, path):
    """Draw the records of `survey precision`, and the least times in `machine`, to `path`."""
    works = list(dict.fromkeys(record.work for record in records))
    runs = list(dict.fromkeys((record.method, record.peer) for record in records))
    unnamed = [method or peer for method, peer in runs if (method or peer) not in STYLES]
    styles = STYLES | {name: OTHERS[k % len(OTHERS)] for k, name in enumerate(unnamed)}
    lines = -(-len(works) // MOST_PANELS)
    columns = -(-len(works) // lines)
    size = (max(4.6 * columns, 8.0), 1.0 + 4.6 * lines)
    figure, panels = plt.subplots(
        lines, columns, figsize=size, sharex=True, sharey=True, squeeze=False, layout="constrained"
    )
    for axes in panels.ravel()[len(works) :]:
        axes.set_axis_off()
    for axes, work in zip(panels.ravel(), works, strict=False):
        of_work = [record for record in records if record.work == work]
        _limit(axes, [entry for entry in machine["least"] if entry["work"] == work], of_work)
        for method, peer in runs:
            colour, marker = styles[method or peer]
            style = {"marker": marker, "color": colour}
            of_run = [r for r in of_work if (r.method, r.peer) == (method, peer)]
            if of_run:  # closed forms do not answer every work
                _line(axes, of_run, style)
        axes.set(title=work, xlabel="time per point on one thread (s)", xscale="log", yscale="log")
        axes.xaxis.set_minor_formatter(partial(_between, axes))
        axes.grid(alpha=0.3)
    for axes in panels[:, 0]:
        axes.set_ylabel(f"largest error of {name} / (1 + |value|)")
    named = {
        label: line
        for axes in panels.ravel()
        for line, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    title = _asked(machine) + "in brackets: compilation time, not included"
    if machine["missing_peers"]:
        title += f"; not installed: {', '.join(machine['missing_peers'])}"
    title = "\n".join(fill(line, int(SMALL * size[0])) for line in title.splitlines())
    figure.legend(
        named.values(),
        named.keys(),
        loc="outside lower center",
        ncols=5,
        fontsize=8,
        title=title,
        title_fontsize=8,
    )
    words = f"{scene}: error against time, lower left is better (numbers at points: wrong verdicts on the references)"
    figure.suptitle(fill(words, int(PLAIN * size[0])))
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _between(axes, x, _position):
    """Labels between powers of ten, where an axis shows few of these: at 2 and 5."""
    low, high = np.log10(axes.get_xlim())
    power = int(np.floor(np.log10(x)))
    mantissa = round(x / 10.0**power)
    return (
        rf"$\mathdefault{{{mantissa}\times10^{{{power}}}}}$"
        if mantissa in (2, 5) and high - low < 1.5
        else ""
    )


def _asked(machine):
    """What was timed, where, and under what load, in a line."""
    if "entry" not in machine:
        return ""
    load = "/".join(f"{x:.1f}" for x in machine["load"])
    asked = sorted(set(machine["outputs"].values()))
    words = f"timed: {machine['entry']}, outputs: {'; '.join(asked)}; one thread, processor time"
    peers = ", ".join(f"{name} {number}" for name, number in machine.get("peers", {}).items())
    words += f"; peers: {peers}" if peers else ""
    words += f"\n{machine['note']}" if machine.get("note") else ""
    return f"{words}\n{machine['cpu']}, load at the end {load} (1, 5, 15 min)\n"


def _line(axes, records, style):
    """One method or peer (hollow, dashed), with the number of wrong verdicts beside each point that
    has any.
    """
    method, peer = records[0].method, records[0].peer
    seconds = [r.seconds_per_point for r in records]
    errors = [max(r.error, LEAST_ERROR) for r in records]
    name = f"peer {peer}" if peer else method
    style |= (
        {"ls": "--", "mfc": "white", "lw": 1.2}
        if peer
        else {"lw": 2.5 if method == "auto" else 1.2}
    )
    axes.plot(seconds, errors, ms=5, label=f"{name} ({records[0].compile_seconds:.1f} s)", **style)
    for number, record in enumerate(r for r in records if r.wrong_verdicts):
        # alternately right and left, else the numbers of neighbours would read as one
        position = (
            {"xytext": (5, 3), "ha": "left"}
            if number % 2 == 0
            else {"xytext": (-5, -9), "ha": "right"}
        )
        axes.annotate(record.wrong_verdicts, (record.seconds_per_point, max(record.error, LEAST_ERROR)),
                      textcoords="offset points", color=style["color"], fontsize=8, **position)  # fmt: skip


def _limit(axes, least, records):
    """Draw the least time of a method's operations against its errors, if they were counted."""
    if not least:
        return
    errors = {
        r.setting: max(r.error, LEAST_ERROR) for r in records if r.method == least[0]["method"]
    }
    heights = [errors[entry["setting"]] for entry in least]
    axes.plot(
        [entry["seconds_per_point"] for entry in least], heights, "k--", lw=1,
        label=f"limit: {least[0]['method']}'s operations at this core's peak rate",
    )  # fmt: skip
