"""Method "auto" for flows on the cylinder: closed forms where they apply and keep their digits, point by point.

The rule is read off the true errors that `workflows/gyrostat_methods.py` maps (rtol = 1e-10). Of all initial states of
a system with b = 0 a closed form serves every one on that plane, with a median error of 4e-16 against 9e-15 of the
Taylor series and at a cost free of t. Next to double and triple roots (separatrices, folds) it serves 38 % of the
plane, the series 84 %; on (61), from conservative to stiff, 87 % and 100 %. The bars tell where: so `method`, the
Taylor series, is asked where no closed form answers or its bar misses rtol, and its answer is taken where its bar is no
wider. No third method is needed: dop853, rk4 or full alone serve 5 points of 4776.
"""

import numpy as np

from survey.kernels.along import EQUILIBRIUM, OK, UNTOLD
from survey.measures import cylinder
from survey.methods import closed


def trajectories(method, rows, times, rtol):
    """As `cylinder.trajectories`: in closed form, and by `method` where that has no answer or too wide a bar."""
    results = cylinder.trajectories(closed, rows, times, rtol)
    missed, untold = cylinder.missed(results, rtol), results[1] == UNTOLD
    if untold.any():
        missed |= untold
        results[0][untold] = np.nan
        results[2][untold & (results[2] == OK)] = closed.NO_CONVERGENCE
    return _completed(results, missed, lambda some, at: cylinder.trajectories(method, some, at, rtol), rows, times)


def abel(method, rows, targets, rtol):
    """As `cylinder.abel`, likewise."""
    results = cylinder.abel(closed, rows, targets, rtol)
    missed = cylinder.missed(results, rtol) & (results[-1] != EQUILIBRIUM)
    return _completed(results, missed, lambda some, at: cylinder.abel(method, some, at, rtol), rows, targets)


def _completed(results, missed, solve, rows, places):
    """`results` with those of `solve` put in where they are missed and `solve` does no worse."""
    some = missed.any(axis=1)
    if not some.any():
        return results
    others = solve(rows[some], np.where(missed[some], places[some], np.inf))
    old = [result[some] for result in results]
    take = missed[some] & (cylinder.badness(others) <= cylinder.badness(old))
    for result, held, new in zip(results, old, others, strict=True):
        held[take] = new[take]
        result[some] = held
    return results
