"""Discriminants of many rows from their Chebyshev series: rows share nothing, lanes of a row share their coefficients.

Source: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003), 2.4.1.
"""

import numpy as np

from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.jit import kernel, splice

TILE = 64
TERMS = 8  # as many as `_sum` spells out
ROWS = 8


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
def discriminants(rows, coefficients, bars, x, rtol, floats, verdict, missed):
    """D of the `rows` from its series at x (L): D, its bar and the verdict; `missed` where not enough.

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
            decided, misses = verdict[first : first + count], missed[first : first + count]
            _decide(sums, bars[j], floats[:, first : first + count], rtol, decided, misses)


@splice
def _decide(d, bar, floats, rtol, verdict, missed):
    """D, its bar and the verdict of neighbouring points, and who missed. Views: an offset index is not vector code."""
    for i in range(len(verdict)):
        floats[0, i], floats[1, i] = d[i], bar
    for i in range(len(verdict)):
        stable, unstable = abs(d[i]) < 2.0 - bar, abs(d[i]) > 2.0 + bar
        verdict[i] = np.int8(STABLE) if stable else np.int8(UNSTABLE) if unstable else np.int8(UNDECIDED)
    for i in range(len(verdict)):
        missed[i] = verdict[i] == UNDECIDED
    if not bar <= rtol:
        for i in range(len(verdict)):
            missed[i] |= not bar <= rtol * (1.0 + abs(d[i]))
