"""Initial states and scaled integrals of Brun's problem -> the wells of `wells.py` beside it, all
in double-double.
"""

from math import cos, sin, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.quartic import slope
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF, ROUNDOFF
from survey.kernels.math.sines import sin_cos
from survey.kernels.nutation import records as rc
from survey.kernels.nutation.wells import (
    HIGH,
    HIGH_MINUS,
    HIGH_PLUS,
    LOST,
    LOW,
    LOW_MINUS,
    LOW_PLUS,
    NOISE_HIGH,
    NOISE_LOW,
    NOISE_WIDTH,
    NONE,
    NUTATION,
    Q_HIGH,
    Q_LOW,
    SEPARATRIX,
    SIZE,
    SUM,
    TINY,
    WIDTH,
    K,
    about_equator,
    barrier,
    find,
    looseness,
    roughness,
    saddle,
)


@inline
def of_state(size_a, size_c, epsilon, theta, p_theta, b, a):
    """k, L, L + k - a b, L + k + a b and u as pairs (S1); the last is False outside the domain."""
    sine, cosine = sin_cos(0.5 * theta)
    k = dd.mul(dd.two_prod(epsilon, size_a), dd.two_sum(size_a, -size_c))
    inside = sine[0] != 0.0 or a == b
    high, low = dd.square(cosine), dd.square(sine)  # (1 + u)/2, (1 - u)/2
    double = dd.scaled(dd.mul(sine, cosine), 2.0)
    minus, plus = dd.two_sum(b, -a), dd.two_sum(b, a)
    divisor = double[0] if sine[0] != 0.0 else 1.0, double[1]  # at the pole x is 0
    x = dd.ratio(dd.loose(dd.mul(minus, high), dd.mul(plus, low)), divisor)
    kinetic = dd.loose(dd.two_prod(p_theta, p_theta), dd.square(x))
    common = dd.loose(kinetic, dd.mul(k, dd.square(double)))
    at_plus = dd.loose(common, dd.times(minus, -a))
    at_minus = dd.loose(common, dd.times(plus, a))
    u = dd.mul(dd.sub(cosine, sine), dd.loose(cosine, sine))
    level = dd.loose(dd.loose(kinetic, dd.neg(dd.mul(k, dd.square(u)))), dd.two_prod(a, a))
    return k, level, at_plus, at_minus, u, inside


@kernel
def possible(points, valid):
    """Fill `valid` (n): are `points`, a tuple of STATE arrays (n), initial states of a body?"""
    a, c, epsilon = points[rc.SIZE_A], points[rc.SIZE_C], points[rc.EPSILON]
    theta, p_theta = points[rc.THETA], points[rc.P_THETA]
    psi, phi = points[rc.P_PSI], points[rc.P_PHI]
    for i in range(len(valid)):
        finite = (abs(a[i]) < np.inf) & (abs(c[i]) < np.inf) & (abs(epsilon[i]) < np.inf)
        finite &= (abs(p_theta[i]) < np.inf) & (abs(psi[i]) < np.inf) & (abs(phi[i]) < np.inf)
        finite &= (theta[i] > 0.0) | (psi[i] == phi[i])
        valid[i] = finite & (abs(theta[i]) < np.inf) & (c[i] <= 2.0 * a[i])


