"""Danby's half-period factors as Chebyshev series in two variables: y = artanh e, panel by panel,
and 4 s - 3.

A to t are entire functions of s, and analytic in y but for |Im y| >= pi / 2, where 1 + e cos f vanishes. They grow
about as exp(2 y), then as exp(4 y), by which they are divided: on panels of length 1, the first and the others.
"""

from math import log1p

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.libration.danby_double import BARS, LOW
from survey.kernels.libration.traces import INVARIANTS, NODES, TILE, coordinate, cosines
from survey.kernels.math import double as dd
from survey.kernels.math.chebyshev import sum_turns
from survey.kernels.math.roundoff import EPS

TERMS = 26  # in y; NODES in 4 s - 3


@kernel
def fit(results, matrix, weights, series, sizes, bars):
    """Series (5, 2, n, n), pairs, from `results` (n^2, RESULTS of `danby_double`) at nodes, those
    of s inner.

    `matrix` (2, n, n) makes coefficients of values; `weights` (n, 2) divide the values at the nodes
    by their growth. `bars` (5) become the largest bounds of the values' errors, `sizes` (5) the
    largest of the values.
    """
    n = len(weights)
    along = np.empty((2, n, n))
    for j in range(INVARIANTS):
        bars[j] = sizes[j] = 0.0
        for i in range(n):
            weight = weights[i, 0], weights[i, 1]
            for k in range(n):
                s, row = (0.0, 0.0), n * i
                for m in range(n):
                    value = results[row + m, j], results[row + m, LOW + j]
                    s = dd.loose(s, dd.mul((matrix[0, k, m], matrix[1, k, m]), value))
                along[0, i, k], along[1, i, k] = dd.mul(weight, s)
                bars[j] = max(bars[j], weight[0] * results[row + k, BARS + j])
                sizes[j] = max(sizes[j], weight[0] * abs(results[row + k, j]))
        for k in range(n):
            for m in range(n):
                s = (0.0, 0.0)
                for i in range(n):
                    s = dd.loose(
                        s,
                        dd.mul(
                            (matrix[0, k, i], matrix[1, k, i]), (along[0, i, m], along[1, i, m])
                        ),
                    )
                series[j, 0, k, m], series[j, 1, k, m] = s


@inline
def artanh(x):
    return 0.5 * log1p(2.0 * x / (1.0 - x))


@inline
def position(e, middle):
    """x in [-1, 1] of e on its panel, within 2.5 EPS; `middle` is the e in its middle and 1 - e
    there, pairs.
    """
    far, rest = dd.two_sum(e, -middle[0])
    return 2.0 * artanh((far + (rest - middle[1])) / ((1.0 - e) + e * middle[2]))


@kernel
def panels(e, out):
    """Fill `out` (N) with the number of the panel of each e."""
    for i in range(len(e)):
        out[i] = int(artanh(e[i]))


@inline
def exponential(x):
    """exp x of a float64 |x| <= 1, as a pair."""
    s = (1.0, 0.0)
    for n in range(30, 0, -1):
        s = dd.shifted(dd.over(dd.times(s, x), float(n)), 1.0)
    return s


@inline
def exact_position(e, middle):
    """As `position`, as a pair: one step of Newton's, from what float64 finds."""
    far = dd.sub(dd.two_sum(0.0, e), (middle[0], middle[1]))
    wanted = dd.div(far, dd.add(dd.two_sum(1.0, -e), dd.times((middle[2], middle[3]), e)))
    y = artanh(wanted[0])
    square = exponential(2.0 * y)
    there = dd.div(dd.shifted(square, -1.0), dd.shifted(square, 1.0))
    gap = dd.div(dd.sub(wanted, there), dd.shifted(dd.neg(dd.mul(wanted, there)), 1.0))
    return dd.scaled(dd.add((y, 0.0), gap), 2.0)


@kernel
def rows(e, first, middle, coefficients, bars, series, row_bars):
    """The series (N, 5, 2, n) in 4 s - 3 of rows e, all of one panel, pairs, and bounds (N, 5) that hold
    for the row.

    `coefficients` (5, 2, terms, n), pairs, and `bars` (5) are those of the panel, `first` is it the first
    one? `middle` see `position`. Inner products as in `convolved`, of all orders in s at once.
    """
    terms, n = coefficients.shape[2:]
    weights, sums = np.empty((terms, 2)), np.empty((2, n))
    for i in range(len(e)):
        x = exact_position(e[i], middle)
        weight, after = (1.0, 0.0), x
        for k in range(terms):
            weights[k, 0], weights[k, 1] = weight
            further = dd.sub(dd.scaled(dd.mul(x, after), 2.0), weight)
            weight, after = after, further
        growth = dd.div(dd.two_sum(1.0, e[i]), dd.two_sum(1.0, -e[i]))
        growth = growth if first else dd.square(growth)
        for j in range(INVARIANTS):
            sums[:] = 0.0
            for k in range(terms):
                weight = weights[k, 0], weights[k, 1]
                for m in range(n):
                    term = coefficients[j, 0, k, m], coefficients[j, 1, k, m]
                    sums[0, m], sums[1, m] = dd.plus_product(sums[0, m], sums[1, m], weight, term)
            for m in range(n):
                value = dd.quick_two_sum(sums[0, m], sums[1, m])
                series[i, j, 0, m], series[i, j, 1, m] = dd.mul(growth, value)
            row_bars[i, j] = 1.01 * growth[0] * bars[j]


@kernel
def points(e, mu, first, middle, coefficients, lengths, bars, out):
    """Fill `out` (N, RESULTS of `traces`) for points of one panel, whose series (5, TERMS, NODES) is in
    float64; order k in y has `lengths`[k] terms, a multiple of `chebyshev.TERMS`.

    A tile of points at once; what is small is added first.
    """
    growth, part, total = np.empty(TILE), np.empty(TILE), np.empty(TILE)
    in_y, in_s = np.empty((TERMS, TILE)), np.zeros((NODES, TILE))
    for start in range(0, len(e), TILE):
        count = min(TILE, len(e) - start)
        for i in range(count):
            x = e[start + i]
            rate = (1.0 + x) / (1.0 - x)
            growth[i] = rate if first else rate * rate
            in_y[0, i], in_y[1, i] = 1.0, position(x, middle)
        for i in range(count):
            in_s[0, i], in_s[1, i] = 1.0, coordinate(mu[start + i])
        cosines(in_y, count)
        cosines(in_s, count)
        for j in range(INVARIANTS):
            for i in range(count):
                total[i] = 0.0
            for k in range(TERMS - 1, -1, -1):
                sum_turns(coefficients[j, k, : lengths[k]], in_s, part, count)
                for i in range(count):
                    total[i] += in_y[k, i] * part[i]
            for i in range(count):
                value = growth[i] * total[i]
                out[start + i, j] = value
                out[start + i, INVARIANTS + j] = growth[i] * bars[j] + 4.0 * EPS * abs(value)
