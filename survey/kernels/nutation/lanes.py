"""Single wells off separatrices, poles and double roots, many at once: what `brun` and `agm` do,
lanes innermost.

The formulas, the double-double set-up and the bars are those of `wells.py` beside it and of
`methods/agm.py`; a lane is done only where every number of its set-up is proved to be right to an
eighth of a rounding and where the fixed numbers of steps suffice: otherwise it is left to them. A
lane's bits do not depend on its neighbours.
"""

from math import copysign, pi, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.chebyshev import nodes
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF, ROUNDOFF
from survey.kernels.nutation import records as rc

TILE = 64
GIVEN = rc.STATE  # rows of what is given
# The outputs of a nutation, and the rows of a tile that hold them, then their bars.
NAMES = ("u_min", "u_max", "period", "precession", "spin", "action")
U_MIN, U_MAX, PERIOD, PRECESSION, SPIN, ACTION = range(0, 6 * TILE, TILE)
U_MIN_BAR, U_MAX_BAR, PERIOD_BAR, PRECESSION_BAR, SPIN_BAR, ACTION_BAR = range(
    6 * TILE, 12 * TILE, TILE
)
OUTPUTS = 12
RIGHT = 0.125 * ROUNDOFF  # errors of the set-up, relative
BLUR = 0.01  # the error of a well's width, relative
SAME = 1e-15  # u and a turning point that differ by less may be the same
WIDE = 0.1  # wells that are wider are no parabolas
NEAR, LAST = 3e-5, 1e-17  # the last two means, and the last weight of R
SLANT, CANCELLED = 0.25, 0.01  # as in methods/agm.py
NODES = 16
COSINES = nodes(NODES)
NOTHING, TWO, THREE, FOUR, SIX, NINE, TWELVE = map(np.float32, (0, 2, 3, 4, 6, 9, 12))
# where the rows of a tile begin: of what is given, a state or scaled integrals in its place; its
# last two are b and a
SIZE_A, SIZE_C, EPSILON, THETA, P_THETA, B, A = (
    TILE * column
    for column in (rc.SIZE_A, rc.SIZE_C, rc.EPSILON, rc.THETA, rc.P_THETA, rc.P_PSI, rc.P_PHI)
)
GIVEN_LEVEL, SIGN, WELL, RATIO = (
    TILE * column for column in (rc.LEVEL, rc.SIGN, rc.WELL, rc.RATIO)
)
# pairs: k, L, L + k - a b, L + k + a b, b - a, b + a
K, L, PLUS_POLE, MINUS_POLE, MINUS, PLUS = range(7 * TILE, 19 * TILE, 2 * TILE)
# pairs: 1 - u and 1 + u of both turning points (first, roughly, of those beside their poles), ul +
# uh
V_HIGH, W_LOW, V_LOW, W_HIGH, SUM = range(19 * TILE, 29 * TILE, 2 * TILE)
# pairs: Q at the turning points, s of (S5), 4 q0 - k S^2
Q_LOW, Q_HIGH, MIDDLE, BEND = range(29 * TILE, 37 * TILE, 2 * TILE)
# u at the start, turning points, their distance, s + g, L - (k ul uh + q0)/2, 1 where all is right
# (after `finish` 2, or 1 where terms cancel), number of wells
U, LOW, HIGH, WIDTH, ABOVE, LEVEL, GOOD, WELLS = range(37 * TILE, 45 * TILE, TILE)
X, Y, WEIGHT, SERIES = range(45 * TILE, 49 * TILE, TILE)  # the mean
# Both poles: the charts, see `chart`; then the sums R: 1 - e, weight, total, 1 if complementary
UP, DOWN = 49 * TILE, 54 * TILE
# l of (S11) at the poles, and its slope
LINE_UP, LINE_DOWN, INCLINE = range(59 * TILE, 62 * TILE, TILE)
# the sum and the difference of the parts of both poles, with all their digits, and their relative
# error (0: unknown)
FINE_TOTAL, FINE_DIFFERENCE, FINE = range(62 * TILE, 65 * TILE, TILE)
# of the first two pairs; (S15), where it is known
BAR_V, BAR_W, SMALL_ACTION = range(65 * TILE, 68 * TILE, TILE)
# the roots of Q at the turning points, P at U
ROOT_LOW, ROOT_HIGH, HERE = range(68 * TILE, 71 * TILE, TILE)
# what the error of ul + uh makes of FINE_TOTAL and FINE_DIFFERENCE
TILTED_TOTAL, TILTED_DIFFERENCE = range(71 * TILE, 73 * TILE, TILE)
ROWS = 73


