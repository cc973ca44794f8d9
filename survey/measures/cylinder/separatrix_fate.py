"""Fates of motions that start on a separatrix, as exactly as their parameters are given (see
`separatrix`).

On a stable branch the motion tends to its saddle. On an unstable one it ends where that branch
does, which is followed from its saddle as a portrait follows it (`destinations`); without
Barnett-London effect that is a saddle again.
"""

import math

import numpy as np

from survey.kernels.cylinder import branches
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.steps import SEPARATRIX
from survey.measures.cylinder import destinations, fate, separatrix
from survey.measures.cylinder.separatrices import TWO_PI, Level, far_end
from survey.status import OK

SADDLE = 1  # as in the verdicts of scenes/gyrostat.py


def solve(method, rows, rtol, stable, left):
    """({output: values (N)}, HEADS (N, HEADS)) for rows that start on a branch (see `separatrix`)."""
    starts = separatrix.Starts(None, rows, stable, left)
    result = fate.empty(len(rows), OK)
    result["status"][:] = starts.status
    ends = {}
    for i in np.flatnonzero(starts.status == OK):
        key = (*rows[i, : rc.SIX].tolist(), starts.heads[i, separatrix.SADDLE])
        if not stable and key not in ends:
            ends[key] = _end(method, rows[i, : rc.SIX], key[-1], rtol, left)
        if stable:
            _at_saddle(
                result,
                i,
                starts.heads[i, separatrix.SADDLE],
                starts.heads[i, separatrix.SADDLE_BAR],
                0,
            )
        else:
            _written(result, i, rows[i, rc.PHI0], *ends[key], left)
    return result, starts.heads


def _at_saddle(result, i, angle, bar, turnings):
    """The motion tends to a saddle, the next on its way or that from which it came."""
    result["verdict"][i], result["turnings"][i], result["net_turns"][i] = SADDLE, turnings, 0
    result["limit_phi"][i], result["limit_phi_error"][i] = angle % TWO_PI, bar + 1e-15


def _end(method, six, angle, rtol, left):
    """(Skeleton, row of the saddle, row of the fate or None, row of the saddle that is reached or None)."""
    s = fate.remembered(method, six)
    saddles = np.flatnonzero(s.equilibria[:, eq.KIND] == eq.SADDLE)
    if not len(saddles):
        return s, None, None, None
    off = np.abs(np.sin(0.5 * (s.equilibria[saddles, eq.ANGLE] - angle)))
    at = saddles[np.argmin(off)]
    if off.min() > 1e-6:  # it is degenerate
        return s, None, None, None
    if s.stratum == fate.I1:
        reached = destinations.level_end(s, at, -1.0 if left else 1.0)
        return s, at, None, reached if reached >= 0 else None
    starts = np.zeros((2 * len(saddles), rc.START))
    branches.of_saddles(s.p, s.equilibria, starts)
    own = starts[2 * int(np.argmin(off)) + (0 if left else 1)]
    return s, at, fate.followed(method, s, own[None], rtol)[0], None


def _written(result, i, phi0, s, at, found, reached, left):
    """Write where the unstable branch of the saddle `at` ends."""
    result["verdict"][i], result["status"][i] = kf.UNDECIDED, SEPARATRIX
    if reached is not None:
        result["status"][i] = OK
        turns = far_end(Level(s.p, s.equilibria[at]), s, -1.0 if left else 1.0)[1]
        _at_saddle(
            result, i, s.equilibria[reached, eq.ANGLE], s.equilibria[reached, eq.BAR], int(turns)
        )
    elif found is not None:
        for name, column in fate.COLUMNS_OF.items():
            result[name][i] = found[column]
        fate.limits(s, found, result, i)
        saddle = s.equilibria[at, eq.ANGLE]
        copy = math.ceil((phi0 - saddle) / TWO_PI) if left else math.floor((phi0 - saddle) / TWO_PI)
        fate.wind(s, found[None], np.array([phi0 - TWO_PI * copy]), result, np.array([i]))
