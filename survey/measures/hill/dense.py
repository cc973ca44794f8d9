"""Dense maps of a Hill problem by Chebyshev series in p, and across rows, solved at nodes alone: of
the discriminant, or, where more is asked, of the four factors.

All are entire functions of p (z is a polynomial in p), so that the series on an axis converge
faster than any power. Where p -> -p exchanges y1 and y2', D is a series in p^2 and its nodes those
of one half axis; so are y1', y2 and y1 + y2', and y1 - y2' is odd. Where the rows are an axis too,
the coefficients are series across it, solved at its nodes; a panel of rows on which they do not
converge is halved, and the rest is served row by row.

The error bound: those at the nodes times the Lebesgue constants, or, of D where these are too
large, times the Lagrange polynomials at each point (D, and with it the bounds, may fall by 1e5
along a row); the tails of the series, and rounding. Points whose verdict or accuracy it leaves open
count as `missed`, and are solved one by one from their factors. All depends on the row and on the
axes of the map, never on the block.

Rotation numbers need the numbers of zeros of y1 and y2. The signs at T/2 tell their parity, and the
numbers at the nodes around a point, between which they lie, the rest; a point where that is
ambiguous, or contradicts the rotation number between those at the nodes, counts as missed.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 4, 8 and
15.
"""

import threading
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from math import log

import numpy as np

from survey import status, waiting
from survey.kernels.hill import answers as kernels
from survey.kernels.hill.series import (
    NEAR,
    TURNS,
    Y1_MOST,
    Y2_MOST,
    discriminants,
    discriminants_at,
    factors,
    neighbours,
    points,
)
from survey.kernels.lanes import DY2, RESULTS, Y1, Y1_ZEROS
from survey.kernels.math import chebyshev
from survey.kernels.math.chebyshev import TERMS
from survey.measures.hill import pointwise
from survey.measures.hill.answers import Answers, Asked

DEGREES = np.array(
    [16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384]
)
# what `_enough` adds to n log(kind)
_OF_DEGREES = DEGREES * np.log(0.5 * np.e / DEGREES) - 0.5 * np.log(2 * np.pi * DEGREES)
# A proxy pays if there are this many points, and rows, for each that it solves.
POINTS_PER_NODE = 3
ROWS_PER_NODE = 3
# Of the requested accuracy, for D at the nodes of a row, whose bars the Lebesgue constant multiplies by
# 4. Those of a map are solved in steps for BEST, which leave rounding alone, as a rule 1e-13 or so; and in
# more only where they miss ENOUGH, or MAP_SHARE of what is requested.
NODES_SHARE, MAP_SHARE, ENOUGH, BEST = 0.1, 0.05, 5e-12, 1e-14
# Of it, for the degree of factors where z is quadratic in p: their coefficients exceed what
# `_enough` looks at by 10^7 or so, on every row that was measured.
FACTORS_SHARE = 1e-6
# Of it, for the first degree of D on a row of its own there: 180 rows that were measured needed 185 series,
# at the accuracy itself 283, and a quarter more nodes.
ROWS_SHARE = 1e-4
# The share of the nodes known to the requested accuracy from which on a series serves.
MOST = 0.9
RETRIES = 2
_ONE_AT_A_TIME = threading.Lock()
ANSWERS = frozenset({"discriminant", "exponent"})
# what an equation with damping needs of that without, whatever is asked
DAMPED = frozenset({"discriminant", "exponent", "verdict", "period", "rotation_number"})
DISCRIMINANT = np.array([name == "discriminant" for name in kernels.FLOATS])
# The parts of the axis across points on their own: rows in each, of D and of factors, where more
# terms are summed.
ROWS_PER_PART = (260, 130)
MOST_PARTS = 8
# Points of a call that answers from factors: their temporaries stay in the processor's cache.
CALL_POINTS = 8192


@dataclass(frozen=True)
class ExpandedFunctions:
    """The functions that are expanded, as rows of `floats`: D, or the factors; and are rotation
    numbers wanted?
    """

    rows: tuple[int, ...]
    turns: bool = False

    @property
    def factors(self):
        return len(self.rows) > 1

    @property
    def wanted(self):
        """What is asked of the nodes."""
        return np.array(
            [i in self.rows or (self.turns and i == kernels.ROTATION) for i in range(7)]
        )


