"""What a certificate states: panels on which few nodes suffice, and cells whose verdicts the checker will prove.

The nodes and the bounds are the checker's own (`survey.proof.checker`), in balls. The cells are searched in binary64,
many at a time, with a bound of all rounding: nothing is stated that does not hold with a margin.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import arb

from survey.proof import checker

BITS = 96  # of the balls
ORDER = 24  # of the Taylor series
SMALL = 1e-9  # what the series of a step may leave out, of the largest factor
NODES = (8, 10, 12, 14, 16, 18, 20, 24, 28, 32)
ELLIPSES = (1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 14, 20)
RATES = 6  # values of w that are tried
UNIT = 2.0**-53


@dataclass(frozen=True)
class Plan:
    """How a panel is proved: the keys of a certificate's panel but for the cells."""

    nodes: tuple
    ellipses: tuple
    rates: tuple
    steps: int
    order: int

    def table(self, cells):
        """The panel of a certificate."""
        return {
            "nodes": list(self.nodes), "ellipses": [_text(r) for r in self.ellipses],
            "rates": [_text(w) for w in self.rates], "steps": self.steps, "order": self.order, "cells": cells,
        }  # fmt: skip


def _text(number):
    return str(Fraction(number).limit_denominator(1000))


def plan(equation, sides, tolerance):
    """The cheapest Plan found whose truncation is below `tolerance` on the panel `sides`; raises checker.Failed."""
    centres = [(checker.exact((low + high) / 2), checker.exact((high - low) / 2)) for low, high in sides]
    real = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(equation.names, centres, strict=True)}
    chosen = [_ellipse(equation, real, name, *side, tolerance) for name, side in zip(equation.names, centres, strict=True)]
    nodes, ellipses, rates = zip(*chosen, strict=True)
    steps = _steps(equation, real)
    return Plan(nodes, ellipses, rates, steps, ORDER)


def _ellipse(equation, real, name, centre, half, tolerance):
    """(number of nodes, r, w) for one parameter."""
    best, why = None, None
    for r in ELLIPSES:
        for w in _rates(equation, real):
            try:
                growth = float(equation.on_ellipse(real, name, centre, half, arb(r), arb(w)))
            except checker.Failed as failed:
                why = failed
                continue
            worst = 4 * growth * max(w, 1, 1 / w)
            n = next((n for n in NODES if worst * r ** (1 - n) / (r - 1) < 0.2 * tolerance), None)
            if n and (best is None or (n, growth) < best[:2]):
                best = n, growth, r, w
    if best is None:
        raise why or checker.Failed("no ellipse has a small enough bound: smaller panels are needed")
    return best[0], best[2], best[3]


def _rates(equation, real):
    """Values of w to try, about the square root of the largest |z|."""
    top = 1e-3
    for start, end, _, z in equation.pieces:
        for part in range(checker.BOXES):
            u = start + (end - start) * checker.share(part, checker.BOXES)
            top = max(top, float(checker.acb(z(u=u, **real)).abs_upper()))
    return [float(Fraction(np.sqrt(top) * x).limit_denominator(1000)) for x in np.linspace(0.4, 1.2, RATES)]


def _steps(equation, real):
    """The number of steps of a piece whose series leave out little enough."""
    steps = 1
    while steps < 10_000:
        try:
            missed = [step[3] for step in equation.steps(real, steps, ORDER, checker.RATIO)]
            if float(sum(y + dy for pair in missed for y, dy in pair)) < SMALL:
                return steps
        except checker.Failed:
            pass
        steps = steps + 1 + steps // 3
    raise checker.Failed("z is too large, or singular too near to the real axis: a smaller rectangle is needed")


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