@kernel
def phase(row, theta, p_theta, start):
    """Fill `start`: the columns DONE to START_BAR of `records`.

    The smaller part comes from P(u0) = (sin theta p_theta)^2 where that loses fewer digits than the
    difference does.
    """
    sine, cosine = sin(0.5 * theta), cos(0.5 * theta)
    v, w = 2.0 * sine * sine, 2.0 * cosine * cosine
    width = row[WIDTH]
    start[rc.DONE], start[rc.LEFT], start[rc.START_BAR] = 0.0, 1.0, 0.0
    start[rc.DIRECTION] = 1.0 if p_theta <= 0.0 else -1.0
    if not width > 0.0:
        return
    done = min(max((row[LOW_PLUS] - v if v < 1.0 else w - row[LOW_MINUS]) / width, 0.0), 1.0)
    left = min(max((v - row[HIGH_PLUS] if v < 1.0 else row[HIGH_MINUS] - w) / width, 0.0), 1.0)
    done, left = (done, 1.0 - done) if done < left else (1.0 - left, left)
    bow = row[K] * width * width * left * done
    size = row[Q_LOW] * left + row[Q_HIGH] * done
    start[rc.START_BAR] = 8.0 * ROUNDOFF * min(v, w)
    q = size - bow
    moved = (
        (abs(row[Q_HIGH] - row[Q_LOW]) + abs(row[K]) * width * width) * start[rc.START_BAR] / width
    )
    rough = 16.0 * ROUNDOFF * (size + abs(bow)) + moved
    if q > 4.0 * rough:  # done left = c, done + left = 1
        c = (2.0 * sine * cosine * p_theta / width) ** 2 / q
        root = sqrt(max(1.0 - 4.0 * c, 0.0))
        other = 2.0 * c / (1.0 + root)
        error = width * other * (16.0 * ROUNDOFF + rough / q) / max(root, TINY)
        if width * root < start[rc.START_BAR]:  # on which side of the middle?
            error += 2.0 * width * root
        if error < start[rc.START_BAR]:
            start[rc.START_BAR] = error
            done, left = (other, 1.0 - other) if done < left else (1.0 - other, other)
    start[rc.DONE], start[rc.LEFT] = done, left


@kernel
def measure(row, start, c, u, theta, p_theta):
    """WIDTH of a narrow well, where its turning points leave few digits of it, from P and P' at the
    start.

    There P = (sin theta p_theta)^2 = (u - ul)(uh - u) Q, and P' gives ul + uh - 2 u: (uh - ul)^2 by
    positive terms.
    """
    k, width, done, left = row[K], row[WIDTH], start[rc.DONE], start[rc.LEFT]
    height, steep = (2.0 * sin(0.5 * theta) * cos(0.5 * theta) * p_theta) ** 2, slope(c, u)[0]
    q = offset = square = 0.0
    for _ in range(2):  # the first round tells better than `start` where in the well it lies
        q = row[Q_LOW] * left + row[Q_HIGH] * done - k * width * width * left * done
        offset = (steep - height * k * (2.0 * u[0] + row[SUM]) / q) / q
        square = offset * offset + 4.0 * height / q
        if square > 0.0:
            share = 0.5 * offset / sqrt(square)
            done, left = 0.5 - share, 0.5 + share
    bends = (abs(row[Q_HIGH] - row[Q_LOW]) + abs(k) * width * width) / q
    terms = abs(c[1][0]) + abs(u[0]) * (4.0 * abs(c[2][0]) + 8.0 * abs(k))
    bar = PAIR_SUM_ROUNDOFF * terms / q + 8.0 * ROUNDOFF * abs(offset)
    noise = 1.0
    if square > 0.0:
        noise = (
            16.0 * ROUNDOFF + row[NOISE_LOW] + row[NOISE_HIGH] + bar * (abs(offset) + bar) / square
        )
        noise += bends * bends * start[rc.START_BAR] / width
    if noise < row[NOISE_WIDTH]:
        row[WIDTH], row[NOISE_WIDTH] = sqrt(square), noise


