"""As `nutation_lanes`, in double-double: what the poles add to multiples of pi, where both nearly cancel."""

from survey.kernels import double as dd
from survey.kernels.jit import inline, kernel
from survey.kernels.nutation_lanes import (
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
    V_HIGH,
    V_LOW,
    W_HIGH,
    W_LOW,
    WIDTH,
    K,
    L,
    pair,
    put,
)
from survey.kernels.quartic import UNIT

MEANS = 8
LAST = 1e-30
FINEST = 2.0**-96
# rows of the tile that follow those of `nutation_lanes`: pairs x, y; p, weight, total of both poles; complementary?
X, Y, UP, DOWN, LOW_UP, LOW_DOWN, ALL = (TILE * (ROWS + n) for n in (0, 2, 4, 10, 16, 17, 18))
P, WEIGHT, TOTAL = 0, 2 * TILE, 4 * TILE


@inline
def ingredients(work, i):
    """The roots of Q at the turning points, h and k - h^2 of (S11), x and y."""
    k, near, far = pair(work, K, i), pair(work, Q_HIGH, i), pair(work, Q_LOW, i)
    high, low = dd.sqrt(near), dd.sqrt(far)
    g, middle, n = dd.mul(high, low), pair(work, MIDDLE, i), pair(work, BEND, i)
    above = dd.add(middle, g)
    if middle[0] < 0.0:  # (S10)
        width = dd.sub(pair(work, V_LOW, i), pair(work, V_HIGH, i))
        above = dd.div(dd.mul(dd.mul(k, n), dd.mul(width, width)), dd.times(dd.sub(g, middle), 4.0))
    incline = dd.times(dd.div(dd.mul(k, pair(work, SUM, i)), dd.add(high, low)), 2.0)
    bend = dd.times(dd.div(dd.mul(k, n), above), 0.5)
    return high, low, incline, bend, dd.sqrt(dd.times(above, 0.5)), dd.sqrt(g)


@inline
def parameter(gap, near, far, root_near, incline):
    """l and Q at the pole."""
    return dd.add(root_near, dd.mul(incline, near)), dd.div(dd.mul(gap, gap), dd.mul(near, far))


@inline
def enter(work, row, low_row, line, q, x, y, i):
    ratio, xy = dd.div(y, line), dd.mul(x, y)
    square = dd.mul(q, dd.mul(ratio, ratio))
    low = square[0] < xy[0]
    other = dd.mul(xy, dd.div(xy, square))
    square = other[0] if low else square[0], other[1] if low else square[1]
    put(work, row + P, i, dd.sqrt(square))
    put(work, row + WEIGHT, i, (1.0, 0.0))
    put(work, row + TOTAL, i, (0.0, 0.0))
    work[low_row + i] = 1.0 if low else 0.0


@inline
def prepare(work, i):
    high, low, incline, _bend, x, y = ingredients(work, i)
    line, q = parameter(pair(work, MINUS, i), pair(work, V_HIGH, i), pair(work, V_LOW, i), high, incline)
    enter(work, UP, LOW_UP, line, q, x, y, i)
    line, q = parameter(pair(work, PLUS, i), pair(work, W_LOW, i), pair(work, W_HIGH, i), low, dd.neg(incline))
    enter(work, DOWN, LOW_DOWN, line, q, x, y, i)
    put(work, X, i, x)
    put(work, Y, i, y)


@inline
def go_on(work, row, low_row, xy, i):
    """A term of the sum R (S12)."""
    p, weight, total = pair(work, row + P, i), pair(work, row + WEIGHT, i), pair(work, row + TOTAL, i)
    size = dd.add(dd.mul(p, p), xy)
    rest = dd.div(dd.times(xy, 2.0), size)
    term = dd.mul(weight, rest)
    low = work[low_row + i] == 1.0
    put(work, row + TOTAL, i, dd.add(total, (term[0] if low else weight[0], term[1] if low else weight[1])))
    put(work, row + WEIGHT, i, dd.times(dd.mul(weight, dd.sub((1.0, 0.0), rest)), 0.5))
    put(work, row + P, i, dd.div(size, dd.times(p, 2.0)))


@inline
def take_mean(work, i):
    x, y = pair(work, X, i), pair(work, Y, i)
    xy = dd.mul(x, y)
    go_on(work, UP, LOW_UP, xy, i)
    go_on(work, DOWN, LOW_DOWN, xy, i)
    put(work, X, i, dd.times(dd.add(x, y), 0.5))
    put(work, Y, i, dd.sqrt(xy))


@inline
def part(gap, near, far, root_near, root_far, incline, bend, ratio):
    """(b -+ a) J/A less pi, times 2/T (S11)."""
    line, q = parameter(gap, near, far, root_near, incline)
    level = dd.add(dd.mul(root_far, near), dd.mul(root_near, far))
    second = dd.times(dd.div(dd.mul(dd.mul(level, bend), ratio), q), 0.25)
    return dd.mul(dd.div(gap, line), dd.add(incline, second))


@inline
def noise(work, i):
    """What the bars of the set-up leave of the parts, relative to their terms, as in methods/agm.py."""
    bar_v, bar_w, size_k = work[BAR_V + i], work[BAR_W + i], abs(work[K + i])
    error = 8.0 * (size_k * (bar_v + bar_w) + UNIT * (abs(work[L + i]) + 8.0 * size_k))
    total = error / work[Q_LOW + i] + error / work[Q_HIGH + i] + FINEST
    total += error / abs(work[BEND + i]) + 2.0 * (bar_v + bar_w) / work[WIDTH + i] if work[MIDDLE + i] < 0.0 else 0.0
    return 4.0 * total + bar_v / work[V_HIGH + i] + bar_w / work[W_LOW + i]


@inline
def finish(work, i):
    high, low, incline, bend, _x, _y = ingredients(work, i)
    up = part(pair(work, MINUS, i), pair(work, V_HIGH, i), pair(work, V_LOW, i), high, low, incline, bend,
              pair(work, UP + TOTAL, i))  # fmt: skip
    down = part(pair(work, PLUS, i), pair(work, W_LOW, i), pair(work, W_HIGH, i), low, high, dd.neg(incline), bend,
                pair(work, DOWN + TOTAL, i))  # fmt: skip
    work[FINE_TOTAL + i], work[FINE_DIFFERENCE + i] = 0.5 * dd.add(down, up)[0], 0.5 * dd.sub(down, up)[0]
    known = (abs(work[UP + WEIGHT + i]) <= LAST * work[UP + TOTAL + i]) & (
        abs(work[DOWN + WEIGHT + i]) <= LAST * work[DOWN + TOTAL + i]
    )
    work[FINE + i] = noise(work, i) if known else 0.0


@kernel
def begin(work):
    for i in range(TILE):
        prepare(work, i)


@kernel
def go(work):
    for _ in range(MEANS):
        for i in range(TILE):
            take_mean(work, i)


@kernel
def fine(work):
    """Fill the rows FINE of `work` (ALL)."""
    begin(work)
    go(work)
    for i in range(TILE):
        finish(work, i)
