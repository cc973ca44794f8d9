"""Method "auto" for flows on the cylinder: closed forms where they apply and keep their digits,
point by point.

The rule is read off the true errors that `survey failures gyrostat` maps (rtol = 1e-10). On the
plane of initial states of a system with b = 0 a closed form serves every one, with a median error
of 4e-16, against 9e-15 of the Taylor series, and at a cost that does not depend on t. Next to
double and triple roots (separatrices, folds) it serves 38 % of the plane, the series 84 %; on (61),
from conservative to stiff, 87 % and 100 %. The error bounds show where: so `method`, the Taylor
series, is asked where no closed form answers or its bound misses rtol, and its answer is taken
where its bound is no wider. dop853, rk4 or full alone serve 5 points of 4776. Points that still
miss rtol are solved with more digits.
"""

from functools import partial

import numpy as np

from survey.kernels.cylinder import closed as forms
from survey.kernels.cylinder import lockstep_pairs, taylor_double
from survey.kernels.cylinder.steps import (
    EQUILIBRIUM,
    NO_CONVERGENCE,
    OK,
    SEPARATRIX,
    TURNING,
    UNDETERMINED,
)
from survey.measures.cylinder import solution
from survey.methods import closed

SAMPLE = 64  # rows that are looked at first: as a rule, a closed form serves all or none
FINEST = 3e-16  # no float64 can be known better
# Methods for what float64 leaves open, in order: many motions at once to 23 digits, then one by one to 30.
IN_TIME, IN_PHI = (lockstep_pairs, taylor_double), (taylor_double,)


def trajectories(method, rows, times, rtol, counted=True):
    """As `solution.trajectories`: in closed form, and by `method` where that has no answer or too
    wide a bound.
    """
    return _by_rows(rows, times, partial(_trajectories, method, rtol, counted))


def abel(method, rows, targets, rtol, before=False, timed=True):
    """As `solution.abel`, likewise."""
    return _by_rows(rows, targets, partial(_abel, method, rtol, before, timed))


def _by_rows(rows, columns, solve):
    """`solve(rows, columns, served)` for those that a closed form serves and for the others."""
    # the few others, if any, are solved as what it misses
    if _served(rows[:: 1 + len(rows) // SAMPLE]).all():
        return solve(rows, columns, True)
    served = _served(rows)
    if not served.any():
        return solve(rows, columns, False)
    parts = [
        solve(rows[pick], columns[pick], known)
        for pick, known in ((served, True), (~served, False))
    ]
    # in the types of the former part, in which turnings are counted
    results = tuple(np.empty((len(rows), *result.shape[1:]), result.dtype) for result in parts[0])
    for pick, part in zip((served, ~served), parts, strict=True):
        for result, new in zip(results, part, strict=True):
            result[pick] = new
    return results


def _served(rows):
    """For which rows does a closed form apply?"""
    served = np.empty(len(rows), dtype=np.bool_)
    forms.served(np.ascontiguousarray(rows, dtype=float), served)
    return served


def _trajectories(method, rtol, counted, rows, times, served):
    # where a closed form serves it counts them too
    counted |= served
    solve = partial(solution.trajectories, rtol=rtol, counted=counted)
    if not served:
        results, met = solution.trajectories_and_met(method, rows, times, rtol, counted)
        if met and not counted and rtol >= FINEST:
            return results
        return _with_more_digits(results, solve, IN_TIME, rtol, rows, times, counted)
    results = solve(closed, rows, times)
    missed = solution.missed(results, rtol)
    floats, turnings, status = results
    uncounted = turnings == UNDETERMINED
    if uncounted.any():
        missed |= uncounted
        floats[uncounted] = np.nan
        status[uncounted & (status == OK)] = closed.NO_CONVERGENCE
    return _further(solve, method, IN_TIME, rtol, results, missed, rows, times)


def _abel(method, rtol, before, timed, rows, targets, served):
    # where a closed form serves it gives times too
    solve = partial(solution.abel, rtol=rtol, before=before, timed=timed or served)
    if not served:
        results, met = solution.abel_and_met(method, rows, targets, rtol, before, timed=timed)
        if met and rtol >= FINEST:
            return results
        return _with_more_digits(results, solve, IN_PHI, rtol, rows, targets, timed)
    results = solve(closed, rows, targets)
    missed = solution.missed(results, rtol) & (results[-1] != EQUILIBRIUM)
    return _further(solve, method, IN_PHI, rtol, results, missed, rows, targets)


def _further(solve, method, finer, rtol, results, missed, rows, columns):
    """`results` of closed forms; where they are missed those of `method`, and then of more digits."""
    some = missed.any(axis=1)
    if not some.any():
        return results
    rows, columns, own = rows[some], columns[some], tuple(result[some] for result in results)
    own = _completed(own, missed[some], partial(solve, method), rows, columns)
    own = _with_more_digits(own, solve, finer, rtol, rows, columns)
    for result, new in zip(results, own, strict=True):
        result[some] = new
    return results


def _with_more_digits(results, solve, finer, rtol, rows, columns, whole=True):
    """`results`, with those of one method of more digits after the other where they are left open."""
    for method in finer:
        left = _left_open(results, rtol, whole)
        if not left.any():
            break
        last = method is finer[-1]
        results = _completed(results, left, partial(solve, method), rows, columns, last)
    return results


def _left_open(results, rtol, whole=True):
    """The points that more digits may still answer: those that miss rtol, unless by
    too many steps or an overflow, and those that have turned an undetermined number of times. Unless
    `whole`, neither these nor times over phi are asked for.
    """
    status, in_time = results[-1], len(results) == 3
    missed = solution.missed(results, max(rtol, FINEST), whole or in_time)
    if status.any():
        missed &= np.isin(status, (OK, TURNING, NO_CONVERGENCE, SEPARATRIX))
    if in_time and whole:
        _floats, turnings, _status = results
        missed |= (turnings == UNDETERMINED) & (status == OK)
    return missed


def _completed(results, missed, solve, rows, columns, last=True):
    """`results`, with those of `solve` where they are `missed` and `solve` does no worse; unless it is
    the `last`, only where it has an answer.
    """
    if not missed.any():
        return results
    some = missed.any(axis=1)
    others = solve(rows[some], np.where(missed[some], columns[some], np.inf))
    old = [result[some] for result in results]
    badness = solution.badness(others)
    take = missed[some] & (badness <= solution.badness(old)) & (last | (badness < 1e300))
    if len(others) == 3:  # turnings that either knows are certain
        (_floats, known, _status), (_others, turnings, _other_status) = old, others
        np.copyto(turnings, known, where=turnings == UNDETERMINED)
    for result, held, new in zip(results, old, others, strict=True):
        held[take] = new[take]
        result[some] = held
    return results
