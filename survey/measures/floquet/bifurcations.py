"""Functions of the monodromy matrix M whose zeros are where multipliers reach the unit circle or
leave it.

    plus_one        det(M - 1)
    minus_one       det(M + 1)
    neimark_sacker  det(C - 1), C the second compound matrix of M: the product of l_i l_j - 1 over all pairs i < j
    collision       of symplectic and reversible systems: the discriminant of the polynomial whose roots are the s =
                    l + 1 / l, as the determinant of their moments sum_s T_j(s / 2) T_k(s / 2)

All are analytic in the parameters, with simple zeros as a rule. Each is given but for a positive
factor, with an error bound that contains that of M. det(C - 1) is also 0 where two real multipliers
are l and 1 / l, and the discriminant where two s meet beyond -2 and 2: `passing` tells these apart.

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory (2004), 10.2; V. A. Yakubovich, V.
M. Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975), III.
"""

import numpy as np
from scipy.linalg import svd

from survey.kernels.math.roundoff import EPS
from survey.measures.floquet import monodromy
from survey.measures.floquet.multipliers import (
    COLLISION,
    MINUS_ONE,
    NEIMARK_SACKER,
    PLUS_ONE,
    Discs,
)

CLOSE = 1e-2  # far more than two s differ, next to a collision, by the error bounds of M
CHUNK = 2_000_000  # entries of matrices that are treated together
BY_GESDD = 36  # rows of a matrix


def functions(n, structure):
    """{class: function(M, E) -> (values (N), error bounds (N))} of systems of n states."""
    found = {PLUS_ONE: plus_one, MINUS_ONE: minus_one}
    if structure == "none":
        return found | ({NEIMARK_SACKER: neimark_sacker} if n > 1 else {})
    return found | ({COLLISION: collision} if n > 3 else {})


def plus_one(M, E, relative=True):
    """det(M - 1), of M (N, n, n) known to within E; `relative`: see `determinant`."""
    return determinant(*_shifted(M, E, -1.0), relative)


def minus_one(M, E, relative=True):
    """det(M + 1)."""
    return determinant(*_shifted(M, E, 1.0), relative)


