"""Chebyshev series of many rows at many points: rows share nothing, lanes of a row share their coefficients.

Source: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003), 2.4.1 (Clenshaw's recurrence).
"""

import numpy as np

from survey.kernels.hill import EPS, EXPONENT, NO_RULE, STABLE, UNDECIDED, UNSTABLE, exponent
from survey.kernels.jit import inline, kernel

TILE = 64
ROWS = 8


@kernel
def expand(values, bars, even, transform, polynomials, back, lebesgue, place, series, totals):
    """The series of D and its bar, row by row, from the factors y1, y1', y2, y2' (4, R, nodes) and their bars there.

    `transform` takes n values to coefficients, `polynomials` these to m values, `back` those to coefficients (all by
    columns: [from, to]); `lebesgue` holds the constants of n and m nodes, `place` is that of `_doubt`. Where D is
    `even` the nodes are those of the upper half axis, x falling from 1, and y1(-p) = y2'(p) gives the other half.
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
            bar[f] = lebesgue[0] * error + _doubt(coefficients, place)
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
        totals[r] = lebesgue[1] * worst + _doubt(series[r], place)


@kernel
def transform(rows, matrix, place, out):
    """Coefficients along the first axis of `rows` (n, m), values at nodes by `matrix` (by columns: [from, to]).

    Returns the `_doubt` over all columns.
    """
    n, m = rows.shape
    sizes = np.empty(n)
    for k in range(n):
        out[k] = 0.0
        for j in range(n):
            for i in range(m):
                out[k, i] += matrix[j, k] * rows[j, i]
        sizes[k] = 0.0
        for i in range(m):
            sizes[k] += abs(out[k, i])
    return _doubt(sizes, place)


@kernel
def restrict(series, x, out):
    """out[r] = sum_k series[k] T_k(x[r]): the rows' own coefficients, by Clenshaw's recurrence."""
    n, m = series.shape
    last, before = np.empty(m), np.empty(m)
    for r in range(len(x)):
        last[:] = 0.0
        before[:] = 0.0
        for k in range(n - 1, 0, -1):
            for i in range(m):
                before[i] = series[k, i] + 2.0 * x[r] * last[i] - before[i]
            last, before = before, last
        for i in range(m):
            out[r, i] = series[0, i] + x[r] * last[i] - before[i]


@inline
def _product(values, columns, out):
    """out = values @ columns, summed in order: the same bits in any block."""
    out[:] = 0.0
    for i in range(columns.shape[0]):
        for j in range(columns.shape[1]):
            out[j] += values[i] * columns[i, j]


@inline
def _doubt(series, place):
    """What a series leaves out and folds back, and rounding; a place on [-1, 1] is known to `place` ulp.

    The first from its last coefficients at the rate at which they fall; the second of the transform, of Clenshaw's
    recurrence, and of the rounded place in the axis, where T_k' <= k^2.
    """
    n = len(series)
    last = before = rounding = 0.0
    for k in range(n):
        size = abs(series[k])
        last = max(last, size) if k >= n - 4 else last
        before = max(before, size) if n - 8 <= k < n - 4 else before
        rounding += size * (4.0 + k + (0.5 + place) * k * k)
    rate = min(max(last / (before + 1e-300), 0.1), 0.9)
    return 4.0 * last / (1.0 - rate) + EPS * rounding


@inline
def _polynomials(x, tile):
    """T_0 ... at x, in the first lanes of the rows of `tile`."""
    for i in range(len(x)):
        tile[0, i], tile[1, i] = 1.0, x[i]
    for k in range(2, len(tile)):
        for i in range(len(x)):
            tile[k, i] = 2.0 * x[i] * tile[k - 1, i] - tile[k - 2, i]


@inline
def _sum(c, tile, sums, count):
    """sum_k c_k T_k in `count` lanes, eight terms a turn; there are a multiple of eight."""
    for i in range(count):
        sums[i] = 0.0
    for k in range(len(c) - 8, -1, -8):
        c0, c1, c2, c3, c4, c5, c6, c7 = c[k], c[k + 1], c[k + 2], c[k + 3], c[k + 4], c[k + 5], c[k + 6], c[k + 7]
        t = tile[k : k + 8]
        for i in range(count):
            low = (c0 * t[0, i] + c1 * t[1, i]) + (c2 * t[2, i] + c3 * t[3, i])
            high = (c4 * t[4, i] + c5 * t[5, i]) + (c6 * t[6, i] + c7 * t[7, i])
            sums[i] += low + high


@kernel
def discriminants(rows, coefficients, bars, x, rule, rtol, wanted, floats, verdict, late):
    """D of the `rows` from its series at x (L): D, its bar, the verdict, the exponent; `late` where not enough.

    Row rows[j]: D = sum_k coefficients[j, k] T_k(x) within bars[j]. Columns and `wanted` as in `kernels.hill.measure`.
    """
    terms, tiles = (coefficients.shape[1] + 7) // 8 * 8, (len(x) + TILE - 1) // TILE
    table, sums, own = np.empty((tiles, terms, TILE)), np.empty(TILE), np.zeros((len(rows), terms))
    own[:, : coefficients.shape[1]] = coefficients
    for t in range(tiles):
        _polynomials(x[t * TILE : (t + 1) * TILE], table[t])
    # A tile of the table stays in the first cache for some rows, and what is written within some pages.
    for turn in range((len(rows) + ROWS - 1) // ROWS * tiles):
        start, t = turn // tiles * ROWS, turn % tiles
        for j in range(start, min(start + ROWS, len(rows))):
            count = min(TILE, len(x) - t * TILE)
            _sum(own[j], table[t], sums, count)
            first = rows[j] * len(x) + t * TILE
            said, missed = verdict[first : first + count], late[first : first + count]
            _judge(sums, bars[j], floats[:, first : first + count], rtol, said, missed)
            if len(rule) > 0:
                for i in range(count):
                    missed[i] |= rule[rows[j], t * TILE + i] != NO_RULE
            if wanted[5]:
                for i in range(count):
                    # |D| - 2 = 4 sinh^2(exponent / 2)
                    growth, bar = exponent(0.25 * (abs(sums[i]) - 2.0), 0.25 * bars[j], said[i])
                    floats[EXPONENT, first + i], floats[EXPONENT + 1, first + i] = growth, bar
                    missed[i] |= not bar <= rtol * (1.0 + growth)


@inline
def _judge(d, bar, floats, rtol, verdict, late):
    """D, its bar and the verdict of neighbouring points, and who is late. Views: an offset index is not vector code."""
    for i in range(len(verdict)):
        floats[0, i], floats[1, i] = d[i], bar
    for i in range(len(verdict)):
        stable, unstable = abs(d[i]) < 2.0 - bar, abs(d[i]) > 2.0 + bar
        verdict[i] = np.int8(STABLE) if stable else np.int8(UNSTABLE) if unstable else np.int8(UNDECIDED)
    for i in range(len(verdict)):
        late[i] = verdict[i] == UNDECIDED
    if not bar <= rtol:
        for i in range(len(verdict)):
            late[i] |= not bar <= rtol * (1.0 + abs(d[i]))
