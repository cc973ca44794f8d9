"""Equilibria of the flow: all roots of g on the circle, their type, and regions that they are
proven to attract.
"""

import math

import numpy as np

from survey.kernels.cylinder.flow import (
    BOUND_DDG,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    S2,
    TWO_PI,
    values,
)
from survey.kernels.cylinder.program import COLUMNS
from survey.kernels.cylinder.roots import CENTRE, MOST_DISCS, NO_REAL, RADIUS, ROOTS, SLOPE, discs
from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.newton import bracketed
from survey.kernels.math.roundoff import ROUNDOFF_UP

MOST = 4  # g has 4 roots at most
MOST_PIECES = 20_000  # of the circle: more are needed next to a triple root only
HIDDEN, LONG = -1, -2
NARROW = 1e-6  # rad: two complex roots in so small a disc leave |g| below 1e-13 of its bound
ANGLE, F, DG, BAR, KIND, STABLE, VAA, VAB, VBB, LEVEL = range(10)
EQUILIBRIUM_SIZE = 10
SADDLE, NODE, FOCUS, DEGENERATE = range(4)


def equilibria(p, table):
    """Fill the rows of `table` (MOST, EQUILIBRIUM_SIZE) with the equilibria in [0, 2 pi), ascending.

    Returns their number, and whether the roundings of float64 hide one, or that there is none: g'
    beside it, or g where it comes near 0 without reaching it. Then the rows are those of
    `clustered`, which is compiled when one needs it.
    """
    count = bisected(p, table)
    if count >= 0:
        return count, False
    if len(p) > COLUMNS:  # the discs know the gyrostat's g alone
        return 0, True
    found, hidden = clustered(p, table)
    return found, hidden or count == HIDDEN


equilibria_inside = kernel(equilibria)  # for kernels


@kernel
def bisected(p, table):
    """As `equilibria`; or HIDDEN, or LONG where it would take long to tell."""
    found = np.empty(len(table) + 1)
    lows, highs = np.empty(4096), np.empty(4096)
    count, top, pieces, start = 0, 0, 16, 0.123456
    for i in range(pieces - 1, -1, -1):
        lows[top], highs[top] = start + i * TWO_PI / pieces, start + (i + 1) * TWO_PI / pieces
        top += 1
    while top > 0:  # |g'| <= BOUND_DG excludes a root, |g''| <= BOUND_DDG shows that g is monotone
        top -= 1
        pieces += 1
        low, high = lows[top], highs[top]
        half, middle = 0.5 * (high - low), 0.5 * (low + high)
        _f, g, dg = values(p, middle)
        if abs(g) > 1.001 * p[BOUND_DG] * half:
            continue
        if abs(dg) > 1.001 * p[BOUND_DDG] * half:
            if (values(p, low)[1] >= 0.0) != (values(p, high)[1] >= 0.0):
                found[count] = root(p, low, high)
                count += 1
        elif half < 1e-13:
            if count == 0 or abs(middle - found[count - 1]) > 1e-6:
                return HIDDEN
        elif top + 2 < len(lows):
            lows[top], highs[top], lows[top + 1], highs[top + 1] = middle, high, low, middle
            top += 2
        if count > len(table):
            return HIDDEN
        if pieces > MOST_PIECES:
            return LONG
    for i in range(count):  # into [0, 2 pi), by insertion
        insert(found, i, max(found[i] - TWO_PI, 0.0) if found[i] >= TWO_PI else found[i])
    for i in range(count):
        f, _g, dg = values(p, found[i])
        bar, hidden = blurred(p, found[i], dg)
        if hidden:
            return HIDDEN
        describe(p, found[i], f, dg, bar, table[i])
    return count


@inline
def blurred(p, x, dg):
    """How far rounding may move a root that float64 finds at x, and does that reach to g' = 0?"""
    bar = 4e-16 * (1.0 + abs(x)) + 4.0 * ROUNDOFF_UP * p[BOUND_G] / max(abs(dg), 1e-300)
    return bar, abs(dg) <= p[BOUND_DDG] * bar + 8.0 * ROUNDOFF_UP * p[BOUND_DG]


@kernel
def clustered(p, table):
    """As `equilibria`, by `discs` in double-double: a cluster that these cannot take apart is one
    degenerate row.
    """
    found, order, at = np.empty((MOST_DISCS, 5)), np.empty(MOST, dtype=np.int64), np.empty(MOST)
    size, count, hidden = discs(p, found), 0, False
    for i in range(size):
        if found[i, ROOTS] == NO_REAL or count == MOST:
            hidden = hidden or found[i, RADIUS] < NARROW
            continue
        x = found[i, CENTRE]
        x = x + TWO_PI if x < 0.0 else x
        k = insert(at, count, 0.0 if x >= TWO_PI else x)
        for j in range(count, k, -1):
            order[j] = order[j - 1]
        order[k] = i
        count += 1
    for i in range(count):
        disc, row, x = found[order[i]], table[i], at[i]
        describe(p, x, values(p, x)[0], disc[SLOPE], 4e-16 * (1.0 + x) + disc[RADIUS], row)
        hidden = hidden or blurred(p, x, disc[SLOPE])[1]
        if p[BOUND_DDG] * row[BAR] > 1e-3 * abs(row[DG]):  # g' has not the digits to prove a region
            row[LEVEL] = 0.0
        if disc[ROOTS] != 1.0:
            row[KIND], row[STABLE], hidden = DEGENERATE, 0.0, True
    return count, hidden


