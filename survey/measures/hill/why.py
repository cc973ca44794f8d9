"""Why a point of Hill's equation has its verdict, in a sentence: which factor decided, against
which error bar.
"""

from survey.measures.hill.edges import FACTORS
from survey.scene import plus_minus

RULE = "an exact rule decides here (no unstable side, or |D| = 2), whatever the error bars"


def why(answer, even=True):
    """The sentence, from what is known of the point (`answer`); `even`: are the factors those at T/2?"""
    if answer["verdict"] == "marginal":
        return f"{RULE}: |D| = 2"
    if not (even and set(FACTORS) <= set(answer)):
        return _by_trace(answer)
    factors = {name: _product(answer, *name) for name in (("dy1", "y2"), ("y1", "dy2"))}
    (p, p_bar), (q, q_bar) = factors.values()
    above, below = f"y1' y2 = {plus_minus(p, p_bar)}", f"y1 y2' = {plus_minus(q, q_bar)}"
    if answer["verdict"] == "unstable":
        if p > p_bar:
            return f"{above} > 0 at T/2, {_times(p, p_bar)} its error bar: D = 2 + 4 y1' y2 > 2"
        if -q > q_bar:
            return f"{below} < 0 at T/2, {_times(q, q_bar)} its error bar: D = 4 y1 y2' - 2 < -2"
    elif answer["verdict"] == "stable" and -p > p_bar and q > q_bar:
        nearest = min(_ratio(p, p_bar), _ratio(q, q_bar))
        return f"{above} < 0 and {below} > 0 at T/2, at least {nearest:.2g} times their error bars: |D| < 2"
    elif answer["verdict"] == "undecided":
        open_ = above if abs(p) <= p_bar else below
        return f"{open_} at T/2: the error bar reaches across 0, an edge of a tongue"
    return f"{above}, {below} at T/2; {RULE}"


def _by_trace(answer):
    d, bar = float(answer["discriminant"]), float(answer["discriminant_error"])
    off = abs(2 - abs(d))
    if answer["verdict"] == "undecided":
        side = "the error bar reaches across |D| = 2"
    elif off > bar:
        side = f"{_times(off, bar)} its error bar: " + ("|D| > 2" if abs(d) > 2 else "|D| < 2")
    else:
        side = (
            "less than its error bar: the factors at T/2, more digits of D or an exact rule decide"
        )
    return f"D = {plus_minus(d, bar)}, {off:.2g} from |D| = 2, {side}"


def _product(answer, one, other):
    """The product of two factors and its error bound."""
    (x, dx), (y, dy) = (
        (float(answer[name]), float(answer[f"{name}_error"])) for name in (one, other)
    )
    return x * y, abs(x) * dy + abs(y) * dx + dx * dy


def _ratio(value, bar):
    return abs(value) / bar if bar else float("inf")


def _times(value, bar):
    return f"{_ratio(value, bar):.2g} times"