@inline
def laguerre(c0, c1, c2, c3, c4, y):
    """A step towards the next root above y where c(y) < 0, or below it where c(y) > 0 (its roots real)."""
    value = c0 + y * (c1 + y * (c2 + y * (c3 + y * c4)))
    first = c1 + y * (2.0 * c2 + y * (3.0 * c3 + y * 4.0 * c4))
    second = 2.0 * c2 + y * (6.0 * c3 + y * 12.0 * c4)
    square = 9.0 * first * first - 12.0 * value * second
    return y - 4.0 * value / (first + sqrt(square if square > 0.0 else 0.0))


@inline
def roughly(c0, c1, c2, c3, c4, y):
    """As `laguerre`, in float32."""
    value = c0 + y * (c1 + y * (c2 + y * (c3 + y * c4)))
    first = c1 + y * (TWO * c2 + y * (THREE * c3 + y * FOUR * c4))
    second = TWO * c2 + y * (SIX * c3 + y * TWELVE * c4)
    square = NINE * first * first - TWELVE * value * second
    return y - FOUR * value / (first + np.sqrt(square if square > NOTHING else NOTHING))


@inline
def halley(c0, c1, c2, c3, c4, y):
    """A last step, without a root."""
    value = c0 + y * (c1 + y * (c2 + y * (c3 + y * c4)))
    first = c1 + y * (2.0 * c2 + y * (3.0 * c3 + y * 4.0 * c4))
    second = c2 + y * (3.0 * c3 + y * 6.0 * c4)
    return y - value * first / (first * first - value * second)


@inline
def residual(c0, c1, c2, c3, c4, y):
    """c(y) at a float64, by Horner's rule with the error of each operation: to a few 2^-98 of the
    sum of |terms|.
    """
    s, e = c4
    for high, low in (c3, c2, c1, c0):
        p, q = dd.two_prod(s, y)
        s, r = dd.two_sum(p, high)
        e = e * y + (q + r + low)
    return s + e


@inline
def polished(c0, c1, c2, c3, c4, x):
    """The root near x as a pair, by Newton's step and the second order of its error, and a bound of
    what is left.
    """
    a0, a1, a2, a3, a4 = abs(c0[0]), abs(c1[0]), abs(c2[0]), abs(c3[0]), abs(c4[0])
    size = a0 + x * (a1 + x * (a2 + x * (a3 + x * a4)))
    steep = a1 + x * (2.0 * a2 + x * (3.0 * a3 + x * 4.0 * a4))
    first = c1[0] + x * (2.0 * c2[0] + x * (3.0 * c3[0] + x * 4.0 * c4[0]))
    second = 2.0 * c2[0] + x * (6.0 * c3[0] + x * 12.0 * c4[0])
    inverse = 1.0 / first
    move, size_inverse = residual(c0, c1, c2, c3, c4, x) * inverse, abs(inverse)
    turn = 0.5 * move * second * inverse
    rest = 4.0 * turn * turn + size_inverse * (
        8.0 * ROUNDOFF * steep + 2.0 * move * move * (a3 + 9.0 * a4)
    )
    bar = 2.0 * PAIR_SUM_ROUNDOFF * (size * size_inverse + x) + abs(move) * rest
    return dd.quick_two_sum(x, -move * (1.0 + turn)), bar


@inline
def pair(work, row, i):
    return work[row + i], work[row + TILE + i]


@inline
def store(work, row, i, value):
    work[row + i], work[row + TILE + i] = value


@inline
def first_step(c0, c1, c2, low):
    """The root of the parabola where P rises with y, or the pole, y = low; in float32."""
    square = c1 * c1 - FOUR * c0 * c2
    root = np.sqrt(square if square > NOTHING else NOTHING)
    rises = c1 > NOTHING
    y = (-TWO * c0 if rises else root - c1) / (c1 + root if rises else TWO * c2)
    return y if rises | (c2 < NOTHING) else low


