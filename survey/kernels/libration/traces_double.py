"""As `traces`, from factors in double-double: what decides is formed to 30 digits, and only then rounded."""

from math import isfinite

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.libration.danby_double import BARS, LOW
from survey.kernels.libration.traces import (
    INVARIANTS,
    KREIN,
    LARGEST,
    MINUS_ONE,
    PAIRS,
    PAIRS_BAR,
    STABLE,
    SUM,
    SUM_BAR,
    TILE,
    UNDECIDED,
    UNSTABLE,
    A,
    B,
    C,
    D,
    T,
    decide,
    inaccurate,
    lost,
)
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import PAIR_ROUNDOFF, ROUNDOFF_UP

MARGIN = 1.01  # for what is of second order in the bars, and for signs told from leading parts
NODES = 32  # of a row's series


@kernel
def measure(results, rtol, overflow, floats, verdict, collision, missed, status):
    """As `traces.measure`, from results (N, danby_double.RESULTS)."""
    for i in range(len(results)):
        _settle(results[i], i, rtol, overflow, floats, verdict, collision, missed, status)


@inline
def _settle(r, i, rtol, overflow, floats, verdict, collision, missed, status):
    """Answer point i from its results r; `missed` if it is undecided in any way, or misses `rtol`."""
    t, t_bar = (r[T], r[LOW + T]), r[BARS + T]
    ab, ab_bar = product((r[A], r[LOW + A]), (r[B], r[LOW + B]), r[BARS + A], r[BARS + B])
    cd, cd_bar = product((r[C], r[LOW + C]), (r[D], r[LOW + D]), r[BARS + C], r[BARS + D])
    by_ab = ab_bar <= cd_bar
    a = dd.scaled(dd.shifted(t, -1.0), 4.0)
    b = dd.add(dd.scaled(t, -8.0 if by_ab else 8.0), dd.scaled(ab if by_ab else cd, 16.0))
    b = dd.shifted(b, 6.0 if by_ab else -10.0)
    size = 1.0 + abs(t[0]) + abs(ab[0] if by_ab else cd[0])
    a_bar = MARGIN * (4.0 * t_bar + 8.0 * PAIR_ROUNDOFF * size) + ROUNDOFF_UP * abs(a[0])
    b_bar = MARGIN * (
        16.0 * min(ab_bar, cd_bar) + 8.0 * t_bar + 64.0 * PAIR_ROUNDOFF * size
    ) + ROUNDOFF_UP * abs(b[0])
    verdict[i] = collision[i] = UNDECIDED
    missed[i] = True
    if not (isfinite(a[0]) and isfinite(b[0]) and a_bar < LARGEST and b_bar < LARGEST):
        status[i] = overflow
        floats[SUM, i] = floats[SUM_BAR, i] = floats[PAIRS, i] = floats[PAIRS_BAR, i] = np.nan
        return
    status[i] = 0
    floats[SUM, i], floats[SUM_BAR, i], floats[PAIRS, i], floats[PAIRS_BAR, i] = (
        a[0],
        a_bar,
        b[0],
        b_bar,
    )
    k, k_bar = discriminant(t, ab, cd, t_bar, ab_bar, cd_bar)
    beyond = dd.shifted(t, -2.0)[0]
    verdict[i] = decide(t[0], beyond, ab[0], cd[0], k[0], t_bar, ab_bar, cd_bar, k_bar)
    if verdict[i] == UNSTABLE:
        collision[i] = lost(t[0], beyond, ab[0], cd[0], k[0], t_bar, ab_bar, cd_bar, k_bar)
    elif verdict[i] == STABLE:
        collision[i] = MINUS_ONE if (r[B] > 0.0) == (r[D] > 0.0) else nearest(t, k, t_bar, k_bar)
    missed[i] = (
        inaccurate(a[0], a_bar, b[0], b_bar, rtol)
        or verdict[i] == UNDECIDED
        or collision[i] == UNDECIDED
    )


@inline
def product(a, b, ea, eb):
    """a b and its error bound; of its sign, where that is certain of both factors, it leaves no doubt."""
    p = dd.mul(a, b)
    return p, MARGIN * (ea * abs(b[0]) + eb * abs(a[0]) + ea * eb + 2.0 * PAIR_ROUNDOFF * abs(p[0]))


