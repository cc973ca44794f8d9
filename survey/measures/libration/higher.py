"""The normal form beyond order 6, by Lie series, and for how long motions stay (`effective_stability`).

`c8` and `c10` are the coefficients of the monomials of four and five actions. At a resonance of order 8 or 10 or less a
generator's divisor vanishes: beside it they grow, and where a divisor is below 1e-12 they are not given.
"""

import numpy as np

from survey.measures.libration import effective_stability
from survey.methods import lie

ORDERS = (8, 10)
BLOCK = 64  # mass ratios whose remainders are in memory at a time


def labels(order):
    """Names of the monomials of this order, such as "400"."""
    return ["".join(map(str, k)) for k in lie.labels(order) if 2 * sum(k) == order]


def solve(mu, periods, order):
    """{output: values} at mu (N) for motions of `periods` (N) periods of the primaries."""
    each, where = np.unique(mu, return_inverse=True)
    parts = [_block(each[i : i + BLOCK], order) for i in range(0, each.size, BLOCK)]
    found = {name: np.concatenate([part[name] for part in parts])[where] for name in parts[0] if name != "norms"}
    keys = parts[0]["norms"]
    norms = {key: np.concatenate([part["norms"][key] for part in parts], axis=-1)[..., where] for key in keys}
    radius, bar, r = effective_stability.radius(norms, 2.0 * np.pi * periods)
    return found | {"effective_radius": radius, "effective_radius_error": bar, "effective_order": r.astype(np.int32)}


def _block(mu, order):
    """Coefficients with their bounds (N, monomials), and the norms of the remainders."""
    names, out = lie.labels(order), {"norms": lie.remainders(mu, order)}
    values, bars = lie.coefficients(mu, order)
    known = np.isfinite(values) & np.isfinite(bars)
    for n in ORDERS:
        rows = [i for i, k in enumerate(names) if 2 * sum(k) == n]
        if rows:
            out[f"c{n}"] = np.where(known, values, np.nan)[rows].T
            out[f"c{n}_error"] = np.where(known, bars, np.nan)[rows].T
    return out
