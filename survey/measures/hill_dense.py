"""Dense maps of a Hill problem: the discriminant as a Chebyshev series in p, and across rows, solved at nodes alone.

The factors y1, y1', y2, y2' at T/2 are entire functions of p (z is a polynomial in p), so their series on the axis
converge faster than any power. The factors are solved at a row's nodes; their product D, with twice the degree, is
expanded at as many nodes as it needs. Where p -> -p exchanges y1 and y2', the nodes of one half axis serve both, and D
is a series in p^2. Where the rows are an axis too, D's coefficients are series across it, solved at its nodes; a panel
of rows on which they do not converge is halved, and what is left over is served row by row.

D's bar: the nodes' own bars times the Lebesgue constant, the tail of the series, and rounding. Points whose verdict
or accuracy it leaves open are `late`, and solved one by one from their factors. All depends on the row and on the whole
axis, never on the block.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 4, 8 and 15.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from survey.kernels import hill as kernels
from survey.kernels.chebyshev import discriminants, expand, restrict, transform
from survey.measures import hill_effort
from survey.measures.hill_answers import Answers, Asked

NO_RULES = np.zeros((0, 0), np.int8)
DEGREES = np.array([16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192])
# A proxy pays if a row has this many points for each that it solves.
POINTS_PER_NODE = 3
ROWS_PER_NODE = 2
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
    even = np.zeros(problem.span.size, np.bool_) if problem.even is None else problem.even
    for symmetric in np.unique(even):
        rows = np.flatnonzero(even == symmetric)
        axis = _axis(problem.line, bool(symmetric))
        if problem.across is not None:
            rows = _surfaces(problem, method, asked, answers, rows, axis, open_points)
        _rows(problem, method, asked, answers, rows, axis, open_points)
    return open_points.reshape(-1)


@dataclass(frozen=True)
class _Axis:
    """Where the series in p live; `even`: on half of a symmetric axis, which then needs fewer nodes."""

    number: int
    middle: float
    radius: float
    even: bool


def _axis(line, symmetric):
    number, low, high = line
    if symmetric and max(-low, high) < 1.5 * (high - low):
        return _Axis(number, 0.0, max(abs(low), abs(high)), True)
    return _Axis(number, 0.5 * (low + high), 0.5 * (high - low), False)


def _rows(problem, method, asked, answers, chosen, axis, open_points):
    """Answer the points of the `chosen` rows, each by a series of its own."""
    most = int(np.searchsorted(DEGREES, axis.number / POINTS_PER_NODE * (2 if axis.even else 1), "right"))
    place = np.full(problem.span.size, DEGREES.size)
    place[chosen] = _places(problem, axis, asked.rtol)[chosen]
    first = place.copy()
    for at in range(most):  # a row whose series has not converged goes on to the next degree
        rows = np.flatnonzero((place == at) & (at <= first + RETRIES))
        if rows.size:
            series, bars = _series(problem, method, asked.rtol, rows, int(DEGREES[at]), axis)
            good = bars <= asked.rtol
            useful = bars <= asked.rtol * (1 + abs(series).sum(axis=1))  # where D is largest, at least
            good |= useful & (at == first[rows] + RETRIES)
            place[rows[~good]] += 1
            rows, series, bars = rows[good], np.ascontiguousarray(series[good]), bars[good]
        if rows.size:
            _answer(problem, asked, answers, rows, series, bars, axis, open_points)


def _answer(problem, asked, answers, rows, series, bars, axis, open_points):
    rule = NO_RULES if problem.rule is None else problem.rule
    x = (problem.p[rows[0]] - axis.middle) / axis.radius  # all rows have the same points
    x = 2 * x * x - 1 if axis.even else x
    discriminants(rows, series, bars, x, rule, asked.rtol, asked.wanted, answers.floats, answers.verdict, answers.late)
    open_points[rows] = answers.late.reshape(problem.p.shape)[rows]


def _surfaces(problem, method, asked, answers, chosen, axis, open_points):
    """Answer the points of those of the `chosen` rows that a series in s and p serves; returns the other rows.

    The axis of rows is halved until D has converged on a panel to `rtol`, or the panel has too few rows.
    """
    across, left = problem.across, [np.zeros(0, int)]
    panels = [(across.low, across.high, across.number)]
    while panels:
        low, high, number = panels.pop()
        s = across.s[chosen]
        rows = chosen[(s >= low) & ((s < high) | ((s == high) & (high == across.high)))]
        if not rows.size:
            continue
        middle, radius = 0.5 * (low + high), 0.5 * (high - low)
        if number < ROWS_PER_NODE * DEGREES[0] or not radius > 0:
            left.append(rows)
            continue
        surface = _surface(across, method, asked, middle, radius, number, axis)
        if surface is None:
            panels += [(low, middle, number / 2), (middle, high, number / 2)]
            continue
        series, bar = surface
        own = np.empty((rows.size, series.shape[1]))
        restrict(series, (across.s[rows] - middle) / radius, own)
        _answer(problem, asked, answers, rows, own, np.full(rows.size, bar), axis, open_points)
    outside = chosen[~((across.s[chosen] >= across.low) & (across.s[chosen] <= across.high))]
    return np.concatenate([*left, outside])


def _surface(across, method, asked, middle, radius, number, axis):
    """D on a panel of rows: (coefficients of T_j in s, by T_k in p; bar), or None where `rtol` is not met."""
    ends = across.at(middle + radius * np.array([-1.0, 1.0]))
    size = np.sqrt((ends.bound * np.abs([1.0, axis.radius, axis.radius**2])).sum(axis=1))
    kind = np.abs(np.diff(ends.span * size))  # half the change of D's phase
    at = int(_enough(kind, asked.rtol)[0])
    place = int(_places(ends, axis, asked.rtol).max())
    most = [np.searchsorted(DEGREES, count, "right") for count in (number / ROWS_PER_NODE, axis.number)]
    for _ in range(2 * RETRIES):
        if at >= most[0] or place >= most[1]:
            return None
        n = int(DEGREES[at])
        nodes = across.at(middle + radius * _nodes(n))
        series, bars = _series(nodes, method, 0.25 * asked.rtol, np.arange(n), int(DEGREES[place]), axis)
        surface = np.empty_like(series)
        place_ulps = (4 + abs(middle) + radius) / radius
        own, of_rows = transform(series, _transform(n), place_ulps, surface), _lebesgue(n) * bars.max()
        if own + of_rows <= asked.rtol:
            return surface, own + of_rows
        at, place = (at + 1, place) if own > of_rows else (at, place + 1)
    return None


def _places(problem, axis, rtol):
    """The place in DEGREES that each row's factors need; beyond DEGREES where none is enough."""
    if problem.c2:
        kind = problem.span * axis.radius * np.sqrt(problem.c2)
    else:
        # cos(span sqrt(p)) on an axis of length 2 radius is half as rich as cos(span p) on its square root
        kind = 0.5 * problem.span * np.sqrt(2 * axis.radius * problem.bound[:, 1])
    return _enough(kind, rtol)


