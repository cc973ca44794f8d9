"""Which method where: a constant coefficient by its closed form, everything else by midpoint
Taylor, and points that it leaves undecided in double-double arithmetic, or by the adaptive DOP853
where a problem has no such kernel. So are the few whose D, if requested, depends on an ulp of the
parameters, where float64 cannot reach rtol.

Measured (`survey precision satellite`): midpoint Taylor is the fastest at every accuracy and has
the sharpest bounds.
"""

import numpy as np

from survey import status
from survey.kernels.hill import taylor_double
from survey.kernels.hill.answers import DISCRIMINANT, LEAST, UNDECIDED
from survey.kernels.lanes import RESULTS
from survey.kernels.math.roundoff import EPS
from survey.measures.hill import dense, pointwise
from survey.measures.hill.answers import ILL, NO_SQUARES, Answers
from survey.methods import taylor16

# Discriminants that are ill conditioned are solved again if so few steps (0.2 s a hundred points) do.
FEW_STEPS = 500
# Keep a call of the double-double kernel below about a second.
CALL_STEPS = 20_000


def solve(problem, asked, answers):
    """Answer every point of the problem, in place; if asked to decide, solve what stays undecided
    again, with more digits.
    """
    free = None
    if problem.constant is not None:
        rows, z = problem.constant
        free = np.zeros(problem.p.shape, np.bool_)
        free[rows] = np.isfinite(z)
        free = free.reshape(-1)
    open_points = (
        dense.solve(problem, taylor16, asked, answers) if dense.serves(problem, asked) else None
    )
    if free is not None:
        open_points = ~free if open_points is None else open_points & ~free
    if open_points is None or open_points.any():
        pointwise.solve(problem, taylor16, asked, answers, open_points)
    if free is not None:
        points = np.flatnonzero(free)
        own = Answers(points.size, asked)
        results = closed_form(z[np.isfinite(z)], problem.span[points // problem.p.shape[1]])
        own.assess(results, None if problem.rule is None else problem.rule.reshape(-1)[points])
        answers.replace(points, own)
    ours = answers.status == status.OK
    if free is not None:
        ours &= ~free
    left = ours & (answers.verdict == UNDECIDED) if asked.decides else np.zeros_like(ours)
    if problem.exact is not None:
        _exactly(problem, answers, np.flatnonzero(left), asked, taylor_double.STEP_LIMIT)
        if asked.rtol < ILL and asked.wanted[DISCRIMINANT]:
            d = abs(answers.floats[DISCRIMINANT])
            bar = answers.bars(DISCRIMINANT)
            _exactly(
                problem, answers, np.flatnonzero(ours & (bar > ILL * (1 + d))), asked, FEW_STEPS
            )
    elif left.any() and problem.walk is not None:
        from survey.methods import dop853  # with all families' kernels: few points need it

        other = Answers(left.size, asked)
        pointwise.solve(problem, dop853, asked, other, left)
        decided = np.flatnonzero(left & (other.status == status.OK) & (other.verdict != UNDECIDED))
        answers.replace(decided, other, decided)


def scattered(box, asked, answers, position, p):
    """Answer points on their own from series; returns those (N, bool) that are left (see
    `dense.scattered`).
    """
    return dense.scattered(box, taylor16, asked, answers, position, p)


def _exactly(problem, answers, points, asked, most):
    """Solve the `points` in double-double, where at most `most` steps suffice; the others keep
    their answers.
    """
    if not points.size:
        return
    phase, distance = taylor_double.hill_density()
    rows, p = points // problem.p.shape[1], problem.points(points)
    low = np.zeros(p.size) if problem.p_low is None else problem.p_low.reshape(-1)[points]
    frequency = np.sqrt((problem.bound[rows] * np.stack([p**0, abs(p), p**2], axis=1)).sum(axis=1))
    length = 0.5 * problem.span[rows] * np.maximum(phase * frequency, distance * problem.rate[rows])
    steps = 2 * np.maximum(np.ceil(length), 1)  # z = 0 asks for none
    within = steps <= most
    points, rows, p, low = points[within], rows[within], p[within], low[within]
    steps = steps[within].astype(np.int64)
    calls = np.cumsum(steps) // CALL_STEPS
    for call in np.unique(calls):
        these = np.flatnonzero(calls == call)
        results = problem.exact(rows[these], p[these], low[these], steps[these])
        known = np.isfinite(results).all(axis=1)
        these, results = these[known], results[known]
        own = Answers(these.size, asked)
        rule = None if problem.rule is None else problem.rule.reshape(-1)[points[these]]
        squares = np.ascontiguousarray(results[:, RESULTS:]) if problem.full_period else NO_SQUARES
        own.assess(results[:, :RESULTS], rule, squares)
        answers.replace(points[these], own)


def closed_form(z, span):
    """Results (..., RESULTS), as of a chain, of y'' + z y = 0 over `span` with constant z: circular or
    hyperbolic.
    """
    rate = np.sqrt(abs(z))
    x = rate * span
    with np.errstate(all="ignore"):
        c, s = np.where(z < 0, np.cosh(x), np.cos(x)), np.where(z < 0, np.sinh(x), np.sin(x))
        y2 = np.where(rate > 0, s / rate, span)
    dy1 = np.where(z < 0, rate, -rate) * s
    # x and rate are known to 3 ulp, and cos, sin, cosh, sinh to 2.
    de, se = EPS * (3 * x * abs(s) + 2 * abs(c)), EPS * (3 * x * abs(c) + 2 * abs(s))
    y2_error = np.where(rate > 0, se / np.where(rate > 0, rate, 1.0), 0.0) + 3 * EPS * abs(y2)
    # Zeros inside: of cos at odd multiples of pi/2, of sin at multiples of pi; the computed signs
    # settle ties.
    m = np.where(z > 0, _zeros(x / np.pi + 0.5, c < 0), 0)
    d = np.where(z > 0, _zeros(x / np.pi, s < 0), 0)
    return np.stack(
        [c, dy1, y2, c, de, rate * se + 3 * EPS * abs(dy1) + LEAST, y2_error, de, m, d], axis=-1
    )


def _zeros(turns, negative):
    """The number of zeros nearest to `turns` - 1/2 whose parity fits the sign."""
    number = np.floor(turns)
    wrong = (number % 2 == 1) != negative
    return np.where(wrong, number + np.where(turns - number < 0.5, -1, 1), number)
