"""Trace invariants of a reversible linear Hamiltonian system with two degrees of freedom, point by
point.

With (P, S; Q, T) the propagator over half the period in canonical coordinates X, Y that the
reflection maps to X, -Y:

    A = det P, B = det T, C = det Q, D = det S, t = tr T'P,     A B - C D = t - 1
    a = 4 t - 4,   b = 6 - 8 t + 16 A B = 8 t - 10 + 16 C D,   K = t^2 - 4 A B = (t - 2)^2 - 4 C D

lambda + 1 / lambda = 2 + 4 w for the two eigenvalues w of S'Q, whose discriminant is K
(`survey.measures.libration.danby`).
"""

from math import inf, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math import double as dd
from survey.kernels.math.chebyshev import sum_turns
from survey.kernels.math.roundoff import EPS

LARGEST = float(np.finfo(np.float32).max)  # bars are kept as float32
UNDECIDED, UNSTABLE, STABLE = -1, 0, 1
NONE, MINUS_ONE, KREIN = 0, 1, 2
# The columns of a point's results, each with its error bound; the rows of its answers.
A, B, C, D, T, A_BAR, B_BAR, C_BAR, D_BAR, T_BAR = range(10)
RESULTS, INVARIANTS = 10, 5  # columns, and how many of them are values
# a, b: the sums of the multipliers, and of the products of two
SUM, SUM_BAR, PAIRS, PAIRS_BAR = range(4)
NODES = 24  # of a row's series
TILE = 64
GROUP = 8  # rows that share a table of T_n, as long as their mu are the same
# Rows of a tile of points, after their results: is the point to be answered?, AB, CD, a and b, each with its bar,
# is all of that finite?, K with its bar, and what is decided.
OPEN, AB, AB_BAR, CD, CD_BAR = range(RESULTS, RESULTS + 5)
OWN_SUM, OWN_SUM_BAR, OWN_PAIRS, OWN_PAIRS_BAR = range(RESULTS + 5, RESULTS + 9)
FINITE, K, K_BAR, DECIDED, MEETING = range(RESULTS + 9, RESULTS + 14)
TILE_ROWS = RESULTS + 14


@splice
def _settle(tile, rtol, overflow, floats, verdict, collision, missed, status):
    """Answer those points of a tile that are OPEN from their A, B, C, D, t and the bars of these.

    Loops over rows of one array, without branches: vector code.
    """
    for i in range(len(status)):
        tile[AB, i], tile[AB_BAR, i] = product(
            tile[A, i], tile[B, i], tile[A_BAR, i], tile[B_BAR, i]
        )
        tile[CD, i], tile[CD_BAR, i] = product(
            tile[C, i], tile[D, i], tile[C_BAR, i], tile[D_BAR, i]
        )
    for i in range(len(status)):
        t, t_bar, ab, cd = tile[T, i], tile[T_BAR, i], tile[AB, i], tile[CD, i]
        ab_bar, cd_bar = tile[AB_BAR, i], tile[CD_BAR, i]
        a, a_bar = 4.0 * t - 4.0, 4.0 * t_bar + EPS * (4.0 * abs(t) + 4.0)
        by_ab = ab_bar <= cd_bar
        one, other = 6.0 - 8.0 * t + 16.0 * ab, 8.0 * t - 10.0 + 16.0 * cd
        b, product_of_two = one if by_ab else other, ab if by_ab else cd
        b_bar = 16.0 * min(ab_bar, cd_bar) + 8.0 * t_bar
        b_bar += EPS * (16.0 * abs(product_of_two) + 16.0 * abs(t) + 20.0)
        finite = (abs(a) < inf) & (abs(b) < inf) & (a_bar < LARGEST) & (b_bar < LARGEST)
        tile[OWN_SUM, i], tile[OWN_SUM_BAR, i] = a, a_bar
        tile[OWN_PAIRS, i], tile[OWN_PAIRS_BAR, i] = b, b_bar
        tile[FINITE, i] = 1.0 if finite else 0.0
        tile[K, i], tile[K_BAR, i] = discriminant(t, ab, cd, t_bar, ab_bar, cd_bar)
    for i in range(len(status)):
        t, t_bar, k, k_bar = tile[T, i], tile[T_BAR, i], tile[K, i], tile[K_BAR, i]
        ab, ab_bar, cd, cd_bar = tile[AB, i], tile[AB_BAR, i], tile[CD, i], tile[CD_BAR, i]
        given = t, t - 2.0, ab, cd, k, t_bar, ab_bar, cd_bar, k_bar
        found = decide(*given)
        alike = (tile[B, i] > 0.0) == (tile[D, i] > 0.0)
        first, where_lost = nearest(t, k, t_bar, k_bar), lost(*given)
        if_stable = MINUS_ONE if alike else first
        meeting = where_lost if found == UNSTABLE else if_stable
        tile[DECIDED, i], tile[MEETING, i] = found, UNDECIDED if found == UNDECIDED else meeting
    for row in range(len(floats)):  # SUM to PAIRS_BAR
        _keep(tile, OWN_SUM + row, floats[row])
    for i in range(len(status)):
        wide = inaccurate(
            tile[OWN_SUM, i], tile[OWN_SUM_BAR, i], tile[OWN_PAIRS, i], tile[OWN_PAIRS_BAR, i], rtol
        )
        known, found = tile[FINITE, i] == 1.0, tile[DECIDED, i]
        open_, left = tile[OPEN, i] == 1.0, wide | (found == UNDECIDED)
        tile[DECIDED, i] = found if known else UNDECIDED
        tile[MEETING, i] = tile[MEETING, i] if known else UNDECIDED
        missed[i] = (left | (not known)) if open_ else missed[i]
        status[i] = np.int8(overflow) if open_ & (not known) else status[i]
    for i in range(len(status)):
        verdict[i] = np.int8(tile[DECIDED, i]) if tile[OPEN, i] == 1.0 else verdict[i]
        collision[i] = np.int8(tile[MEETING, i]) if tile[OPEN, i] == 1.0 else collision[i]