@inline
def chart(work, row, at, here, slope, i):
    """P by a pole's distance less `at`: `at`, P there, its slope, half its curvature; where the search
    stands follows.
    """
    k, u = work[K + i], 1.0 - at
    bend = (k - work[L + i]) - 6.0 * k * u * u
    work[row + i], work[row + TILE + i], work[row + 2 * TILE + i], work[row + 3 * TILE + i] = (
        at,
        here,
        slope,
        bend,
    )


@inline
def numbers(work, row, i):
    """The numbers of a chart, in their order."""
    return (
        work[row + i],
        work[row + TILE + i],
        work[row + 2 * TILE + i],
        work[row + 3 * TILE + i],
    )


@inline
def size_of(work, row, i):
    """The size of a chart's numbers."""
    return abs(work[row + TILE + i]) + abs(work[row + 2 * TILE + i]) + abs(work[row + 3 * TILE + i])


@inline
def begin_roughly(work, row, scale, rough, first, i):
    """The chart in float32, times `scale`; and where to start."""
    at, here, slope, bend = numbers(work, row, i)
    k = work[K + i]
    c0, c1, c2 = np.float32(scale * here), np.float32(scale * slope), np.float32(scale * bend)
    low = np.float32(-at)
    rough[first + i], rough[first + TILE + i], rough[first + 2 * TILE + i] = c0, c1, c2
    rough[first + 3 * TILE + i] = np.float32(scale * (4.0 * k * (1.0 - at)))
    rough[first + 4 * TILE + i] = np.float32(-scale * k)
    rough[first + 5 * TILE + i] = low
    rough[first + 6 * TILE + i] = min(max(first_step(c0, c1, c2, low), low), low + TWO)


@inline
def step_roughly(rough, first, i):
    """A step towards a turning point, in float32."""
    low = rough[first + 5 * TILE + i]
    y = roughly(
        rough[first + i],
        rough[first + TILE + i],
        rough[first + 2 * TILE + i],
        rough[first + 3 * TILE + i],
        rough[first + 4 * TILE + i],
        rough[first + 6 * TILE + i],
    )
    rough[first + 6 * TILE + i] = min(max(y, low), low + TWO)


@inline
def step(method, work, row, i):
    """A step towards a turning point."""
    at, here, slope, bend = numbers(work, row, i)
    k = work[K + i]
    y = method(here, slope, bend, 4.0 * k * (1.0 - at), -k, work[row + 4 * TILE + i])
    work[row + 4 * TILE + i] = min(max(y, -at), 2.0 - at)


@inline
def between(c0, c1, c2, c3, c4, work, row, i):
    """As `laguerre`, from the point in `work` towards a root between a pole and `top`, where c > 0:
    never beyond.
    """
    y, low, high = work[row + i], work[row + TILE + i], work[row + 2 * TILE + i]
    value = c0 + y * (c1 + y * (c2 + y * (c3 + y * c4)))
    low, high = y if value <= 0.0 else low, y if value > 0.0 else high
    new = min(max(laguerre(c0, c1, c2, c3, c4, y), 0.0), 2.0)
    bad = (not (new > low)) | (not (new < high))
    work[row + i] = 0.5 * (low + high) if bad & (value != 0.0) else new
    work[row + TILE + i], work[row + 2 * TILE + i] = low, high


@inline
def search(work, i):
    """A step of `between` on both sides of U."""
    k, level = work[K + i], work[L + i]
    c2, c3 = -level - 5.0 * k, 4.0 * k
    minus, plus = work[MINUS + i], work[PLUS + i]
    between(-minus * minus, 2.0 * work[PLUS_POLE + i], c2, c3, -k, work, UP, i)
    between(-plus * plus, 2.0 * work[MINUS_POLE + i], c2, c3, -k, work, DOWN, i)


@inline
def choose(work, i):
    """Where there are two wells, the inner turning point of the one that holds U for the outer one
    of the other.

    Where P is even and so the well, to the last bit: the advance that vanishes then does so
    exactly.
    """
    k, v, w = work[K + i], work[V_HIGH + i], work[W_LOW + i]
    total, width = w - v, 2.0 - v - w
    bend = 4.0 * (work[L + i] - k) + k * (2.0 * total * total + width * width)
    middle = -0.5 * total
    two = (k > 0.0) & (bend < 0.0) & (middle > w - 1.0) & (middle < 1.0 - v)
    half = sqrt(-0.25 * bend / k) if two else 0.0
    upper = work[U + i] > middle
    work[V_HIGH + i] = 1.0 + 0.5 * total + half if two & (not upper) else v
    even = ((work[A + i] == 0.0) | (work[B + i] == 0.0)) & (v < 1.0) & (w < 1.0)
    work[W_LOW + i] = 1.0 - 0.5 * total + half if two & upper else v if even else w