def serves(problem, asked):
    """Is there an axis along the rows?"""
    return problem.line is not None and problem.line[2] > problem.line[1]


def _sought(asked, factors_only=False):
    named = {name for name, wanted in zip(kernels.FLOATS, asked.wanted, strict=True) if wanted}
    if named <= ANSWERS and not factors_only:
        return ExpandedFunctions((kernels.DISCRIMINANT,))
    return ExpandedFunctions(tuple(kernels.FACTOR_ROWS.tolist()), "rotation_number" in named)


def compile_ahead(sample, no_rows, variables):
    """Compile, by calls on next to nothing, what a map of these variables needs beside the kernel
    of the method.

    `sample` and its empty `no_rows` are the scene's. While this is done, the map's own process
    compiles the method's kernel: what it needs at once comes first, and what it waits for last.
    """
    sample(no_rows, np.ones(1), np.empty((0, 1, 2, 1)))
    yield from of_functions(variables, {})


def of_functions(variables, options):
    """As `compile_ahead`, for a user's z, whose samples this cannot compile."""
    grows = not {"exponent", "exponent_per_orbit"}.isdisjoint(variables)
    named = {name for name in kernels.FLOATS if name in variables} | (
        {"exponent"} if grows else set()
    )
    answers = Answers(1, Asked(1.0, np.array([name in named for name in kernels.FLOATS])))
    Answers(1, Asked(1.0, DISCRIMINANT)).assess(np.ones((1, RESULTS)), None)
    yield "measure"
    if named <= ANSWERS:
        _discriminants(answers, np.zeros(1, int), np.ones((1, TERMS)), np.ones(1), np.ones(1), None)
        if grows:
            kernels.exponents(np.zeros(1, int), 1, 1.0, *answers.found)
        answers.assess(np.ones((1, RESULTS)), None)
    else:
        yield "answers"  # a few points need no more
        _factors(
            np.ones((4, 1, TERMS)),
            np.ones((4, 1)),
            np.ones(1),
            False,
            np.zeros((TURNS, 1, 2)),
            _between(np.ones(1), 2, 2),
            False,
        )


def of_damped(variables, options):
    """As `of_functions`, for equations with damping, which need the same of that without, whatever is asked."""
    yield from of_functions(DAMPED, options)


def solve(problem, method, asked, answers):
    """Answer the points of the rows that a proxy serves; returns the points (N, bool) still to be solved."""
    open_points = np.ones(problem.p.shape, np.bool_)
    even = np.zeros(len(problem.p), np.bool_) if problem.even is None else problem.even
    for symmetric in (False, True):
        rows = np.flatnonzero(even == symmetric)
        if not rows.size:
            continue
        axis = _axis(problem.line, symmetric)
        if problem.row_axis is not None:
            rows = _surfaces(problem, method, asked, answers, rows, axis, open_points)
        _rows(problem, method, asked, answers, rows, axis, open_points)
    return open_points.reshape(-1)


def scattered(box, method, asked, answers, position, p):
    """Answer points on their own (N each) from the series of their `box`; returns those (N, bool)
    to be solved.
    """
    sought = _sought(asked)
    axis = _axis(box.line, box.even)
    open_points = np.ones(p.size, np.bool_)
    served = _served_panels(box, method, asked, axis, sought)
    if not sought.factors and any(not bars[0] <= asked.rtol for _, _, _, bars, *_ in served):
        # where D varies by many powers of ten, bounds of the factors are nearer
        sought = _sought(asked, factors_only=True)
        served = _served_panels(box, method, asked, axis, sought)
    for low, high, series, bars, turns, _, _ in served:
        inside = np.flatnonzero(open_points & (position >= low) & (position <= high))
        padded, number, bars = _shortened(series, bars)
        for some in np.split(inside, range(CALL_POINTS, inside.size, CALL_POINTS)):
            if not some.size:
                continue
            across = (position[some] - 0.5 * (low + high)) / (0.5 * (high - low))
            along = (p[some] - axis.middle) / axis.radius
            alone = some[-1] - some[0] == some.size - 1
            found, first = (answers, some[0]) if alone else (Answers(some.size, asked), 0)
            if sought.factors:
                results = _at_points(
                    box, axis, padded, number, bars, turns, across, along, position[some]
                )
                found.assess(results, None, first=first)
            else:
                _discriminants_at(
                    found,
                    first,
                    padded[0],
                    number[0],
                    bars[0],
                    np.stack([across, along]),
                    axis.even,
                )
            own = slice(first, first + some.size)
            if not alone:
                answers.replace(some, found)
            failed = found.status[own] != status.OK
            open_points[some] = found.missed[own] | failed
            # what this leaves without an answer is solved again
            answers.status[some[failed]] = status.OK
    return open_points


