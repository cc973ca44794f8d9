"""The order of the midpoint Taylor step, proved on power series in h: double precision leaves no
room to measure 16.
"""

import numpy as np

from survey.methods import taylor16

DEGREE = 20


class Series:
    """A power series in h, cut after h^20, perhaps over h; abs and division by anything but h serve
    bounds only.
    """

    def __init__(self, coefficients):
        self.c = np.zeros(DEGREE + 2)
        self.c[: len(coefficients)] = coefficients

    def __add__(self, other):
        return Series(self.c + _series(other).c)

    def __mul__(self, other):
        if isinstance(other, OverH):
            return Series(np.append(other.factor * self.c[1:], 0))
        return Series(np.convolve(self.c, _series(other).c)[: DEGREE + 2])

    def __neg__(self):
        return self * -1.0

    def __sub__(self, other):
        return self + -_series(other)

    def __rsub__(self, other):
        return _series(other) - self

    def __rtruediv__(self, number):
        return OverH(number) if np.count_nonzero(self.c) == 1 and self.c[1] == 1.0 else self

    def __abs__(self):
        return self

    __radd__, __rmul__ = __add__, __mul__


class OverH:
    """A number over h: only to multiply a series by."""

    def __init__(self, factor):
        self.factor = factor


def _series(value):
    return value if isinstance(value, Series) else Series([value])


def exact(z):
    """P of y'' + z(t) y = 0 from -h/2 to h/2 as series in h, z given by its powers of t."""
    columns = []
    for start in ([1.0, 0.0], [0.0, 1.0]):
        y = list(start)
        for n in range(30):
            y.append(-sum(z[j] * y[n - j] for j in range(min(n + 1, len(z)))) / ((n + 1) * (n + 2)))
        columns.append(np.array(y))
    at = {}
    for sign in (1, -1):
        for i, y in enumerate(columns):
            powers = (sign * 0.5) ** np.arange(y.size)
            at[sign, i] = Series((y * powers)[: DEGREE + 2])
            slope = y[1:] * np.arange(1, y.size)
            at[sign, i + 2] = Series((slope * powers[:-1])[: DEGREE + 2])
    a, b, da, db = (at[1, i] for i in range(4))
    a0, b0, da0, db0 = (at[-1, i] for i in range(4))
    return a * db0 - b * da0, b * a0 - a * b0, da * db0 - db * da0, db * a0 - da * b0


def test_local_error_is_h_to_the_17():
    z = np.random.default_rng(4).uniform(0.5, 1.5, 10)
    powers = [Series([0.0] * (j + 2) + [-z[j] * 0.5 ** (j + 2)]) for j in range(10)]
    f = powers + [Series([0])] * (2 * taylor16.WIDTH - 10)
    step = getattr(taylor16.hill_step, "py_func", taylor16.hill_step)
    got = step(f, 0.0, 0.0, Series([0.0, 1.0]))[:4]
    first = 0.0
    for mine, wanted in zip(got, exact(z), strict=True):
        difference = abs(mine.c - wanted.c)
        assert np.all(
            difference[: taylor16.ORDER + 1] < 1e-14 * abs(wanted.c[: taylor16.ORDER + 1]) + 1e-18
        )
        first = max(first, difference[taylor16.ORDER + 1])
    assert first > 1e-17
