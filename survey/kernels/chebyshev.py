"""Chebyshev series of many rows at many points: rows share nothing, lanes of a row share their coefficients.

Source: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003), 2.4.1 (Clenshaw's recurrence).
"""

import numpy as np

from survey.kernels.hill import EPS, EXPONENT, NO_RULE, STABLE, UNDECIDED, UNSTABLE, exponent
from survey.kernels.jit import inline, kernel

TILE = 64


@inline
def _series(coefficients, state, count):
    """sum_k c_k T_k(x) in `count` lanes of state[1], where state[0] is 2 x; state[2] is scratch."""
    for i in range(count):
        state[1, i] = state[2, i] = 0.0
    k = len(coefficients) - 1
    if k % 2 == 1:  # two terms a turn keep the recurrence in place
        for i in range(count):
            state[1, i] = coefficients[k]
        k -= 1
    while k > 0:
        c, next_c = coefficients[k], coefficients[k - 1]
        for i in range(count):
            state[2, i] = c + state[0, i] * state[1, i] - state[2, i]
            state[1, i] = next_c + state[0, i] * state[2, i] - state[1, i]
        k -= 2
    c = coefficients[0]
    for i in range(count):
        state[1, i] = c + 0.5 * state[0, i] * state[1, i] - state[2, i]


@kernel
def expand(values, bars, even, transform, polynomials, back, lebesgue, series, totals):
    """The series of D and its bar, row by row, from the factors y1, y1', y2, y2' (4, R, nodes) and their bars there.

    `transform` takes n values to coefficients, `polynomials` these to m values, `back` those to coefficients (all by
    columns: [from, to]); `lebesgue` holds the constants of n and m nodes. Where D is `even` the nodes are those of
    the upper half axis, x falling from 1, and y1(-p) = y2'(p) gives the other half.
    """
    n, m, own = transform.shape[0], back.shape[0], values.shape[2]
    row, coefficients, factors = np.empty(n), np.empty(n), np.empty((4, m))
    bar = np.empty(4)
    for r in range(values.shape[1]):
        for f in range(4):
            other = 3 - f if f == 0 or f == 3 else f
            error = 0.0
            for i in range(n):
                mirrored = even and i >= own
                row[i] = values[other, r, n - 1 - i] if mirrored else values[f, r, i]
                error = max(error, bars[other, r, n - 1 - i] if mirrored else bars[f, r, i])
            _product(row, transform, coefficients)
            bar[f] = lebesgue[0] * error + _doubt(coefficients)
            _product(coefficients, polynomials, factors[f])
        worst = 0.0
        for i in range(m):
            y1, dy1, y2, dy2 = factors[0, i], factors[1, i], factors[2, i], factors[3, i]
            sine, cosine = -dy1 * y2, y1 * dy2
            sine_bar = bar[1] * abs(y2) + bar[2] * abs(dy1) + bar[1] * bar[2] + EPS * abs(sine)
            cosine_bar = bar[0] * abs(dy2) + bar[3] * abs(y1) + bar[0] * bar[3] + EPS * abs(cosine)
            d = 2.0 - 4.0 * sine if sine_bar <= cosine_bar else 4.0 * cosine - 2.0
            worst = max(worst, 4.0 * min(sine_bar, cosine_bar) + 2.0 * EPS * (2.0 + abs(d)))
            factors[0, i] = d
        _product(factors[0], back, series[r])
        totals[r] = lebesgue[1] * worst + _doubt(series[r])


@inline
def _product(values, columns, out):
    """out = values @ columns, summed in order: the same bits in any block."""
    out[:] = 0.0
    for i in range(columns.shape[0]):
        for j in range(columns.shape[1]):
            out[j] += values[i] * columns[i, j]


@inline
def _doubt(series):
    """What a series leaves out and folds back, and rounding.

    The first from its last coefficients at the rate at which they fall; the second of the transform, of Clenshaw's
    recurrence, and of the rounded place in the axis, where T_k' <= k^2.
    """
    n = len(series)
    last = before = rounding = 0.0
    for k in range(n):
        size = abs(series[k])
        last = max(last, size) if k >= n - 4 else last
        before = max(before, size) if n - 8 <= k < n - 4 else before
        rounding += size * (4.0 + k + 0.5 * k * k)
    rate = min(max(last / (before + 1e-300), 0.1), 0.9)
    return 4.0 * last / (1.0 - rate) + EPS * rounding


@kernel
def discriminants(rows, coefficients, bars, middle, radius, even, p, rule, rtol, wanted, floats, verdict, late):
    """D of the `rows` of p (R, L) from its series: D, its bar, the verdict, the exponent; `late` where not enough.

    Row rows[j]: D = sum_k coefficients[j, k] T_k(x) within bars[j], x = (p - middle) / radius, or 2 (p / radius)^2 - 1
    where D is `even`. Columns and `wanted` as in `survey.kernels.hill.measure`.
    """
    state = np.empty((3, TILE))
    for j in range(len(rows)):
        r, bar = rows[j], bars[j]
        for start in range(0, p.shape[1], TILE):
            count = min(TILE, p.shape[1] - start)
            for i in range(count):
                t = (p[r, start + i] - middle) / radius
                state[0, i] = 4.0 * t * t - 2.0 if even else 2.0 * t
            _series(coefficients[j], state, count)
            first = r * p.shape[1] + start
            for i in range(count):
                d = state[1, i]
                size = abs(d)
                floats[0, first + i], floats[1, first + i] = d, bar
                said = STABLE if size < 2.0 - bar else UNSTABLE if size > 2.0 + bar else UNDECIDED
                verdict[first + i] = said
                late[first + i] = (said == UNDECIDED) | (not bar <= rtol * (1.0 + size))
            if len(rule) > 0:
                for i in range(count):
                    late[first + i] |= rule[r, start + i] != NO_RULE
            if wanted[5]:
                for i in range(count):
                    # |D| - 2 = 4 sinh^2(exponent / 2)
                    growth, own = exponent(0.25 * (abs(state[1, i]) - 2.0), 0.25 * bar, verdict[first + i])
                    floats[EXPONENT, first + i], floats[EXPONENT + 1, first + i] = growth, own
                    late[first + i] |= not own <= rtol * (1.0 + growth)