@inline
def narrow(work, i):
    """Turning points that nearly coincide, from the parabola at the greatest P between them."""
    k, minus = pair(work, K, i), pair(work, MINUS, i)
    c2, c3 = dd.neg(dd.add(pair(work, L, i), dd.times(k, 5.0))), dd.times(k, 4.0)
    c1 = dd.times(pair(work, PLUS_POLE, i), 2.0)
    v, w, start = work[V_HIGH + i], work[W_LOW + i], 1.0 - work[U + i]
    known = abs(work[U + i]) <= 1.0
    y = start if known else 0.5 * (v + (2.0 - w))
    for _ in range(2):
        first = c1[0] + y * (2.0 * c2[0] + y * (3.0 * c3[0] - y * 4.0 * k[0]))
        second = 2.0 * c2[0] + y * (6.0 * c3[0] - y * 12.0 * k[0])
        y -= first / second
    r, slope = dd.sub(c3, dd.times(k, y)), dd.sub(dd.times(c3, 3.0), dd.times(k, 4.0 * y))
    r, slope = dd.add(dd.times(r, y), c2), dd.add(dd.times(slope, y), dd.times(c2, 2.0))
    r, slope = dd.add(dd.times(r, y), c1), dd.add(dd.times(slope, y), c1)
    height = dd.sub(dd.times(r, y), dd.mul(minus, minus))[0]
    half = sqrt(slope[0] * slope[0] - 2.0 * height * second)
    lower, upper = (half - slope[0]) / second, (-half - slope[0]) / second
    close = (upper - lower < WIDE) & (half > 0.0) & (second < 0.0)
    close &= (abs(start - y) < WIDE) if known else (abs(v - y) < WIDE) & (abs(2.0 - w - y) < WIDE)
    store(work, V_HIGH, i, dd.two_sum(y, lower) if close else (v, 0.0))
    store(work, W_LOW, i, dd.sub((2.0, 0.0), dd.two_sum(y, upper)) if close else (w, 0.0))


@inline
def polish(work, i):
    """A step of Newton's method towards both turning points."""
    k, minus, plus = pair(work, K, i), pair(work, MINUS, i), pair(work, PLUS, i)
    c2, c3, c4 = dd.neg(dd.add(pair(work, L, i), dd.times(k, 5.0))), dd.times(k, 4.0), dd.neg(k)
    at_plus = dd.times(pair(work, PLUS_POLE, i), 2.0)
    at_minus = dd.times(pair(work, MINUS_POLE, i), 2.0)
    v, bar_v = polished(dd.neg(dd.mul(minus, minus)), at_plus, c2, c3, c4, work[V_HIGH + i])
    w, bar_w = polished(dd.neg(dd.mul(plus, plus)), at_minus, c2, c3, c4, work[W_LOW + i])
    store(work, V_HIGH, i, v)
    store(work, W_LOW, i, w)
    work[BAR_V + i], work[BAR_W + i] = bar_v, bar_w