@splice
def _keep(tile, row, values):
    """Fill the `values` of points that are OPEN from a row of the tile, NaN where not all is FINITE."""
    for i in range(len(values)):
        known = tile[row, i] if tile[FINITE, i] == 1.0 else np.nan
        values[i] = known if tile[OPEN, i] == 1.0 else values[i]


@inline
def inaccurate(a, a_bar, b, b_bar, rtol):
    return not ((a_bar <= rtol * (1.0 + abs(a))) & (b_bar <= rtol * (1.0 + abs(b))))


@inline
def product(a, b, ea, eb):
    """a b and its error bound, the rounding of the product included."""
    return a * b, ea * abs(b) + eb * abs(a) + ea * eb + EPS * abs(a * b)


@inline
def discriminant(t, ab, cd, t_bar, ab_bar, cd_bar):
    """K and its bar, from whichever of its two forms has the smaller one."""
    near, far = abs(t), abs(t - 2.0)
    by_ab = 2.0 * near * t_bar + 4.0 * ab_bar <= 2.0 * far * t_bar + 4.0 * cd_bar
    root = t if by_ab else t - 2.0
    other, bar = (ab, ab_bar) if by_ab else (cd, cd_bar)
    k = root * root - 4.0 * other
    rounding = EPS * (2.0 * root * root + 4.0 * abs(other) + (0.0 if by_ab else 4.0 * abs(root)))
    return k, 2.0 * abs(root) * t_bar + t_bar * t_bar + 4.0 * bar + rounding


@inline
def decide(t, beyond, ab, cd, k, t_bar, ab_bar, cd_bar, k_bar):
    """Stable: both w real, different and in (-1, 0). Certain only where the bars exclude the other
    answer.

    `beyond` is t - 2, whose bar is that of t.
    """
    off = (ab < -ab_bar) | (cd < -cd_bar) | (k < -k_bar) | (t < -t_bar) | (beyond > t_bar)
    on = (ab > ab_bar) & (cd > cd_bar) & (k > k_bar) & (t > t_bar) & (beyond < -t_bar)
    return UNSTABLE if off else STABLE if on else UNDECIDED


@inline
def lost(t, beyond, ab, cd, k, t_bar, ab_bar, cd_bar, k_bar):
    """Which multipliers are off the circle: a complex quadruple, a negative pair, or positive ones alone."""
    real = k > k_bar
    through = (ab < -ab_bar) | (real & (t < -t_bar))
    none = real & (ab > ab_bar) & ((cd < -cd_bar) | (beyond > t_bar))
    return KREIN if k < -k_bar else MINUS_ONE if through else NONE if none else UNDECIDED


