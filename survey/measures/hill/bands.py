"""How far a user's z(u, p) may lie from its interpolant at Chebyshev points: a bound, by running
its code on bounds.

Numbers are replaced by what bounds them: u by an ellipse about [0, end], the parameters by their
largest size. What comes out bounds z there, where it is analytic, and its rounding on [0, end];
what is compared, or may be singular, is unknown. A z that is known so has no spike between its
samples, and need not be probed for one.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), theorem 8.2.
"""

import math
from functools import lru_cache

from survey.kernels.math.roundoff import EPS
from survey.measures.hill import multiprecision
from survey.measures.hill.dependence import OTHER_NAMES, StandIn, Unknown

# Ellipses, by the sum of their half axes relative to those of an interval of half length 1.
ELLIPSES = (2.0, 4.0)
# Of a library's function, in EPS; and how much more an interpolant at some hundred points may be
# off than its values.
OF_FUNCTIONS, LEBESGUE = 4.0, 5.0
# Of where samples are, in EPS of the end.
OF_POSITIONS = 2.0
ROUND = frozenset({"sin", "cos"})
STEEP = {"exp": math.exp, "sinh": math.cosh, "cosh": math.cosh}


class Bound(StandIn):
    """Bounds of an analytic function of u: its `size` and that of its imaginary part on the ellipse; on
    the interval itself its size, `real`, and its rounding, `off`.
    """

    __slots__ = ("imaginary", "off", "real", "size")

    def __init__(self, size, imaginary, real, off):
        self.size, self.imaginary, self.real, self.off = size, imaginary, real, off

    def __add__(self, other):
        other = _bound(other)
        real = self.real + other.real
        return Bound(
            self.size + other.size,
            self.imaginary + other.imaginary,
            real,
            self.off + other.off + EPS * real,
        )

    def __mul__(self, other):
        other = _bound(other)
        real = self.real * other.real
        off = self.real * other.off + self.off * (other.real + other.off) + EPS * real
        imaginary = self.imaginary * other.size + self.size * other.imaginary
        return Bound(self.size * other.size, imaginary, real, off)

    def __truediv__(self, other):
        if not _is_number(other):
            raise Unknown
        return self * (1.0 / abs(other)) * (1.0 + 2 * EPS)

    def __pow__(self, other):
        if not (_is_number(other) and other == int(other) and 0 <= other <= 64):
            raise Unknown
        out = _bound(1.0)
        for _ in range(int(other)):
            out = out * self
        return out * (1.0 + OF_FUNCTIONS * EPS)

    __abs__ = __rtruediv__ = __rpow__ = StandIn._refused


def _is_number(value):
    return isinstance(value, (int, float))


def _bound(value):
    if isinstance(value, Bound):
        return value
    if not _is_number(value):
        raise Unknown
    return Bound(abs(value), 0.0, abs(value), 0.0)


class _Functions:
    """The functions that `multiprecision.lift` gives to the code: those of `math`, of numbers and
    of bounds.
    """

    def __getattr__(self, name):
        def call(*given):
            if all(map(_is_number, given)):
                return (OTHER_NAMES.get(name) or getattr(math, name))(*given)
            if name == "power":
                return (
                    given[0] ** given[1]
                    if isinstance(given[0], Bound)
                    else _bound(given[0])._refused()
                )
            (x,) = given
            if name == "mpf":
                return x
            if name in ROUND:
                return Bound(
                    math.cosh(x.imaginary), math.sinh(x.imaginary), 1.0, x.off + OF_FUNCTIONS * EPS
                )
            if name in STEEP:
                size, real = STEEP[name](x.size), STEEP[name](x.real)
                return Bound(size, size, real, real * (math.expm1(2 * x.off) + OF_FUNCTIONS * EPS))
            raise Unknown

        return call


@lru_cache(maxsize=32)
def _lifted(z):
    return multiprecision.lift(z, _Functions())


@lru_cache(maxsize=256)
def missed(z, largest, end, samples):
    """A bound of how far z(u, p), as computed, is from its interpolant at as many Chebyshev points
    on [0, end], for all parameters of these `largest` sizes; infinite if none is known.
    """
    least = math.inf
    for rho in ELLIPSES:
        wide, high = 0.25 * end * (rho + 1 / rho), 0.25 * end * (rho - 1 / rho)
        u = Bound(0.5 * end + wide + high, high, end, OF_POSITIONS * EPS * end)
        try:
            found = _bound(_lifted(z)(u, [Bound(size, 0.0, size, 0.0) for size in largest]))
        except Exception:  # a user's code may raise anything
            return math.inf
        least = min(least, 4 * found.size * rho ** (1 - samples) / (rho - 1) + LEBESGUE * found.off)
    return least if least >= 0 else math.inf
