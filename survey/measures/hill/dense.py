"""Dense maps of a Hill problem: the discriminant as a Chebyshev series in p, and across rows, solved at nodes alone.

D is an entire function of p (z is a polynomial in p), so its series on the axis converges faster than any power; where
p -> -p exchanges y1 and y2', D is a series in p^2 and its nodes those of one half axis. Where the rows are an axis too,
D's coefficients are series across it, solved at its nodes; a panel of rows on which they do not converge is halved,
and the rest is served row by row.

The error bound of D: those at the nodes times the Lebesgue constants, the tails of the series, and rounding. Points
whose verdict or accuracy it leaves open count as `missed`, and are solved one by one from their factors. All depends on
the row and on the axes of the map, never on the block.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 4, 8 and 15.
"""

import threading
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from survey.kernels.hill import answers as kernels
from survey.kernels.hill.series import TERMS, discriminants
from survey.kernels.jit import wait_for_other_compiler
from survey.kernels.lanes import RESULTS
from survey.kernels.math import chebyshev
from survey.measures.hill import pointwise
from survey.measures.hill.answers import Answers, Asked

DEGREES = np.array([16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384])
# A proxy pays if there are this many points, and rows, for each that it solves.
POINTS_PER_NODE = 3
ROWS_PER_NODE = 3
# Of the asked accuracy, for D at the nodes of a row, whose bars the Lebesgue constant multiplies by 4; those of a map
# are solved as well as can be.
NODES_SHARE, BEST = 0.1, 1e-14
# The share of the nodes known to the asked accuracy from which on a series serves.
MOST = 0.9
RETRIES = 2
_ONE_AT_A_TIME = threading.Lock()
ANSWERS = frozenset({"discriminant", "exponent"})
DISCRIMINANT = np.array([name == "discriminant" for name in kernels.FLOATS])


def serves(problem, asked):
    """Is the row dense enough, and is nothing asked but what follows from D?"""
    named = {name for name, wanted in zip(kernels.FLOATS, asked.wanted, strict=True) if wanted}
    return problem.line is not None and named <= ANSWERS and problem.line[2] > problem.line[1]


def compile_ahead(sample, no_rows, variables):
    """Compile, by calls on next to nothing, what a map of these variables needs beside the kernel of the method.

    `sample` and its empty `no_rows` are the scene's. While this is done, the map's own process compiles the method's
    kernel: what it needs at once comes first, and what it waits for last.
    """
    sample(no_rows, np.ones(1), np.empty((0, 1, 2, 1)))
    grows = not {"exponent", "exponent_per_orbit"}.isdisjoint(variables)
    named = {name for name in kernels.FLOATS if name in variables} | ({"exponent"} if grows else set())
    answers = Answers(1, Asked(1.0, np.array([name in named for name in kernels.FLOATS])))
    if named <= ANSWERS:
        Answers(1, Asked(1.0, DISCRIMINANT)).assess(np.ones((1, RESULTS)), None)
        _discriminants(answers, np.zeros(1, int), np.ones((1, TERMS)), np.ones(1), np.ones(1))
        if grows:
            kernels.exponents(np.zeros(1, int), 1, 1.0, answers.floats, answers.verdict, answers.missed)
    answers.assess(np.ones((1, RESULTS)), None)


def solve(problem, method, asked, answers):
    """Answer the points of the rows that a proxy serves; returns the points (N, bool) still to be solved."""
    open_points = np.ones(problem.p.shape, np.bool_)
    even = np.zeros(problem.span.size, np.bool_) if problem.even is None else problem.even
    for symmetric in np.unique(even):
        rows = np.flatnonzero(even == symmetric)
        axis = _axis(problem.line, bool(symmetric))
        if problem.row_axis is not None:
            rows = _surfaces(problem, method, asked, answers, rows, axis, open_points)
        _rows(problem, method, asked, answers, rows, axis, open_points)
    return open_points.reshape(-1)