def _enough(kind, rtol):
    """The place in DEGREES where J_n(kind), about a coefficient, is below rtol; beyond DEGREES where there is none.

    |J_n(x)| <= (x/2)^n / n! (DLMF 10.14.4).
    """
    with np.errstate(divide="ignore"):
        size = DEGREES * np.log(0.5 * np.e / DEGREES * kind[:, None]) - 0.5 * np.log(2 * np.pi * DEGREES)
    enough = size < np.log(0.01 * rtol)
    return np.where(enough.any(axis=1), enough.argmax(axis=1), DEGREES.size)


def _series(problem, method, rtol, rows, n, axis):
    """Coefficients of D (rows, m; of T_k(2 (p/radius)^2 - 1) if even) and its bar, not finite where there is none."""
    x, even = _nodes(n), axis.even
    solved = x[: n // 2] if even else x
    nodes = problem.at(rows, np.broadcast_to(axis.middle + axis.radius * solved, (rows.size, solved.size)).copy())
    finer = Asked(max(NODES_SHARE * rtol, 3e-14), FACTORS, together=True)
    own = Answers(nodes.p.size, finer)
    hill_effort.solve(nodes, method, finer, own)
    values, bars = (
        np.stack(
            [own.floats[c + at].reshape(nodes.p.shape) for c in (kernels.Y1, kernels.DY1, kernels.Y2, kernels.DY2)]
        )
        for at in (0, 1)
    )
    m = n + n // 2
    m = m // 2 if even else m
    series, totals = np.empty((rows.size, m)), np.empty(rows.size)
    lebesgue = np.array([_lebesgue(n), _lebesgue(m)])
    place_ulps = (abs(axis.middle) + axis.radius) / axis.radius
    expand(
        values, bars, even, _transform(n), _polynomials(n, m, even), _transform(m), lebesgue, place_ulps, series, totals
    )
    return series, totals


def _lebesgue(n):
    """Lebesgue constant of n Chebyshev nodes: Trefethen, theorem 15.2."""
    return 2 / np.pi * np.log(n + 1) + 1


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


@cache
def _polynomials(n, m, even):
    """Coefficients -> values, by columns: T_0 ... T_(n-1) at m nodes; those in x of the upper half if `even`."""
    x = _nodes(2 * m)[:m] if even else _nodes(m)  # those of T_k(2 x^2 - 1)
    return np.cos(np.arange(n)[:, None] * np.arccos(x))
