"""Closed forms with error bars: arrays of numbers, each with a bound of its error, through + - * /,
roots and means.

The bounds hold for what the inputs may be off and for every rounding; they are infinite, or NaN,
where a denominator or the argument of a root may vanish or be negative.
"""

from dataclasses import dataclass

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF_UP

UP = 1.0 + 1e-14  # the roundings of a bound itself
MEANS = 40  # quadratic convergence, after the ratio has come down from 1e300


@dataclass(frozen=True)
class Bounded:
    """`value` (any shape) known to within `bar` (broadcasts with it)."""

    value: np.ndarray
    bar: np.ndarray | float = 0.0

    __array_ufunc__ = None  # so that array + Bounded is asked of Bounded

    def __add__(self, other):
        other = of(other)
        return _rounded(self.value + other.value, self.bar + other.bar)

    def __neg__(self):
        return Bounded(-self.value, self.bar)

    def __sub__(self, other):
        return self + -of(other)

    def __mul__(self, other):
        other = of(other)
        off = abs(self.value) * other.bar + self.bar * (abs(other.value) + other.bar)
        return _rounded(self.value * other.value, off)

    def __truediv__(self, other):
        other = of(other)
        value, least = self.value / other.value, abs(other.value) - other.bar
        return _rounded(
            value, np.where(least > 0.0, (self.bar + abs(value) * other.bar) / least, np.inf)
        )

    def __radd__(self, other):
        return self + other

    def __rsub__(self, other):
        return -self + other

    def __rmul__(self, other):
        return self * other

    def __rtruediv__(self, other):
        return of(other) / self

    def sqrt(self):
        """The square root; NaN where the number is negative, and 0 where it may be."""
        least = self.value - self.bar
        root = np.sqrt(np.where(abs(self.value) <= self.bar, 0.0, self.value))
        off = np.where(
            least > 0.0,
            self.bar / (np.sqrt(np.maximum(least, 0.0)) + root),
            np.sqrt(self.value + self.bar),
        )
        return _rounded(root, off)

    def sign(self):
        """-1 or 1 where the sign is certain, else 0."""
        return np.where(abs(self.value) > self.bar, np.sign(self.value), 0.0)


def of(number):
    """The Bounded itself, or that of a number or an array, which counts as exact."""
    return number if isinstance(number, Bounded) else Bounded(np.asarray(number, dtype=float))


def mean(a, b):
    """The arithmetic-geometric mean of positive Bounded (DLMF 19.8(i)), homogeneous and increasing
    in both.
    """
    low, high = ([np.maximum(x.value + side * x.bar, 0.0) for x in (a, b)] for side in (-1.0, 1.0))
    ends = [_mean(*pair) for pair in (low, high)]
    middle = _mean(a.value, b.value)
    return _rounded(
        middle, np.maximum(ends[1] - middle, middle - ends[0]) + 2 * MEANS * ROUNDOFF_UP * middle
    )


def _mean(a, b):
    for _ in range(MEANS):
        a, b = 0.5 * (a + b), np.sqrt(a * b)
    return a


def where(condition, a, b):
    """`a` where the condition holds, else `b`, bars included."""
    a, b = of(a), of(b)
    return Bounded(np.where(condition, a.value, b.value), np.where(condition, a.bar, b.bar))


def _rounded(value, bar):
    return Bounded(value, (bar + ROUNDOFF_UP * abs(value)) * UP)
