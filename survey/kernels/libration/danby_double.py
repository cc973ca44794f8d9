"""Danby's problem in double-double: A, B, C, D, t to about 28 digits, for points that float64
leaves open.

With u = tan(f / 2) to f = pi / 2 and u = -cot(f / 2) from there the equations of `danby` are
rational, and no function is needed: df = 2 du / (1 + u^2), r df = 2 du / (b0 + b2 u^2); (b0, b2) is
(1 + e, 1 - e), then (1 - e, 1 + e). For x, g = q + x, k = p + m and m

    (1 + u^2) x' = 2 (k - 2 m)      (b0 + b2 u^2) g' = -2 d2 m
    (1 + u^2) m' = 2 (2 x - g)      (b0 + b2 u^2) k' =  2 d1 x

so that each coefficient of a power series follows from the two before it. Every coefficient has a
running bound of its rounding; the steps' ends are float64 numbers, as good as any others. Errors
travel as in `kernels.libration.danby`.
"""

from math import asinh, ceil, sinh, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel, splice
from survey.kernels.libration.traces import INVARIANTS, A, C, D, T
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import PAIR_ROUNDOFF

ORDERS = 100  # at most; a series ends where its terms fall below SMALL
FIRST = 8  # which they do not by chance before this one
SMALL = 1e-33
RATIO = 0.3  # half a step over the distance to the nearest singularity: i, or i sqrt(b0 / b2)
# Of a coefficient, relative to its terms: two products and sums, and what their constants miss; of
# a sum of products.
ROUNDING, PRODUCT = 20.0 * PAIR_ROUNDOFF, 6.0 * PAIR_ROUNDOFF
MARGIN = 1.01  # for what is of second order in the bars
# Lanes are the columns of so many points. The working table is flat, rows of lanes one after the
# other, so that LLVM sees how far apart they are: of a step the constants of x and m (TURN), of g
# and k (RATE); of series x, g, k, m the last coefficient a_n (NOW), c_n = n a_n (SCALED), c_(n-1)
# (BEFORE) and the sums over both parities, all of them pairs; bounds of the errors of a_n, c_n,
# c_(n-1) and of the sums; 1 while a series goes on.
COLUMNS, POINTS = 4, 4
LANES = COLUMNS * POINTS
TURN, TURN_1, TURN_2, RATE_G, RATE_K, RATE_1, RATE_2, NOW = range(0, 16 * LANES, 2 * LANES)
X, G, K, M, _SERIES = range(0, 10 * LANES, 2 * LANES)
SCALED, BEFORE, SUM, OTHER, OFF, SCALED_OFF, BEFORE_OFF, BOUND, TAIL, LIVE = (
    NOW + i * _SERIES for i in range(1, 11)
)
SIZE = LIVE + LANES
# Columns A to T of `traces` are leading parts; LOW columns further on follows what rounding left of
# them, and BARS further on the bounds of their errors.
# Of a point, each in two columns, high and low: d1 and d2 of `danby`; 1 + e and 1 - e.
FIRST_RATE, SECOND_RATE = 0, 2
ONE_PLUS, ONE_MINUS = 0, 2
LOW, BARS, RESULTS = INVARIANTS, 2 * INVARIANTS, 3 * INVARIANTS


@kernel
def rates(mu, out):
    """FIRST_RATE and SECOND_RATE, (N, 4): (3 / 2)(1 +- s) with s^2 = 1/4 + 3 (1/2 - mu)^2: nothing
    cancels.
    """
    for i in range(len(mu)):
        square = dd.shifted(dd.times(dd.square(dd.two_sum(0.5, -mu[i])), 3.0), 0.25)
        d1 = dd.times(dd.shifted(dd.sqrt(square), 1.0), 1.5)
        out[i, FIRST_RATE], out[i, FIRST_RATE + 1] = d1
        out[i, SECOND_RATE], out[i, SECOND_RATE + 1] = dd.div(
            dd.times(dd.times(dd.two_sum(1.0, -mu[i]), mu[i]), 6.75), d1
        )


@kernel
def shapes(e, out):
    """ONE_PLUS and ONE_MINUS, (N, 4)."""
    for i in range(len(e)):
        out[i, ONE_PLUS], out[i, ONE_PLUS + 1] = dd.two_sum(1.0, e[i])
        out[i, ONE_MINUS], out[i, ONE_MINUS + 1] = dd.two_sum(1.0, -e[i])


