"""Multipliers from the characteristic polynomial of matrices known within bounds: those of every
matrix within them are in the error bars, and verdict, signs and crossing are those of discs.
"""

from itertools import combinations

import numpy as np
import pytest
from mpmath import mp
from scipy.linalg import expm
from scipy.optimize import linear_sum_assignment

from survey.measures.floquet import dense, stability
from survey.measures.floquet.monodromy import Matrices
from survey.measures.floquet.multipliers import UNDECIDED, symplectic_form

ASKED = {"multiplier_re", "spectral_radius", "verdict", "crossing"}


def matrices(n, structure, number, seed):
    """Matrices (number, n, n), what they are known to within, and units in which they are balanced."""
    rng = np.random.default_rng(seed)
    M, units = np.empty((number, n, n)), 2.0 ** rng.integers(-12, 12, size=(number, n))
    if structure == "symplectic":
        units[:, n // 2 :] = 1.0 / units[:, : n // 2]
    for i in range(number):
        size = 10.0 ** rng.uniform(-1, 0.4)
        A = rng.normal(size=(n, n)) * size
        if structure == "symplectic":
            S = A + A.T if rng.random() < 0.5 else A @ A.T / n
            M[i] = expm(symplectic_form(n) @ S)
        else:
            M[i] = A
            if rng.random() < 0.3:  # nearly defective
                M[i, :2, :2], M[i, 2:, :2] = [[0.9, 1.0], [10.0 ** rng.uniform(-12, -3), 0.9]], 0.0
    E = 10.0 ** rng.uniform(-13, -5, size=(number, 1, 1)) * abs(M)
    if structure == "symplectic":
        E += 1e-13 * np.sqrt((M * M).sum(axis=(1, 2), keepdims=True))
    back = units[:, :, None] / units[:, None]
    return M * back, E * back, back


@pytest.mark.parametrize(
    ("n", "structure"),
    [(2, "none"), (3, "none"), (4, "none"), (6, "none"), (2, "symplectic"), (4, "symplectic"),
     (6, "symplectic")],
)  # fmt: skip
def test_multipliers_of_all_matrices_within_the_bounds(n, structure):
    M, E, back = matrices(n, structure, 400, n)
    rng, other = np.random.default_rng(1), M / back
    if structure == "none":  # matrices near a symplectic one need not be
        other += rng.choice([-1.0, 1.0], size=M.shape) * E / back
    found = stability.by_coefficients(Matrices.plain(M, E), structure, 1.0, ASKED, None)
    served = np.flatnonzero(~found.missed)
    worst, signs = 0.0, {int(v) for v in found.verdict[served]}
    for p in served:
        exact = np.linalg.eigvals(other[p])
        # of the reference, and of a matrix that is symplectic within rounding alone
        noise = 1e-15 * np.linalg.norm(other[p]) * np.linalg.cond(np.linalg.eig(other[p])[1])
        noise *= 20.0 if structure == "symplectic" else 1.0
        re, im, bar_re, bar_im = found.floats[: 4 * n, p].reshape(4, n)
        off = np.maximum(
            abs(re[:, None] - exact.real) / (bar_re[:, None] + noise),
            abs(im[:, None] - exact.imag) / (bar_im[:, None] + noise),
        )
        rows, columns = linear_sum_assignment(np.minimum(off, 1e9))
        worst = max(worst, off[rows, columns].max())
        value, bar = found.floats[4 * n :, p]
        assert abs(abs(exact).max() - value) <= bar + noise
    assert worst <= 1.0
    assert served.size > 130 and signs >= {0, 1}
    discs = stability.by_discs(Matrices.plain(M, E), structure, 1.0, ASKED)
    for name in ("verdict", "crossing"):
        one, two = getattr(found, name)[served], getattr(discs, name)[served]
        both = (one != UNDECIDED) & (two != UNDECIDED)
        assert both.mean() > 0.8 and (one[both] == two[both]).all()
    both = (found.signs[:, served] != 0) & (discs.signs[:, served] != 0)
    assert (found.signs[:, served] == discs.signs[:, served])[both].all()
    if structure == "symplectic":
        assert both.any()


@pytest.mark.parametrize("wide", [1.0, 1e4])
@pytest.mark.parametrize("n", [2, 3, 5])
def test_coefficients_are_sums_of_principal_minors(n, wide):
    """Of matrices within the bounds, wide ones too, in 50 digits."""
    M, E, back = matrices(n, "none", 40, n)
    E, rng, scale = wide * E, np.random.default_rng(n), back[:, :, 0] / back[:, :1, 0]
    for own in (M, M + rng.choice([-1.0, 1.0], M.shape) * E):
        value, bar = dense.coefficients(M / back, E / back, scale, "none")
        for p in range(len(M)):
            with mp.workdps(50):
                exact = mp.matrix(own[p].tolist())
                for k in range(1, n + 1):
                    minors = (
                        mp.det(mp.matrix([[exact[i, j] for j in rows] for i in rows]))
                        for rows in combinations(range(n), k)
                    )
                    off = abs((-1) ** k * mp.fsum(minors) - value[p, k - 1])
                    assert off <= bar[p, k - 1] * (1 + 1e-9)
    narrow = dense.coefficients(M / back, 0.0 * E, scale, "none")[1]
    assert np.median(narrow / (1e-16 + abs(value))) < 1e-13


@pytest.mark.parametrize("n", [2, 4])
def test_a_structure_that_the_polynomial_has_not(n):
    """Multipliers 0.5 and 3: 1 / l is none of them, whatever was said."""
    M = np.diag([0.5, 3.0, 0.7, 1.2][:n])[None]
    for asked in (ASKED, {"spectral_radius", "verdict"}):
        found = stability.by_coefficients(
            Matrices.plain(M, 1e-15 * abs(M)), "reversible", 1.0, asked
        )
        assert found.missed.all() and found.verdict.tolist() == [UNDECIDED]


def test_what_is_left_open_goes_to_the_discs():
    """A double multiplier off the circle: missed here, answered by discs in `assess`."""
    M = np.array(
        [[[0.5, 1.0], [0.0, 0.5]], [[0.5, 1.0], [0.0, 0.25]], [[np.nan, 1.0], [0.0, 0.25]]]
    )
    E = np.full(M.shape, 1e-15)
    found = stability.by_coefficients(Matrices.plain(M, E), "none", 1e-10, ASKED, None)
    assert found.missed.tolist() == [True, False, True]
    found = stability.assess(Matrices.plain(M, E), "none", 1e-10, ASKED)
    assert found.verdict.tolist() == [1, 1, -1] and found.status[0] == 0 and found.status[2] != 0
