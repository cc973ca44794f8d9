"""Inverse functions of many numbers at once, as loops and formulas that become vector code.

The math library's are called for one number after the other. Here log m of a number 2^e m, m from
sqrt(1/2) to sqrt 2, is 2 atanh((m - 1) / (m + 1)), and an arctangent is that of the nearest
multiple of pi/8 and of what is left, at most tan(pi/16): both by Taylor's series, of which TERMS
terms leave less than 2^-54.

Source: DLMF 4.6.4, 4.24.3, 4.24.15.
"""

from fractions import Fraction
from math import log, pi, sqrt, tan

import numpy as np

from survey.kernels.jit import inline, splice
from survey.kernels.unroll import unroll

TERMS = 11
_ODD = [1.0 / (2 * k + 1) for k in range(1, TERMS)]
# log 2, of which e times the first part is exact
_LOG_2 = np.floor(log(2.0) * 2.0**32) / 2.0**32
_LOG_2_REST = float(Fraction("0.693147180559945309417232121458176568") - Fraction(float(_LOG_2)))
# as integers, a number's bits below its exponent, and those of 1 and of sqrt(1/2)
_FRACTION, _ONE, _ROOT = (
    2**52 - 1,
    int(np.float64(1.0).view(np.int64)),
    int(np.float64(sqrt(0.5)).view(np.int64)),
)
_BIAS = 1023
_EIGHTH, _LOW, _HIGH = tan(pi / 8), tan(pi / 16) ** 2, tan(3 * pi / 16) ** 2


@unroll
def _atanh_rest(z):
    """atanh(x) / x - 1, at z = x^2."""
    total = _ODD[-1]
    for c in _ODD[-2::-1]:
        total = c + z * total
    return z * total


@unroll
def _atan_rest(z):
    """atan(x) / x - 1, at z = x^2."""
    return _atanh_rest(-z)


@splice
def arcsinh_roots(x, work):
    """asinh sqrt(x) of numbers x (n), in place, to within 2 EPS, relative; 0 where x is negative.
    `work` has n numbers.

    log(1 + u), u = sqrt(x) + x / (1 + sqrt(1 + x)), where what rounding took from 1 + u is put back.
    """
    bits = work.view(np.int64)
    for i in range(len(x)):
        positive = max(x[i], 0.0)
        u = sqrt(positive) + positive / (1.0 + sqrt(1.0 + positive))
        work[i] = 1.0 + u
        lost = 1.0 - (work[i] - u) if u >= 1.0 else u - (work[i] - 1.0)
        x[i] = lost / work[i]
    for i in range(len(x)):
        own = bits[i] + (_ONE - _ROOT)
        e = float((own >> 52) - _BIAS)
        bits[i] = (own & _FRACTION) + _ROOT
        s = (work[i] - 1.0) / (work[i] + 1.0)
        x[i] = e * _LOG_2 + (2.0 * s + (2.0 * s * _atanh_rest(s * s) + (e * _LOG_2_REST + x[i])))


@inline
def arctan_root(x, y):
    """atan sqrt(x / y) of x, y >= 0, not both 0, to within 2 EPS; negative ones count as 0."""
    x, y = max(x, 0.0), max(y, 0.0)
    least, most = min(x, y), max(x, y)
    a, b = sqrt(least), sqrt(most)
    first, second = least > _LOW * most, least > _HIGH * most
    by = 1.0 if second else _EIGHTH if first else 0.0
    near = 0.25 * pi if second else 0.125 * pi if first else 0.0
    t = (a - by * b) / (b + by * a)
    angle = near + (t + t * _atan_rest(t * t))
    return 0.5 * pi - angle if x > y else angle
