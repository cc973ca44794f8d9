"""Roots and logarithms for the sizes of steps, to a few digits: the bits of a number are nearly linear in its
logarithm, and libm's power takes a fifth of a step's time.
"""

import math

import numpy as np

from survey.kernels.jit import inline

# bits of numbers: those of the exponent, those of 1, and 15 / 16 of the latter; where the exponent begins
_EXPONENT, _ONE, _ROOT_OF_1, _BEGIN = (
    np.uint64(bits) for bits in (0x7FF0000000000000, 0x3FF0000000000000, 0x3BF1000000000000, 52)
)
_BIAS = 1023


@inline
def sixteenth_root(x):
    """The 16th root of a normal number x > 0, to 1 %."""
    bits = (np.float64(x).view(np.uint64) >> np.uint64(4)) + _ROOT_OF_1
    power = np.uint64(bits & _EXPONENT).view(np.float64)
    rest = np.uint64((bits & ~_EXPONENT) | _ONE).view(np.float64)
    return power * (0.68632 + rest * (0.34316 * rest - 0.02948))


@inline
def log2(x):
    """The logarithm of a normal number x > 0 to base 2, to 0.0009."""
    bits = np.float64(x).view(np.uint64)
    m = np.uint64((bits & ~_EXPONENT) | _ONE).view(np.float64)  # from 1 to 2
    rest = m * (3.01116215 + m * (0.15270028 * m - 1.02680491)) - 2.13623207
    return np.float64(np.int64(bits >> _BEGIN) - _BIAS) + rest


@inline
def exp2(y):
    """2^y, -1000 < y < 1000, to 0.0001 of it."""
    whole = math.floor(y)
    f = y - whole
    power = np.uint64(np.uint64(np.int64(whole) + _BIAS) << _BEGIN).view(np.float64)
    return power * (0.99990029 + f * (0.69632477 + f * (0.22469316 + 0.07896726 * f)))
