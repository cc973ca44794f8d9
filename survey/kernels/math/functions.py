"""The functions that a user's recorded code may use, by number, each NaN outside its domain; and 1/cosh^2."""

import math

from survey.kernels.jit import kernel

NAMES = tuple(
    "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt erf".split()
)
SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ASINH, ACOSH, ATANH, EXP, LOG, SQRT, ERF = range(
    16
)


@kernel
def function(code, x):
    """The function of this code at x; NaN outside its domain."""
    if code == SIN:
        return math.sin(x)
    if code == COS:
        return math.cos(x)
    if code == TAN:
        return math.tan(x)
    if code == ASIN:
        return math.asin(x) if abs(x) <= 1.0 else math.nan
    if code == ACOS:
        return math.acos(x) if abs(x) <= 1.0 else math.nan
    if code == ATAN:
        return math.atan(x)
    if code == SINH:
        return math.sinh(x) if abs(x) < 700.0 else math.nan
    if code == COSH:
        return math.cosh(x) if abs(x) < 700.0 else math.nan
    if code == TANH:
        return math.tanh(x)
    if code == ASINH:
        return math.asinh(x)
    if code == ACOSH:
        return math.acosh(x) if x >= 1.0 else math.nan
    if code == ATANH:
        return math.atanh(x) if abs(x) < 1.0 else math.nan
    if code == EXP:
        return math.exp(x) if x < 709.0 else math.nan
    if code == LOG:
        return math.log(x) if x > 0.0 else math.nan
    if code == SQRT:
        return math.sqrt(x) if x >= 0.0 else math.nan
    return math.erf(x)


@kernel
def sech_squared(x):
    """1 / cosh(x)^2, to 3 * 2^-52 of itself where it is not subnormal."""
    small = math.exp(-2.0 * abs(x))
    return 4.0 * small / ((1.0 + small) * (1.0 + small))
