"""Danby's map in double-double, for points that float64 leaves undecided or less accurate than
asked.

Points one by one; rows of many such points by Chebyshev series, as in `danby`, and then one by one
what these leave open. Verdicts are decided with about 27 digits; values are rounded once, at the
end.
"""

import numpy as np

from survey import status, waiting
from survey.kernels.libration import danby_double, traces_double
from survey.measures.libration import panels
from survey.measures.libration.answers import Answers

POINTS, VALUES = 1000, 50_000  # of a kernel call, to keep it below about a second


def solve(e, mu, rtol, answers, points, dense=False):
    """Answer the `points` (ascending) of rows e (R) of mu (R, L), in place; by the rows' series
    first, if `dense`.
    """
    waiting.wait("double")
    if dense:
        points = _by_series(e, mu, rtol, answers, points)
    row_of = points // mu.shape[1]
    for first in range(0, points.size, POINTS):
        some = points[first : first + POINTS]
        own = Answers(some.size)
        results = _results(e[row_of[first : first + POINTS]], mu.reshape(-1)[some])
        traces_double.measure(results, rtol, status.OVERFLOW, *own.all)
        _take(answers, some, own)


def compile_ahead(variables, options):
    """Compile what panels are made of, then what else points need that are solved one by one (see
    `survey.scenes`).
    """
    one = np.full(1, 1e-3)
    results = _results(one, one)
    yield "chain"
    traces_double.measure(results, 1e-9, status.OVERFLOW, *Answers(1).all)
    yield "double"


def _take(answers, points, own):
    """The answers of the points become their `own`, where there are any."""
    better = own.status == status.OK
    answers.replace(points[better], own, better)


def factors(e, mu):
    """A, B, C, D, t (N, 5) of points, rounded once, and their error bounds (N, 5)."""
    results = np.concatenate(
        [_results(e[i : i + POINTS], mu[i : i + POINTS]) for i in range(0, e.size, POINTS)]
    )
    values, low, bars = np.split(results, 3, axis=1)
    return values, bars + abs(low)


def _results(e, mu):
    """Results (N, RESULTS) of points; those with as many steps, by e, go together."""
    order = np.argsort(e, kind="stable")
    shapes, rates = np.empty((2, e.size, 4))
    results, found = np.empty((2, e.size, danby_double.RESULTS))
    danby_double.shapes(e[order], shapes)
    danby_double.rates(mu[order], rates)
    danby_double.chain(shapes, rates, found)
    results[order] = found
    return results


def _by_series(e, mu, rtol, answers, points):
    """Answer the `points` from their rows' series; returns those that are left."""
    row_of = points // mu.shape[1]
    rows = np.unique(row_of)
    for row, series, bars in zip(rows, *panels.pairs(e[rows]), strict=True):
        some = points[slice(*np.searchsorted(row_of, (row, row + 1)))]
        for first in range(0, some.size, VALUES):
            part = some[first : first + VALUES]
            own = Answers(part.size)
            traces_double.dense(series, bars, mu.reshape(-1)[part], rtol, status.OVERFLOW, *own.all)
            _take(answers, part, own)
    return points[answers.unsettled[points]]
