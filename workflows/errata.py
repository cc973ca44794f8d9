"""What the pages of errata share: residuals of formulas at random parameters, to many digits, and the page of them."""

import random

from mpmath import mp, mpf
from script import parser, say

DIGITS = 40
TRIALS = 5


def number(dice):
    """A random number of size 0.3 to 1.3: none is 0 or 1, or a missing factor would hide."""
    return dice.choice((-1, 1)) * (mpf(3) + 10 * mpf(dice.random())) / 10


def trials(function, seed=0):
    """The values of `function` at TRIALS random parameters, in DIGITS digits."""
    with mp.workdps(DIGITS):
        return [function(random.Random(seed + i)) for i in range(TRIALS)]


def erratum(function):
    """(least residual as printed, worst residual corrected)."""
    found = trials(function)
    return float(min(a for a, _ in found)), float(max(b for _, b in found))


def residual(function):
    return float(max(trials(function)))


def short(value):
    return f"{value:.0e}" if value else "0"


def write(doc, name, page, tables):
    """Write NAME.md: `page` with tables: errata (place, printed, correct, test), right, gaps (place, words, test)."""
    folder = parser(doc, "the page").parse_args().output
    say("printed against corrected")
    rows = [(place, a, b, *erratum(test)) for place, a, b, test in tables["errata"]]
    said = {"errata": "\n".join(f"| {place} | {a} | {b} | {x:.1g} | {short(y)} |" for place, a, b, x, y in rows)}
    say("what is right, and what is missing")
    for key in ("right", "gaps"):
        said[key] = "\n".join(f"| {place} | {what} | {short(residual(test))} |" for place, what, test in tables[key])
    path = folder / f"{name}.md"
    path.write_text(page.format(digits=DIGITS, trials=TRIALS, **said))
    print(path)
