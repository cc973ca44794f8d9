"""Outputs of a nutation that are computed only where they are named: growth, twist, constants, the
rotation at t.
"""

import numpy as np

from survey import methods
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import records as rc
from survey.measures.nutation import rotation, separatrix, twist
from survey.measures.nutation import wells as nutation
from survey.modules import load
from survey.status import OK

_RTOL = 1e-13


def solve(given, valid, times, out, request):
    """{name: values, name_error: bars} of those that `request` wants, in the shapes of `out` where
    its status is ok.

    given: the parameters (n) of states in the order of the scene's, or of scaled integrals; times
    (n, m) or None.
    """
    wanted = request.variables
    found = {}
    with np.errstate(all="ignore"):
        if "saddle_growth" in wanted:
            found["saddle_growth"] = _growth(given, request)
        if "l" in given:
            found |= _of_integrals(given, valid, int(request.options["sign"]), wanted)
        else:
            found |= _of_states(given, valid, times, out, wanted)
        if not found:
            return {}
        good = out["status"] == OK
        return {
            key: np.where(_shaped(good, part), _shaped(part, good), np.nan)
            for name, pair in found.items()
            for key, part in zip((name, f"{name}_error"), pair, strict=True)
        }


def _shaped(values, like):
    """`values` (n, ...) with as many dimensions as `like` has, if that is more."""
    return values.reshape(values.shape + (1,) * (like.ndim - values.ndim))


def _growth(given, request):
    if "l" in given:
        return separatrix.growth(given["alpha"], given["beta"], np.float64(request.options["sign"]))
    k = given["epsilon"] * given["A"] * (given["A"] - given["C"])
    size = np.sqrt(abs(k))
    value, bar = separatrix.growth(given["p_phi"] / size, given["p_psi"] / size, np.sign(k))
    unit = size / given["A"]
    return value * unit, (bar + 8 * ROUNDOFF * value) * unit


def _of_integrals(given, valid, sign, wanted):
    if wanted.isdisjoint(twist.NAMES):
        return {}
    points = np.column_stack([given["l"], given["alpha"], given["beta"]])
    points[~valid] = 1.0
    rows, kinds, _count, _heights = nutation.of_integrals(points, sign)
    rows = np.ascontiguousarray(rows.reshape(-1, rows.shape[-1]))
    ratio = np.repeat(np.where(valid, given["ratio"], 1.0), 2)
    found = twist.determinants(
        rows, kinds.ravel(), (np.ones_like(ratio), ratio, np.repeat(points[:, rc.ALPHA], 2)), wanted
    )
    return {name: tuple(x.reshape(-1, 1, 2) for x in pair) for name, pair in found.items()}


def _of_states(given, valid, times, out, wanted):
    phased, moving = {*rotation.ENERGIES, *rotation.PHASES} & wanted, rotation.AT_T.keys() & wanted
    if wanted.isdisjoint(twist.NAMES) and not phased and not moving:
        return {}
    points = np.column_stack(list(given.values()))
    points[~valid] = nutation.HARMLESS
    rows, kinds, _count, _heights, starts = nutation.of_states(points)
    sizes = points[:, rc.SIZE_A], points[:, rc.SIZE_C], points[:, rc.P_PHI]
    found = twist.determinants(rows, kinds, sizes, wanted)
    if phased or moving:
        periods, kinds = nutation.periods(load(methods, "agm", "method"), rows, kinds, _RTOL)
    if phased:
        constants = rotation.constants(rows, kinds, starts, periods, points)
        found |= {name: constants[name] for name in phased}
    if moving:
        at_t = rotation.at_times(rows, kinds, starts, periods, times, points, out)
        found |= {name: at_t[name] for name in moving}
    return found