@dataclass(frozen=True)
class _Interval:
    """Where the series in p live; `even`: on half of a symmetric axis, which then needs half the nodes."""

    number: int
    middle: float
    radius: float
    even: bool

    @property
    def most(self):
        """The number of DEGREES whose nodes pay."""
        return int(np.searchsorted(DEGREES, self.number / POINTS_PER_NODE * (2 if self.even else 1), "right"))


def _axis(line, symmetric):
    number, low, high = line
    if symmetric and max(-low, high) < 1.5 * (high - low):
        return _Interval(number, 0.0, max(abs(low), abs(high)), True)
    return _Interval(number, 0.5 * (low + high), 0.5 * (high - low), False)


def _rows(problem, method, asked, answers, chosen, axis, open_points):
    """Answer the points of the `chosen` rows, each by a series of its own."""
    degree = np.full(problem.span.size, DEGREES.size)
    degree[chosen] = _degrees(problem, axis, asked.rtol)[chosen]
    first = degree.copy()
    for at in range(axis.most):  # a row whose series has not converged goes on to the next degree
        rows = np.flatnonzero((degree == at) & (at <= first + RETRIES))
        if rows.size:
            values, series, bars = _series(problem, method, NODES_SHARE * asked.rtol, rows, int(DEGREES[at]), axis)
            served = _served(values, bars[:, None], asked.rtol).mean(axis=1)
            good = (served >= MOST) | ((served > 0) & (at == first[rows] + RETRIES))
            degree[rows[~good]] += 1
            rows, series, bars = rows[good], np.ascontiguousarray(series[good]), bars[good]
        if rows.size:
            _answer(problem, asked, answers, rows, series, bars, axis, open_points)


