"""Points of a Hill problem solved one by one, by a method, on the rungs of its ladder
(`survey.measures.answers`).

Points of a row with the same number of steps share the row's samples; rows with the same number go
through one kernel call of at most about a second.
"""

import numpy as np

from survey import methods, status, waiting
from survey.kernels.hill.answers import UNTRIED, first_rungs, segments
from survey.kernels.lanes import DY2_BAR, RESULTS, Y1_BAR, Y1_ZEROS
from survey.measures.answers import Ladder
from survey.measures.hill.answers import Answers

BOUNDS = slice(Y1_BAR, DY2_BAR + 1)
# Numbers of steps: even, so that a half period's middle falls between steps; four to the octave
# from 8 on. A point climbs to 1.4 times as many at least.
_NUMBERS = np.array([4, 6, *((4 + i % 4) << (i // 4 + 1) for i in range(57))])
STEP_COUNTS = Ladder(
    _NUMBERS, np.searchsorted(_NUMBERS, 1.4 * _NUMBERS), BOUNDS, most=len(_NUMBERS)
)
# Of adaptive methods: tolerances of a step, 10^(-3 - i / 2).
TOLERANCES = Ladder(10.0 ** (-3 - 0.5 * np.arange(25)), np.arange(25) + 2, BOUNDS, most=25)
# Keep a kernel call below about a second and its samples in the processor's cache.
CALL_WORK = 8_000_000
CALL_SAMPLES = 40_000
OWN = ("C", "W")  # kernels would be compiled again for a view to read alone
# Points of shorter rows go each in a lane of its own, samples and all: the same bits.
LANES_PER_ROW = 3
# Radians of the fastest phase per step, at most: zeros are counted by signs at the ends of steps.
LONGEST = 2.8


def solve(problem, method, asked, answers, where=None):
    """Answer the points `where` (N, bool; all by default) of the problem, in place."""
    if where is None:
        _solve(problem, method, asked, answers, slice(None))
        return
    inside = where.reshape(problem.p.shape)
    rows = np.flatnonzero(inside.any(axis=1))  # leave out those that have no such point
    count = inside[rows].sum(axis=1)
    # the points of each row, side by side
    chosen = np.arange(count.max(initial=1)) < count[:, None]
    p, points = np.full(chosen.shape, np.nan), np.flatnonzero(where)
    p[chosen] = problem.points(points)
    rule = None
    if problem.rule is not None:
        rule = np.zeros(chosen.shape, problem.rule.dtype)
        rule[chosen] = problem.rule.reshape(-1)[points]
    found = Answers(points.size, asked)
    _solve(problem.at(rows, p, rule), method, asked, found, np.flatnonzero(chosen))
    answers.replace(points, found)


def _solve(problem, method, asked, answers, chosen):
    """The answers of the `chosen` points of the flat problem."""
    adaptive = methods.adaptive(method)
    run, ladder = (_walk, TOLERANCES) if adaptive else (_chain, STEP_COUNTS)
    first = (
        _first_tolerance(problem, asked.rtol) if adaptive else _first_steps(problem, method, asked)
    )
    rung = first.reshape(-1)[chosen].copy()
    rule = None if problem.rule is None else problem.rule.reshape(-1)[chosen]

    def run_at(points, rung):
        """The results (points, RESULTS) of these points of the flat problem on their rungs."""
        on_rung = np.full_like(first, UNTRIED)
        out = np.empty((first.size, RESULTS))
        on_rung.reshape(-1)[points] = rung
        run(problem, method, on_rung, out)
        return out[points]

    def solve_at(points, rung):
        return run_at(np.arange(first.size)[chosen][points], rung)

    def assess(points, results):
        found = Answers(len(results), asked)
        found.assess(results, None if rule is None else rule[points])
        return found

    answers.status[rung == UNTRIED] = status.INVALID_PARAMETERS
    answers.status[rung > ladder.top] = status.STEP_LIMIT
    results = run_at(chosen, rung)
    answers.status[(answers.status == status.OK) & np.isnan(results[:, Y1_ZEROS])] = (
        status.STEP_LIMIT
    )
    answers.assess(results, rule)
    ladder.climb(rung, results, answers, solve_at, assess)
    answers.results = results


def _first_steps(problem, method, asked):
    """The first rung (R, L) with as many steps as the method asks for; above the top where none
    has; UNTRIED at NaN.
    """
    phase, distance = method.hill_density(asked.rtol if asked.aim is None else asked.aim)
    phase = max(phase, 1 / LONGEST)
    if not asked.together:
        return _first_rungs(problem, phase, distance)
    known = np.isfinite(problem.p)
    size = abs(np.where(known, problem.p, 0.0)).max(axis=1)
    frequency = np.sqrt(
        problem.bound[:, 0] + size * (problem.bound[:, 1] + size * problem.bound[:, 2])
    )
    steps = np.maximum(phase * frequency * problem.span, distance * problem.rate * problem.span)
    return np.where(
        known & np.isfinite(steps)[:, None],
        np.searchsorted(STEP_COUNTS.rungs, steps)[:, None],
        UNTRIED,
    )


def _first_tolerance(problem, rtol):
    """The first rung (R, L) whose tolerance is a share of rtol, or the top one; UNTRIED at NaN.

    The share falls as the number of steps grows whose errors add up: with rtol^(-1/8) for a method
    of order 8.
    """
    tolerance = 0.03 * rtol**1.125
    first = int(np.searchsorted(-TOLERANCES.rungs, -max(tolerance, TOLERANCES.rungs[-1])))
    return np.where(_first_rungs(problem, 0.0, 0.0) == UNTRIED, UNTRIED, first)


def _first_rungs(problem, phase, distance):
    rung = np.empty(problem.p.shape, np.int64)
    first_rungs(
        np.require(problem.p, requirements=OWN),
        problem.bound,
        problem.span,
        problem.rate,
        phase,
        distance,
        STEP_COUNTS.rungs,
        rung,
    )
    return rung


def _walk(problem, method, rung, out):
    """Points one by one, each with its tolerance; results are NaN (zeros too) where the end was not
    reached.
    """
    points = np.flatnonzero(rung >= 0)
    rows, tolerance = points // rung.shape[1], TOLERANCES.rungs[rung.reshape(-1)[points]]
    results, reached = problem.walk(rows, problem.points(points), tolerance)
    out[points] = np.where(reached[:, None], results, np.nan)


def _chain(problem, method, rung, out):
    """Points solved by fixed steps: those with the same number of steps together, in calls of
    bounded work.
    """
    order, rows, on_rung, starts, ends = _segments(rung)
    nodes, p = np.array(method.NODES), np.require(problem.p, requirements=OWN).reshape(-1)
    scattered = rung.shape[1] < LANES_PER_ROW

    def compose(samples, h, first, last):
        if scattered:
            method.hill_scatter(samples, problem.c2, h, p, order, first, out)
        else:
            method.hill_chain(samples, problem.c2, h, p, order, first, last, out)

    # compile this, by calls on nothing, while that process compiles the rest
    if waiting.other_compiler:
        compose(np.empty((0, 0, 2, nodes.size)), np.empty((0, 0)), starts[:0], ends[:0])
    for at in np.flatnonzero(np.bincount(on_rung)):
        steps, own = int(STEP_COUNTS.rungs[at]), on_rung == at
        segment = rows[own], starts[own], ends[own]
        for used, first, last in _calls(
            *(_by_point(*segment) if scattered else segment), steps, nodes.size
        ):
            compose(problem.sample(used, nodes, steps), problem.lengths(used, steps), first, last)


def _segments(rung):
    """(points by row and rung; row, rung, start and end of each segment), as `segments`."""
    size = rung.shape[1]
    if size and (rung == rung[:, :1]).all():  # nothing to sort within a row
        rows = np.flatnonzero((rung[:, 0] >= 0) & (rung[:, 0] <= STEP_COUNTS.top))
        return np.arange(rung.size), rows, rung[rows, 0], rows * size, (rows + 1) * size
    most = rung.shape[0] * min(size, len(STEP_COUNTS.rungs)) + 1
    order = np.empty(rung.size, np.int64)
    rows, on_rung, starts = (np.empty(most, np.int64) for _ in range(3))
    count = segments(rung, STEP_COUNTS.top, order, rows, on_rung, starts)
    return order, rows[:count], on_rung[:count], starts[:count], starts[1 : count + 1]


def _by_point(rows, starts, ends):
    """(rows, starts, ends) of the segments cut into points."""
    count = ends - starts
    first = np.repeat(starts - np.cumsum(count) + count, count) + np.arange(count.sum())
    return np.repeat(rows, count), first, first + 1


def _calls(rows, starts, ends, steps, nodes):
    """(rows, starts, ends) of the segments in parts, each one kernel call; long segments are cut."""
    most = max(1, CALL_WORK // steps)
    most_rows = max(1, CALL_SAMPLES // (steps * nodes))
    if rows.size <= most_rows and (ends - starts).sum() <= most:
        yield rows, starts, ends
        return
    pieces = -(-(ends - starts) // most)
    if pieces.max(initial=1) > 1:
        number = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        rows, ends = np.repeat(rows, pieces), np.repeat(ends, pieces)
        starts = np.repeat(starts, pieces) + most * number
        ends = np.minimum(ends, starts + most)
    total = np.cumsum(ends - starts)
    first = 0
    while first < rows.size:
        done = total[first - 1] if first else 0
        last = max(
            first + 1, min(first + most_rows, int(np.searchsorted(total, done + most, "right")))
        )
        yield rows[first:last], starts[first:last], ends[first:last]
        first = last