@inline
def settle(work, i):
    """All that the turning points give, with all its digits; GOOD where it is proved to have them."""
    k, level, v, w = pair(work, K, i), pair(work, L, i), pair(work, V_HIGH, i), pair(work, W_LOW, i)
    bar_v, bar_w = work[BAR_V + i], work[BAR_W + i]
    high, low = dd.shifted(dd.neg(v), 1.0), dd.shifted(w, -1.0)
    v_low = dd.shifted(dd.neg(w), 2.0)
    w_high = dd.shifted(dd.neg(v), 2.0)
    total = dd.loose(w, dd.neg(v))
    width = (v_low[0] - v[0]) + (v_low[1] - v[1])
    rest, bow, double = dd.loose(level, dd.neg(k)), dd.mul(k, dd.square(total)), dd.scaled(k, 2.0)
    common = dd.loose(rest, bow)
    near = dd.loose(common, dd.mul(double, dd.square(high)))
    far = dd.loose(common, dd.mul(double, dd.square(low)))
    middle = dd.loose(common, dd.scaled(bow, 0.5))
    bend = dd.loose(common, dd.neg(dd.mul(k, dd.mul(high, low))))
    bend = dd.loose(dd.scaled(bend, 4.0), dd.neg(bow))
    level_rest = (level[0] - 0.5 * common[0]) + (level[1] - 0.5 * common[1])
    root_low, root_high = sqrt(far[0]), sqrt(near[0])
    g = root_low * root_high
    error = 8.0 * (
        abs(k[0]) * (bar_v + bar_w) + PAIR_SUM_ROUNDOFF * (abs(level[0]) + 8.0 * abs(k[0]))
    )
    smooth = middle[0] >= 0.0
    sure = (error < RIGHT * near[0]) & (error < RIGHT * far[0]) & (bar_v + bar_w < BLUR * width)
    sure &= smooth | ((error < RIGHT * abs(bend[0])) & (bar_v + bar_w < RIGHT * width))
    sure &= (bar_v < RIGHT * v[0]) & (bar_w < RIGHT * w[0])
    sure &= (bar_w < RIGHT * v_low[0]) & (bar_v < RIGHT * w_high[0])
    sure &= (work[MINUS + i] != 0.0) & (work[PLUS + i] != 0.0)
    u = work[U + i]  # it lies in the well; beyond 1 it is not known
    sure &= (abs(u) > 1.0) | ((u >= low[0] - SAME) & (u <= high[0] + SAME))
    sure &= (total[0] == 0.0) | (bar_v + bar_w < RIGHT * abs(total[0]))
    # else it is a regular precession
    sure &= width > 4.0 * (bar_v + bar_w + ROUNDOFF * (abs(low[0]) + abs(high[0])))
    two = (k[0] > 0.0) & (bend[0] < 0.0)
    aside = (-0.5 * total[0] > high[0]) | (-0.5 * total[0] < low[0])  # Q is least outside the well
    sure &= (k[0] <= 0.0) | (bend[0] > error) | (aside & (bend[0] < -error))
    work[WELLS + i] = 2.0 if two else 1.0
    work[GOOD + i] = 1.0 if sure else 0.0
    work[ABOVE + i] = (
        middle[0] + g if smooth else 0.25 * k[0] * width * width * bend[0] / (g - middle[0])
    )
    work[LOW + i], work[HIGH + i], work[WIDTH + i], work[LEVEL + i] = (
        low[0],
        high[0],
        width,
        level_rest,
    )
    store(work, V_LOW, i, v_low)
    store(work, W_HIGH, i, w_high)
    store(work, SUM, i, total)
    store(work, Q_LOW, i, far)
    store(work, Q_HIGH, i, near)
    store(work, MIDDLE, i, middle)
    store(work, BEND, i, bend)
    work[ROOT_LOW + i], work[ROOT_HIGH + i] = root_low, root_high


@inline
def parameter(gap, near, far, q_far, root_near, incline, g, xy):
    """p^2/(x y) of the sum R as a fraction, of (S13) where that is used, and l at the pole."""
    line = root_near + incline * near
    slanted = line <= SLANT * root_near
    here = q_far * near
    both = here + g * far
    # all known before one is chosen: vector code, where a branch would keep the loop from it
    over, square, under, across = (
        both * both,
        gap * gap * g,
        4.0 * here * far,
        near * far * line * line,
    )
    return over if slanted else square, xy * (under if slanted else across), line


@inline
def enter(work, row, over, under, i):
    """The start of a sum R (S12) for p^2/(x y) = over/under: e is odd in its logarithm."""
    work[row + i], work[row + TILE + i], work[row + 2 * TILE + i] = (
        2.0 * min(over, under) / (over + under),
        1.0,
        0.0,
    )
    work[row + 3 * TILE + i] = 1.0 if over < under else 0.0


