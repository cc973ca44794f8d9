"""Trace invariants of a reversible linear Hamiltonian system with two degrees of freedom, point by
point.

With (P, S; Q, T) the propagator over half the period in canonical coordinates X, Y that the
reflection maps to X, -Y:

    A = det P, B = det T, C = det Q, D = det S, t = tr T'P,     A B - C D = t - 1
    a = 4 t - 4,   b = 6 - 8 t + 16 A B = 8 t - 10 + 16 C D,   K = t^2 - 4 A B = (t - 2)^2 - 4 C D

lambda + 1 / lambda = 2 + 4 w for the two eigenvalues w of S'Q, whose discriminant is K
(`survey.measures.libration.danby`).
"""

from math import isfinite, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
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


@kernel
def measure(results, rtol, overflow, floats, verdict, collision, missed, status):
    """a, its bar, b, its bar (4, N), verdict and collision from `results` (N, RESULTS); who misses
    `rtol` is `missed`.

    Points whose `status` is not 0 are skipped; those that leave the range of floats get the status
    `overflow`.
    """
    for i in range(len(results)):
        if status[i] == 0:
            r = results[i]
            values = (r[A], r[B], r[C], r[D], r[T])
            bars = (r[A_BAR], r[B_BAR], r[C_BAR], r[D_BAR], r[T_BAR])
            _settle(values, bars, i, rtol, overflow, floats, verdict, collision, missed, status)


@inline
def _settle(values, bars, i, rtol, overflow, floats, verdict, collision, missed, status):
    """Answer point i from its A, B, C, D, t and their bars."""
    missed[i] = False
    t, t_bar = values[T], bars[T]
    ab, ab_bar = product(values[A], values[B], bars[A], bars[B])
    cd, cd_bar = product(values[C], values[D], bars[C], bars[D])
    a, a_bar = 4.0 * t - 4.0, 4.0 * t_bar + EPS * (4.0 * abs(t) + 4.0)
    by_ab = ab_bar <= cd_bar
    b = 6.0 - 8.0 * t + 16.0 * ab if by_ab else 8.0 * t - 10.0 + 16.0 * cd
    b_bar = 16.0 * min(ab_bar, cd_bar) + 8.0 * t_bar
    b_bar += EPS * (16.0 * abs(ab if by_ab else cd) + 16.0 * abs(t) + 20.0)
    if not (isfinite(a) and isfinite(b) and a_bar < LARGEST and b_bar < LARGEST):
        status[i] = overflow
        floats[SUM, i] = floats[SUM_BAR, i] = floats[PAIRS, i] = floats[PAIRS_BAR, i] = np.nan
        verdict[i] = collision[i] = UNDECIDED
        missed[i] = True
        return
    floats[SUM, i], floats[SUM_BAR, i], floats[PAIRS, i], floats[PAIRS_BAR, i] = a, a_bar, b, b_bar
    k, k_bar = discriminant(t, ab, cd, t_bar, ab_bar, cd_bar)
    verdict[i] = decide(t, t - 2.0, ab, cd, k, t_bar, ab_bar, cd_bar, k_bar)
    collision[i] = UNDECIDED
    if verdict[i] == UNSTABLE:
        collision[i] = lost(t, t - 2.0, ab, cd, k, t_bar, ab_bar, cd_bar, k_bar)
    elif verdict[i] == STABLE:
        definite = (values[B] > 0.0) == (values[D] > 0.0)
        collision[i] = MINUS_ONE if definite else nearest(t, k, t_bar, k_bar)
    missed[i] = inaccurate(a, a_bar, b, b_bar, rtol) or verdict[i] == UNDECIDED


@inline
def inaccurate(a, a_bar, b, b_bar, rtol):
    return not (a_bar <= rtol * (1.0 + abs(a)) and b_bar <= rtol * (1.0 + abs(b)))


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
    if ab < -ab_bar or cd < -cd_bar or k < -k_bar or t < -t_bar or beyond > t_bar:
        return UNSTABLE
    if ab > ab_bar and cd > cd_bar and k > k_bar and t > t_bar and beyond < -t_bar:
        return STABLE
    return UNDECIDED


@inline
def lost(t, beyond, ab, cd, k, t_bar, ab_bar, cd_bar, k_bar):
    """Which multipliers are off the circle: a complex quadruple, a negative pair, or positive ones alone."""
    if k < -k_bar:
        return KREIN
    if ab < -ab_bar or (k > k_bar and t < -t_bar):
        return MINUS_ONE
    if k > k_bar and ab > ab_bar and (cd < -cd_bar or beyond > t_bar):
        return NONE
    return UNDECIDED


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
    if gap > margin and two < -0.5 - bar:
        return MINUS_ONE
    return KREIN if gap < -margin or two > -0.5 + bar else UNDECIDED


@inline
def coordinate(mu):
    """4 s - 3 within half an EPS."""
    s = dd.positive_root(dd.shifted(dd.times(dd.square(dd.two_sum(0.5, -mu)), 3.0), 0.25))
    return (4.0 * s[0] - 3.0) + 4.0 * s[1]


@kernel
def dense(series, bars, rows, mu, rtol, overflow, floats, verdict, collision, missed, status):
    """Answer the `missed` points of `rows` of mu (R, L) from their Chebyshev series in 4 s - 3
    (rows, 5, NODES).

    `bars` (rows, 5) hold for the whole row; `missed` remain those that miss `rtol` or are
    undecided.
    """
    here, x = np.empty((INVARIANTS, TILE)), np.empty(TILE)
    for r in range(len(rows)):
        bar = bars[r, A], bars[r, B], bars[r, C], bars[r, D], bars[r, T]
        for first in range(0, mu.shape[1], TILE):
            count = min(TILE, mu.shape[1] - first)
            for i in range(count):
                x[i] = coordinate(mu[rows[r], first + i])
            for j in range(INVARIANTS):
                # Clenshaw; NODES is a constant, so that the inner loop is unrolled
                for i in range(count):
                    one = two = 0.0
                    for n in range(NODES - 1, 0, -1):
                        one, two = series[r, j, n] + 2.0 * x[i] * one - two, one
                    here[j, i] = series[r, j, 0] + x[i] * one - two
            for i in range(count):
                at = rows[r] * mu.shape[1] + first + i
                if missed[at]:
                    values = here[A, i], here[B, i], here[C, i], here[D, i], here[T, i]
                    _settle(
                        values, bar, at, rtol, overflow, floats, verdict, collision, missed, status
                    )
