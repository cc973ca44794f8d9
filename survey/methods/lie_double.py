"""Lie series at L4 in double-double arithmetic: every even order, beside resonances and mu_R too.

As `lie`, 20 digits further: what cancellation beside a resonance, towards mu = 0 and mu_R costs is
found there. Domain: 0 < mu < mu_R, every mu that is a float64; NaN outside, and where a divisor of
a generator is below 1e-20.

Source: that of `lie`.
"""

from survey.kernels.libration.lie_double import normal_forms
from survey.kernels.libration.lie_plan import COEFFICIENT_BAR, REAL, solved
from survey.methods.lie import labels as labels

ORDER = 0  # no steps: each order's sum is finite
SERVES = ("normal_form",)


def coefficients(mu, order):
    """As `lie.coefficients`."""
    values, _norms = solved(normal_forms, mu, order)
    return values[REAL], values[COEFFICIENT_BAR]


def remainders(mu, order):
    """As `lie.remainders`."""
    return solved(normal_forms, mu, order, True)[1]