@inline
def prepare(work, i):
    """The means' start."""
    root_low, root_high = work[ROOT_LOW + i], work[ROOT_HIGH + i]
    x, g = sqrt(0.5 * work[ABOVE + i]), root_low * root_high
    y = sqrt(g)
    incline = 2.0 * work[K + i] * work[SUM + i] / (root_low + root_high)
    over, under, line = parameter(work[MINUS + i], work[V_HIGH + i], work[V_LOW + i], work[Q_LOW + i], root_high,
                                  incline, g, x * y)  # fmt: skip
    enter(work, UP, over, under, i)
    work[LINE_UP + i] = line
    over, under, line = parameter(work[PLUS + i], work[W_LOW + i], work[W_HIGH + i], work[Q_HIGH + i], root_low,
                                  -incline, g, x * y)  # fmt: skip
    enter(work, DOWN, over, under, i)
    work[LINE_DOWN + i], work[INCLINE + i] = line, incline
    work[X + i], work[Y + i], work[SERIES + i] = x, y, 0.0


@inline
def last_sum(work, row, i):
    """The sum R with one more term, and the size of what is left out."""
    rest, weight = work[row + i], work[row + TILE + i]
    total = work[row + 2 * TILE + i] + (
        weight * rest if work[row + 3 * TILE + i] == 1.0 else weight
    )
    return total, abs(0.5 * weight * (1.0 - rest))


@inline
def add_term(work, row, i):
    """Add a term to the sum R."""
    rest, weight = work[row + i], work[row + TILE + i]
    work[row + 2 * TILE + i] += weight * rest if work[row + 3 * TILE + i] == 1.0 else weight
    work[row + TILE + i] = 0.5 * weight * (1.0 - rest)
    return (2.0 - rest) * rest


@inline
def take_mean(work, weight, i):
    """A step of the mean; e of both sums: with r = (1 - e^2) (x + y)/(2 sqrt(x y)) the next is (1 -
    r)/(1 + r).
    """
    x, y = work[X + i], work[Y + i]
    middle, root = 0.5 * (x + y), sqrt(x * y)
    up, down = middle * add_term(work, UP, i), middle * add_term(work, DOWN, i)
    above, below = root + up, root + down
    inverse = 2.0 / (above * below)
    work[UP + i], work[DOWN + i] = up * below * inverse, down * above * inverse
    c = x - y
    work[SERIES + i] += weight * c * c
    work[X + i], work[Y + i] = middle, root


@inline
def advance(gap, near, far, q_far, width, root_near, root_far, incline, bend, period, line, ratio):
    """As in methods/agm.py: whole multiples of pi, the rest, and the size of its terms."""
    slanted = line <= SLANT * root_near
    here, there = q_far * near, root_near * root_far * far
    both = here + there
    direct = near * both + 0.5 * width * (both + 0.5 * (here - there) * ratio)
    first = incline * gap * gap
    second = 0.25 * (root_far * near + root_near * far) * bend * ratio * near * far
    part = 0.5 * period / (far * near * both if slanted else gap * line)
    value = part * (gap * direct if slanted else first + second)
    size = abs(value) if slanted else abs(part) * (abs(first) + abs(second))
    return 0.0 if slanted else copysign(1.0, gap), value, size


