"""The normal form beyond order 6, by Lie series, and for how long motions stay
(`effective_stability`).

`c8` and `c10` are the coefficients of the monomials of four and five actions. At a resonance of
order 8 or 10 or less a generator's divisor vanishes: beside it they grow, and where it is too small
to divide by they are not given.
"""

import numpy as np

from survey import measures
from survey.kernels.libration.closed_forms import MU_R
from survey.measures.libration import effective_stability
from survey.methods import lie, lie_double

ORDERS = (8, 10)
# the second where the first misses the accuracy; closed forms end at order 6
SERIES = (lie, lie_double)
LARGEST_BAR = 3e38  # a file keeps bars as float32; where one is larger the coefficient is not given
BLOCK = 64  # mass ratios whose remainders are in memory at a time


def labels(order):
    """Names of the monomials of this order, such as "400"."""
    return ["".join(map(str, k)) for k in lie.labels(order) if 2 * sum(k) == order]


def solve(mu, periods, order, method, rtol):
    """{output: values} at mu (N) for motions of `periods` (N) periods of the primaries.

    `method` is the name of a method, or "auto", as in `normal_form`; closed forms have none of
    these outputs, so for their methods all is as with "auto".
    """
    own = None if method == "auto" else measures.method(method)
    series = (own,) if own in SERIES else SERIES
    return _solve(_coefficients, (mu,), order, series, rtol) | _solve(
        _radius, (mu, periods), order, series, rtol
    )


def _solve(answers, points, order, series, rtol):
    """What `answers` gives at the points, again by the next of `series` where an error bound misses rtol."""
    out = answers(*points, order, series[0])
    for finer in series[1:]:
        open_ = _missed(out, rtol) & (points[0] < MU_R[0])
        if open_.any():
            for name, values in answers(
                *(values[open_] for values in points), order, finer
            ).items():
                out[name][open_] = values
    return out


def _missed(out, rtol):
    """Points (N) where an error bound exceeds rtol (1 + |value|), or nothing is known."""
    wide = [
        ~(bar <= rtol * (1 + abs(out[name.removesuffix("_error")])))
        for name, bar in out.items()
        if "_error" in name
    ]
    return np.any([w if w.ndim == 1 else w.any(axis=1) for w in wide], axis=0)


def _coefficients(mu, order, series):
    """Coefficients with their bounds (N, monomials)."""
    each, where = np.unique(mu, return_inverse=True)
    (values, bars) = series.coefficients(each, order)
    out = {}
    known = (bars < LARGEST_BAR) & np.isfinite(values)
    values, bars = np.where(known, values, np.nan), np.where(known, bars, np.nan)
    for n in ORDERS:
        rows = [i for i, k in enumerate(series.labels(order)) if 2 * sum(k) == n]
        if rows:
            out[f"c{n}"], out[f"c{n}_error"] = values[rows].T[where], bars[rows].T[where]
    return out


def _radius(mu, periods, order, series):
    """The radius of effective stability with its bound, and the order of normalisation that gives it (N)."""
    each, where = np.unique(mu, return_inverse=True)
    parts = [series.remainders(each[i : i + BLOCK], order) for i in range(0, each.size, BLOCK)]
    norms = {
        key: np.concatenate([part[key] for part in parts], axis=-1)[..., where] for key in parts[0]
    }
    radius, bar, r = effective_stability.radius(norms, 2.0 * np.pi * periods)
    return {
        "effective_radius": radius,
        "effective_radius_error": bar,
        "effective_order": r.astype(np.int32),
    }
