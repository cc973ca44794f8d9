"""sin and cos of a float64 in double-double: a table on a grid of 1/16, where the rest is exact,
and Taylor series.
"""

from fractions import Fraction
from math import factorial

import numpy as np

from survey.kernels.jit import inline
from survey.kernels.math.double import loose, mul, neg, of_fraction, quick_two_sum, times, two_prod

GRID = 16.0
LARGEST = 3.2
_ORDERS = 60
_BITS = 400


def _row(j):
    """sin and cos of j / GRID, as hi and lo: their series in integers, in units of 2^-_BITS."""
    sums, term = [0, 0], 1 << _BITS
    for n in range(_ORDERS):
        sums[n % 2] += (-1) ** (n // 2) * term
        term = term * j // (int(GRID) * (n + 1))
    return *of_fraction(Fraction(sums[1], 1 << _BITS)), *of_fraction(Fraction(sums[0], 1 << _BITS))


_TABLE = np.array([_row(j) for j in range(int(LARGEST * GRID) + 2)])
# 1/n!, whose sign alternates in pairs
_S3, _S5, _S7 = (of_fraction(Fraction((-1) ** (n // 2), factorial(n))) for n in (3, 5, 7))
_C4, _C6 = (of_fraction(Fraction((-1) ** (n // 2), factorial(n))) for n in (4, 6))


@inline
def _small(a, b):
    """a + b, where |b| is less than |a|."""
    s, e = quick_two_sum(a[0], b[0])
    return quick_two_sum(s, e + (a[1] + b[1]))


@inline
def sin_cos(x):
    """sin x and cos x of 0 <= x <= LARGEST, to a few units of 2^-104; relative, where sin x is
    small with x.
    """
    j = int(x * GRID + 0.5)
    r = x - j / GRID  # exact
    z = two_prod(r, r)
    y = z[0]
    s = _small(_S7, (y * (1 / 362880.0 - y * (1 / 39916800.0 - y * (1 / 6227020800.0))), 0.0))
    s = mul(z, _small(_S3, mul(z, _small(_S5, mul(z, s)))))
    s = _small((r, 0.0), times(s, r))
    c = _small(_C6, (y * (1 / 40320.0 - y * (1 / 3628800.0 - y * (1 / 479001600.0))), 0.0))
    c = mul(z, _small((-0.5, 0.0), mul(z, _small(_C4, mul(z, c)))))  # cos r - 1
    sine, cosine = (_TABLE[j, 0], _TABLE[j, 1]), (_TABLE[j, 2], _TABLE[j, 3])
    whole_sine = loose(sine, loose(mul(cosine, s), mul(sine, c)))
    return whole_sine, loose(cosine, loose(mul(cosine, c), neg(mul(sine, s))))