@kernel
def chain(shapes, rates, out):
    """Fill `out` (N, RESULTS) for points with their `shapes` and `rates` (N, 4 each).

    Neighbours with as many steps go together; the bits of a point do not depend on them.
    """
    work = np.zeros(SIZE)
    ends, doubt = np.zeros((2, 2, 4, 4)), np.zeros((2, 4, 4))
    step, off = np.zeros((2, 4, 4)), np.zeros((4, 4))
    composed, spread = np.zeros((POINTS, 2, 4, 4)), np.zeros((POINTS, 4, 4))
    first = 0
    while first < len(out):
        numbers = steps_of(1.0), steps_of(nearest(shapes[first]))
        count = 1
        while count < POINTS and first + count < len(out):
            if steps_of(nearest(shapes[first + count])) != numbers[1]:
                break
            count += 1
        for i in range(POINTS):
            for j in range(4):
                for k in range(4):
                    composed[i, 0, j, k] = 1.0 if j == k else 0.0
                    composed[i, 1, j, k] = spread[i, j, k] = 0.0
        for part in range(2):
            for n in range(numbers[part]):
                for i in range(POINTS):
                    at = first + min(i, count - 1)
                    near = nearest(shapes[at]) if part else 1.0
                    left = step_end(n, numbers[part], near, part)
                    right = step_end(n + 1, numbers[part], near, part)
                    prepare(left, right, shapes[at], part, rates[at], work, COLUMNS * i)
                columns(work)
                for i in range(count):
                    collect(work, COLUMNS * i, ends, doubt)
                    propagator(ends, doubt, step, off)
                    advance(step, off, composed[i], spread[i])
        for i in range(count):
            finish(composed[i], spread[i], numbers[0] + numbers[1], out[first + i])
        first += count


@inline
def nearest(shape):
    """How far off u = 0 the singularities of the second part are."""
    return sqrt(shape[ONE_MINUS] / shape[ONE_PLUS])


@inline
def steps_of(near):
    """The number of steps of a part whose singularities are `near`."""
    return ceil(asinh(1.0 / near) / (2.0 * RATIO))


@inline
def step_end(n, number, near, part):
    """The n-th end u of the steps, even in asinh(u / near): from 0 to 1, and in the second part
    from -1 to 0.
    """
    n = number - n if part else n
    u = 1.0 if n == number else near * sinh(asinh(1.0 / near) * n / number)
    return -u if part else u


@inline
def pair(work, at):
    return work[at], work[at + LANES]


@inline
def store(work, at, number):
    work[at], work[at + LANES] = number


@kernel
def prepare(left, right, shape, part, rates, work, lane):
    """The constants of a step in z, u = middle + half z, and the first coefficients, in the lanes
    of one point.
    """
    more = shape[ONE_PLUS], shape[ONE_PLUS + 1]
    less = shape[ONE_MINUS], shape[ONE_MINUS + 1]
    b0, b2 = (less, more) if part else (more, less)
    middle, half = dd.scaled(dd.two_sum(left, right), 0.5), dd.scaled(dd.two_sum(right, -left), 0.5)
    square, linear, last = dd.square(middle), dd.scaled(dd.mul(middle, half), 2.0), dd.square(half)
    a0, c0 = dd.shifted(square, 1.0), dd.add(b0, dd.mul(b2, square))
    by_r = dd.scaled(dd.div(half, c0), 2.0)
    store(work, TURN + lane, dd.scaled(dd.div(half, a0), 2.0))
    store(work, TURN_1 + lane, dd.div(linear, a0))
    store(work, TURN_2 + lane, dd.div(last, a0))
    store(work, RATE_G + lane, dd.mul(by_r, (-rates[SECOND_RATE], -rates[SECOND_RATE + 1])))
    store(work, RATE_K + lane, dd.mul(by_r, (rates[FIRST_RATE], rates[FIRST_RATE + 1])))
    store(work, RATE_1 + lane, dd.div(dd.mul(b2, linear), c0))
    store(work, RATE_2 + lane, dd.div(dd.mul(b2, last), c0))
    for c in range(lane, lane + COLUMNS):
        for row in range(0, NOW, LANES):
            work[row + c] = work[row + lane]
        for row in range(NOW, SIZE, LANES):
            work[row + c] = 0.0
        work[LIVE + c] = 1.0
    # the columns start with x, q, p or m = 1: g = q + x, k = p + m
    for at in (NOW + lane, SUM + lane):
        work[at + X] = work[at + G] = work[at + G + 1] = 1.0
        work[at + K + 2] = work[at + K + 3] = work[at + M + 3] = 1.0


