"""What a certificate states: panels on which few nodes suffice, and cells whose verdicts the
checker will prove.

The nodes and the bounds are the checker's own (`survey.proof.checker`), in balls. The cells of a
map are searched in binary64, many at a time, with a bound of all rounding: nothing is stated that
does not hold with a margin. Those of a row, which are far smaller about its edges, are the
checker's own, too.
"""

import math
from fractions import Fraction
from functools import reduce
from itertools import product

import numpy as np
from flint import acb, arb

from survey.proof import checker

BITS = 96  # of the balls
ORDERS = range(12, 80, 4)  # of the Taylor series
NODES = (6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 36, 40)
ELLIPSES = (1.6, 1.9, 2.3, 2.8, 3.5, 4.5, 6, 8, 12, 20)
# least w relative to the square root of the largest |L11|, which are tried
RATES = np.geomspace(0.03, 1.3, 10)
# of the growth in the factors, by their number
POWERS = {1: 1, 2: 1, 4: 1, 7: np.array([2, 2, 2, 2, 2, 2, 4])}
# positions in a piece that are sampled; every so many of their ends K and L must be analytic
SAMPLES, CHECKED = 96, 12
UNIT = 2.0**-53
PANEL = "."  # in a layout
SMALLEST = 2  # halvings of a map's panel: for fewer cells it is not worth its nodes
PANELS = 10  # halvings of a row, at most, to find panels


def plan(equation, sides, tolerance):
    """A panel without its cells, on which the polynomials leave out less than `tolerance`, or than
    this part of the largest factor that is found there; raises checker.Failed.

    `sides`: the ends of both, rational."""
    sides = [
        (checker.exact((low + high) / 2), checker.exact((high - low) / 2)) for low, high in sides
    ]
    allowed = tolerance * _scale(equation, sides)
    chosen = [_ellipse(equation, sides, name, allowed) for name in equation.names]
    nodes, ellipses, rates = zip(*chosen, strict=True)
    return {
        "nodes": list(nodes), "ellipses": [str(r) for r in ellipses], "rates": [str(w) for w in rates],
        "order": _order(equation, sides, allowed), "cells": checker.OPEN,
    }  # fmt: skip


def _scale(equation, sides):
    """The largest modulus of each factor at the middle and the corners of the sides, at least 1."""
    found = [np.ones(1)]
    for at in [(0,) * len(sides), *product((-1, 1), repeat=len(sides))]:
        point = {
            n: centre + x * half
            for n, x, (centre, half) in zip(equation.names, at, sides, strict=True)
        }
        factors = equation.factors(equation.steps(point, ORDERS[4]), ORDERS[4], point)
        found.append(np.array([abs(float(f.mid())) for f in factors]))
    return reduce(np.maximum, found)


def _ellipse(equation, sides, name, allowed):
    """(number of nodes, r, least w) for one parameter: the fewest nodes."""
    tried = []
    why = checker.Failed("no ellipse has a small enough bound: smaller panels are needed")
    for r in map(arb, ELLIPSES):
        length, entries = _sampled(equation, sides, name, r)
        if not np.isfinite(entries).all():  # they are singular in this ellipse, and in larger ones
            break
        for w in np.sqrt(abs(checker.blocks(entries)[1][0][0])).max() * RATES:
            bound = (
                4
                * np.max(_growth(length, entries, w) ** POWERS[len(allowed)] / allowed)
                / (float(r) - 1)
            )
            n = next((n for n in NODES if bound * float(r) ** (1 - n) < 0.1), None)
            if n:
                tried.append((n, bound * float(r) ** (1 - n), r, w))
    for n, _, r, w in _best_of_each(tried):
        least = _rational(w, 1000)
        try:
            grown = equation.sizes(sides, name, r, checker.exact(least))
        except checker.Failed as failed:
            why = failed
            continue
        bound = (
            4
            * max(float(x.upper()) / own for x, own in zip(grown, allowed, strict=True))
            / (float(r) - 1)
        )
        for more in NODES[NODES.index(n) :]:
            if bound * float(r) ** (1 - more) < 0.2:
                return more, _rational(float(r), 10), least
    raise why


