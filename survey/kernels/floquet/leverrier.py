"""Multipliers, and what follows from them, of many matrices by the coefficients of their
characteristic polynomials.

With B_0 = 1, c_k = -tr(M B_(k-1)) / k and B_k = M B_(k-1) + c_k (Leverrier, Faddeev); an error dM of
M changes c_k by the mean of -tr(B_(k-1) dM) on the way from M to M + dM. All errors are bounded by
sums of positive terms. `characteristic` answers from the coefficients and their bounds; what it
leaves open, as where multipliers nearly meet, or rounding beside huge ones hides the small, is
`missed`: that takes eigenvectors, which cost ten times as much.

Source: D. K. Faddeev, V. N. Faddeeva, Computational Methods of Linear Algebra (1963), 47.
"""

import math

import numpy as np

from survey.kernels.floquet.characteristic import LANES
from survey.kernels.floquet.steps import copy
from survey.kernels.jit import kernel, part
from survey.kernels.math.roundoff import EPS


@kernel
def fill_matrices(M, E, det, change, forms, paired, c, bars, points):
    """Fill the coefficients that `characteristic.answer` takes of N points from M (N, n, n), known
    within E; det (2, N) or (2, 0): its determinant, and to within what it is known.

    Row j of change (m + 1, m + 1), m = n / 2, and of forms (m, m): l^j + l^-j (1 for j = 0) as a
    polynomial of s = l + 1 / l, from the constant term on. Without `forms`, of size (0, 0), there
    are no Krein signs.
    """
    N, n = M.shape[:2]
    m, of_forms, K = n // 2, len(forms) > 0, c.shape[1]
    d = m if paired else n
    squares, sums, powers = np.empty((7, n, n)), np.empty((5, n + 1)), np.empty((0, n, n))
    ones, others, other_bars = np.ones(n), np.zeros(n + 1), np.full(n + 1, math.inf)
    for b in range(len(c)):
        own, own_bars, count = c[b], bars[b], min(LANES, N - b * LANES)
        for lane in range(LANES):
            p = b * LANES + lane
            if lane >= count:
                points[b, lane] = -1
                for k in range(K):
                    own[k, lane], own_bars[k, lane] = own[k, 0], own_bars[k, 0]
                continue
            points[b, lane] = p
            _leverrier(M[p], E[p], ones, others, other_bars, 0.0, powers, squares, sums)
            if paired:
                _in_sums(sums[0], sums[2], m, change, own, own_bars, 0, lane)
                if of_forms:
                    _in_sums(sums[3], sums[4], m, forms, own, own_bars, d, lane)
                if not _palindromic(sums[0], sums[2]):
                    for k in range(K):
                        own_bars[k, lane] = math.inf
            else:
                for k in range(n):
                    own[k, lane], own_bars[k, lane] = sums[0, k + 1], sums[2, k + 1]
                if det.shape[1] and det[1, p] < own_bars[n - 1, lane]:
                    own[n - 1, lane] = -det[0, p] if n % 2 else det[0, p]
                    own_bars[n - 1, lane] = det[1, p]


@kernel
def coefficients(M, E, units, others, other_bars, near, powers, sums):
    """Fill powers (N, K, n, n) with B_0 to B_(K-1) and sums (N, 5, n + 1): see `_leverrier`, whose
    other arguments these are, of N points.
    """
    squares = np.empty((7, M.shape[1], M.shape[1]))
    for p in range(len(M)):
        _leverrier(
            M[p], E[p], units[p], others[p], other_bars[p], near[p], powers[p], squares, sums[p]
        )


@part
def _leverrier(M, E, units, others, other_bars, near, powers, squares, sums):
    """Fill sums (5, n + 1) with c_k, bounds of what rounding does to them and of all their errors, and
    tr(B_k J), J = (0 1; -1 0), and bounds of theirs, k = 0 to n; powers (K, n, n) with B_0 to B_(K-1).

    M is known within E, in the `units` (n) of the states, J without. `others` (n + 1): c_k known
    otherwise, within `other_bars` and `near` times the sum of |B_(k-1)|, infinite where it is not.
    """
    # off: what rounding does to B, wide: what all errors do; X, offs, wides: the same of M B
    B, X, size, off = squares[0], squares[1], squares[2], squares[3]
    offs, wide, wides = squares[4], squares[5], squares[6]
    c, rounded, bars, form, form_bars = sums[0], sums[1], sums[2], sums[3], sums[4]
    n = len(M)
    m = n // 2
    for i in range(n):
        for j in range(n):
            B[i, j], off[i, j], wide[i, j] = 1.0 if i == j else 0.0, 0.0, 0.0
            size[i, j] = abs(M[i, j]) + E[i, j]
    c[0], rounded[0], bars[0], form[0], form_bars[0] = 1.0, 0.0, 0.0, 0.0, 0.0
    for k in range(1, n + 1):
        if k <= len(powers):
            copy(B, powers[k - 1])
        shift = trace = doubt = moduli = 0.0
        for i in range(n):
            for j in range(n):
                total = tall = one = two = 0.0
                for r in range(n):
                    total += M[i, r] * B[r, j]
                    tall += size[i, r] * abs(B[r, j])
                    one += size[i, r] * off[r, j]
                    two += size[i, r] * wide[r, j] + E[i, r] * abs(B[r, j])
                X[i, j] = total
                offs[i, j], wides[i, j] = one + n * EPS * tall, two + n * EPS * tall
                shift += (abs(B[i, j]) + wide[i, j]) * E[j, i]
                moduli += abs(B[i, j])
            trace += X[i, i]
            doubt += offs[i, i] + n * EPS * abs(X[i, i])
        c[k], rounded[k] = -trace / k, doubt / k
        other_bar = other_bars[k] + near * moduli
        if not rounded[k] < other_bar:
            c[k], rounded[k] = others[k], other_bar
        rounded[k] += EPS * abs(c[k])
        bars[k] = (rounded[k] + shift) * (1.0 + n * n * EPS)
        form[k] = form_bars[k] = 0.0
        for i in range(n):
            for j in range(n):
                B[i, j], off[i, j], wide[i, j] = X[i, j], offs[i, j], wides[i, j]
            B[i, i] += c[k]
            off[i, i] += rounded[k] + EPS * abs(B[i, i])
            wide[i, i] += bars[k] + EPS * abs(B[i, i])
        for i in range(m):
            up = units[m + i] / units[i]
            low, high = up * B[m + i, i], B[i, m + i] / up
            form[k] += low - high
            form_bars[k] += up * wide[m + i, i] + wide[i, m + i] / up
            form_bars[k] += n * EPS * (abs(low) + abs(high))


@part
def _palindromic(c, bars):
    """May the polynomial be the same from its last coefficient on, as where 1 / l is a root with l?"""
    n = len(c) - 1
    for k in range(n + 1):
        if abs(c[k] - c[n - k]) > bars[k] + bars[n - k]:
            return False
    return True


@part
def _in_sums(c, c_bars, m, change, out, out_bars, first, lane):
    """c_m + the sum of c_(m-j) (l^j + l^-j) as a polynomial of s = l + 1 / l in rows `first` on, highest
    power first: of c without the first, 1; of tr(B_k J), whose first is 0, all.
    """
    most = len(change) - 1
    for i in range(m):
        power, total, bound = m - 1 - i, 0.0, 0.0
        for j in range(most + 1):
            total += c[m - j] * change[j, power]
            bound += (c_bars[m - j] + (m + 4) * EPS * abs(c[m - j])) * abs(change[j, power])
        out[first + i, lane], out_bars[first + i, lane] = total, bound