@inline
def nearest(t, k, t_bar, k_bar):
    """Which arc of the unit circle is the shorter: from one pair to the other, or through -1 within
    one pair?

    cos theta = 1 + 2 w; the arcs are theta2 - theta1 and 2 (pi - theta2), and the second is the
    shorter where theta1 < 3 theta2 - 2 pi: where theta2 > 2 pi / 3 and cos theta1 > cos 3 theta2.
    """
    root, low = sqrt(max(k, 0.0)), sqrt(max(k - k_bar, 0.0))
    bar = t_bar + max(sqrt(k + k_bar) - root, root - low) + 4.0 * EPS
    one, two = t - 1.0 + root, t - 1.0 - root
    gap = one - two * (4.0 * two * two - 3.0)
    margin = bar * (1.0 + abs(12.0 * two * two - 3.0) + 24.0 * bar)
    inside, between = (gap > margin) & (two < -0.5 - bar), (gap < -margin) | (two > -0.5 + bar)
    return MINUS_ONE if inside else KREIN if between else UNDECIDED


@inline
def coordinate(mu):
    """4 s - 3 within half an EPS."""
    s = dd.positive_root(dd.shifted(dd.times(dd.square(dd.two_sum(0.5, -mu)), 3.0), 0.25))
    return (4.0 * s[0] - 3.0) + 4.0 * s[1]


@inline
def cosines(out, count):
    """T_n of out[1] in row n, of the first `count` columns."""
    for n in range(2, len(out)):
        for i in range(count):
            out[n, i] = 2.0 * out[1, i] * out[n - 1, i] - out[n - 2, i]


@kernel
def answer(
    results, series, bars, rows, mu, rtol, overflow, floats, verdict, collision, missed, status
):
    """a, its bar, b, its bar (4, N), verdict and collision; who misses `rtol` or is undecided is
    `missed`, and those that leave the range of floats get the status `overflow`.

    Of the points whose `status` is 0 from their `results` (N, RESULTS); or, where there are none, of the
    `missed` ones of `rows` of mu (R, L) from the rows' Chebyshev series in 4 s - 3 (rows, 5, NODES),
    of which `bars` (rows, 5) hold for the whole row. One kernel, as most of it is the same code.
    """
    table, tile, known = np.empty((NODES, TILE)), np.empty((TILE_ROWS, TILE)), np.empty(TILE)
    by_points = len(results) > 0
    number, size = (1, len(results)) if by_points else (len(rows), mu.shape[1])
    for start in range(0, number, GROUP):
        for first in range(0, size, TILE):
            count = min(TILE, size - first)
            for r in range(start, min(start + GROUP, number)):
                at = first if by_points else rows[r] * size + first
                end = at + count
                left, state = missed[at:end], status[at:end]
                if by_points:
                    for i in range(count):
                        for j in range(RESULTS):
                            tile[j, i] = results[first + i, j]
                        tile[OPEN, i] = 1.0 if state[i] == 0 else 0.0
                else:
                    own = mu[rows[r], first : first + count]
                    if r == start or _differ(own, known):
                        _table(own, known, table)
                    for j in range(INVARIANTS):
                        sum_turns(series[r, j], table, tile[j], count)
                        for i in range(count):
                            tile[INVARIANTS + j, i] = bars[r, j]
                    for i in range(count):
                        tile[OPEN, i] = 1.0 if left[i] else 0.0
                _settle(tile, rtol, overflow, floats[:, at:end], verdict[at:end], collision[at:end], left,
                        state)  # fmt: skip


@splice
def _differ(one, other):
    """Is any of the numbers another than that of the first of `other`?"""
    number = 0
    for i in range(len(one)):
        number += one[i] != other[i]
    return number > 0


@splice
def _table(mu, known, table):
    """T_n, n < NODES, at the points mu, which are noted, and at 0 in the other lanes."""
    for i in range(TILE):
        known[i] = mu[i] if i < len(mu) else 0.0
    for i in range(TILE):
        table[0, i], table[1, i] = 1.0, coordinate(known[i])
    cosines(table, TILE)
