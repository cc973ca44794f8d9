"""The stability of a linear periodic system everywhere in cells of a map, and the area of each
verdict.

By the signs of functions that are analytic in the parameters (`survey.measures.sign_cells`); p is
the characteristic polynomial of M.

    no structure             p(1), (-1)^n p(-1), and the leading minors, but for the last, of Schur and Cohn's matrix
                             S = T T' - R R', T and R the lower triangular Toeplitz matrices of the
                             coefficients of p from its first and from its last one on
    symplectic, reversible   the leading minors of the moments sum_s (4 - s^2) s^(j+k) of the roots s = l + 1 / l
    symplectic               besides, those of J M + (J M)^T

All are positive if all multipliers are inside the unit circle (S > 0; two multipliers l and 1 / l,
or 1 / conj(l), take two from the rank of S, so that its last minor but one is 0 there), or if all s
are real, different and between -2 and 2. None is negative if these are inside or on the circle, or
between -2 and 2 or at these. So where one is negative, a multiplier is outside.

Where s meet, a minor of the moments is 0. A symplectic M leaves the form of J M + (J M)^T as it is,
so that motions are bounded, strongly, where this is definite: where all multipliers of one Krein
sign are on one half of the circle, as those of equal oscillators are. Where others of one Krein
sign meet and do no harm, the cells stay undecided.

Source: M. Marden, Geometry of Polynomials (1966), 43 (Schur-Cohn); F. R. Gantmacher, The Theory of
Matrices (1959), XV (moments); V. A. Yakubovich, V. M. Starzhinskii, Linear Differential Equations
with Periodic Coefficients (1975), III (invariant forms).
"""

from functools import partial

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures import sign_cells
from survey.measures.floquet import bifurcations, dense
from survey.measures.floquet.multipliers import (
    STABLE,
    UNDECIDED,
    UNSTABLE,
    symplectic_form,
)
from survey.measures.hill.cells import MOST, POINTS, Side, accuracy
from survey.measures.tasks import in_turn

OUTPUTS = ("monodromy",)
VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE}

__all__ = [
    "MOST",
    "OUTPUTS",
    "POINTS",
    "VERDICTS",
    "Side",
    "accuracy",
    "find",
    "keywords",
    "refusal",
]


def refusal(scene, point):
    """Why there are no cells on maps of the scene about this point, {parameter: value}, in words;
    None if there are.
    """
    if scene.FAMILY == "orbit":
        return "cells are available for linear systems, not for periodic orbits, which end at folds"
    if not hasattr(scene, "conserved"):
        return "cells are available only for systems whose matrix A(t, p) is given"
    n = len(scene.states)
    if n > dense.LARGEST:
        return f"cells are available for systems of up to {dense.LARGEST} states, not of {n}"
    if scene.conserved is not None:
        return "no cells are available for systems with CONSERVED: a multiplier is 1 everywhere"
    if scene.structure != "none" and n % 2:
        return f"no cells are available for {scene.structure} systems of an odd number of states"
    if not scene.is_analytic(point):
        return "cells need multipliers that are analytic in the parameters, but a branch of the code depends on one"
    return None


def keywords(scene):
    """Further arguments of `find` for the scene."""
    return {"structure": scene.structure, "states": len(scene.states)}


def find(solve, x, y, each=in_turn, report=None, structure="none", states=2):
    """The `hill.cells.Cells` of the Sides x and y of a system of this structure and so many states;
    other arguments as there.
    """
    minors = states if structure == "symplectic" and states > 2 else 0
    values = partial(_values, structure=structure, minors=minors)
    return sign_cells.find(solve, x, y, each, report, values, minors)


