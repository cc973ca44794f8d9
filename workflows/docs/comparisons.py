"""The tables of how methods and peers compare, made from the measurements in `results/precision_*.json`."""

import json
from pathlib import Path

RESULTS = Path(__file__).resolve().parents[2] / "results"
ACCURACY = (1e-6, 1e-10)
UNITS = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
INTRODUCTION = """\
# How it compares

Time per point, on one thread, that each method of `survey` and the best other programs need for a stated accuracy: the
largest error relative to 1 + |value| over reference points whose values are known to 30 digits or more. Each peer is
used at its best; its file in `survey/precision/peers/` documents how. Peers give no error bars: `wrong` counts the
reference points for which the verdict is wrong; undecided is not wrong.

`survey precision SCENE --peers` repeats all this on your machine. Every number on this page is read from the stored
measurements when the page is built; a dash means that none of the settings tried reached the accuracy.
"""


def page():
    """The page of all charts, a table for each work of each scene."""
    parts = [INTRODUCTION]
    for path in sorted(RESULTS.glob("precision_*.json")):
        scene = path.stem.removeprefix("precision_")
        measured = json.loads(path.read_text(encoding="utf-8"))
        parts += [
            f"## {scene}",
            _machine(measured["machine"]),
            f"![{scene}: error against time](results/{path.stem}.png)",
        ]
        works = dict.fromkeys(record["work"] for record in measured["records"])
        parts += [
            _table(work, [r for r in measured["records"] if r["work"] == work]) for work in works
        ]
    return "\n\n".join(parts) + "\n"


def _machine(machine):
    versions = ", ".join(
        f"{name.removeprefix('version_')} {value}"
        for name, value in machine.items()
        if name.startswith("version_")
    )
    return f"Measured on {machine['cpu']}, one thread, commit {machine['commit'][:10]}; {versions}."


def _table(work, records):
    """One row for each method and peer, `auto` first, then by time at the accuracy."""
    names = dict.fromkeys((record["method"], record["peer"]) for record in records)
    rows = [(name, [best(records, *name, accuracy) for accuracy in ACCURACY]) for name in names]
    auto = next((found for (method, _), found in rows if method == "auto"), None)
    rows.sort(
        key=lambda row: (
            row[0][0] != "auto",
            row[1][-1] is None,
            row[1][-1] and row[1][-1]["seconds_per_point"],
        )
    )
    head = " | ".join(
        f"to {accuracy:.0e}".replace("e-0", "e-") + " | of auto's | wrong" for accuracy in ACCURACY
    )
    lines = [f"### {work}", "", f"| | {head} |", "|---|" + "---:|" * (3 * len(ACCURACY))]
    for (method, peer), found in rows:
        cells = [_cells(one, auto[i] if auto else None) for i, one in enumerate(found)]
        lines.append(f"| {f'{peer} (peer)' if peer else method} | {' | '.join(cells)} |")
    return "\n".join(lines)


def best(records, method, peer, accuracy):
    """The fastest record of a method or peer whose error is at most `accuracy`, or None."""
    good = [
        r for r in records if (r["method"], r["peer"]) == (method, peer) and r["error"] <= accuracy
    ]
    return min(good, key=lambda record: record["seconds_per_point"], default=None)


def _cells(record, auto):
    if record is None:
        return "- | - | -"
    ratio = _ratio(record["seconds_per_point"] / auto["seconds_per_point"]) if auto else "-"
    return f"{_time(record['seconds_per_point'])} | {ratio} | {record['wrong_verdicts']}"


def _ratio(ratio):
    return f"{ratio:,.0f}" if ratio >= 100 else f"{ratio:.2g}"


def _time(seconds):
    unit, size = next(((unit, size) for unit, size in UNITS if seconds >= size), UNITS[-1])
    return f"{seconds / size:.3g} {unit}"
