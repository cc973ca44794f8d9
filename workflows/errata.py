"""What the pages of errata share: residuals of formulas at random parameters with many digits, and
the page.
"""

import random

from mpmath import mp, mpf
from script import parser, say

DIGITS = 40
TRIALS = 5


def number(dice):
    """A random number of magnitude 0.3 to 1.3: exactly 0 or 1 could hide a missing factor."""
    return dice.choice((-1, 1)) * (mpf(3) + 10 * mpf(dice.random())) / 10


def numbers(dice, count):
    return [number(dice) for _ in range(count)]


def worst(values):
    return max(abs(v) for v in values)


def same_dice(printed, *right):
    """The residual of the printed formula and the largest of the right ones, with the same random numbers."""

    def test(dice):
        state, values = dice.getstate(), []
        for function in (printed, *right):
            dice.setstate(state)
            values.append(function(dice))
        return values[0], worst(values[1:])

    return test


def trials(function, seed=0):
    """The values of `function` at TRIALS random parameters, computed with DIGITS digits."""
    with mp.workdps(DIGITS):
        return [function(random.Random(seed + i)) for i in range(TRIALS)]


def erratum(function):
    """(least residual of the printed formula, largest of the corrected one)."""
    found = trials(function)
    return float(min(a for a, _ in found)), float(max(b for _, b in found))


def residual(function):
    return float(max(trials(function)))


def short(value):
    return f"{value:.0e}" if value else "0"


def write(doc, name, page, tables):
    """Write NAME.md: `page` with tables: errata (place, printed, correct, test), right, gaps
    (place, words, test).
    """
    folder = parser(doc, "the page").parse_args().output
    say("comparing printed and corrected formulas")
    rows = [(place, a, b, *erratum(test)) for place, a, b, test in tables["errata"]]
    filled = {
        "errata": "\n".join(
            f"| {place} | {a} | {b} | {x:.1g} | {short(y)} |" for place, a, b, x, y in rows
        )
    }
    say("checking the remaining formulas")
    for key in ("right", "gaps"):
        filled[key] = "\n".join(
            f"| {place} | {what} | {short(residual(test))} |" for place, what, test in tables[key]
        )
    path = folder / f"{name}.md"
    path.write_text(page.format(digits=DIGITS, trials=TRIALS, **filled), encoding="utf-8")
    print(path)