def _answer(problem, asked, answers, rows, series, bars, axis, open_points):
    wait_for_other_compiler()
    x = (problem.p[rows[0]] - axis.middle) / axis.radius  # all rows have the same points
    _discriminants(answers, rows, series, bars, 2 * x * x - 1 if axis.even else x)
    if asked.wanted[kernels.EXPONENT // 2]:
        kernels.exponents(rows * x.size, x.size, asked.rtol, answers.floats, answers.verdict, answers.missed)
    open_points[rows] = answers.missed.reshape(problem.p.shape)[rows]


def _discriminants(answers, rows, series, bars, x):
    """D of the rows from their series, padded to TERMS, at x, in place."""
    padded = np.zeros((len(series), -(-series.shape[1] // TERMS) * TERMS))
    padded[:, : series.shape[1]] = series
    discriminants(rows, padded, bars, x, answers.asked.rtol, answers.floats, answers.verdict, answers.missed)


def _surfaces(problem, method, asked, answers, chosen, axis, open_points):
    """Answer those `chosen` rows that a series across rows serves; returns the others."""
    with _ONE_AT_A_TIME:
        served = panels(problem.row_axis, method, asked.rtol, axis)
    position, left = problem.positions[chosen], np.ones(chosen.size, np.bool_)
    for low, high, series, bar in served:
        inside = left & (position >= low) & (position <= high)
        rows, own = chosen[inside], np.empty((np.count_nonzero(inside), series.shape[1]))
        if rows.size:
            x = (position[inside] - 0.5 * (low + high)) / (0.5 * (high - low))
            chebyshev.restrict(series, x, np.empty((2, own.shape[1])), own)
            _answer(problem, asked, answers, rows, own, np.full(rows.size, bar), axis, open_points)
        left &= ~inside
    return chosen[left]


@lru_cache(maxsize=64)
def panels(row_axis, method, rtol, axis):
    """[(low, high, series of D, its bound)] of the panels of rows on which D converges, the same for all blocks.

    The axis of rows is halved until D has converged to `rtol`, as long as all that is solved for it pays.
    """
    left, found, budget = [(row_axis.low, row_axis.high, 1.0)], [], row_axis.number / ROWS_PER_NODE
    while left:
        low, high, share = left.pop(0)
        if not high > low:
            continue
        middle, radius = 0.5 * (low + high), 0.5 * (high - low)
        surface, spent = _surface(row_axis, method, rtol, middle, radius, axis, min(budget, share * row_axis.number))
        budget -= spent
        if surface is not None:
            found.append((low, high, *surface))
        elif spent:
            left += [(low, middle, 0.5 * share), (middle, high, 0.5 * share)]
    return found


def _surface(row_axis, method, rtol, middle, radius, axis, budget):
    """((coefficients of T_j in s by T_k in p, bound), or None where `rtol` is not met; rows solved, in `budget`)."""
    ends = row_axis.at(middle + radius * np.array([-1.0, 1.0]))
    size = np.sqrt((ends.bound * np.abs([1.0, axis.radius, axis.radius**2])).sum(axis=1))
    at = int(_enough(np.abs(np.diff(ends.span * size)), rtol)[0])  # half the change of D's phase
    degree, spent, doubt = int(_degrees(ends, axis, rtol).max()), 0, np.inf
    while at < DEGREES.size and degree < axis.most and spent + DEGREES[at] <= budget:
        n, before = int(DEGREES[at]), doubt
        spent += n
        nodes = row_axis.at(middle + radius * chebyshev.symmetric_nodes(n))
        values, series, bars = _series(nodes, method, 0.0, np.arange(n), int(DEGREES[degree]), axis)
        surface, tail = chebyshev.transform(series, chebyshev.by_columns(n), (4 + abs(middle) + radius) / radius)
        doubt = tail + chebyshev.lebesgue(n) * bars.max()
        if _served(values, doubt, rtol).mean() >= MOST:
            return (surface, doubt), spent
        if not doubt < 0.5 * before:
            break
        at, degree = (at + 1, degree) if tail > 0.5 * doubt else (at, degree + 1)
    return None, spent


def _degrees(problem, axis, rtol):
    """The index in DEGREES of what each row's D needs; beyond DEGREES where none is enough."""
    if problem.c2:
        return _enough(2 * problem.span * axis.radius * np.sqrt(problem.c2), rtol)
    # cos(span sqrt(p)) on an axis of length 2 radius is half as rich as cos(span p) on its square root
    return _enough(problem.span * np.sqrt(2 * axis.radius * problem.bound[:, 1]), rtol)


def _enough(kind, rtol):
    """The index in DEGREES where J_n(kind), about a coefficient, is below rtol; beyond DEGREES where there is none.

    |J_n(x)| <= (x/2)^n / n! (DLMF 10.14.4).
    """
    with np.errstate(divide="ignore"):
        size = DEGREES * np.log(0.5 * np.e / DEGREES * kind[:, None]) - 0.5 * np.log(2 * np.pi * DEGREES)
    enough = size < np.log(0.01 * rtol)
    return np.where(enough.any(axis=1), enough.argmax(axis=1), DEGREES.size)


def _series(problem, method, rtol, rows, n, axis):
    """D at nodes (rows, n; n/2 if even), its coefficients (of T_k(2 (p/radius)^2 - 1) if even), and its bound (rows).

    Nodes are solved to `rtol` or as well as can be; an error bound is not finite where there is none.
    """
    x = chebyshev.symmetric_nodes(n)
    x = x[: n // 2] if axis.even else x
    nodes = problem.at(rows, np.broadcast_to(axis.middle + axis.radius * x, (rows.size, x.size)).copy())
    finer = Asked(max(rtol, BEST), DISCRIMINANT, together=True, full_period=problem.full_period)
    own = Answers(nodes.p.size, finer)
    pointwise.solve(nodes, method, finer, own)
    values, bars = (own.floats[c].reshape(nodes.p.shape) for c in (kernels.DISCRIMINANT, kernels.DISCRIMINANT + 1))
    ulps = (abs(axis.middle) + axis.radius) / axis.radius
    series, doubts = chebyshev.expand(values, chebyshev.by_columns(x.size), ulps)
    return values, series, doubts + chebyshev.lebesgue(x.size) * bars.max(axis=1)


def _served(values, bar, rtol):
    """Where D is known to `rtol` (relative where it is large) if it is `values` within `bar`."""
    return bar <= rtol * (1 + abs(values))