@inline
def discriminant(t, ab, cd, t_bar, ab_bar, cd_bar):
    """K and its bar, as `traces.discriminant`."""
    other = dd.shifted(t, -2.0)
    by_ab = abs(t[0]) * t_bar + 2.0 * ab_bar <= abs(other[0]) * t_bar + 2.0 * cd_bar
    root, last, bar = (t, ab, ab_bar) if by_ab else (other, cd, cd_bar)
    square, last = dd.square(root), dd.scaled(last, 4.0)
    rounding = PAIR_ROUNDOFF * (
        4.0 * square[0] + 2.0 * abs(last[0]) + (0.0 if by_ab else 4.0 * abs(root[0]))
    )
    return dd.sub(square, last), MARGIN * (
        2.0 * abs(root[0]) * t_bar + t_bar * t_bar + 4.0 * bar + rounding
    )


@inline
def nearest(t, k, t_bar, k_bar):
    """As `traces.nearest`, of k > k_bar."""
    root = dd.sqrt(k)
    low, high = dd.sqrt(dd.shifted(k, -k_bar)), dd.sqrt(dd.shifted(k, k_bar))
    bar = MARGIN * (t_bar + dd.sub(high, low)[0] + 16.0 * PAIR_ROUNDOFF)
    one, two = dd.add(dd.shifted(t, -1.0), root), dd.sub(dd.shifted(t, -1.0), root)
    cosine = dd.mul(two, dd.shifted(dd.scaled(dd.square(two), 4.0), -3.0))
    gap = dd.sub(one, cosine)[0]
    margin = bar * (1.0 + abs(12.0 * two[0] * two[0] - 3.0) + 24.0 * bar) + 64.0 * PAIR_ROUNDOFF
    beyond = dd.shifted(two, 0.5)[0]
    if gap > margin and beyond < -bar:
        return MINUS_ONE
    return KREIN if gap < -margin or beyond > bar else UNDECIDED


@kernel
def to_series(results, matrix, series, bars):
    """Chebyshev series (5, 2, NODES) of A to t and their bars (5) from results (NODES, 15) at the
    nodes.

    `matrix` (2, NODES, NODES) makes coefficients of values, row by coefficient.
    """
    for j in range(INVARIANTS):
        bars[j] = 0.0
        for n in range(NODES):
            s = (0.0, 0.0)
            for i in range(NODES):
                s = dd.add(
                    s,
                    dd.mul(
                        (matrix[0, n, i], matrix[1, n, i]), (results[i, j], results[i, LOW + j])
                    ),
                )
            series[j, 0, n], series[j, 1, n] = s
            bars[j] = max(bars[j], results[n, BARS + j])


@kernel
def dense(series, bars, mu, rtol, overflow, floats, verdict, collision, missed, status):
    """Answer all points mu (N) of a row from its series (5, 2, NODES) in 4 s - 3; the `bars` (5)
    hold for the row.
    """
    r, here = np.empty(BARS + INVARIANTS), np.empty((INVARIANTS, 2, TILE))
    x, one, two = np.empty((2, TILE)), np.empty((2, TILE)), np.empty((2, TILE))
    for first in range(0, len(mu), TILE):
        count = min(TILE, len(mu) - first)
        for i in range(count):
            half = dd.two_sum(0.5, -mu[first + i])
            s = dd.positive_root(dd.shifted(dd.times(dd.square(half), 3.0), 0.25))
            x[0, i], x[1, i] = dd.shifted(dd.scaled(s, 4.0), -3.0)
        for j in range(INVARIANTS):
            one[:], two[:] = 0.0, 0.0
            for n in range(NODES - 1, -1, -1):  # Clenshaw, of all points at once
                factor, coefficient = (2.0 if n else 1.0), (series[j, 0, n], series[j, 1, n])
                for i in range(count):
                    last, before = (one[0, i], one[1, i]), (two[0, i], two[1, i])
                    rest = dd.sub(dd.scaled(dd.mul((x[0, i], x[1, i]), last), factor), before)
                    two[0, i], two[1, i] = last
                    one[0, i], one[1, i] = dd.add(coefficient, rest)
            here[j, 0, :count], here[j, 1, :count] = one[0, :count], one[1, :count]
        for i in range(count):
            for j in range(INVARIANTS):
                r[j], r[LOW + j], r[BARS + j] = here[j, 0, i], here[j, 1, i], bars[j]
            _settle(r, first + i, rtol, overflow, floats, verdict, collision, missed, status)
