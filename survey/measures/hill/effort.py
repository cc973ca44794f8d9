"""How hard to work at each point of a Hill problem: steps from a ladder, more where the bars ask for it.

The effort of a point depends on that point, the method and rtol alone, never on its neighbours, so its bits are the
same in any block. Points of a row with the same number of steps share the row's samples; rows with the same number
go through one kernel call of at most about a second.
"""

import numpy as np

from survey import status
from survey.kernels import jit
from survey.kernels.hill.answers import UNTRIED, levels, segments
from survey.kernels.lanes import DY2_BAR, RESULTS, Y1_BAR, Y1_ZEROS
from survey.measures.hill.answers import Answers

# Even, so that a half period's middle falls between steps; four to the octave from 8 on.
LADDER = np.array([4, 6, *((4 + i % 4) << (i // 4 + 1) for i in range(57))])
# The place of twice as many steps.
HARDER = np.searchsorted(LADDER, 1.4 * LADDER)
# Adaptive methods: the local tolerance at effort i is 10^(-3 - i / 2).
TOLERANCES = 10.0 ** (-3 - 0.5 * np.arange(25))
# Keep a kernel call below about a second and its samples in the processor's cache.
CALL_WORK = 8_000_000
CALL_SAMPLES = 40_000
# Points of shorter rows go each in a lane of its own, samples and all: the same bits.
LANES_PER_ROW = 3
# Radians of the fastest phase per step, at most: zeros are counted by signs at the ends of steps.
LONGEST = 2.8


def solve(problem, method, asked, answers, where=None):
    """Answer the points `where` (N, bool; all by default) of the problem, in place."""
    if where is not None:  # leave out the rows that have no such point
        inside = where.reshape(problem.p.shape)
        rows = np.flatnonzero(inside.any(axis=1))
        rule = None if problem.rule is None else problem.rule[rows]
        problem, places, where = (
            problem.at(rows, problem.p[rows], rule),
            np.flatnonzero(where),
            inside[rows].reshape(-1),
        )
    adaptive = getattr(method, "ADAPTIVE", False)
    run, top = (_walk, len(TOLERANCES) - 1) if adaptive else (_chain, len(LADDER) - 1)
    level = _first_tolerance(problem, asked.rtol) if adaptive else _first_steps(problem, method, asked)
    flat = level.reshape(-1)
    chosen = slice(None) if where is None else np.flatnonzero(where)
    if where is not None:
        flat[~where] = UNTRIED
    own = answers if where is None else Answers(chosen.size, asked)
    rule = None if problem.rule is None else problem.rule.reshape(-1)[chosen]
    mine = flat[chosen].copy()
    own.status[mine == UNTRIED] = status.INVALID_PARAMETERS
    own.status[mine > top] = status.STEP_LIMIT
    results = np.empty((flat.size, RESULTS))
    run(problem, method, level, results)
    results = results[chosen]
    own.status[(own.status == status.OK) & np.isnan(results[:, Y1_ZEROS])] = status.STEP_LIMIT
    own.judge(results, rule)
    _harder(problem, method, own, rule, chosen, mine, level, results, run, top)
    if where is not None:
        answers.put(places, own)


def _harder(problem, method, own, rule, chosen, effort, level, results, run, top):
    """Solve the late points again with twice the effort, as long as that halves their bars.

    `effort` (changed) and `results` are those of the answers `own`, which lie at `chosen` in the flat problem.
    """
    left, new = np.flatnonzero(own.late), None
    places = np.arange(level.size)[chosen]
    while left.size:
        effort[left] = effort[left] + 2 if run is _walk else HARDER[effort[left]]
        left = left[effort[left] <= top]
        there = places[left]
        level[:] = UNTRIED
        level.reshape(-1)[there] = effort[left]
        new = np.empty((level.size, RESULTS)) if new is None else new
        run(problem, method, level, new)
        old_bar, new_bar = _bar(results[left]), _bar(new[there])
        better = new_bar < old_bar
        results[left[better]] = new[there[better]]
        again = Answers(left.size, own.asked)
        again.judge(results[left], None if rule is None else rule[left])
        own.put(left, again)
        # Truncation falls by a factor of 4 or more each time; where the bar does not halve, rounding rules.
        left = left[again.late & (new_bar < 0.5 * old_bar)]


def _bar(results):
    """One figure for the four bars; a point without a finite one has an infinite bar."""
    bar = results[:, Y1_BAR : DY2_BAR + 1].max(axis=-1)
    return np.where(np.isfinite(bar), bar, np.inf)


def _first_steps(problem, method, asked):
    """The ladder's first step number that the method asks for; beyond the ladder where it has none; UNTRIED at NaN."""
    phase, distance = method.hill_density(asked.rtol)
    phase = max(phase, 1 / LONGEST)
    if not asked.together:
        return _levels(problem, phase, distance)
    known = np.isfinite(problem.p)
    size = abs(np.where(known, problem.p, 0.0)).max(axis=1)
    frequency = np.sqrt(problem.bound[:, 0] + size * (problem.bound[:, 1] + size * problem.bound[:, 2]))
    steps = np.maximum(phase * frequency * problem.span, distance * problem.rate * problem.span)
    return np.where(known & np.isfinite(steps)[:, None], np.searchsorted(LADDER, steps)[:, None], UNTRIED)


def _first_tolerance(problem, rtol):
    first = int(np.searchsorted(-TOLERANCES, -max(0.01 * rtol, TOLERANCES[-1])))
    return np.where(_levels(problem, 0.0, 0.0) == UNTRIED, UNTRIED, first)


def _levels(problem, phase, distance):
    level = np.empty(problem.p.shape, np.int64)
    levels(problem.p, problem.bound, problem.span, problem.rate, phase, distance, LADDER, level)
    return level


def _walk(problem, method, level, out):
    """Points of their own, each with its tolerance; results are NaN (zeros too) where the end was not reached."""
    places = np.flatnonzero(level >= 0)
    rows = places // level.shape[1]
    results, reached = problem.walk(rows, problem.p.reshape(-1)[places], TOLERANCES[level.reshape(-1)[places]])
    out[places] = np.where(reached[:, None], results, np.nan)


def _chain(problem, method, level, out):
    """Points solved by fixed steps: those with the same number of steps together, in calls of bounded work."""
    order, rows, of_level, starts, ends = _segments(level)
    nodes, p = np.array(method.NODES), problem.p.reshape(-1)
    lone = level.shape[1] < LANES_PER_ROW

    def compose(samples, h, first, last):
        if lone:
            method.hill_scatter(samples, problem.c2, h, p, order, first, out)
        else:
            method.hill_chain(samples, problem.c2, h, p, order, first, last, out)

    if jit.ahead:  # by calls on nothing, compile this while another process compiles the rest
        compose(np.empty((0, 0, 2, nodes.size)), np.empty((0, 0)), starts[:0], ends[:0])
        row, none = np.empty(0), np.empty((0, 2), np.int64)
        levels(np.empty((0, 2)), np.empty((0, 3)), row, row, 1.0, 1.0, LADDER, none)
        segments(none, 0, *np.empty((4, 1), np.int64))
    for at in np.flatnonzero(np.bincount(of_level)):
        steps, own = int(LADDER[at]), of_level == at
        segment = _points_alone(rows[own], starts[own], ends[own]) if lone else (rows[own], starts[own], ends[own])
        for used, first, last in _calls(*segment, steps, nodes.size):
            compose(problem.sample(used, nodes, steps), problem.lengths(used, steps), first, last)


def _segments(level):
    """(points by row and level; row, level, first and last place of each segment), as `segments`."""
    size = level.shape[1]
    if size and (level == level[:, :1]).all():  # whole rows: nothing to sort
        rows = np.flatnonzero((level[:, 0] >= 0) & (level[:, 0] < len(LADDER)))
        return np.arange(level.size), rows, level[rows, 0], rows * size, (rows + 1) * size
    most = level.shape[0] * min(size, len(LADDER)) + 1
    order = np.empty(level.size, np.int64)
    rows, of_level, starts = (np.empty(most, np.int64) for _ in range(3))
    count = segments(level, len(LADDER) - 1, order, rows, of_level, starts)
    return order, rows[:count], of_level[:count], starts[:count], starts[1 : count + 1]


def _points_alone(rows, starts, ends):
    """(rows, starts, ends) of the segments cut into points."""
    count = ends - starts
    first = np.repeat(starts - np.cumsum(count) + count, count) + np.arange(count.sum())
    return np.repeat(rows, count), first, first + 1


def _calls(rows, starts, ends, steps, nodes):
    """(rows, starts, ends) of the segments in parts, each one kernel call; long segments are cut."""
    most = max(1, CALL_WORK // steps)
    pieces = -(-(ends - starts) // most)
    if pieces.max(initial=1) > 1:
        number = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        rows, ends = np.repeat(rows, pieces), np.repeat(ends, pieces)
        starts = np.repeat(starts, pieces) + most * number
        ends = np.minimum(ends, starts + most)
    total = np.cumsum(ends - starts)
    most_rows, first = max(1, CALL_SAMPLES // (steps * nodes)), 0
    while first < rows.size:
        done = total[first - 1] if first else 0
        last = max(first + 1, min(first + most_rows, int(np.searchsorted(total, done + most, "right"))))
        yield rows[first:last], starts[first:last], ends[first:last]
        first = last
