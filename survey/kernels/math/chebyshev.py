"""Chebyshev series of many rows at many points: rows share nothing, lanes of a row share their coefficients.

Source: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003), 2.4.1 (Clenshaw's recurrence).
"""

import numpy as np

from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.jit import kernel, splice
from survey.kernels.math.roundoff import EPS

TILE = 64
TERMS = 8  # as many as `_sum` spells out
ROWS = 8


def expand(values, matrix, place):
    """The series of each row of `values` (R, n) at nodes, by `matrix` (n, n; [from, to]), and its `_doubt` (R)."""
    series = np.zeros_like(values)
    for at, weights in enumerate(matrix):  # in this order, so that a row's bits do not depend on the others
        series += values[:, at, None] * weights
    return series, _doubt(np.abs(series), place)


def transform(rows, matrix, place):
    """Coefficients (n, m) along the first axis of `rows`, values at nodes, by `matrix` (n, n; [from, to]), and the
    `_doubt` (a number) of their sums over the columns.
    """
    series = np.zeros_like(rows)
    for row, weights in zip(rows, matrix, strict=True):
        series += weights[:, None] * row
    return series, float(_doubt(np.abs(series).sum(axis=1)[None], place)[0])


@kernel
def restrict(series, x, work, out):
    """out[r] = sum_k series[k] T_k(x[r]): the rows' own coefficients, by Clenshaw's recurrence; `work` is (2, m)."""
    n, m = series.shape
    for r in range(len(x)):
        last, before = work[0], work[1]
        for i in range(m):
            last[i], before[i] = 0.0, 0.0
        for k in range(n - 1, 0, -1):
            for i in range(m):
                before[i] = series[k, i] + 2.0 * x[r] * last[i] - before[i]
            last, before = before, last
        for i in range(m):
            out[r, i] = series[0, i] + x[r] * last[i] - before[i]


def _doubt(sizes, place):
    """What series of such coefficients (R, n) leave out and fold back, and rounding; a place on [-1, 1] is known to
    `place` ulp.

    The first from its last coefficients at the rate at which they fall; the second of the transform, of Clenshaw's
    recurrence, and of the rounded place in the axis, where T_k' <= k^2.
    """
    k = np.arange(sizes.shape[1])
    last, before = sizes[:, -4:].max(axis=1), sizes[:, -8:-4].max(axis=1, initial=0.0)
    rounding = (sizes * (4.0 + k + (0.5 + place) * k * k)).sum(axis=1)
    rate = np.clip(last / (before + 1e-300), 0.1, 0.9)
    return 4.0 * last / (1.0 - rate) + EPS * rounding


@splice
def _polynomials(x, tile):
    """T_0 ... at x, in the first lanes of the rows of `tile`."""
    for i in range(len(x)):
        tile[0, i], tile[1, i] = 1.0, x[i]
    for k in range(2, len(tile)):
        for i in range(len(x)):
            tile[k, i] = 2.0 * x[i] * tile[k - 1, i] - tile[k - 2, i]


@splice
def _sum(c, tile, sums, count):
    """sum_k c_k T_k in `count` lanes, TERMS terms a turn."""
    for i in range(count):
        sums[i] = 0.0
    for k in range(len(c) - TERMS, -1, -TERMS):
        c0, c1, c2, c3, c4, c5, c6, c7 = c[k], c[k + 1], c[k + 2], c[k + 3], c[k + 4], c[k + 5], c[k + 6], c[k + 7]
        t = tile[k : k + TERMS]
        for i in range(count):
            low = (c0 * t[0, i] + c1 * t[1, i]) + (c2 * t[2, i] + c3 * t[3, i])
            high = (c4 * t[4, i] + c5 * t[5, i]) + (c6 * t[6, i] + c7 * t[7, i])
            sums[i] += low + high


@kernel
def discriminants(rows, coefficients, bars, x, rtol, floats, verdict, late):
    """D of the `rows` from its series at x (L): D, its bar and the verdict; `late` where not enough.

    Row rows[j]: D = sum_k coefficients[j, k] T_k(x) within bars[j], coefficients in a multiple of TERMS. Columns as in
    `kernels.hill.answers.measure`.
    """
    terms, tiles = coefficients.shape[1], (len(x) + TILE - 1) // TILE
    table, sums = np.empty((tiles, terms, TILE)), np.empty(TILE)
    for t in range(tiles):
        _polynomials(x[t * TILE : (t + 1) * TILE], table[t])
    # A tile of the table stays in the first cache for some rows, and what is written within some pages.
    for turn in range((len(rows) + ROWS - 1) // ROWS * tiles):
        start, t = turn // tiles * ROWS, turn % tiles
        count = len(x) - t * TILE if t == tiles - 1 else TILE
        for j in range(start, len(rows) if start + ROWS > len(rows) else start + ROWS):
            _sum(coefficients[j], table[t], sums, count)
            first = rows[j] * len(x) + t * TILE
            said, missed = verdict[first : first + count], late[first : first + count]
            _judge(sums, bars[j], floats[:, first : first + count], rtol, said, missed)


@splice
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