@inline
def insert(sorted_, size, x):
    """Put x where it belongs among the first `size`, ascending; returns its index."""
    k = size
    while k > 0 and sorted_[k - 1] > x:
        sorted_[k] = sorted_[k - 1]
        k -= 1
    sorted_[k] = x
    return k


@part
def root(p, low, high):
    """The root of g between low and high, where g is monotone and changes sign."""
    given = p, values(p, high)[1] >= 0.0
    return bracketed(
        _acceleration, values, given, 0.5 * (low + high), (low, high), (2e-16, 2e-16), 80
    )[1]


@inline
def _acceleration(flow, given, x):
    p, rising = given
    _f, g, dg = flow(p, x)
    return g, dg, (g >= 0.0) != rising


@kernel
def describe(p, x, f, dg, bar, row):
    """Type and region of attraction of the equilibrium at x, known within `bar`."""
    row[ANGLE], row[F], row[DG], row[BAR] = x, f, dg, bar
    row[VAA], row[VAB], row[VBB], row[LEVEL] = 0.0, 0.0, 0.0, 0.0
    row[STABLE] = (
        0.0
        if abs(f) <= 16.0 * ROUNDOFF_UP * p[BOUND_F] + p[BOUND_F] * bar
        else math.copysign(1.0, f)
    )
    if dg > 0.0:
        row[KIND] = SADDLE
    else:
        row[KIND] = NODE if f * f + 4.0 * dg >= 0.0 else FOCUS
        if row[STABLE] < 0.0 and dg < 0.0:
            attracted(p, f, dg, row)


@inline
def attracted(p, f, dg, row):
    """V(x) = x' P x with A'P + PA = -1 falls where |x| < r = 1/(2 max eig P c), the quadratic terms being < c |x|^2.

    The region V < LEVEL lies inside that ball.
    """
    b = -0.5 / dg
    e = (1.0 + 2.0 * b) / (-2.0 * f)
    a = -f * b - dg * e
    middle, spread = 0.5 * (a + e), math.hypot(0.5 * (a - e), b)
    largest = middle + spread
    smallest = (a * e - b * b) / largest
    r = 0.5 / (largest * 0.5 * (p[BOUND_F] + p[BOUND_DDG]))
    row[VAA], row[VAB], row[VBB], row[LEVEL] = a, b, e, 0.9 * smallest * r * r


@inline
def offset(phi, angle):
    """phi - angle, brought into [-pi, pi], and the turns taken out."""
    x = phi - angle
    turns = math.floor(x / TWO_PI + 0.5)
    return x - turns * TWO_PI, turns


@kernel
def resting(p, table, count, phi0):
    """The row of the equilibrium that phi0 is exactly, or -1.

    Of binary64 angles only 0 can be one: at any other exp(i phi0) is transcendental (Lindemann), so
    it is no root of a polynomial with rational coefficients, as which g can be written.
    """
    best, least = -1, math.inf
    if phi0 != 0.0 or p[S2] != p[C23]:
        return best
    for i in range(count):
        away = abs(offset(phi0, table[i, ANGLE])[0])
        if away < least:
            best, least = i, away
    return best


@kernel
def captured(table, count, phi, w, bar):
    """The row of the equilibrium that certainly attracts every state within `bar` of (phi, w), or -1."""
    for i in range(count):
        row = table[i]
        if row[LEVEL] > 0.0:
            x, _turns = offset(phi, row[ANGLE])
            v = row[VAA] * x * x + 2.0 * row[VAB] * x * w + row[VBB] * w * w
            reach = math.sqrt(v) + math.sqrt(row[VAA] + row[VBB]) * (bar + row[BAR])
            if reach * reach < row[LEVEL]:
                return i
    return -1


@part
def settled(p, f, dg, x, w):
    """Is it certain that w keeps its sign from here to the stable node at distance x?

    For m = w/x, m' = -(m - fast)(m - slow) + O(r): m in a band between fast and slow/2 stays there
    and tends to slow, when the quadratic terms c r (1 + m^2) are small against the speed at the
    edges of the band.
    """
    square = f * f + 4.0 * dg
    if x == 0.0 or square <= 0.0:
        return False
    fast = 0.5 * (f - math.sqrt(square))
    slow = -dg / fast
    m, gap = w / x, slow - fast
    low, high = fast + 0.25 * gap, 0.5 * slow
    if not low < m < high:
        return False
    error = 4.0 * abs(x) * (1.0 + fast * fast) * (p[BOUND_F] + p[BOUND_DDG])
    return error < 0.1875 * gap * gap and error < (high - fast) * -0.5 * slow
