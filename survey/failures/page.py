"""The page of `survey failures`: what was asked, the picture, a table per plane, what `auto` does."""

import numpy as np

from survey.failures.plane import MAP, RTOL

PAGE = """# Where methods fail: {scene}

Made by `survey failures {scene}{asked}`. Every method solves every point of {number} at rtol = {rtol:g};
shown is the largest true error among the outputs, over 1 + |value|.

{about}

Grey: it gives no answer, and says why in `status`. Hatched: an error bar of its own misses rtol. Black: a lie, that
is, a true error beyond its bar, or a verdict that the truth contradicts: there are **{lies}** among {answers:,}
answers. The largest true error is {ratio:.2g} of its bar{unchecked}.

![true errors of each method](failures_{name}.png)

{tables}
"""
TABLE = """## {title}

{source}

| method | answers | meets rtol | undecided | median error | largest error | largest where it meets rtol | largest error / bar | lies |
|---|---|---|---|---|---|---|---|---|
{rows}

{auto}
"""  # noqa: E501  (a row of a table)


def text(scene, name, about, planes, results, records, share):
    """The page as Markdown."""
    answers = sum(r.points - r.refused for r in records)
    vague = sum(r.unchecked for r in records)
    return PAGE.format(
        scene=scene, name=name, about=about.strip(), rtol=RTOL, answers=answers,
        asked=f" --share {share:g}" if share < 1 else "",
        number=f"{len(planes)} planes" if len(planes) > 1 else "one plane",
        lies=sum(r.lies for r in records) or "none",
        ratio=max((r.largest_error_over_bar for r in records if r.points > r.refused), default=0.0),
        unchecked=f"; at {vague:,} answers the truth is no sharper than the bars" if vague else "",
        tables="\n".join(_table(plane, of, records) for plane, of in zip(planes, results, strict=True)),
    ).replace("\n\n\n", "\n\n")  # fmt: skip


def _table(plane, results, records):
    own = [r for r in records if r.name == plane.name]
    return TABLE.format(
        title=plane.name,
        source=plane.source,
        rows="\n".join(_row(r) for r in own),
        auto=_auto(dict(results)),
    )


def _row(r):
    if r.refused == r.points:
        return f"| {r.method} | none | | | | | | | |"
    answers = r.points - r.refused
    met = f"{r.largest_error_where_met:.0e}" if answers > r.missed else ""
    return (
        f"| {r.method} | {answers / r.points:.1%} | {(answers - r.missed) / r.points:.1%} | {r.undecided} | "
        f"{r.median_error:.0e} | {r.largest_error:.0e} | {met} | {r.largest_error_over_bar:.2g} | {r.lies} |"
    )


def _auto(results):
    """What `auto` does beside the others, in a sentence."""
    auto = results["auto"]
    met = {
        method: found.answered & ~found.missed
        for method, found in results.items()
        if found is not None
    }
    rest = [of for method, of in met.items() if method not in ("auto", MAP)]
    some = np.any(rest, axis=0) if rest else np.zeros_like(met["auto"])
    lost, gained = int((some & ~met["auto"]).sum()), int((met["auto"] & ~some).sum())
    left = int((auto.answered & auto.missed).sum())
    points = met["auto"].size
    return (
        f"`auto` meets rtol at {int(met['auto'].sum()):,} of {points:,} points, at {gained:,} of them alone, and "
        f"misses it with an answer at {left:,}; where another method meets it, `auto` does too"
        + (f" except at {lost:,} points." if lost else ".")
    )
