"""Closed rational forms in float64, with running error bounds: a microsecond per mass ratio, no
expansion.

Domain: 0 < mu < mu_R, every mu that is a float64, those next to the resonances and to mu_R
included. The forms of order 4 are those of A. Deprit, A. Deprit-Bartholome, Astron. J. 72 (1967)
173, in the plane; the others were found by exact rational reconstruction (`scenes/libration.md`).
"""

from survey.kernels.libration.closed_forms import ROWS, closed_forms, tabulate
from survey.kernels.libration.coefficients import NAMES

ORDER = 0  # no truncation
SERVES = ("normal_form",)


def coefficients(mu, order):
    """Coefficients of orders 4 to `order` (4 or 6), in the order of LABELS, and their bars, both
    (rows, N).

    NaN outside 0 < mu < mu_R. Raises KeyError for another order: no closed forms of higher orders
    are known.
    """
    return tabulate(closed_forms, mu, ROWS[order])


def combined(mu):
    """All coefficients, then a20, a11, a02, D4 and D6: in closed form too, so that nothing cancels."""
    return tabulate(closed_forms, mu, len(NAMES))