@kernel
def columns(work):
    """All series from a step's middle: sums of even orders in SUM, of odd ones in OTHER, and bounds
    of their errors.
    """
    for n in range(0, ORDERS, 2):
        extend(work, n)
        extend(work, n + 1)
        live = 0.0
        for i in range(LANES):
            live += work[LIVE + i]
        if live == 0.0:
            break


@kernel
def extend(work, n):
    """Coefficient n + 1 of all series; the sum over its parity and the other one change places."""
    least = SMALL if n > FIRST else 0.0
    for i in range(LANES):
        x = pair(work, NOW + X + i)
        g = pair(work, NOW + G + i)
        k = pair(work, NOW + K + i)
        m = pair(work, NOW + M + i)
        off_x, off_g, off_k, off_m = (
            work[OFF + X + i],
            work[OFF + G + i],
            work[OFF + K + i],
            work[OFF + M + i],
        )
        by_x = dd.loose(k, (-2.0 * m[0], -2.0 * m[1]))
        by_m = dd.loose((2.0 * x[0], 2.0 * x[1]), (-g[0], -g[1]))
        doubt_x = off_k + 2.0 * off_m + ROUNDING * (abs(k[0]) + 2.0 * abs(m[0]))
        doubt_m = 2.0 * off_x + off_g + ROUNDING * (2.0 * abs(x[0]) + abs(g[0]))
        follow(work, i, X, n, by_x, doubt_x, TURN, TURN_1, TURN_2)
        follow(work, i, M, n, by_m, doubt_m, TURN, TURN_1, TURN_2)
        follow(work, i, G, n, m, off_m + ROUNDING * abs(m[0]), RATE_G, RATE_1, RATE_2)
        follow(work, i, K, n, x, off_x + ROUNDING * abs(x[0]), RATE_K, RATE_1, RATE_2)
        last = (abs(x[0]) + abs(g[0])) + (abs(k[0]) + abs(m[0]))
        last += (abs(work[NOW + X + i]) + abs(work[NOW + G + i])) + (
            abs(work[NOW + K + i]) + abs(work[NOW + M + i])
        )
        work[LIVE + i] = 0.0 if last < least else work[LIVE + i]


@splice
def follow(work, i, row, n, driver, doubt, rate, one, two):
    """a_(n+1) of the series `row`: (n + 1) a_(n+1) = c_(n+1) = rate driver - one c_n - two c_(n-1),
    and its bound.
    """
    r, p, q = pair(work, rate + i), pair(work, one + i), pair(work, two + i)
    at = row + i
    c, b, live = pair(work, SCALED + at), pair(work, BEFORE + at), work[LIVE + i]
    new = dd.sum_of_products(r, driver, p, (-c[0], -c[1]), q, (-b[0], -b[1]))
    bound = abs(r[0]) * doubt + abs(p[0]) * (work[SCALED_OFF + at] + ROUNDING * abs(c[0]))
    bound += abs(q[0]) * (work[BEFORE_OFF + at] + ROUNDING * abs(b[0]))
    a, off = dd.over(new, n + 1.0), bound / (n + 1.0)
    # each coefficient that follows is less than half of that before
    tail = 2.0 * (abs(a[0]) + abs(work[NOW + at]))
    work[TAIL + at] = tail if live > 0.0 else work[TAIL + at]
    total = dd.add(pair(work, OTHER + at), (live * a[0], live * a[1]))
    work[BOUND + at] += live * (off + PAIR_ROUNDOFF * abs(total[0]))
    store(work, OTHER + at, pair(work, SUM + at))
    store(work, SUM + at, total)
    store(work, BEFORE + at, c)
    store(work, SCALED + at, new)
    store(work, NOW + at, a)
    work[BEFORE_OFF + at], work[SCALED_OFF + at], work[OFF + at] = work[SCALED_OFF + at], bound, off