@kernel
def of_states(points, rows, kinds, count, heights, starts):
    """The well of each initial state (n, STATE).

    Fills rows (n, SIZE), kinds (n) (LOST outside the domain), the number of wells (-1 on a
    separatrix), heights (n, HEIGHT) and starts (n, START), with the columns of `records`.
    """
    both, two = np.empty((2, SIZE)), np.empty(2, np.int64)
    for i in range(len(points)):
        size_a, size_c, epsilon, theta, p_theta, b, a = points[i]
        k, level, at_plus, at_minus, u, inside = of_state(
            size_a, size_c, epsilon, theta, p_theta, b, a
        )
        if not inside:
            kinds[i] = LOST
            continue
        rough = abs(level[0]) + 2.0 * abs(k[0]) * u[0] * u[0]
        heights[i, rc.ABOVE], heights[i, rc.ABOVE_BAR] = find(
            a, b, k, level, at_plus, at_minus, rough, both, two
        )
        heights[i, rc.FIELD] = abs(k[0])
        well = 1 if two[1] != NONE and u[0] > 0.5 * (both[0, HIGH] + both[1, LOW]) else 0
        count[i] = (two[0] != NONE) + (two[1] != NONE) if two[0] != SEPARATRIX else -1
        kinds[i] = two[well] if two[well] != NONE else LOST
        for j in range(SIZE):
            rows[i, j] = both[well, j]
        if kinds[i] >= NUTATION:
            phase(rows[i], theta, p_theta, starts[i])
            if kinds[i] == NUTATION and rows[i, NOISE_WIDTH] > ROUNDOFF:
                measure(rows[i], starts[i], about_equator(a, b, level, k), u, theta, p_theta)


@kernel
def of_integrals(points, sign, rows, kinds, heights):
    """As `of_states`, at scaled integrals alone (n, INTEGRALS), where A = 1 and k = `sign`: both
    wells, rows (n, 2, SIZE), kinds (n, 2).
    """
    k = (sign, 0.0)
    for i in range(len(points)):
        level, a, b = points[i]
        product = dd.two_prod(a, b)
        high = dd.two_sum(level, sign)
        pair = level, 0.0
        heights[i, rc.ABOVE], heights[i, rc.ABOVE_BAR] = find(
            a, b, k, pair, dd.sub(high, product), dd.add(high, product), 0.0, rows[i], kinds[i]
        )
        heights[i, rc.FIELD] = 1.0


@kernel
def heights_of_states(points, heights):
    """Fill `heights` (n, HEIGHT) as `of_states`, for points in columns (STATE, n)."""
    for i in range(len(heights)):
        b, a = points[rc.P_PSI, i], points[rc.P_PHI, i]
        k, level, at_plus, at_minus, u, _inside = of_state(
            points[rc.SIZE_A, i],
            points[rc.SIZE_C, i],
            points[rc.EPSILON, i],
            points[rc.THETA, i],
            points[rc.P_THETA, i],
            b,
            a,
        )
        loose = looseness(a, b, abs(level[0]) + 2.0 * abs(k[0]) * u[0] * u[0])
        found = barrier(a, b, k, about_equator(a, b, level, k), loose, at_plus[0], at_minus[0])
        heights[i, rc.ABOVE], heights[i, rc.ABOVE_BAR], heights[i, rc.FIELD] = (
            found[0],
            found[1],
            abs(k[0]),
        )


@kernel
def saddles_of_states(points, u, bars):
    """u of the saddle at the momenta of each state, in columns (STATE, n), and its bar; NaN where
    there is none.
    """
    for i in range(len(u)):
        b, a = points[rc.P_PSI, i], points[rc.P_PHI, i]
        size_a = points[rc.SIZE_A, i]
        k = points[rc.EPSILON, i] * size_a * (size_a - points[rc.SIZE_C, i])
        u[i], rise, _doubtful = saddle(a, b, k)
        bars[i] = roughness(u[i], a, b, k) / rise if rise > 0.0 else np.nan
        u[i] = u[i] if rise > 0.0 else np.nan


@kernel
def heights_of_integrals(points, heights):
    """As `heights_of_states`, for scaled integrals in the place of a state."""
    for i in range(len(heights)):
        level, sign = points[rc.LEVEL, i], points[rc.SIGN, i]
        b, a = points[rc.P_PSI, i], points[rc.P_PHI, i]
        pair = (level, 0.0)
        k = (sign, 0.0)
        high = dd.two_sum(level, sign)
        product = dd.two_prod(a, b)
        at_plus, at_minus = dd.sub(high, product)[0], dd.add(high, product)[0]
        found = barrier(
            a, b, k, about_equator(a, b, pair, k), looseness(a, b, 0.0), at_plus, at_minus
        )
        heights[i, rc.ABOVE], heights[i, rc.ABOVE_BAR], heights[i, rc.FIELD] = (
            found[0],
            found[1],
            1.0,
        )
