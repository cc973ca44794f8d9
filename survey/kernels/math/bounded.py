"""Numbers with running error bounds: pairs (value, bound), for formulas short enough that such
bounds stay sharp.
"""

from math import inf, sqrt

from survey.kernels.jit import inline
from survey.kernels.math.roundoff import ROUNDOFF


@inline
def exact(x):
    return x, 0.0


@inline
def add(x, y):
    total = x[0] + y[0]
    return total, x[1] + y[1] + ROUNDOFF * abs(total)


@inline
def sub(x, y):
    total = x[0] - y[0]
    return total, x[1] + y[1] + ROUNDOFF * abs(total)


@inline
def mul(x, y):
    product = x[0] * y[0]
    return product, abs(x[0]) * y[1] + abs(y[0]) * x[1] + x[1] * y[1] + ROUNDOFF * abs(product)


@inline
def scaled(x, factor):
    """`factor` times x, for a factor that is exact."""
    return factor * x[0], abs(factor) * x[1] + ROUNDOFF * abs(factor * x[0])


@inline
def div(x, y):
    """The bound is infinite where the divisor may be 0."""
    quotient, least = x[0] / y[0], abs(y[0]) - y[1]
    bound = (x[1] + abs(quotient) * y[1]) / least if least > 0.0 else inf
    return quotient, bound + ROUNDOFF * abs(quotient)


@inline
def root(x):
    """Of a number that is certainly positive, else the bound is infinite."""
    value, least = sqrt(max(x[0], 0.0)), x[0] - x[1]
    return value, x[1] / (value + sqrt(least)) + ROUNDOFF * value if least > 0.0 else inf
