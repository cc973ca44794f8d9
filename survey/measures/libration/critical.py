"""The mass ratios at which the verdict on the triangular points of the circular problem changes;
there are no others.

Each from its equation in x = (27/4) mu (1 - mu) = v (1 - v), v = omega2^2 (`scenes/libration.md`):
Routh's mu_R, x = 1/4; mu1 and mu2, x = 4/25 and 9/100, at which alone omega1 = 2 omega2 and 3
omega2; mu_c and mu_d, the only zeros of D4 and a02 in 0 < mu < mu_R (Sturm). Between these no
verdict changes.
"""

from decimal import Decimal, localcontext
from functools import cache

import numpy as np

CLASSES = {"D4_is_0": 3, "resonance_1_to_3": 4, "a02_is_0": 5, "resonance_1_to_2": 6, "routh": 7}
DIGITS = 50
D4 = (36, -541, 644)  # its numerator, by powers of x
A02 = (972, -7119, -7017, 10084, 2564, 960)  # q(v)


@cache
def ratios():
    """[(code of CLASSES, mu, bound of its error)], ascending; mu is the float64 that is nearest."""
    with localcontext(prec=DIGITS) as context:
        v = _zero(A02, Decimal(1) / 2)
        x = {
            "D4_is_0": _zero(D4, Decimal(1) / 4),
            "resonance_1_to_3": Decimal(9) / 100,
            "a02_is_0": v * (1 - v),
            "resonance_1_to_2": Decimal(4) / 25,
            "routh": Decimal(1) / 4,
        }
        exact = {name: _mass(value) for name, value in x.items()}
        noise = context.power(10, 10 - DIGITS)
        return [
            (
                CLASSES[name],
                float(mu),
                float(np.nextafter(float(abs(mu - Decimal(float(mu))) + noise), 1.0)),
            )
            for name, mu in sorted(exact.items(), key=lambda item: item[1])
        ]


def _mass(x):
    """mu of x (F3)."""
    g = 4 * x / 27
    return 2 * g / (1 + (1 - 4 * g).sqrt())


def _zero(polynomial, high):
    """The only zero of a polynomial, positive at 0, between 0 and `high`, to nearly DIGITS digits."""
    low = Decimal(0)
    for _ in range(4 * DIGITS):
        middle = (low + high) / 2
        value = Decimal(0)
        for coefficient in reversed(polynomial):
            value = value * middle + coefficient
        low, high = (middle, high) if value > 0 else (low, middle)
    return low