@kernel
def collect(work, lane, ends, doubt):
    """The propagators (2, 4, 4) from the middle to the ends 1 and -1 of one point, in x, q, p, m;
    bounds of errors.
    """
    for c in range(4):
        for i in range(4):
            at = lane + c + i * G
            even, odd = pair(work, SUM + at), pair(work, OTHER + at)
            bound = (
                work[BOUND + at]
                + work[TAIL + at]
                + SMALL
                + PAIR_ROUNDOFF * (abs(even[0]) + abs(odd[0]))
            )
            ends[0, 0, i, c], ends[0, 1, i, c] = dd.add(even, odd)
            ends[1, 0, i, c], ends[1, 1, i, c] = dd.sub(even, odd)
            doubt[0, i, c] = doubt[1, i, c] = bound
        for side in range(2):
            for i, other in ((1, 0), (2, 3)):  # q = g - x, p = k - m
                two = ends[side, 0, other, c], ends[side, 1, other, c]
                s = dd.sub((ends[side, 0, i, c], ends[side, 1, i, c]), two)
                ends[side, 0, i, c], ends[side, 1, i, c] = s
                doubt[side, i, c] += doubt[side, other, c] + PAIR_ROUNDOFF * abs(s[0])


@inline
def propagator(ends, doubt, step, off):
    """`step` = F B^-1 with F and B to the ends 1 and -1, and a bound of each entry's error.

    Entry (n, j) of the inverse of (P, S; Q, T), (T', -S'; -Q', P'), is +-B(j + 2, n + 2), indices
    modulo 4.
    """
    for i in range(4):
        for j in range(4):
            s, bound = (0.0, 0.0), 0.0
            for n in range(4):
                k, m, sign = (j + 2) % 4, (n + 2) % 4, 1.0 if (n < 2) == (j < 2) else -1.0
                f = (ends[0, 0, i, n], ends[0, 1, i, n])
                b = (sign * ends[1, 0, k, m], sign * ends[1, 1, k, m])
                s = dd.add(s, dd.mul(f, b))
                bound += (
                    doubt[0, i, n] * abs(b[0])
                    + doubt[1, k, m] * abs(f[0])
                    + PRODUCT * abs(f[0] * b[0])
                )
            step[0, i, j], step[1, i, j], off[i, j] = s[0], s[1], bound


@inline
def advance(step, off, composed, spread):
    """composed <- step composed, and V <- G V G' + diag(d^2) with d the largest new error of a row."""
    old, carried, local = composed.copy(), np.zeros((4, 4)), np.zeros(4)
    for i in range(4):
        for j in range(4):
            s, bound = (0.0, 0.0), 0.0
            for n in range(4):
                g, w = (step[0, i, n], step[1, i, n]), (old[0, n, j], old[1, n, j])
                s = dd.add(s, dd.mul(g, w))
                bound += (off[i, n] + PRODUCT * abs(g[0])) * abs(w[0])
                carried[i, j] += g[0] * spread[n, j]
            composed[0, i, j], composed[1, i, j] = s
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
        # 4 steps - 3 terms, as in `kernels.libration.danby`
        bars[i] = MARGIN * sqrt((4.0 * steps - 3.0) * spread[i, i])


@inline
def finish(composed, spread, steps, out):
    """A, B, C, D, t and the bounds of their errors: A = det P, B = det T, C = det Q, D = det S, t =
    tr T'P.
    """
    bars = np.zeros(4)
    row_bars(spread, steps, bars)
    for at in range(INVARIANTS - 1):
        i, j = 0 if at in (A, D) else 2, 0 if at in (A, C) else 2
        a = (composed[0, i, j], composed[1, i, j])
        b = (composed[0, i, j + 1], composed[1, i, j + 1])
        c = (composed[0, i + 1, j], composed[1, i + 1, j])
        d = (composed[0, i + 1, j + 1], composed[1, i + 1, j + 1])
        one, other = dd.mul(a, d), dd.mul(b, c)
        out[at], out[LOW + at] = dd.sub(one, other)
        bar = (
            bars[i] * (abs(c[0]) + abs(d[0]))
            + bars[i + 1] * (abs(a[0]) + abs(b[0]))
            + 2.0 * bars[i] * bars[i + 1]
        )
        out[BARS + at] = bar + PRODUCT * (abs(one[0]) + abs(other[0]))
    t, bar = (0.0, 0.0), 0.0
    for i in range(2):
        for j in range(2):
            a = (composed[0, i, j], composed[1, i, j])
            b = (composed[0, 2 + i, 2 + j], composed[1, 2 + i, 2 + j])
            t = dd.add(t, dd.mul(a, b))
            bar += (
                bars[i] * abs(b[0])
                + bars[2 + i] * abs(a[0])
                + bars[i] * bars[2 + i]
                + PRODUCT * abs(a[0] * b[0])
            )
    out[T], out[LOW + T], out[BARS + T] = t[0], t[1], bar
