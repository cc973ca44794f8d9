"""Danby's problem in double-double: A, B, C, D, t to about 28 digits, for points that float64 leaves open.

With u = tan(f / 2) to f = pi / 2 and u = -cot(f / 2) from there the equations of `danby` are rational, and no
function is needed: df = 2 du / (1 + u^2), r df = 2 du / (b0 + b2 u^2); (b0, b2) is (1 + e, 1 - e), then (1 - e, 1 + e).
For x, g = q + x, k = p + m and m

    (1 + u^2) x' = 2 (k - 2 m)      (b0 + b2 u^2) g' = -2 d2 m
    (1 + u^2) m' = 2 (2 x - g)      (b0 + b2 u^2) k' =  2 d1 x

so that each coefficient of a power series follows from the two before it. Every coefficient has a running bound of its
rounding; the steps' ends are float64 numbers, as good as any others. Errors travel as in `kernels.libration.danby`.
"""

from math import asinh, ceil, sinh, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.libration.traces import INVARIANTS, A, C, D, T
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import PAIR_ROUNDOFF

ORDERS = 100  # at most; a series ends where its terms fall below SMALL
FIRST = 8  # which they do not by chance before this one
SMALL = 1e-33
RATIO = 0.3  # half a step over the distance to the nearest singularity: i, or i sqrt(b0 / b2)
# Of a coefficient, relative to its terms: two products and sums, and what their constants miss; of a sum of products.
ROUNDING, PRODUCT = 20.0 * PAIR_ROUNDOFF, 6.0 * PAIR_ROUNDOFF
MARGIN = 1.01  # for what is of second order in the bars
X, G, K, M = range(4)
# Columns A to T of `traces` are leading parts; LOW columns further on follows what rounding left of them, and BARS
# further on the bounds of their errors.
LOW, BARS, RESULTS = INVARIANTS, 2 * INVARIANTS, 3 * INVARIANTS


@kernel
def rates(mu, out):
    """d1, d2 of `danby` as pairs, (N, 4): (3 / 2)(1 +- s) with s^2 = 1/4 + 3 (1/2 - mu)^2: nothing cancels."""
    for i in range(len(mu)):
        square = dd.shifted(dd.times(dd.square(dd.two_sum(0.5, -mu[i])), 3.0), 0.25)
        d1 = dd.times(dd.shifted(dd.sqrt(square), 1.0), 1.5)
        out[i, 0], out[i, 1] = d1
        out[i, 2], out[i, 3] = dd.div(dd.times(dd.times(dd.two_sum(1.0, -mu[i]), mu[i]), 6.75), d1)


@kernel
def chain(e, both, out):
    """Fill `out` (N, RESULTS) for points e (N) with their rates `both` (N, 4)."""
    series, errors = np.zeros((4, 2, ORDERS + 2)), np.zeros((4, ORDERS + 2))
    ends, doubt = np.zeros((2, 2, 4, 4)), np.zeros((2, 4, 4))
    step, whole = np.zeros((2, 4, 4)), np.zeros((2, 4, 4))
    off, constants = np.zeros((4, 4)), np.zeros((2, 3, 4))
    for i in range(len(e)):
        whole[:], spread, steps = 0.0, np.zeros((4, 4)), 0
        for j in range(4):
            whole[0, j, j] = 1.0
        for part in range(2):
            side = 1.0 - 2.0 * part
            near = sqrt((1.0 - e[i]) / (1.0 + e[i])) if part else 1.0
            number = ceil(asinh(1.0 / near) / (2.0 * RATIO))
            for n in range(number):
                left, right = place(n, number, near, part), place(n + 1, number, near, part)
                prepare(left, right, dd.two_sum(1.0, side * e[i]), dd.two_sum(1.0, -side * e[i]), both[i], constants)
                for c in range(4):
                    column(c, constants, series, errors, ends, doubt)
                propagator(ends, doubt, step, off)
                advance(step, off, whole, spread)
            steps += number
        finish(whole, spread, steps, out[i])


@inline
def place(n, number, near, part):
    """The n-th end u of the steps, even in asinh(u / near): from 0 to 1, and in the second part from -1 to 0."""
    n = number - n if part else n
    u = 1.0 if n == number else near * sinh(asinh(1.0 / near) * n / number)
    return -u if part else u