def neimark_sacker(M, E):
    """det(C - 1)."""
    one, two = np.triu_indices(M.shape[1], 1)
    rows, columns = (one[:, None], two[:, None]), (one, two)

    def minors(chunk, bars):
        (a, b), (c, d) = ([chunk[:, row, column] for column in columns] for row in rows)
        (ea, eb), (ec, ed) = ([bars[:, row, column] for column in columns] for row in rows)
        with np.errstate(all="ignore"):
            bar = abs(a) * ed + abs(d) * ea + ea * ed + abs(b) * ec + abs(c) * eb + eb * ec
            return a * d - b * c, bar + EPS * (abs(a * d) + abs(b * c))

    size = max(1, CHUNK // one.size**2)
    parts = [
        determinant(*_shifted(*minors(M[i : i + size], E[i : i + size]), -1.0))
        for i in range(0, len(M), size)
    ]
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def collision(M, E):
    """The discriminant."""
    n, m = M.shape[1], M.shape[1] // 2
    power = np.broadcast_to(np.eye(n), M.shape)
    bar = np.zeros_like(M)
    traces, bars = np.full((2, 2 * m - 1, len(M)), float(2 * m))
    bars[0] = 0.0
    for k in range(1, 2 * m - 1):
        with np.errstate(all="ignore"):
            bar = abs(power) @ (E + n * EPS * abs(M)) + bar @ (abs(M) + E)
            power = power @ M
        # an odd number of states leaves one multiplier 1
        traces[k] = np.trace(power, axis1=1, axis2=2) - n % 2
        bars[k] = np.trace(bar, axis1=1, axis2=2) + n * EPS * np.trace(abs(power), axis1=1, axis2=2)
    j, k = np.indices((m, m))
    moments, doubt = (np.moveaxis(t[j + k] + t[abs(j - k)], 2, 0) for t in (traces, bars))
    return determinant(moments, doubt + EPS * abs(moments))


def _shifted(A, E, by):
    """A + by times the identity, and its bounds."""
    one = np.eye(A.shape[1])
    with np.errstate(all="ignore"):
        return A + by * one, E + EPS * (abs(A) + 1.0) * one


def determinant(A, E, relative=True):
    """det A, over the square root of det(1 + A^T A) if `relative`, and its bound, of A (N, n, n)
    known to within E.

    With A = U S V^T within R, entries of U^T (E + R) V are moduli B at most, and the determinant of S + G, |G| <= B,
    differs from the product of the s_i by at most prod(s_i + sum_j B_ij) - prod s_i, as a permanent.
    """
    value, bar = np.full((2, len(A)), np.nan)
    n = A.shape[1]
    with np.errstate(all="ignore"):
        # a smooth one: that of the balanced A would jump
        log_det = (
            np.linalg.slogdet(np.eye(n) + np.swapaxes(A, 1, 2) @ A)[1]
            if relative
            else np.zeros(len(A))
        )
        size = np.exp(log_det / (2 * n))
        scale = monodromy.balanced(abs(A))
        A, E = (X * scale[:, None, :] / scale[:, :, None] for X in (A, E))
        good = np.isfinite(A).all(axis=(1, 2)) & np.isfinite(E).all(axis=(1, 2))
        A, E, size = A[good], E[good], size[good]
        U, s, V = _svd(A)
        E = E + abs(A - (U * s[:, None, :]) @ V) + n * EPS * (abs(U) * s[:, None, :]) @ abs(V)
        # U and V are orthogonal but for rounding
        B = (1 + 1e-12) * (np.swapaxes(abs(U), 1, 2) @ E @ np.swapaxes(abs(V), 1, 2)).sum(axis=2)
        product, off = np.ones((2, len(A)))
        off[:] = 0.0
        for k in range(n):
            off = (off * (s[:, k] + B[:, k]) + product * B[:, k]) / size
            product *= s[:, k] / size
        value[good] = product * np.sign(np.linalg.det(U) * np.linalg.det(V))
        bar[good] = off * (1 + 1e-12) + 8 * n * EPS * product
    return value, bar


def _svd(A):
    """np.linalg.svd of A (N, n, n). Of larger ones LAPACK's gesdd starts threads, which take up to a
    hundred times the time of the work where cores are busy; gesvd starts none.
    """
    if A.shape[1] <= BY_GESDD or not len(A):
        return np.linalg.svd(A)
    each = (svd(one, lapack_driver="gesvd", check_finite=False) for one in A)
    return tuple(np.stack(part) for part in zip(*each, strict=True))


def _distances(s, some):
    """Between the s (N, n) of `some` multipliers (N, n); infinite elsewhere."""
    return np.where(
        some[:, :, None] & some[:, None, :] & ~np.eye(s.shape[1], dtype=bool),
        abs(s[:, :, None] - s[:, None, :]),
        np.inf,
    )


def passing(M, E, kind, structure):
    """What passes at points (N) of a curve of the class `kind`: (does it?, angle, its bound,
    outside).

    The angle is the argument of the multiplier, from 0 to pi, and `outside` the number of the
    others that are certainly outside the unit circle, NaN where the error bounds allow several.
    """
    discs = Discs(monodromy.Matrices.plain(M, E))
    rows = np.arange(len(M))
    centre, bars, n = discs.centre, discs.bars, M.shape[1]
    own = np.zeros(centre.shape, bool)
    paired = structure != "none"
    with np.errstate(all="ignore"):
        if kind in (PLUS_ONE, MINUS_ONE):
            goal = 1.0 if kind == PLUS_ONE else -1.0
            order = np.argsort(abs(centre - goal), axis=1)[:, : 2 if paired else 1]
            own[rows[:, None], order] = True
            sure = np.ones(len(M), bool)
            angle = np.full(len(M), np.pi * (goal < 0))
            bar = np.zeros(len(M))
            bar += EPS * angle
        else:
            upper = centre.imag > bars
            if kind == NEIMARK_SACKER:
                first = second = np.where(upper, abs(abs(centre) - 1), np.inf).argmin(axis=1)
                # the product that vanishes is that of the pair of conjugates, not one of real
                # multipliers
                left = abs(centre[:, :, None] * centre[:, None, :] - 1)
                left[:, np.arange(n), np.arange(n)] = np.inf
                sure = (
                    abs(abs(centre[rows, first]) ** 2 - 1) <= 1.01 * left.min(axis=(1, 2)) + 4 * EPS
                )
            else:
                real = (abs(centre.imag) <= bars) & (abs(centre) > 1.0)
                s = centre + 1.0 / centre
                apart, other = (_distances(s, some) for some in (upper, real))
                first, second = np.unravel_index(apart.reshape(len(M), -1).argmin(axis=1), (n, n))
                # it is not two beyond -2 and 2 that meet, as real ones or as conjugates
                sure = (apart[rows, first, second] < CLOSE) & (
                    apart[rows, first, second] < other.min(axis=(1, 2))
                )
                sure &= abs(s[rows, first] + s[rows, second]) < 4.0
            sure &= upper[rows, first] & upper[rows, second]
            angle = np.angle(centre[rows, first] + centre[rows, second])
            # |arg z - arg c| <= asin(r / |c|) <= (pi / 2) r / |c|
            bar = (
                1.6 * np.maximum(*(bars[rows, k] / abs(centre[rows, k]) for k in (first, second)))
                + 4 * EPS
            )
            for k in (first, second):
                mirror = abs(centre - centre[rows, k].conj()[:, None]).argmin(axis=1)
                own[rows, k], own[rows, mirror] = True, True
        low, high = discs.moduli
        least = np.where(discs.together, low[:, None, :], np.inf).min(axis=2)
        most = np.where(discs.together, high[:, None, :], 0.0).max(axis=2)
        beyond, within = least > 1.0, most < 1.0
        if paired:
            within |= discs.on_circle
        known = (beyond | within | own).all(axis=1)
    return sure, angle, bar, np.where(known, (beyond & ~own).sum(axis=1), np.nan)