def _served_panels(box, method, asked, axis, sought):
    with _ONE_AT_A_TIME:
        return [
            panel
            for part in _parts(box.row_axis, sought)
            for panel in panels(part, method, asked.rtol, axis, sought)
        ]


def _discriminants_at(answers, first, series, number, bar, x, even):
    """D of the answers from the `first` on, at points x (2, N) across and along, from its series,
    and the exponent.
    """
    asked = answers.asked
    own = answers.of(kernels.DISCRIMINANT)
    discriminants_at(first, series, number, bar, x, even, asked.rtol, *own)
    if asked.wanted[kernels.EXPONENT]:
        kernels.exponents(np.array([first]), x.shape[1], asked.rtol, *answers.found)


def _parts(row_axis, sought):
    """The axis in parts: the more points there are, the more of them pay, on which series have
    fewer terms.
    """
    parts = int(np.clip(row_axis.number // ROWS_PER_PART[sought.factors], 1, MOST_PARTS))
    ends = np.linspace(row_axis.low, row_axis.high, parts + 1)
    return [replace(row_axis, low=float(low), high=float(high)) for low, high in pairwise(ends)]


def _shortened(series, bars):
    """The series (4, across, along) as `points` takes them: the number of terms across that count
    for each along, and the bounds with what is left out, a tenth of them.
    """
    by_terms = series.transpose(0, 2, 1)
    rest = np.cumsum(abs(by_terms[:, :, ::-1]), axis=2)[:, :, ::-1]
    number = (rest > 0.1 * bars[:, None, None] / by_terms.shape[1]).sum(axis=2)
    padded = np.zeros((*by_terms.shape[:2], -(-by_terms.shape[2] // TERMS) * TERMS))
    padded[:, :, : by_terms.shape[2]] = by_terms
    return padded, -(-number // TERMS) * TERMS, 1.1 * bars


def _at_points(box, axis, series, number, bars, turns, across, along, position):
    """The results (N, RESULTS) at x `across` and `along` the rows of a panel."""
    results = np.empty((RESULTS, position.size))
    nodes = turns.shape[2] * (2 if axis.even else 1)
    *one, share = _between(across, turns.shape[1], turns.shape[1])
    *other, further = _between(abs(along) if axis.even else along, nodes, turns.shape[2])
    x = np.stack([across, along])
    around = np.stack([*one, *other])  # LOW_ACROSS to HIGH_ALONG
    shares = np.stack([share, further])
    odd = _odd(box.row_axis, axis, position)
    points(series, number, bars, x, axis.even, odd, turns, around, shares, box.full_period, results)
    return results.T


@dataclass(frozen=True)
class _Interval:
    """Where the series in p live; `even`: on half of a symmetric axis, which then needs half the nodes."""

    number: int
    middle: float
    radius: float
    even: bool

    @cached_property
    def most(self):
        """The number of DEGREES whose nodes pay."""
        return int(
            np.searchsorted(
                DEGREES, self.number / POINTS_PER_NODE * (2 if self.even else 1), "right"
            )
        )


def _axis(line, symmetric):
    number, low, high = line
    if symmetric and max(-low, high) < 1.5 * (high - low):
        return _Interval(number, 0.0, max(abs(low), abs(high)), True)
    return _Interval(number, 0.5 * (low + high), 0.5 * (high - low), False)


def _rows(problem, method, asked, answers, chosen, axis, open_points):
    """Answer the points of the `chosen` rows, each by a series of its own."""
    if not chosen.size:
        return
    sought = _sought(asked)
    degree = np.full(len(problem.p), DEGREES.size)
    sizes = _sizes(_argument(problem, axis, sought)[chosen])
    enough = _below(sizes, _smallest(problem, asked.rtol, sought))
    if problem.c2 and not sought.factors:  # not beyond what pays, where less may do
        more = np.minimum(_below(sizes, ROWS_SHARE * asked.rtol), axis.most - 1)
        enough = np.maximum(enough, more)
    degree[chosen] = enough
    first = degree.copy()
    # a row whose series has not converged goes on to the next degree
    while (at := int(degree.min(initial=axis.most))) < axis.most:
        rows = np.flatnonzero(degree == at)
        share = max(BEST, NODES_SHARE * asked.rtol)
        values, series, bars, turns, nodal = _series(
            problem, method, (share, share), rows, int(DEGREES[at]), axis, sought
        )
        served = _served(values, bars[:, :, None], asked.rtol).mean(axis=2).min(axis=0)
        few = np.flatnonzero(served < MOST)
        if nodal is not None and few.size:
            between = _served(values[0, few], nodal.of(few).between(), asked.rtol)
            served[few] = np.maximum(served[few], between.mean(axis=1))
        last = at == first[rows] + RETRIES
        good = (served >= MOST) | ((served > 0) & last)
        degree[rows] = np.where(good | last, DEGREES.size, at + 1)
        rows, series, bars = rows[good], np.ascontiguousarray(series[:, good]), bars[:, good]
        turns = None if turns is None else turns[:, good]
        nodal = None if nodal is None else nodal.of(good)
        if rows.size:
            _answer(problem, asked, answers, rows, series, bars, turns, nodal, axis, open_points)


def _answer(problem, asked, answers, rows, series, bars, turns, nodal, axis, open_points):
    waiting.wait("answers")
    x = (problem.p[rows[0]] - axis.middle) / axis.radius  # all rows have the same points
    if len(series) > 1:
        waiting.wait("factors")
        _answer_by_factors(problem, asked, answers, rows, series, bars, turns, axis, x, open_points)
        return
    x, wide = 2 * x * x - 1 if axis.even else x, ~(bars[0] <= asked.rtol)
    _discriminants(answers, rows[~wide], series[0, ~wide], bars[0, ~wide], x, None)
    if wide.any():  # points may miss it: bounds of their own, which cost more
        _discriminants(answers, rows[wide], series[0, wide], None, x, nodal.of(wide))
    if asked.wanted[kernels.EXPONENT]:
        kernels.exponents(rows * x.size, x.size, asked.rtol, *answers.found)
    open_points[rows] = answers.missed.reshape(problem.p.shape)[rows]


def _answer_by_factors(problem, asked, answers, rows, series, bars, turns, axis, x, open_points):
    """Answer the points x of the rows from the series (FACTOR_COUNT, R, n) of their factors, and `turns`
    (TURNS, R, nodes).
    """
    padded = np.zeros((*series.shape[:2], -(-series.shape[2] // TERMS) * TERMS))
    padded[:, :, : series.shape[2]] = series
    number = turns.shape[2] * (2 if axis.even else 1)
    between = _between(abs(x) if axis.even else x, number, turns.shape[2])
    rule = None if problem.rule is None else problem.rule.reshape(-1)
    most = max(1, CALL_POINTS // x.size)
    apart = np.flatnonzero(np.diff(rows) != 1) + 1
    for part in np.split(np.arange(rows.size), apart):
        for some in (part[i : i + most] for i in range(0, part.size, most)):
            some = slice(some[0], some[-1] + 1)
            results = _factors(
                padded[:, some],
                bars[:, some],
                x,
                axis.even,
                turns[:, some],
                between,
                asked.full_period,
            )
            answers.assess(results, rule, first=rows[some.start] * x.size)
    # what this leaves without an answer is solved again
    failed = answers.status != status.OK
    answers.status[failed] = status.OK
    open_points[rows] = (answers.missed | failed).reshape(problem.p.shape)[rows]


def _factors(series, bars, x, even, turns, between, full_period):
    """The results (R x, RESULTS) of the points x of rows, which lie `between` nodes of the `turns`."""
    left, right, share = between
    place = left + right
    results = np.empty((RESULTS, turns.shape[1] * x.size))
    series, bars, turns = (np.ascontiguousarray(values) for values in (series, bars, turns))
    factors(series, bars, x, even, turns, place, share, full_period, results)
    return results.T


def _between(x, number, kept):
    """The nodes around x and the share between them: see `neighbours`."""
    left, right = np.empty((2, x.size), np.int64)
    share = np.empty(x.size)
    neighbours(np.ascontiguousarray(x), number, kept, left, right, share)
    return left, right, share


def _discriminants(answers, rows, series, bars, x, nodal):
    """D of the rows from their series at x, in place, within `bars`, or within what is `nodal`."""
    at_nodes = np.empty((len(series), 0))
    nodes = 0
    if nodal is not None:
        bars = nodal.doubts
        at_nodes = _padded(nodal.bars)
        nodes = nodal.bars.shape[1]
    own = answers.of(kernels.DISCRIMINANT)
    discriminants(rows, _padded(series), bars, at_nodes, nodes, x, answers.asked.rtol, *own)


def _padded(series):
    """The series (R, n), with zeros up to a multiple of TERMS."""
    padded = np.zeros((len(series), -(-series.shape[1] // TERMS) * TERMS))
    padded[:, : series.shape[1]] = series
    return padded


@dataclass(frozen=True)
class NodalBounds:
    """How far D from series of R rows may be off: `doubts` (R), and `bars` (R, n) times Lagrange
    polynomials.
    """

    doubts: np.ndarray
    bars: np.ndarray

    def of(self, rows):
        return NodalBounds(self.doubts[rows], self.bars[rows])

    def between(self):
        """Bounds (R, n) half way from each node to the next."""
        n = self.bars.shape[1]
        return self.doubts[:, None] + chebyshev.combined(
            self.bars, chebyshev.lagrange(chebyshev.between(n), n)
        )

    def across(self, x, doubt):
        """The same of rows at x, from series across these rows, at nodes, that have a doubt of their own."""
        weights = chebyshev.lagrange(x, len(self.doubts))
        doubts, bars = (
            chebyshev.combined(values, weights) for values in (self.doubts[None], self.bars.T)
        )
        return NodalBounds(doubt + doubts[0], bars.T)


def _surfaces(problem, method, asked, answers, chosen, axis, open_points):
    """Answer those `chosen` rows that a series across rows serves; returns the others."""
    # compile this, by a call on nothing, while that process compiles what the nodes need
    if waiting.other_compiler:
        chebyshev.restrict(np.empty((0, 0)), np.empty(0), np.empty((0, 0)))
    with _ONE_AT_A_TIME:
        served = panels(problem.row_axis, method, asked.rtol, axis, _sought(asked))
    position = problem.positions[chosen]
    left = np.ones(chosen.size, np.bool_)
    for low, high, series, bars, turns, of_nodes, nodal in served:
        inside = left & (position >= low) & (position <= high)
        rows = chosen[inside]
        own = np.empty((len(series), np.count_nonzero(inside), series.shape[2]))
        if rows.size:
            x = (position[inside] - 0.5 * (low + high)) / (0.5 * (high - low))
            for of, out in zip(series, own, strict=True):
                chebyshev.restrict(of, x, out)
            bar = np.repeat(bars[:, None], rows.size, axis=1)
            odd = _odd(problem.row_axis, axis, position[inside])
            # points may miss it: bounds of the rows themselves, which cost more
            if (bars > asked.rtol).any():
                tails, bars_there = of_nodes
                own_bars = chebyshev.combined(
                    bars_there, chebyshev.lagrange(x, bars_there.shape[1])
                )
                bar = np.minimum(bar, tails[:, None] + own_bars)
            if len(own) > 1:
                own[DY2], bar[DY2] = own[DY2] * odd[:, None], bar[DY2] * odd
            wide = nodal is not None and not (bar[0] <= asked.rtol).all()
            at_rows = nodal.across(x, of_nodes[0][0]) if wide else None
            _answer(
                problem,
                asked,
                answers,
                rows,
                own,
                bar,
                _across(turns, x),
                at_rows,
                axis,
                open_points,
            )
        left &= ~inside
    return chosen[left]


def _odd(row_axis, axis, positions):
    """What y1 - y2' is divided by to be analytic in the position (R): see `RowAxis`."""
    return row_axis.odd(positions) if axis.even and row_axis.odd else np.ones(positions.size)


def _across(turns, x):
    """The `turns` (TURNS, R, m) of rows at x from those (TURNS, n, m) at nodes: means, the least and
    the largest numbers.
    """
    if turns is None:
        return None
    left, right, share = _between(x, turns.shape[1], turns.shape[1])
    one, other = turns[:, left], turns[:, right]
    out = np.minimum(one, other)
    for most in (Y1_MOST, Y2_MOST):
        out[most] = np.maximum(one[most], other[most])
    out[NEAR] = one[NEAR] + share[:, None] * (other[NEAR] - one[NEAR])
    return out


@lru_cache(maxsize=64)
def panels(row_axis, method, rtol, axis, sought):
    """[(low, high, series (F, n, m), bounds (F), `turns` at nodes, (tails (F), bounds at nodes (F,
    n)), `NodalBounds`)] of the panels of rows on which what is sought converges, the same for all blocks.

    The axis of rows is halved until it has converged to `rtol`, as long as all that is solved for
    it pays.
    """
    left = [(row_axis.low, row_axis.high, 1.0)]
    found = []
    budget = row_axis.number / ROWS_PER_NODE
    while left:
        low, high, share = left.pop(0)
        if not high > low:
            continue
        middle, radius = 0.5 * (low + high), 0.5 * (high - low)
        most = min(budget, share * row_axis.number)
        surface, spent = _surface(row_axis, method, rtol, middle, radius, axis, most, sought)
        budget -= spent
        if surface is not None:
            found.append((low, high, *surface))
        elif spent:
            left += [(low, middle, 0.5 * share), (middle, high, 0.5 * share)]
    return found


def _surface(row_axis, method, rtol, middle, radius, axis, budget, sought):
    """((coefficients (F) of T_j in s by T_k in p, bounds (F), `turns` at nodes, tails and bounds
    there, `NodalBounds`), or None where `rtol` is not met; rows solved, in `budget`).
    """
    ends = row_axis.at(middle + radius * np.array([-1.0, 1.0]))
    size = np.sqrt((ends.bound * np.abs([1.0, axis.radius, axis.radius**2])).sum(axis=1))
    argument = np.abs(np.diff(ends.span * size))  # half the change of D's phase
    at = int(_enough(0.5 * argument if sought.factors else argument, rtol)[0])
    smallest = _smallest(ends, rtol, sought)
    degree = int(_enough(_argument(ends, axis, sought), smallest).max())
    spent = 0
    doubt = np.inf
    while at < DEGREES.size and degree < axis.most and spent + DEGREES[at] <= budget:
        n, before = int(DEGREES[at]), doubt
        spent += n
        nodes = row_axis.at(middle + radius * chebyshev.symmetric_nodes(n))
        accuracy = max(BEST, min(ENOUGH, MAP_SHARE * rtol)), BEST
        found = _series(nodes, method, accuracy, np.arange(n), int(DEGREES[degree]), axis, sought)
        values, series, bars, turns, nodal = found
        matrix = chebyshev.by_columns(n)
        ulps = (4 + abs(middle) + radius) / radius
        if sought.factors:
            odd = _odd(row_axis, axis, middle + radius * chebyshev.symmetric_nodes(n))
            series[DY2], bars[DY2] = series[DY2] / odd[:, None], bars[DY2] / odd
        surfaces, tails = zip(
            *(chebyshev.transform(of, matrix, ulps) for of in series), strict=True
        )
        tails = np.array(tails)
        doubts = tails + chebyshev.lebesgue(n) * bars.max(axis=1)
        served = _served(values, doubts[:, None, None], rtol).mean(axis=(1, 2)).min()
        if nodal is not None and served < MOST:
            between = nodal.across(chebyshev.between(n), tails[0]).between()
            served = _served(values[0], between, rtol).mean()
        if served >= MOST:
            return (np.array(surfaces), doubts, turns, (tails, bars), nodal), spent
        worst = doubts.argmax()
        doubt, tail = doubts[worst], tails[worst]
        if not doubt < 0.5 * before:
            break
        at, degree = (at + 1, degree) if tail > 0.5 * doubt else (at, degree + 1)
    return None, spent


def _argument(problem, axis, sought):
    """The argument x of J_n(x) that the coefficients of each row's D, or of its factors, resemble."""
    share = 0.5 if sought.factors else 1.0  # they are those of half a period
    if problem.c2:
        return share * (2 * problem.span * axis.radius * np.sqrt(problem.c2))
    # cos(span sqrt(p)) on an axis of length 2 radius is half as rich as cos(span p) on its square
    # root
    return share * (problem.span * np.sqrt(2 * axis.radius * problem.bound[:, 1]))


def _smallest(problem, rtol, sought):
    """The size of coefficients below which a series may end."""
    return FACTORS_SHARE * rtol if problem.c2 and sought.factors else rtol


def _enough(argument, rtol):
    """The index in DEGREES where J_n(argument), about a coefficient, is below rtol; beyond DEGREES
    where there is none.

    |J_n(x)| <= (x/2)^n / n! (DLMF 10.14.4).
    """
    return _below(_sizes(argument), rtol)


def _sizes(argument):
    """log (|argument| / 2)^n / n! (R, DEGREES)."""
    with np.errstate(divide="ignore"):
        return DEGREES * np.log(argument)[:, None] + _OF_DEGREES


def _below(sizes, rtol):
    """The index of the first degree whose size is below a hundredth of rtol; beyond the last where
    there is none.
    """
    return np.count_nonzero(~(sizes < log(0.01 * rtol)), axis=1)


def _series(problem, method, accuracy, rows, n, axis, sought):
    """What is sought at nodes (F, rows, n; n/2 if even), its coefficients, their bounds (F, rows),
    and, of factors, the `turns` (TURNS, rows, n) there, NEAR to Y2_MOST; of D the `NodalBounds`.

    If even, the coefficients are those of T_k(2 (p/radius)^2 - 1), and of factors those of (y1 +
    y2') / 2, y1', y2 and, of T_{2k + 1}(p/radius), (y1 - y2') / 2. `accuracy` is what nodes are solved
    to if that can be, and what their first steps are chosen for; an error bound is not finite where
    there is none.
    """
    x = chebyshev.symmetric_nodes(n)
    x = x[: n // 2] if axis.even else x
    nodes = problem.at(
        rows, np.broadcast_to(axis.middle + axis.radius * x, (rows.size, x.size)).copy()
    )
    finer = Asked(
        accuracy[0],
        sought.wanted,
        together=True,
        full_period=problem.full_period,
        decides=False,
        aim=accuracy[1],
    )
    own = Answers(nodes.p.size, finer)
    pointwise.solve(nodes, method, finer, own)
    values, at_nodes = (
        np.array([of(row) for row in sought.rows]).reshape(-1, *nodes.p.shape)
        for of in (own.floats.__getitem__, own.bars)
    )
    bars = at_nodes.max(axis=2)
    turns = None
    if sought.factors:
        zeros = own.results[:, Y1_ZEROS:].T.reshape(2, *nodes.p.shape)
        turns = np.stack(
            [
                own.floats[kernels.ROTATION].reshape(nodes.p.shape) if sought.turns else zeros[0],
                *np.repeat(zeros, 2, axis=0),
            ]
        )
    ulps = (abs(axis.middle) + axis.radius) / axis.radius
    matrix = chebyshev.by_columns(x.size)
    odd = sought.factors and axis.even
    if odd:
        y1, dy1, y2, dy2 = values
        values = np.stack([0.5 * (y1 + dy2), dy1, y2, 0.5 * (y1 - dy2)])
        bars[[Y1, DY2]] = 0.5 * (bars[Y1] + bars[DY2])
    expanded = [chebyshev.expand(of, matrix, ulps) for of in values[: DY2 if odd else None]]
    if odd:  # T_{2k + 1}, whose arguments' rounding weighs four times as much
        series, doubts = chebyshev.expand(values[DY2], chebyshev.odd_columns(x.size), ulps)
        expanded.append((series, 4 * doubts))
    series, doubts = (np.stack(of) for of in zip(*expanded, strict=True))
    nodal = None if sought.factors else NodalBounds(doubts[0], at_nodes[0])
    return values, series, doubts + chebyshev.lebesgue(n if odd else x.size) * bars, turns, nodal


def _served(values, bar, rtol):
    """Where D is known to `rtol` (relative where it is large) if it is `values` within `bar`."""
    return bar <= rtol * (1 + abs(values))