@inline
def prepare(left, right, b0, b2, both, constants):
    """The constants of a step in z, u = middle + half z: of each series that of its driver, and those of z and z^2."""
    middle, half = dd.scaled(dd.two_sum(left, right), 0.5), dd.scaled(dd.two_sum(right, -left), 0.5)
    square, linear, last = dd.square(middle), dd.scaled(dd.mul(middle, half), 2.0), dd.square(half)
    a0, c0 = dd.shifted(square, 1.0), dd.add(b0, dd.mul(b2, square))
    turn, by_r = dd.scaled(dd.div(half, a0), 2.0), dd.scaled(dd.div(half, c0), 2.0)
    for i in (X, M):
        put(constants, 0, i, turn)
        put(constants, 1, i, dd.div(linear, a0))
        put(constants, 2, i, dd.div(last, a0))
    for i in (G, K):
        rate = (both[0], both[1]) if i == K else (-both[2], -both[3])
        put(constants, 0, i, dd.mul(by_r, rate))
        put(constants, 1, i, dd.div(dd.mul(b2, linear), c0))
        put(constants, 2, i, dd.div(dd.mul(b2, last), c0))


@inline
def put(constants, row, i, number):
    constants[0, row, i], constants[1, row, i] = number


@inline
def column(c, constants, series, errors, ends, doubt):
    """Column c of the propagators from a step's middle to its ends (1, -1), and bounds of its errors.

    Place n + 1 of a series is its n-th coefficient, place 0 that of -1.
    """
    series[:, :, 1], errors[:, 1] = 0.0, 0.0
    series[X, 0, 1], series[G, 0, 1] = 1.0 * (c == 0), 1.0 * (c < 2)
    series[K, 0, 1], series[M, 0, 1] = 1.0 * (c > 1), 1.0 * (c == 3)
    last = ORDERS
    for n in range(ORDERS):
        for i in range(4):
            follow(i, n, constants, series, errors)
        if n > FIRST and max(np.abs(series[:, 0, n + 1]).max(), np.abs(series[:, 0, n + 2]).max()) < SMALL:
            last = n + 1
            break
    sums(series, errors, last, c, ends, doubt)


@inline
def follow(i, n, constants, series, errors):
    """Coefficient n + 1 of series i, and its bound: (rate driver - c1 n a_n - c2 (n - 1) a_(n-1)) / (n + 1)."""
    first, other = (X, G) if i == M else (K, M) if i == X else (X, X) if i == K else (M, M)
    two = 2.0 if i == M else 1.0
    driver = dd.scaled((series[first, 0, n + 1], series[first, 1, n + 1]), two)
    size, error = abs(driver[0]), two * errors[first, n + 1]
    if first != other:
        less = 3.0 - two
        driver = dd.sub(driver, dd.scaled((series[other, 0, n + 1], series[other, 1, n + 1]), less))
        size, error = size + less * abs(series[other, 0, n + 1]), error + less * errors[other, n + 1]
    now, before = (series[i, 0, n + 1], series[i, 1, n + 1]), (series[i, 0, n], series[i, 1, n])
    rate, one = (constants[0, 0, i], constants[1, 0, i]), (constants[0, 1, i], constants[1, 1, i])
    s = dd.sub(dd.mul(rate, driver), dd.times(dd.mul(one, now), float(n)))
    s = dd.sub(s, dd.times(dd.mul((constants[0, 2, i], constants[1, 2, i]), before), n - 1.0))
    series[i, 0, n + 2], series[i, 1, n + 2] = dd.over(s, n + 1.0)
    bound = abs(rate[0]) * (error + ROUNDING * size) + abs(one[0]) * n * (errors[i, n + 1] + ROUNDING * abs(now[0]))
    bound += abs(constants[0, 2, i] * (n - 1.0)) * (errors[i, n] + ROUNDING * abs(before[0]))
    errors[i, n + 2] = bound / (n + 1.0)


@inline
def sums(series, errors, last, c, ends, doubt):
    """The series x, g, k, m at 1 and -1, then q = g - x and p = k - m: column c of `ends` and of `doubt`."""
    for i in range(4):
        both, bound = np.zeros((2, 2)), SMALL
        for n in range(last, -1, -1):
            s = dd.add((both[n % 2, 0], both[n % 2, 1]), (series[i, 0, n + 1], series[i, 1, n + 1]))
            both[n % 2, 0], both[n % 2, 1] = s
            bound += errors[i, n + 1] + PAIR_ROUNDOFF * abs(s[0])
        even, odd = (both[0, 0], both[0, 1]), (both[1, 0], both[1, 1])
        # each coefficient that follows is less than half of that before
        bound += 2.0 * (abs(series[i, 0, last + 1]) + abs(series[i, 0, last])) + PAIR_ROUNDOFF * (
            abs(even[0]) + abs(odd[0])
        )
        ends[0, 0, i, c], ends[0, 1, i, c] = dd.add(even, odd)
        ends[1, 0, i, c], ends[1, 1, i, c] = dd.sub(even, odd)
        doubt[0, i, c] = doubt[1, i, c] = bound
    for side in range(2):
        for i in (G, K):
            other = X if i == G else M
            s = dd.sub((ends[side, 0, i, c], ends[side, 1, i, c]), (ends[side, 0, other, c], ends[side, 1, other, c]))
            ends[side, 0, i, c], ends[side, 1, i, c] = s
            doubt[side, i, c] += doubt[side, other, c] + PAIR_ROUNDOFF * abs(s[0])


