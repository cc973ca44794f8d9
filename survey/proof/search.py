"""What a certificate states: panels on which few nodes suffice, and cells whose verdicts the checker will prove.

The nodes and the bounds are the checker's own (`survey.proof.checker`), in balls. The cells are searched in binary64,
many at a time, with a bound of all rounding: nothing is stated that does not hold with a margin.
"""

from fractions import Fraction

import numpy as np
from flint import arb

from survey.proof import checker

BITS = 96  # of the balls
ORDERS = range(12, 80, 4)  # of the Taylor series
NODES = (6, 8, 10, 12, 14, 16, 18, 20)
ELLIPSES = (1.6, 1.9, 2.3, 2.8, 3.5, 4.5, 6, 8, 12, 20)
RATES = np.geomspace(0.3, 1.3, 8)  # w relative to the square root of the largest |z|, which are tried
UNIT = 2.0**-53
PANEL = "."  # in a layout
SMALLEST = 2  # halvings of a panel: for fewer cells it is not worth its nodes


def plan(equation, sides, tolerance):
    """A panel without its cells, on which the polynomials leave out less than `tolerance`, relative to the bound of the
    factors' growth for real parameters; raises checker.Failed.

    `sides`: the ends of both, rational."""
    sides = [(checker.exact((low + high) / 2), checker.exact((high - low) / 2)) for low, high in sides]
    chosen = [_ellipse(equation, sides, name, tolerance) for name in equation.names]
    nodes, ellipses, rates = zip(*chosen, strict=True)
    return {
        "nodes": list(nodes), "ellipses": [str(Fraction(r).limit_denominator(10)) for r in ellipses],
        "rates": [str(Fraction(w).limit_denominator(1000)) for w in rates],
        "order": _order(equation, sides, tolerance), "cells": checker.OPEN,
    }  # fmt: skip


def _ellipse(equation, sides, name, tolerance):
    """(number of nodes, r, w) for one parameter: the fewest nodes."""
    best, why = None, None
    for r in ELLIPSES:
        try:
            arcs = equation.on_ellipse(sides, name, arb(r))
        except checker.Failed as failed:  # z is singular in the larger ones, too
            why = failed
            break
        parts = [[(length, z.real.mid(), z.imag.mid(), z.rad()) for length, z in arc] for arc in arcs]
        length, real, imaginary, radius = np.moveaxis(np.array(parts, float), -1, 0)
        top = np.sqrt(np.abs(real).max() + radius.max())
        for w in top * RATES:
            exponent = (length * (np.hypot(w * w - real, imaginary) + radius) / (2 * w)).sum(1).max()
            bound = 4 * np.exp(min(exponent, 700.0)) * max(w, 1 / w, 1) / (r - 1)
            n = next((n for n in NODES if bound * r ** (1 - n) < 0.2 * tolerance), None)
            if n and (best is None or (n, bound * r ** (1 - n)) < best[:2]):
                best = n, bound * r ** (1 - n), r, float(w)
        if best and r > 2 * best[2]:
            break
    if best is None:
        raise why or checker.Failed("no ellipse has a small enough bound: smaller panels are needed")
    return best[0], best[2], best[3]


def _order(equation, sides, tolerance):
    """The order at which the series of all steps leave out little enough."""
    real = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(equation.names, sides, strict=True)}
    for order in ORDERS:
        missed = (y + dy for step in equation.steps(real, order) for y, dy in step[3])
        if float(sum(missed)) < 1e-3 * tolerance:
            return order
    raise checker.Failed("the series of the steps leave out too much")


def panels(equation, sides, depth, tolerance):
    """(layout, panels of the certificate) of a part of the rectangle, whose cells are halved at most `depth` times.

    Where few nodes do not suffice, its quarters are proved instead.
    """
    try:
        found = plan(equation, sides, tolerance)
        panel = checker.Panel(equation, sides, found)
        return PANEL, [found | {"cells": cells(panel, depth)}]
    except checker.Failed:
        if depth <= SMALLEST:
            return PANEL, [open_panel()]
    quarters = [checker.within(sides, place) for place in reversed(checker.quarters(((Fraction(0), Fraction(1)),) * 2))]
    layouts, lists = zip(*(panels(equation, quarter, depth - 1, tolerance) for quarter in quarters), strict=True)
    found = [panel for some in lists for panel in some]
    if all(panel["cells"] == checker.OPEN for panel in found):
        return PANEL, [open_panel()]
    return checker.SPLIT + "".join(layouts), found


def open_panel():
    """A panel of which nothing is stated."""
    return {"nodes": [2, 2], "ellipses": ["2", "2"], "rates": ["1", "1"], "order": 2, "cells": checker.OPEN}


def cells(panel, depth):
    """The certificate's cells of a checker's Panel, halved at most `depth` times."""
    tables, bounds = panel.polynomials()
    margins = [float(bound) for bound in bounds]
    floats = [np.array([[float(x.mid()) for x in row] for row in table.tolist()]) for table in tables]
    rounding = [
        max(float(x.rad().upper()) for x in table.entries()) + 4 * UNIT * abs(values).max()
        for table, values in zip(tables, floats, strict=True)
    ]
    return Search(panel, floats, margins, rounding, depth).run()


class Search:
    """Level by level: the cells that are not decided, each with the coefficients of the factors of unknown sign."""

    def __init__(self, panel, floats, margins, rounding, depth):
        self.panel, self.depth, self.margins, self.rounding = panel, depth, margins, list(rounding)
        self.largest = [abs(values).max() for values in floats]
        self.halves = [_halving(n) for n in panel.counts]
        self.signs = np.zeros((1, len(floats)), np.int8)
        self.tables = [(np.zeros(1, int), values[None]) for values in floats]  # (cells, their coefficients)

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
        letters = np.array([self.panel.verdict(signs) for signs in self.signs.tolist()])
        return letters if last else np.where(letters == checker.OPEN, checker.SPLIT, letters)

    def _split(self, going):
        """Go on to the quarters of these cells."""
        number = np.cumsum(going) - 1
        self.signs = np.repeat(self.signs[going], 4, 0)
        for factor, (index, table) in enumerate(self.tables):
            some = going[index] & (self.signs[4 * number[index], factor] == 0)
            index, table = number[index[some]], table[some]
            quarters = np.empty((len(index), 4, *table.shape[1:]))
            for at, (upper, right) in enumerate(reversed(checker.QUARTERS)):
                quarters[:, at] = self.halves[0][right] @ table @ self.halves[1][upper].T
            self.tables[factor] = (4 * index[:, None] + np.arange(4)).ravel(), quarters.reshape(-1, *table.shape[1:])
            self.rounding[factor] += 2 * (sum(table.shape[1:]) + 2) * UNIT * self.largest[factor]


def _halving(n):
    """The checker's matrices in binary64, in which they are exact."""
    return [np.array([[float(x.mid()) for x in row] for row in half.tolist()]) for half in checker.halving(n)]


def _text_of(levels):
    """The letters of the levels as a text in which a split cell is followed by its quarters."""
    texts = levels[-1].tolist()
    for letters in reversed(levels[:-1]):
        below, found = iter(texts), []
        for letter in letters.tolist():
            found.append(letter + "".join(next(below) for _ in range(4)) if letter == checker.SPLIT else letter)
        texts = found
    return texts[0]
