"""Lie series at L4: the Birkhoff normal form of any even order, from the Taylor expansion of the
Hamiltonian.

Independent of the closed forms, and not bound to their orders 4 and 6; what the normalisation
leaves: `remainders`. Bars: running error analysis (`kernels/libration/lie.py`). Domain: 0 < mu <
mu_R - 4e-15; NaN outside, and where a divisor of a generator is below 1e-12.

Source: A. P. Markeev, Libration Points (1978), ch. 8; algorithm: `kernels/libration/lie_plan.py`.
"""

import numpy as np

from survey.kernels.libration.lie import normal_forms
from survey.kernels.libration.lie_plan import COEFFICIENT_BAR, REAL, solved
from survey.kernels.libration.monomials import monomials

ORDER = 0  # no steps: each order's sum is finite
SERVES = ("normal_form",)


def coefficients(mu, order):
    """Values and bars (M, N) of the M coefficients named by `labels(order)`, any even order >= 4,
    at N values of mu.
    """
    values, _norms = solved(normal_forms, mu, order)
    return values[REAL], values[COEFFICIENT_BAR]


def labels(order):
    """(i, j, k) of the coefficients of r1^i r2^j r3^k, of degrees 2, ..., order / 2, as
    `coefficients` gives them.
    """
    found = []
    for degree in range(4, order + 1, 2):
        m = monomials(degree)
        own = (m.harmonic == 0).all(axis=1)
        found += [tuple(map(int, e[:3])) for e in m.exponents[own][np.argsort(m.row[own])]]
    return found


def remainders(mu, order):
    """{(r, d): (values, bars) (2, 3, N)}: after normalisation to degree r, norms of the terms of
    degree d <= order + 1.

    The norm for r_j is the sum over monomials of |k_j| |coefficient|, so that these terms change r_j by at most
    norm rho^d per unit of time where all |z_j| <= rho, r_j = |z_j|^2. r = 2: before the first step.
    """
    return solved(normal_forms, mu, order, True)[1]