def _rational(number, denominator):
    return max(Fraction(number).limit_denominator(denominator), Fraction(1, denominator))


def _best_of_each(tried):
    """The tries in the order of their numbers of nodes, one of each ellipse."""
    seen = {}
    for found in sorted(tried, key=lambda found: found[:2]):
        seen.setdefault(float(found[2]), found)
    return list(seen.values())[:3]


def _sampled(equation, sides, name, r):
    """(the length of each sample of u, the entries of K and L at them on the border of the ellipse,
    each an array with samples along its first axis), no bounds; NaN where they are singular."""
    arcs, boxes = equation.cover(sides, name, r)
    arcs = [{key: x.mid() for key, x in region.items()} for region in arcs]
    lengths, rows = [], []
    for start, end, _, entries in equation.pieces:
        known = [start + (end - start) * (arb(k) / SAMPLES) for k in range(0, SAMPLES + 1, CHECKED)]
        if not all(
            acb(f(u=u, **region)).is_finite() for u in known for region in boxes for f in entries
        ):
            return np.array([1.0]), np.full((1, 1, 1), math.nan)
        for k in range(SAMPLES):
            u = start + (end - start) * (arb(2 * k + 1) / (2 * SAMPLES))
            lengths.append(float((end - start) / SAMPLES))
            rows.append([[complex(acb(f(u=u, **region))) for region in arcs] for f in entries])
    return np.array(lengths), np.array(rows).swapaxes(0, 1)


def _growth(length, entries, least):
    """About the largest bound of the norms that `checker.growth` finds."""
    upper, lower = checker.blocks(list(entries))
    w = np.maximum(np.sqrt(abs(lower[0][0])), least)
    d, m = (np.sqrt(w), 1 / np.sqrt(w)), range(len(lower))
    sums = [[d[i] * d[j] * upper[i][j] + lower[i][j].conj() / (d[i] * d[j]) for j in m] for i in m]
    rate = np.max([sum(map(abs, row)) for row in sums], 0) / 2
    exponent = (length[:, None] * rate).sum(0) + 0.5 * abs(np.diff(np.log(w), axis=0)).sum(0)
    if len(lower) == 1:
        first, last = np.log(w[0]), np.log(w[-1])
        exponent += 0.5 * np.maximum(abs(first - last), abs(first + last))
    return math.exp(min(exponent.max(), 170.0))


def _order(equation, sides, allowed):
    """The order at which the factors in the middle are known well enough."""
    real = {
        name: centre + half * arb(0, 1)
        for name, (centre, half) in zip(equation.names, sides, strict=True)
    }
    middle = {name: centre for name, (centre, _) in zip(equation.names, sides, strict=True)}
    for order in ORDERS:
        found = equation.factors(equation.steps(real, order), order, middle)
        if all(float(f.rad()) < 1e-3 * own for f, own in zip(found, allowed, strict=True)):
            return order
    raise checker.Failed("the truncation error of the steps' series is too large")


def panels(equation, sides, depth, tolerance, smallest=None):
    """(layout, panels of the certificate) of a part of the rectangle, whose cells are halved at
    most `depth` times.

    Where few nodes do not suffice, its quarters are proved instead, down to panels of `smallest`
    halvings.
    """
    row = len(sides) == 1
    if smallest is None:
        smallest = max(depth - PANELS, 0) if row else SMALLEST
    try:
        found = plan(equation, sides, tolerance)
        panel = checker.Panel(equation, sides, found)
        found["cells"] = row_cells(panel, depth) if row else cells(panel, depth)
        if depth <= smallest or {checker.STABLE, checker.UNSTABLE} & set(found["cells"]):
            return PANEL, [found]
    except checker.Failed:
        if depth <= smallest:
            return PANEL, [open_panel(len(sides))]
    parts = [
        panels(equation, part, depth - 1, tolerance, smallest)
        for part in reversed(checker.halved(sides))
    ]
    layouts, lists = zip(*parts, strict=True)
    found = [panel for some in lists for panel in some]
    if all(panel["cells"] == checker.OPEN for panel in found):
        return PANEL, [open_panel(len(sides))]
    return checker.SPLIT + "".join(layouts), found


