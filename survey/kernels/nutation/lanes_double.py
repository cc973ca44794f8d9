"""As `lanes`, in double-double: what the poles add to multiples of pi, where both nearly cancel."""

from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF, ROUNDOFF
from survey.kernels.nutation.lanes import (
    BAR_V,
    BAR_W,
    BEND,
    FINE,
    FINE_DIFFERENCE,
    FINE_TOTAL,
    MIDDLE,
    MINUS,
    PLUS,
    Q_HIGH,
    Q_LOW,
    ROWS,
    SUM,
    TILE,
    TILTED_DIFFERENCE,
    TILTED_TOTAL,
    V_HIGH,
    V_LOW,
    W_HIGH,
    W_LOW,
    WIDTH,
    K,
    L,
    pair,
    store,
)

FURTHER = 2  # means that double-double takes more than float64
LAST = 1e-30
FINEST = 2.0**-96
# rows of the tile that follow those of `lanes`: pairs x, y; 1 - e, weight, total of both poles;
# complementary?
X, Y, UP, DOWN, LOW_UP, LOW_DOWN = (TILE * (ROWS + n) for n in (0, 2, 4, 10, 16, 17))
REST, WEIGHT, TOTAL = 0, 2 * TILE, 4 * TILE
# pairs: the roots of Q at the turning points, h and k - h^2 of (S11), l at both poles
HIGH, LOW, INCLINE, BOW, LINE_UP, LINE_DOWN, ALL = (TILE * (ROWS + n) for n in range(18, 32, 2))


@inline
def enter(work, row, low_row, over, under, i):
    """The start of a sum R (S12) for p^2/(x y) = over/under."""
    low = over[0] < under[0]
    less = over[0] if low else under[0], over[1] if low else under[1]
    store(work, row + REST, i, dd.ratio(dd.scaled(less, 2.0), dd.loose(over, under)))
    store(work, row + WEIGHT, i, (1.0, 0.0))
    store(work, row + TOTAL, i, (0.0, 0.0))
    work[low_row + i] = 1.0 if low else 0.0


@inline
def prepare(work, i):
    k, near, far = pair(work, K, i), pair(work, Q_HIGH, i), pair(work, Q_LOW, i)
    high, low = dd.positive_root(near), dd.positive_root(far)
    g = dd.mul(high, low)
    above = dd.loose(pair(work, MIDDLE, i), g)
    middle = pair(work, MIDDLE, i)
    bend = pair(work, BEND, i)
    if middle[0] < 0.0:  # (S10)
        width = dd.sub(pair(work, V_LOW, i), pair(work, V_HIGH, i))
        below = dd.scaled(dd.loose(g, dd.neg(middle)), 4.0)
        above = dd.ratio(dd.mul(dd.mul(k, bend), dd.square(width)), below)
    incline = dd.scaled(dd.ratio(dd.mul(k, pair(work, SUM, i)), dd.loose(high, low)), 2.0)
    x, y = dd.positive_root(dd.scaled(above, 0.5)), dd.positive_root(g)
    xy = dd.mul(x, y)
    gap, v, other = pair(work, MINUS, i), pair(work, V_HIGH, i), pair(work, V_LOW, i)
    line = dd.loose(high, dd.mul(incline, v))
    store(work, LINE_UP, i, line)
    under = dd.mul(dd.mul(dd.mul(v, other), dd.square(line)), xy)
    enter(work, UP, LOW_UP, dd.mul(dd.square(gap), g), under, i)
    gap, w, other = pair(work, PLUS, i), pair(work, W_LOW, i), pair(work, W_HIGH, i)
    line = dd.loose(low, dd.neg(dd.mul(incline, w)))
    store(work, LINE_DOWN, i, line)
    under = dd.mul(dd.mul(dd.mul(w, other), dd.square(line)), xy)
    enter(work, DOWN, LOW_DOWN, dd.mul(dd.square(gap), g), under, i)
    store(work, X, i, x)
    store(work, Y, i, y)
    store(work, HIGH, i, high)
    store(work, LOW, i, low)
    store(work, INCLINE, i, incline)
    store(work, BOW, i, dd.scaled(dd.ratio(dd.mul(k, bend), above), 0.5))


