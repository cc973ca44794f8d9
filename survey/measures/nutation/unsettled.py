"""Which nutations are solved again with more digits (`multiprecision`): open verdicts, and bounds
that miss rtol.
"""

import numpy as np

from survey.kernels.nutation import wells as nu
from survey.measures.nutation import derived, multiprecision, wells
from survey.status import NO_CONVERGENCE, OK, OVERFLOW

# float64 reaches this, relative to 1 + |value|, at every point that is not ill conditioned
ILL = 1e-13
DISTANCE = "separatrix_distance"


def settle(out, points, solver, valid, request, known=False):
    """Solve points again in place, as `solver` of `multiprecision` does, where that is needed.

    points: a tuple of an array (n) for each parameter.

    known: only motions whose period is known already. For methods other than `auto`, only distances
    from a separatrix whose existence is in doubt.
    """
    doubt = np.isinf(out[f"{DISTANCE}_error"]) if DISTANCE in out else np.zeros(valid.size, bool)
    unsettled = valid & doubt
    if request.method == "auto":
        unsettled |= valid & _open(out, request)
    if known:
        unsettled &= (out["status"] == OK) & (out["verdict"] >= nu.NUTATION)
    for i in np.flatnonzero(unsettled):
        point = [values[i] for values in points]
        _solve(out, i, point, solver, request.method == "auto")
    if DISTANCE in out:
        out[f"{DISTANCE}_error"][np.isnan(out[DISTANCE])] = np.nan


def _open(out, request):
    """Where a verdict is open, or an error bound of an output that is asked for misses rtol."""
    status, verdict = out["status"], out["verdict"]
    found = (status == NO_CONVERGENCE) | (status == OVERFLOW)
    found |= (status == OK) & (verdict != nu.NUTATION) & (verdict != nu.PASSAGE)
    rtol = max(request.rtol, ILL)
    for name in derived.needed(request.variables) & {*wells.NAMES, DISTANCE} & out.keys():
        bars = out[f"{name}_error"]
        if bars.max(initial=0.0) <= rtol:  # as a rule
            continue
        with np.errstate(invalid="ignore"):
            missed = bars > rtol * (1.0 + np.abs(out[name]))
        found |= missed.reshape(len(missed), -1).any(axis=1)
    return found


def _solve(out, i, point, solver, everything):
    try:
        answer = solver(*map(float, point))
    except multiprecision.NoMotion:
        answer = None
        if everything:
            _store(out, i, [{}], wells.NO_MOTION, wells.UNDECIDED, 0)
    if answer is None:
        return
    passes, number, found = answer
    for name in (DISTANCE, f"{DISTANCE}_error"):
        if name in out:
            out[name][i] = found[0].get(name, np.nan)
    if everything:
        _store(out, i, found, OK, nu.PASSAGE if passes else nu.NUTATION, number)


def _store(out, i, found, status, verdict, number):
    """One point's answers, of each of its wells."""
    numbers = [value for well in found for value in well.values()]
    out["status"][i] = status if np.isfinite(numbers).all() else OVERFLOW
    out["verdict"][i] = verdict if out["status"][i] == OK else wells.UNDECIDED
    out["wells"][i] = number
    for name in {*wells.NAMES, *(f"{name}_error" for name in wells.NAMES)} & out.keys():
        row = out[name][i : i + 1].reshape(-1)
        row[:] = np.nan
        if out["status"][i] == OK:
            row[: len(found)] = [well[name] for well in found]
