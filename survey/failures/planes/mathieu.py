"""Mathieu's equation: a and q to 1e4, and gaps down to 1e-13."""

import numpy as np

from survey.analysis.edge import edge
from survey.failures.plane import Plane, few, logarithmic, plain, two_sided
from survey.truth.hill import mathieu

ABOUT = """Where a and q are large the solutions grow by hundreds of orders of magnitude in a period, or oscillate
hundreds of times; the gaps between them narrow like q^n. `auto` takes 16th-order Taylor steps (series over dense
rows), and double-double where float64 leaves a verdict open."""
SOURCE = "Truth: Taylor series of order 30 in double-double."
ORDER = 5  # of the gap


def planes(share):
    return [_large(share), _gaps(share)]


def _large(share):
    y, a = two_sided("$a$", np.linspace(-1.0, 4.0, few(share, 14)))
    q = np.linspace(-1.0, 4.0, few(share, 26))
    given = {"a": a[:, None], "q": 10.0 ** q[None]}
    return Plane("a and q to 1e4", logarithmic("$q$", q), y, "mathieu", given, mathieu, SOURCE)


def _gaps(share):
    """Width about 2 (q / 4)^n / (n - 1)!^2 / 4^-n, from 1e-3 to 1e-13."""
    q = 10.0 ** np.linspace(-1.6, 0.5, few(share, 18))
    position = np.linspace(-1.5, 1.5, few(share, 25))
    ends = [edge("mathieu", along="a", a=(24.0, 26.5), q=x).edge.values for x in q]
    low, high = np.array([[x[0], x[-1]] for x in ends]).T
    a = 0.5 * (low + high)[:, None] + position[None] * (high - low)[:, None]
    return Plane(
        f"the gap at a = {ORDER**2}, width\n1e-13 to 1e-3", plain("position in the gap, over its width", position),
        logarithmic("width of the gap", np.log10(high - low)), "mathieu", {"q": q[:, None], "a": a}, mathieu, SOURCE,
    )  # fmt: skip
