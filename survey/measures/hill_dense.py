"""Dense rows of a Hill problem: the discriminant as a Chebyshev series in p, solved at its nodes alone.

The factors y1, y1', y2, y2' at T/2 are entire functions of p (z is a polynomial in p), so their series on the axis
converge faster than any power. The factors are solved at a row's nodes; their product D, with twice the degree, is
expanded at as many nodes as it needs. Where p -> -p exchanges y1 and y2', the nodes of one half axis serve both, and D
is a series in p^2.

D's bar: the nodes' own bars times the Lebesgue constant, the tail of the series, and rounding. Points whose verdict
or accuracy it leaves open are `late`, and solved one by one from their factors. All depends on the row and on the whole
axis, never on the block.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 4, 8 and 15.
"""

from functools import cache

import numpy as np

from survey.kernels import hill as kernels
from survey.kernels.chebyshev import discriminants, expand
from survey.measures import hill_effort
from survey.measures.hill_answers import Answers, Asked

NO_RULES = np.zeros((0, 0), np.int8)
DEGREES = np.array([16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192])
# A proxy pays if a row has this many points for each that it solves.
POINTS_PER_NODE = 3
# Of the asked accuracy, for the factors at the nodes: Lebesgue constants and products multiply their bars by 100.
NODES_SHARE = 2e-3
RETRIES = 2
ANSWERS = frozenset({"discriminant", "exponent"})
FACTORS = np.array([name in ("y1", "y2", "dy1", "dy2") for name in kernels.FLOATS])


def serves(problem, asked):
    """Is the row dense enough, and is nothing asked but what follows from D?"""
    named = {name for name, wanted in zip(kernels.FLOATS, asked.wanted, strict=True) if wanted}
    return problem.line is not None and named <= ANSWERS and problem.line[2] > problem.line[1]


def solve(problem, method, asked, answers):
    """Answer the points of the rows that a proxy serves; returns the points (N, bool) still to be solved."""
    open_points = np.ones(problem.p.shape, np.bool_)
    halved = max(-problem.line[1], problem.line[2]) < 1.5 * (problem.line[2] - problem.line[1])
    even = np.zeros(problem.span.size, np.bool_) if problem.even is None or not halved else problem.even
    for half in np.unique(even):
        _solve(problem, method, asked, answers, np.flatnonzero(even == half), bool(half), open_points)
    return open_points.reshape(-1)


def _solve(problem, method, asked, answers, chosen, even, open_points):
    """Answer the points of the `chosen` rows; `even`: from half of a symmetric axis, which then needs fewer nodes."""
    number, low, high = problem.line
    middle, radius = (0.0, max(abs(low), abs(high))) if even else (0.5 * (low + high), 0.5 * (high - low))
    most = int(np.searchsorted(DEGREES, number / POINTS_PER_NODE * (2 if even else 1), "right"))
    place = np.full(problem.span.size, DEGREES.size)
    place[chosen] = _places(problem, radius, asked.rtol)[chosen]
    first = place.copy()
    for at in range(most):  # a row whose series has not converged goes on to the next degree
        rows = np.flatnonzero((place == at) & (at <= first + RETRIES))
        if rows.size:
            series, bars = _series(problem, method, asked, rows, int(DEGREES[at]), middle, radius, even)
            good = bars <= asked.rtol
            useful = bars <= asked.rtol * (1 + abs(series).sum(axis=1))  # where D is largest, at least
            good |= useful & (at == first[rows] + RETRIES)
            place[rows[~good]] += 1
            rows, series, bars = rows[good], np.ascontiguousarray(series[good]), bars[good]
        if rows.size:
            rule = NO_RULES if problem.rule is None else problem.rule
            discriminants(
                rows, series, bars, middle, radius, even, problem.p, rule, asked.rtol, asked.wanted,
                answers.floats, answers.verdict, answers.late,
            )  # fmt: skip
            open_points[rows] = answers.late.reshape(problem.p.shape)[rows]


def _places(problem, radius, rtol):
    """The place in DEGREES that each row's factors need: where a coefficient, about J_n of their type, is below rtol.

    |J_n(x)| <= (x/2)^n / n! (DLMF 10.14.4); beyond DEGREES where none is enough or the row is not finite.
    """
    if problem.c2:
        kind = problem.span * radius * np.sqrt(problem.c2)
    else:
        # cos(span sqrt(p)) on an axis of length 2 radius is half as rich as cos(span p) on its square root
        kind = 0.5 * problem.span * np.sqrt(2 * radius * problem.bound[:, 1])
    with np.errstate(divide="ignore"):
        size = DEGREES * np.log(0.5 * np.e / DEGREES * kind[:, None]) - 0.5 * np.log(2 * np.pi * DEGREES)
    enough = size < np.log(0.01 * rtol)
    return np.where(enough.any(axis=1), enough.argmax(axis=1), DEGREES.size)


def _series(problem, method, asked, rows, n, middle, radius, even):
    """Coefficients of D (rows, m; of T_k(2 (p/radius)^2 - 1) if `even`) and its bar, not finite where there is none."""
    x = _nodes(n)
    solved = x[: n // 2] if even else x
    nodes = problem.at(rows, np.broadcast_to(middle + radius * solved, (rows.size, solved.size)).copy())
    finer = Asked(max(NODES_SHARE * asked.rtol, 3e-14), FACTORS, together=True)
    own = Answers(nodes.p.size, finer)
    hill_effort.solve(nodes, method, finer, own)
    values, bars = (
        np.stack(
            [own.floats[c + at].reshape(nodes.p.shape) for c in (kernels.Y1, kernels.DY1, kernels.Y2, kernels.DY2)]
        )
        for at in (0, 1)
    )
    m = n + n // 2
    x = _nodes(m)[: m // 2] if even else _nodes(m)  # those in x of the upper half are those in 2 x^2 - 1 of the whole
    series, totals = np.empty((rows.size, x.size)), np.empty(rows.size)
    lebesgue = 2 / np.pi * np.log(np.array([n, x.size]) + 1) + 1  # Trefethen, theorem 15.2
    expand(values, bars, even, _transform(n), _polynomials(n, x), _transform(x.size), lebesgue, series, totals)
    return series, totals


@cache
def _nodes(n):
    """n Chebyshev nodes of the first kind, from 1 to -1, symmetric to the last bit."""
    x = np.sin(np.pi * (n - 1 - 2 * np.arange(n)) / (2 * n))
    return np.concatenate([x[: n // 2], [0.0] * (n % 2), -x[: n // 2][::-1]])


@cache
def _transform(n):
    """Values at the nodes -> coefficients, by columns."""
    k = np.arange(n)
    matrix = 2 / n * np.cos(np.pi * k * (2 * np.arange(n)[:, None] + 1) / (2 * n))
    matrix[:, 0] /= 2
    return matrix


def _polynomials(n, x):
    """Coefficients -> values at x, by columns: T_0 ... T_(n-1) at x."""
    return np.cos(np.arange(n)[:, None] * np.arccos(x))
