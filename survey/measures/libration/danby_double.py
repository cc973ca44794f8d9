"""Danby's map in double-double, for points that float64 leaves undecided or less accurate than asked.

Points one by one; rows of many such points by Chebyshev series, as in `danby`, and then one by one what these
leave open. Verdicts are decided with about 27 digits; values are rounded once, at the end.
"""

from decimal import Decimal, localcontext
from functools import lru_cache

import numpy as np

from survey import status
from survey.kernels.libration import danby_double, traces_double
from survey.kernels.libration.traces import INVARIANTS
from survey.kernels.libration.traces_double import NODES
from survey.kernels.math.chebyshev import lebesgue
from survey.kernels.math.roundoff import PAIR_ROUNDOFF
from survey.measures.libration.answers import Answers

POINTS, VALUES = 1000, 50_000  # of a kernel call, to keep it below about a second
LEBESGUE = lebesgue(NODES - 1)
# Of Clenshaw's sum at the ends of its interval: n rounds |c_n| up to n + 1 times, each with a weight up to n + 1
CLENSHAW = 4.0 * PAIR_ROUNDOFF * np.arange(1.0, NODES + 1) ** 3
TRANSFORM = 16.0 * PAIR_ROUNDOFF * NODES  # of the sums that make coefficients of values
DIGITS = 40


def solve(e, mu, rtol, answers, points, rows=()):
    """Answer the `points` (ascending) of rows e (R) of mu (R, L), in place; those of `rows` by series first."""
    row_of = points // mu.shape[1]
    for row in np.intersect1d(rows, row_of):
        some = points[slice(*np.searchsorted(row_of, (row, row + 1)))]
        _take(answers, some, _by_series(e[row], mu.reshape(-1)[some], rtol))
    if len(rows):
        settled = np.isin(row_of, rows) & ~answers.unsettled[points]
        points, row_of = points[~settled], row_of[~settled]
    for first in range(0, points.size, POINTS):
        some = points[first : first + POINTS]
        both = np.empty((some.size, 4))
        danby_double.rates(mu.reshape(-1)[some], both)
        own = Answers(some.size)
        traces_double.measure(_results(e[row_of[first : first + POINTS]], both), rtol, status.OVERFLOW, *own.all)
        _take(answers, some, own)


def _take(answers, points, own):
    """The answers of the points become their `own`, where there are any."""
    better = own.status == status.OK
    answers.replace(points[better], own, better)


def _results(e, both):
    results = np.empty((e.size, danby_double.RESULTS))
    danby_double.chain(e, both, results)
    return results


def _by_series(e, mu, rtol):
    """Answers of points mu of one row."""
    both, matrix = tables()
    results = _results(np.full(NODES, e), both)
    series, bars = np.empty((INVARIANTS, 2, NODES)), np.empty(INVARIANTS)
    traces_double.to_series(results, matrix, series, bars)
    sizes = abs(series[:, 0])
    # what the series leaves out falls faster than by a half from each coefficient to the next
    with np.errstate(over="ignore"):
        bars = LEBESGUE * bars + 4.0 * sizes[:, -2:].sum(axis=1) + (CLENSHAW * sizes).sum(axis=1)
        bars += TRANSFORM * abs(results[:, :INVARIANTS]).max(axis=0)
    own = Answers(mu.size)
    for first in range(0, mu.size, VALUES):
        part = Answers(mu[first : first + VALUES].size)
        traces_double.dense(series, bars, mu[first : first + VALUES], rtol, status.OVERFLOW, *part.all)
        own.replace(slice(first, first + VALUES), part)
    return own


@lru_cache
def tables():
    """The rates at the nodes (NODES, 4), and the matrix that makes coefficients of values (2, NODES, NODES)."""
    with localcontext() as context:
        context.prec = DIGITS
        cosines = [_cosine(k) for k in range(4 * NODES)]  # of k pi / (2 NODES)
        at = range(1, 2 * NODES, 2)
        one = Decimal(1)
        # d1, d2 = (3 / 2)(1 +- s), s = (3 + cos) / 4, and 1 - cos without cancellation
        both = [
            (*_pair((7 + cosines[k]) * 3 / 8), *_pair((1 - cosines[k]) * 3 / 8 if cosines[k] < one / 2 else _less(k)))
            for k in at
        ]
        matrix = [[_pair(cosines[k * n % (4 * NODES)] * (2 if n else 1) / NODES) for k in at] for n in range(NODES)]
    return np.array(both), np.ascontiguousarray(np.moveaxis(np.array(matrix), 2, 0))


def _cosine(k):
    """cos(k pi / (2 NODES)) in decimals, by its series at an angle below pi / 4."""
    k %= 4 * NODES
    if k > 2 * NODES:
        return _cosine(4 * NODES - k)
    if k > NODES:
        return -_cosine(2 * NODES - k)
    return _sum(k, 0) if 2 * k <= NODES else _sum(NODES - k, 1)


def _less(k):
    """(3 / 8)(1 - cos(k pi / (2 NODES))) = (3 / 4) sin^2 of half the angle."""
    return Decimal("0.75") * _sum(Decimal(k) / 2, 1) ** 2


def _sum(k, first):
    """cos (first 0) or sin (first 1) of k pi / (2 NODES)."""
    x = k * Decimal(PI) / (2 * NODES)
    term = total = x if first else Decimal(1)
    for n in range(first + 2, 60, 2):
        term = -term * x * x / (n * (n - 1))
        total += term
    return total


PI = "3.14159265358979323846264338327950288419716939937510582097494"


def _pair(number):
    high = float(number)
    return high, float(number - Decimal(high))