@inline
def finish(work, size, drift, i, answers):
    """Fill `answers` for the well of a body with A = `size`; GOOD stays 0 where it is left to the
    other kernels.
    """
    middle, apart = 0.5 * (work[X + i] + work[Y + i]), 0.5 * (work[X + i] - work[Y + i])
    # the next mean, but for the fourth order
    period = 2.0 * pi / (middle - 0.25 * apart * apart / middle)
    root_low, root_high, width = work[ROOT_LOW + i], work[ROOT_HIGH + i], work[WIDTH + i]
    incline, bend = work[INCLINE + i], 0.5 * work[K + i] * work[BEND + i] / work[ABOVE + i]
    minus, plus = work[MINUS + i], work[PLUS + i]
    (ratio_up, last_up), (ratio_down, last_down) = last_sum(work, UP, i), last_sum(work, DOWN, i)
    turns_up, up, size_up = advance(minus, work[V_HIGH + i], work[V_LOW + i], work[Q_LOW + i], width, root_high,
                                    root_low, incline, bend, period, work[LINE_UP + i],
                                    ratio_up)  # fmt: skip
    turns_down, down, size_down = advance(plus, work[W_LOW + i], work[W_HIGH + i], work[Q_HIGH + i], width, root_low,
                                          root_high, -incline, bend, period, work[LINE_DOWN + i],
                                          ratio_down)  # fmt: skip
    total, difference, rough = down + up, down - up, size_up + size_down
    sure = (work[GOOD + i] == 1.0) & (abs(apart) <= 0.5 * NEAR * middle)
    sure &= (last_up <= LAST * ratio_up) & (last_down <= LAST * ratio_down)
    # without multiples of pi
    bare = abs(total) if turns_up + turns_down == 0.0 else abs(difference + drift * size * period)
    cancelled = (bare < CANCELLED * rough) & (turns_up * turns_down != 0.0)
    fine = work[FINE + i] > 0.0
    exactly = fine & cancelled
    total = work[FINE_TOTAL + i] * period if exactly else total
    difference = work[FINE_DIFFERENCE + i] * period if exactly else difference
    error, rounding = (
        (work[FINE + i] * rough, 12.0 * ROUNDOFF)
        if exactly
        else (25.0 * ROUNDOFF * rough, 2.0 * ROUNDOFF)
    )
    turned = 2.0 * ROUNDOFF * pi
    precession = pi * (turns_down + turns_up) + total
    spin = pi * (turns_down - turns_up) + difference
    error_precession = error + rounding * abs(total) + turned * abs(turns_down + turns_up)
    error_precession += period * work[TILTED_TOTAL + i] if exactly else 0.0
    error_spin = error + rounding * abs(difference) + turned * abs(turns_down - turns_up)
    error_spin += period * work[TILTED_DIFFERENCE + i] if exactly else 0.0
    rest = 0.5 * (
        0.5 * work[ABOVE + i] - (work[SERIES + i] + 2.0 * work[WEIGHT + i] * apart * apart)
    )
    up, down = minus * (pi * turns_up + up), plus * (pi * turns_down + down)
    action = (period * (work[LEVEL + i] + rest) - up - down) / (2.0 * pi)
    rough = period * (abs(work[LEVEL + i]) + abs(rest))
    rough += abs(minus) * (pi + size_up) + abs(plus) * (pi + size_down)
    error_action = 25.0 * ROUNDOFF * rough / (2.0 * pi)
    small = (error_action > 1e-14 * abs(action)) & (work[SMALL_ACTION + i] > 0.0)
    action = work[SMALL_ACTION + i] if small else action
    blur = (work[BAR_V + i] + work[BAR_W + i]) / width
    error_action = (65.0 * ROUNDOFF + 2.5 * blur) * action if small else error_action
    period *= size
    error_period = 15.0 * ROUNDOFF * period
    turned = drift * period
    answers[U_MIN + i], answers[U_MAX + i], answers[PERIOD + i] = (
        work[LOW + i],
        work[HIGH + i],
        period,
    )
    answers[PRECESSION + i], answers[SPIN + i], answers[ACTION + i] = (
        precession,
        spin + turned,
        action,
    )
    answers[U_MIN_BAR + i] = work[BAR_W + i] + ROUNDOFF * abs(work[LOW + i])
    answers[U_MAX_BAR + i] = work[BAR_V + i] + ROUNDOFF * abs(work[HIGH + i])
    answers[PERIOD_BAR + i], answers[PRECESSION_BAR + i] = error_period, error_precession
    answers[ACTION_BAR + i] = error_action
    answers[SPIN_BAR + i] = (
        error_spin + 23.0 * ROUNDOFF * abs(turned) + ROUNDOFF * abs(spin + turned)
    )
    work[GOOD + i] = 0.0 if not sure else 1.0 if cancelled & (not fine) else 2.0


@inline
def add_node(work, cosine, i):
    """A node of (S15)."""
    up, down, width = 0.5 * (1.0 + cosine), 0.5 * (1.0 - cosine), work[WIDTH + i]
    q = work[Q_LOW + i] * down + work[Q_HIGH + i] * up - work[K + i] * width * width * up * down
    rest = (work[V_LOW + i] * down + work[V_HIGH + i] * up) * (
        work[W_LOW + i] * down + work[W_HIGH + i] * up
    )
    work[SMALL_ACTION + i] += up * down * sqrt(q) / rest


@inline
def conclude(work, i):
    """The action, or 0 where singularities are too near for so few nodes."""
    k, width, total = work[K + i], work[WIDTH + i], work[SUM + i]
    ratio = 0.25 * work[BEND + i] / k
    beyond, beside = abs(sqrt(abs(ratio)) - abs(total)), sqrt(total * total + abs(ratio))
    far = 2.0 if k == 0.0 else beyond if ratio < 0.0 else beside
    known = (min(work[V_HIGH + i], work[W_LOW + i]) >= 0.5 * width) & (far >= 1.1 * width)
    work[SMALL_ACTION + i] = width * width * work[SMALL_ACTION + i] / NODES if known else 0.0


