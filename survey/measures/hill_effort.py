"""How hard to work at each point of a Hill problem: steps from a ladder, more where the bars ask for it.

The effort of a point depends on that point, the method and rtol alone, never on its neighbours, so its bits are the
same in any block. Points of a row with the same number of steps share the row's samples; rows with the same number
go through one kernel call of at most about a second.
"""

import numpy as np

from survey import status

# 4, 6, 8, 12, 16, 24, ...: even, so that a half period's middle falls between steps.
LADDER = np.array([(4, 6)[i % 2] << (i // 2) for i in range(30)])
STEP_BUDGET = int(LADDER[-1])
# Adaptive methods: the local tolerance at effort i is 10^(-3 - i / 2).
TOLERANCES = 10.0 ** (-3 - 0.5 * np.arange(25))
# Keep a kernel call below about a second and its samples in tens of megabytes.
CALL_WORK = 8_000_000
CALL_SAMPLES = 2_000_000
UNTRIED = -1
# Radians of the fastest phase per step, at most: zeros are counted by signs at the ends of steps.
LONGEST = 2.8


def solve(problem, method, rtol, judge):
    """Outputs (R, L) and status codes.

    `judge(points, results)` gives the outputs of the points, by name, and which of them deserve more effort.
    """
    adaptive = getattr(method, "ADAPTIVE", False)
    run, top = (_walk, len(TOLERANCES) - 1) if adaptive else (_chain, len(LADDER) - 1)
    effort = _first_tolerance(problem, rtol) if adaptive else _first_steps(problem, method, rtol)
    code = np.where(effort == UNTRIED, status.INVALID_PARAMETERS, status.OK)
    code[effort > top] = status.STEP_LIMIT
    points = np.nonzero(code == status.OK)
    results, reached = run(problem, method, points, effort[points])
    code[points] = np.where(reached, status.OK, status.STEP_LIMIT)
    outputs, late = judge(points, results)
    # From here on `left` counts places in `points` and `results`.
    left = np.nonzero(late & reached)[0]
    while (left := left[effort[points][left] + 2 <= top]).size:
        these = tuple(index[left] for index in points)
        effort[these] += 2
        new, reached = run(problem, method, these, effort[these])
        old_bar, new_bar = _bar(results[left]), _bar(new)
        better = reached & (new_bar < old_bar)
        new_outputs, late = judge(these, new)
        for name, values in outputs.items():
            values[left[better]] = new_outputs[name][better]
        results[left[better]] = new[better]
        # Truncation falls by a factor of 4 or more each time; where the bar does not halve, rounding rules.
        left = left[late & reached & (new_bar < 0.5 * old_bar)]
    return {name: _spread(values, points, code.shape) for name, values in outputs.items()}, code


def _spread(values, points, shape):
    """Values of the points in their places; NaN, or 0 for integers, elsewhere."""
    if values.size == np.prod(shape):
        return values.reshape(shape)
    whole = np.full(shape, np.nan if values.dtype.kind == "f" else 0, dtype=values.dtype)
    whole[points] = values
    return whole


def _bar(results):
    """One figure for the four bars; a point without a finite one has an infinite bar."""
    bar = results[..., 4:8].max(axis=-1)
    return np.where(np.isfinite(bar), bar, np.inf)


def _first_steps(problem, method, rtol):
    """The ladder's first step number that the method asks for; beyond the ladder where it has none; UNTRIED at NaN."""
    phase, distance = method.hill_density(rtol)
    density = np.maximum(max(phase, 1 / LONGEST) * problem.frequency, distance * problem.rate[:, None])
    steps = problem.span[:, None] * density
    return np.where(np.isnan(steps), UNTRIED, np.searchsorted(LADDER, steps))


def _first_tolerance(problem, rtol):
    first = int(np.searchsorted(-TOLERANCES, -max(0.01 * rtol, TOLERANCES[-1])))
    valid = np.isfinite(problem.span[:, None] * problem.frequency)
    return np.where(valid, first, UNTRIED)


def _walk(problem, method, points, effort):
    rows, lanes = points
    return problem.walk(rows, lanes, TOLERANCES[effort])


def _chain(problem, method, points, effort):
    """Points solved by fixed steps: those with the same number of steps together, in calls of bounded work."""
    rows, lanes = points
    out = np.empty((rows.size, 10))
    for level in np.nonzero(np.bincount(effort))[0]:
        steps = int(LADDER[level])
        chosen = np.nonzero(effort == level)[0]
        for part in _parts(rows[chosen], steps, len(method.NODES)):
            index = chosen[part]
            out[index] = _call(problem, method, rows[index], problem.p[rows[index], lanes[index]], steps)
    return out, np.ones(rows.size, bool)


def _parts(rows, steps, nodes):
    """Slices of the points (sorted by row), each one kernel call."""
    most = max(1, CALL_WORK // steps)
    most_rows = max(1, CALL_SAMPLES // (steps * nodes))
    order = np.concatenate([[0], np.cumsum(np.diff(rows) != 0)])
    first = 0
    while first < rows.size:
        last = min(first + most, int(np.searchsorted(order, order[first] + most_rows)))
        yield slice(first, last)
        first = last


def _call(problem, method, rows, p, steps):
    ends = np.append(np.nonzero(np.diff(rows))[0] + 1, rows.size)
    used = rows[ends - 1]
    nodes = np.array(method.NODES)
    samples = problem.sample(used, nodes, steps)
    out = np.empty((p.size, 10))
    method.hill_chain(samples, problem.c2, problem.span[used] / steps, p, ends, out)
    return out
