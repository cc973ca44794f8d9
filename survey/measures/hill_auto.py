"""Which method where: a constant coefficient by its closed form, everything else by midpoint Taylor, and points
that it leaves undecided by the adaptive DOP853 as well.

Measured (`survey precision satellite`): midpoint Taylor is the fastest at every accuracy and has the sharpest bars.
"""

import numpy as np

from survey import status
from survey.kernels.hill import UNDECIDED
from survey.measures import hill_dense, hill_effort
from survey.measures.hill_answers import Answers
from survey.methods import dop853, taylor16

EPS = 2.3e-16


def solve(problem, asked, answers):
    """Answer every point of the problem, in place."""
    free = None if problem.constant is None else np.isfinite(problem.constant + problem.p).reshape(-1)
    open_points = hill_dense.solve(problem, taylor16, asked, answers) if hill_dense.serves(problem, asked) else None
    if free is not None:
        open_points = ~free if open_points is None else open_points & ~free
    if open_points is None or open_points.any():
        hill_effort.solve(problem, taylor16, asked, answers, open_points)
    if free is not None:
        places = np.flatnonzero(free)
        own = Answers(places.size, asked)
        results = closed_form(problem.constant.reshape(-1)[places], problem.span[places // problem.p.shape[1]])
        own.judge(results, None if problem.rule is None else problem.rule.reshape(-1)[places])
        answers.put(places, own)
    left = (answers.status == status.OK) & (answers.verdict == UNDECIDED)
    left = left if free is None else left & ~free
    if left.any() and problem.walk is not None:
        again = Answers(left.size, asked)
        hill_effort.solve(problem, dop853, asked, again, left)
        decided = np.flatnonzero(left & (again.status == status.OK) & (again.verdict != UNDECIDED))
        answers.put(decided, again, decided)


def closed_form(z, span):
    """Results (..., 10), as of a chain, of y'' + z y = 0 over `span` with constant z: circular or hyperbolic."""
    rate = np.sqrt(abs(z))
    x = rate * span
    with np.errstate(all="ignore"):
        c, s = np.where(z < 0, np.cosh(x), np.cos(x)), np.where(z < 0, np.sinh(x), np.sin(x))
        y2 = np.where(rate > 0, s / rate, span)
    dy1 = np.where(z < 0, rate, -rate) * s
    # x and rate are known to 3 ulp, and cos, sin, cosh, sinh to 2.
    de, se = EPS * (3 * x * abs(s) + 2 * abs(c)), EPS * (3 * x * abs(c) + 2 * abs(s))
    y2_error = np.where(rate > 0, se / np.where(rate > 0, rate, 1.0), 0.0) + 3 * EPS * abs(y2)
    # Zeros inside: of cos at odd multiples of pi/2, of sin at multiples of pi; the computed signs settle ties.
    m = np.where(z > 0, _zeros(x / np.pi + 0.5, c < 0), 0)
    d = np.where(z > 0, _zeros(x / np.pi, s < 0), 0)
    return np.stack([c, dy1, y2, c, de, rate * se + 3 * EPS * abs(dy1), y2_error, de, m, d], axis=-1)


def _zeros(turns, negative):
    """The whole number of zeros nearest to `turns` - 1/2 whose parity fits the sign."""
    number = np.floor(turns)
    wrong = (number % 2 == 1) != negative
    return np.where(wrong, number + np.where(turns - number < 0.5, -1, 1), number)