@kernel
def small_actions(work):
    """Fill the row SMALL_ACTION by Gauss-Chebyshev quadrature, see `action.small`."""
    for j in range(NODES):
        for i in range(TILE):
            add_node(work, COSINES[j], i)
    for i in range(TILE):
        conclude(work, i)


@inline
def begin(work, i, v, w):
    """1 - u and 1 + u of the turning points, in float64 so far, and nothing known beyond."""
    store(work, V_HIGH, i, (v, 0.0))
    store(work, W_LOW, i, (w, 0.0))
    work[FINE + i], work[SMALL_ACTION + i] = 0.0, 0.0


@kernel
def inside(work):
    """The start from U, between the turning points, where P is HERE: nearly there at once if they
    nearly coincide.
    """
    for i in range(TILE):
        k, u, here = work[K + i], work[U + i], work[HERE + i]
        slope = 2.0 * (work[A + i] * work[B + i] + u * (k * (1.0 - 2.0 * u * u) - work[L + i]))
        chart(work, UP, 1.0 - u, here, -slope, i)
        chart(work, DOWN, 1.0 + u, here, slope, i)


@kernel
def poles(work):
    """The start from the poles."""
    for i in range(TILE):
        minus, plus = work[MINUS + i], work[PLUS + i]
        chart(work, UP, 0.0, -minus * minus, 2.0 * work[PLUS_POLE + i], i)
        chart(work, DOWN, 0.0, -plus * plus, 2.0 * work[MINUS_POLE + i], i)


@kernel
def approach_roughly(work, steps):
    """From the polynomial about the start towards the turning points, in float32."""
    rough = np.empty(14 * TILE, np.float32)
    up, down = 0, 7 * TILE
    for i in range(TILE):
        scale = 1.0 / (abs(work[K + i]) + size_of(work, UP, i) + size_of(work, DOWN, i))
        begin_roughly(work, UP, scale, rough, up, i)
        begin_roughly(work, DOWN, scale, rough, down, i)
    for _ in range(steps):
        for i in range(TILE):
            step_roughly(rough, up, i)
            step_roughly(rough, down, i)
    for i in range(TILE):
        work[UP + 4 * TILE + i] = rough[up + 6 * TILE + i]
        work[DOWN + 4 * TILE + i] = rough[down + 6 * TILE + i]


@kernel
def approach(work, steps):
    """To the turning points, in float64."""
    for _ in range(steps):
        for i in range(TILE):
            step(laguerre, work, UP, i)
            step(laguerre, work, DOWN, i)
    for i in range(TILE):
        step(halley, work, UP, i)
        step(halley, work, DOWN, i)
        begin(
            work,
            i,
            work[UP + i] + work[UP + 4 * TILE + i],
            work[DOWN + i] + work[DOWN + 4 * TILE + i],
        )
        choose(work, i)


@kernel
def approach_slowly(work, steps):
    """As `approach`, where Laguerre's method has gone astray or would take many steps."""
    for i in range(TILE):
        for row, top in ((UP, 1.0 - work[U + i]), (DOWN, 1.0 + work[U + i])):
            work[row + i], work[row + TILE + i] = 0.0, 0.0
            work[row + 2 * TILE + i] = top if 0.0 <= top <= 2.0 else 2.0
    for _ in range(steps):
        for i in range(TILE):
            search(work, i)
    for i in range(TILE):
        begin(work, i, work[UP + i], work[DOWN + i])
        choose(work, i)
    for i in range(TILE):
        narrow(work, i)


@kernel
def wells(work, steps):
    """To the wells, in double-double."""
    for _ in range(steps):
        for i in range(TILE):
            polish(work, i)
    for i in range(TILE):
        settle(work, i)


@kernel
def means(work, number):
    last, weight = 2.0**number, 0.5  # a power within the loop would keep it from being vector code
    for i in range(TILE):
        prepare(work, i)
        work[WEIGHT + i] = last
    for _ in range(number):
        for i in range(TILE):
            take_mean(work, weight, i)
        weight *= 2.0