@inline
def add_term(work, row, low_row, middle, root, i):
    """Add a term to the sum R (S12), see `lanes.take_mean`."""
    rest = pair(work, row + REST, i)
    weight = pair(work, row + WEIGHT, i)
    total = pair(work, row + TOTAL, i)
    lower, e = dd.neg(rest), dd.shifted(dd.neg(rest), 1.0)
    term = dd.mul(weight, rest)
    low = work[low_row + i] == 1.0
    store(
        work,
        row + TOTAL,
        i,
        dd.loose(total, (term[0] if low else weight[0], term[1] if low else weight[1])),
    )
    store(work, row + WEIGHT, i, dd.scaled(dd.mul(weight, e), 0.5))
    part = dd.mul(middle, dd.mul(dd.shifted(lower, 2.0), rest))
    store(work, row + REST, i, dd.ratio(dd.scaled(part, 2.0), dd.loose(root, part)))


@inline
def take_mean(work, i):
    x, y = pair(work, X, i), pair(work, Y, i)
    middle, root = dd.scaled(dd.loose(x, y), 0.5), dd.positive_root(dd.mul(x, y))
    add_term(work, UP, LOW_UP, middle, root, i)
    add_term(work, DOWN, LOW_DOWN, middle, root, i)
    store(work, X, i, middle)
    store(work, Y, i, root)


@inline
def part(gap, near, far, root_near, root_far, incline, bow, line, ratio):
    """(b -+ a) J/A less pi, times 2/T (S11)."""
    level = dd.loose(dd.mul(root_far, near), dd.mul(root_near, far))
    second = dd.scaled(dd.mul(dd.mul(dd.mul(level, bow), ratio), dd.mul(near, far)), 0.25)
    return dd.ratio(dd.loose(dd.mul(incline, dd.square(gap)), second), dd.mul(gap, line))


@inline
def noise(work, i):
    """What the bars of the set-up leave of the parts, relative to their terms, as in methods/agm.py."""
    bar_v, bar_w, size_k = work[BAR_V + i], work[BAR_W + i], abs(work[K + i])
    error = 8.0 * (size_k * (bar_v + bar_w) + PAIR_SUM_ROUNDOFF * (abs(work[L + i]) + 8.0 * size_k))
    total = error / work[Q_LOW + i] + error / work[Q_HIGH + i] + FINEST
    total += (
        error / abs(work[BEND + i]) + 2.0 * (bar_v + bar_w) / work[WIDTH + i]
        if work[MIDDLE + i] < 0.0
        else 0.0
    )
    return 4.0 * total + bar_v / work[V_HIGH + i] + bar_w / work[W_LOW + i]


@inline
def finish(work, i):
    high = pair(work, HIGH, i)
    low = pair(work, LOW, i)
    incline = pair(work, INCLINE, i)
    bow = pair(work, BOW, i)
    up = part(pair(work, MINUS, i), pair(work, V_HIGH, i), pair(work, V_LOW, i), high, low, incline, bow,
              pair(work, LINE_UP, i), pair(work, UP + TOTAL, i))  # fmt: skip
    down = part(pair(work, PLUS, i), pair(work, W_LOW, i), pair(work, W_HIGH, i), low, high, dd.neg(incline), bow,
                pair(work, LINE_DOWN, i), pair(work, DOWN + TOTAL, i))  # fmt: skip
    total, difference = dd.loose(down, up), dd.loose(down, dd.neg(up))
    work[FINE_TOTAL + i], work[FINE_DIFFERENCE + i] = 0.5 * total[0], 0.5 * difference[0]
    # the error of ul + uh is one of h, as in methods/agm.py
    tilt = abs(work[K + i]) * (work[BAR_V + i] + work[BAR_W + i]) / (high[0] + low[0])
    over_up, over_down = 1.0 / work[LINE_UP + i], 1.0 / work[LINE_DOWN + i]
    one, other = work[MINUS + i] * over_up, work[PLUS + i] * over_down
    more = abs(up[0] * work[V_HIGH + i] * over_up) + abs(down[0] * work[W_LOW + i] * over_down)
    more += 4.0 * ROUNDOFF * (abs(one) + abs(other))
    work[TILTED_TOTAL + i] = tilt * (abs(one - other) + more)
    work[TILTED_DIFFERENCE + i] = tilt * (abs(one + other) + more)
    known = (abs(work[UP + WEIGHT + i]) <= LAST * work[UP + TOTAL + i]) & (
        abs(work[DOWN + WEIGHT + i]) <= LAST * work[DOWN + TOTAL + i]
    )
    work[FINE + i] = noise(work, i) if known else 0.0


@kernel
def begin(work):
    for i in range(TILE):
        prepare(work, i)


@kernel
def go(work, means):
    for _ in range(means):
        for i in range(TILE):
            take_mean(work, i)


@kernel
def end(work):
    for i in range(TILE):
        finish(work, i)


@splice
def fill(work, means):
    """Fill the rows FINE of `work` (ALL); `means` is the number of means that suffices in float64."""
    begin(work)
    go(work, means + FURTHER)
    end(work)