@inline
def propagator(ends, doubt, step, off):
    """`step` = F B^-1 with F and B to the ends 1 and -1, and a bound of each entry's error.

    Entry (n, j) of the inverse of (P, S; Q, T), (T', -S'; -Q', P'), is +-B(j + 2, n + 2), places modulo 4.
    """
    for i in range(4):
        for j in range(4):
            s, bound = (0.0, 0.0), 0.0
            for n in range(4):
                k, m, sign = (j + 2) % 4, (n + 2) % 4, 1.0 if (n < 2) == (j < 2) else -1.0
                f, b = (ends[0, 0, i, n], ends[0, 1, i, n]), (sign * ends[1, 0, k, m], sign * ends[1, 1, k, m])
                s = dd.add(s, dd.mul(f, b))
                bound += doubt[0, i, n] * abs(b[0]) + doubt[1, k, m] * abs(f[0]) + PRODUCT * abs(f[0] * b[0])
            step[0, i, j], step[1, i, j], off[i, j] = s[0], s[1], bound


@inline
def advance(step, off, whole, spread):
    """whole <- step whole, and V <- G V G' + diag(d^2) with d the largest new error of a row."""
    old, carried, local = whole.copy(), np.zeros((4, 4)), np.zeros(4)
    for i in range(4):
        for j in range(4):
            s, bound = (0.0, 0.0), 0.0
            for n in range(4):
                g, w = (step[0, i, n], step[1, i, n]), (old[0, n, j], old[1, n, j])
                s = dd.add(s, dd.mul(g, w))
                bound += (off[i, n] + PRODUCT * abs(g[0])) * abs(w[0])
                carried[i, j] += g[0] * spread[n, j]
            whole[0, i, j], whole[1, i, j] = s
            local[i] = max(local[i], bound)
    for i in range(4):
        for j in range(4):
            v = local[i] * local[i] if i == j else 0.0
            for n in range(4):
                v += carried[i, n] * step[0, j, n]
            spread[i, j] = v


@inline
def row_bars(spread, steps, bars):
    """Fill `bars` with the error bounds of the entries of each row after `steps` steps."""
    for i in range(4):
        bars[i] = MARGIN * sqrt((4.0 * steps - 3.0) * spread[i, i])  # of so many terms, as in `kernels.libration.danby`


@inline
def finish(whole, spread, steps, out):
    """A, B, C, D, t and the bounds of their errors: A = det P, B = det T, C = det Q, D = det S, t = tr T'P."""
    bars = np.zeros(4)
    row_bars(spread, steps, bars)
    for at in range(INVARIANTS - 1):
        i, j = 0 if at in (A, D) else 2, 0 if at in (A, C) else 2
        a, b = (whole[0, i, j], whole[1, i, j]), (whole[0, i, j + 1], whole[1, i, j + 1])
        c, d = (whole[0, i + 1, j], whole[1, i + 1, j]), (whole[0, i + 1, j + 1], whole[1, i + 1, j + 1])
        one, other = dd.mul(a, d), dd.mul(b, c)
        out[at], out[LOW + at] = dd.sub(one, other)
        bar = bars[i] * (abs(c[0]) + abs(d[0])) + bars[i + 1] * (abs(a[0]) + abs(b[0])) + 2.0 * bars[i] * bars[i + 1]
        out[BARS + at] = bar + PRODUCT * (abs(one[0]) + abs(other[0]))
    t, bar = (0.0, 0.0), 0.0
    for i in range(2):
        for j in range(2):
            a, b = (whole[0, i, j], whole[1, i, j]), (whole[0, 2 + i, 2 + j], whole[1, 2 + i, 2 + j])
            t = dd.add(t, dd.mul(a, b))
            bar += bars[i] * abs(b[0]) + bars[2 + i] * abs(a[0]) + bars[i] * bars[2 + i] + PRODUCT * abs(a[0] * b[0])
    out[T], out[LOW + T], out[BARS + T] = t[0], t[1], bar