def row_cells(panel, depth):
    """The certificate's cells of a checker's Panel of a row, with edges halved `depth` times."""

    def found(cell, left):
        letter = checker.verdict(cell[1])
        if letter == checker.OPEN:
            if not left:
                return panel.edge(*cell) or letter
            return checker.SPLIT + "".join(
                found(panel.cell(cell, (half,)), left - 1) for half in (0, 1)
            )
        return letter

    return found(panel.cell(), depth)


def open_panel(sides):
    """A panel with one side or two of which nothing is stated."""
    return {
        "nodes": [2] * sides, "ellipses": ["2"] * sides, "rates": ["1"] * sides, "order": 2, "cells": checker.OPEN,
    }  # fmt: skip


def cells(panel, depth):
    """The certificate's cells of a checker's Panel, halved at most `depth` times."""
    tables, bounds, _ = zip(*panel.factors, strict=True)
    margins = [float(bound) for bound in bounds]
    floats = [
        np.array([[float(x.mid()) for x in row] for row in table.tolist()]) for table in tables
    ]
    rounding = [
        max(float(x.rad().upper()) for x in table.entries()) + 4 * UNIT * abs(values).max()
        for table, values in zip(tables, floats, strict=True)
    ]
    return Search(panel, floats, margins, rounding, depth).run()


class Search:
    """Level by level: the cells that are not decided, each with the coefficients of the factors of
    unknown sign.
    """

    def __init__(self, panel, floats, margins, rounding, depth):
        self.panel = panel
        self.depth = depth
        self.margins = margins
        self.rounding = list(rounding)
        self.largest = [abs(values).max() for values in floats]
        self.halves = [_halving(n) for n in panel.counts]
        self.signs = np.zeros((1, len(floats)), np.int8)
        # (cells, their coefficients)
        self.tables = [(np.zeros(1, int), values[None]) for values in floats]

    def run(self):
        """The cells as a text."""
        levels = []
        for level in range(self.depth + 1):
            letters = self._decide(level == self.depth)
            levels.append(letters)
            going = letters == checker.SPLIT
            if not going.any():
                break
            self._split(going)
        return _text_of(levels)

    def _decide(self, last):
        """The letter of each cell."""
        for factor, (index, table) in enumerate(self.tables):
            # twice: the sums that make a coefficient, and the margin itself, are rounded
            margin = (self.margins[factor] + self.rounding[factor]) * (1 + 1e-9)
            low, high = table.min((1, 2)), table.max((1, 2))
            self.signs[index, factor] = np.where(low > margin, 1, np.where(high < -margin, -1, 0))
        letters = np.array(
            [checker.verdict(dict(enumerate(signs))) for signs in self.signs.tolist()]
        )
        return letters if last else np.where(letters == checker.OPEN, checker.SPLIT, letters)

    def _split(self, going):
        """Go on to the quarters of these cells."""
        number = np.cumsum(going) - 1
        self.signs = np.repeat(self.signs[going], 4, 0)
        for factor, (index, table) in enumerate(self.tables):
            some = going[index] & (self.signs[4 * number[index], factor] == 0)
            index, table = number[index[some]], table[some]
            quarters = np.empty((len(index), 4, *table.shape[1:]))
            for at, (upper, right) in enumerate(product((0, 1), repeat=2)):
                quarters[:, at] = self.halves[0][right] @ table @ self.halves[1][upper].T
            self.tables[factor] = (
                (4 * index[:, None] + np.arange(4)).ravel(),
                quarters.reshape(-1, *table.shape[1:]),
            )
            self.rounding[factor] += 2 * (sum(table.shape[1:]) + 2) * UNIT * self.largest[factor]


def _halving(n):
    """The checker's matrices in binary64, in which they are exact."""
    return [
        np.array([[float(x.mid()) for x in row] for row in half.tolist()])
        for half in checker.halving(n)
    ]


def _text_of(levels):
    """The letters of the levels as a text in which a split cell is followed by its quarters."""
    texts = levels[-1].tolist()
    for letters in reversed(levels[:-1]):
        below = iter(texts)
        found = []
        for letter in letters.tolist():
            found.append(
                letter + "".join(next(below) for _ in range(4))
                if letter == checker.SPLIT
                else letter
            )
        texts = found
    return texts[0]