def _values(out, structure, minors):
    """The functions and their bounds (B, F, m, m)."""
    M, E = out["monodromy"], out["monodromy_error"].astype(float)
    shape, n = M.shape[:-2], M.shape[-1]
    M, E = (one.reshape(-1, n, n) for one in (M, E))
    number = minors + (n // 2 if structure != "none" else n + 1)
    values, bars = np.full((2, len(M), number), np.nan)
    good = np.flatnonzero(np.isfinite(M).all(axis=(1, 2)) & np.isfinite(E).all(axis=(1, 2)))
    if good.size:
        found = [margins(M[good], E[good], structure)]
        found += [_of_form(M[good], E[good])] if minors else []
        values[good], bars[good] = (
            np.concatenate(both, axis=1) for both in zip(*found, strict=True)
        )
    return tuple(np.moveaxis(one.reshape(*shape, -1), -1, 1) for one in (values, bars))


def margins(M, E, structure):
    """The functions (N, F) of M (N, n, n) known to within E, and their bounds."""
    n = M.shape[1]
    one = np.ones((len(M), M.shape[1]))
    if structure != "none":
        c, d = dense.coefficients(M, E, one, "reversible")
        return _minors(*_moments(c, d))
    (first, d_first), last = bifurcations.plus_one(M, E, False), bifurcations.minus_one(M, E, False)
    c, d = (np.concatenate([np.full((len(M), 1), k), own], axis=1) for k, own in
            zip((1.0, 0.0), dense.coefficients(M, E, one, structure), strict=True))  # fmt: skip
    minors = _minors(*_schur_cohn(c, d), most=n - 1)
    ends = ((-1.0) ** n * first, d_first), last
    return tuple(np.column_stack([*(end[k] for end in ends), minors[k]]) for k in (0, 1))


def _of_form(M, E):
    """The leading minors (N, n) of J M + (J M)^T, and their bounds."""
    J = symplectic_form(M.shape[1])
    Q, off = J @ M, abs(J) @ E
    Q = Q + np.swapaxes(Q, 1, 2)
    return _minors(Q, off + np.swapaxes(off, 1, 2) + EPS * abs(Q))


def _schur_cohn(c, d):
    """S (N, n, n) of the polynomials with the coefficients c (N, n + 1), known to within d, and its
    bounds.
    """
    n = c.shape[1] - 1
    S, E = np.zeros((2, len(c), n, n))
    for i in range(n):
        for j in range(n):
            for k in range(min(i, j) + 1):
                for sign, one, two in ((1.0, i - k, j - k), (-1.0, n - i + k, n - j + k)):
                    S[:, i, j] += sign * c[:, one] * c[:, two]
                    tall = abs(c[:, one] * c[:, two])
                    off = abs(c[:, one]) * d[:, two] + d[:, one] * (abs(c[:, two]) + d[:, two])
                    E[:, i, j] += off + 2 * (n + 1) * EPS * tall
    return S, E


def _moments(c, d):
    """The moments (N, m, m) of the roots of s^m + c_1 s^(m-1) + ..., c (N, m) known to within d,
    and their bounds.
    """
    m = c.shape[1]
    sums, bars = np.zeros((2, len(c), 2 * m + 1))
    sums[:, 0] = m
    for k in range(1, 2 * m + 1):
        # Newton's identities
        for j in range(1, min(k, m) + 1):
            other, off = (float(k), 0.0) if j == k else (sums[:, k - j], bars[:, k - j])
            sums[:, k] -= c[:, j - 1] * other
            bars[:, k] += abs(c[:, j - 1]) * off + d[:, j - 1] * (abs(other) + off)
            bars[:, k] += 2 * (m + 1) * EPS * abs(c[:, j - 1] * other)
    j, k = np.indices((m, m))
    low, high = sums[:, j + k], sums[:, j + k + 2]
    return 4.0 * low - high, 4.0 * bars[:, j + k] + bars[:, j + k + 2] + 4 * EPS * (
        4.0 * abs(low) + abs(high)
    )


def _minors(A, E, most=None):
    """The leading minors (N, most) of A (N, n, n), all by default, and their bounds."""
    count = A.shape[1] if most is None else most
    found = [
        bifurcations.determinant(A[:, :k, :k], E[:, :k, :k], False) for k in range(1, count + 1)
    ]
    return tuple(
        np.stack([one[k] for one in found], axis=1) if found else np.zeros((len(A), 0))
        for k in (0, 1)
    )
