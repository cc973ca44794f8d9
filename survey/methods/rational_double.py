"""Closed rational forms in double-double: every coefficient within an ulp, zeros and poles
included; 8 microseconds.

Domain and sources: those of `rational`. It decides next to the critical values, where float64's
bars do not.
"""

from survey.kernels.libration.closed_forms import ROWS, closed_forms_double, tabulate
from survey.kernels.libration.coefficients import NAMES

ORDER = 0  # no truncation
SERVES = ("normal_form",)


def coefficients(mu, order):
    """As `rational.coefficients`."""
    return tabulate(closed_forms_double, mu, ROWS[order])


def combined(mu):
    """As `rational.combined`."""
    return tabulate(closed_forms_double, mu, len(NAMES))
