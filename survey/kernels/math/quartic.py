"""A quartic in double-double, (c0, .., c4) as pairs: its value, and its root between two points."""

from math import sqrt

from survey.kernels.jit import inline, kernel
from survey.kernels.math.double import add, mul
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF

STEPS = 200
ROUGH = 1e-14  # relative: below, float64 has no digits of a sum left
SAME = 1e-8  # steps that are smaller, relative, need no bracket
CLOSE = 1e-15  # and these are the last in float64
FINE = 8


@kernel
def value(c, y):
    """c(y) as a pair, and the sum of |terms|."""
    r, size = c[4], abs(c[4][0])
    for i in range(4):
        r = add(mul(r, y), c[3 - i])
        size = size * abs(y[0]) + abs(c[3 - i][0])
    return r, size


@inline
def roughly(c, y):
    """c(y) to a few digits at least, and the sum of |terms|: in float64 where that has them."""
    c0, c1, c2, c3, c4 = c[0][0], c[1][0], c[2][0], c[3][0], c[4][0]
    r = c0 + y * (c1 + y * (c2 + y * (c3 + y * c4)))
    x = abs(y)
    size = abs(c0) + x * (abs(c1) + x * (abs(c2) + x * (abs(c3) + x * abs(c4))))
    if abs(r) > ROUGH * size:
        return r, size
    fine, _size = value(c, (y, 0.0))
    return fine[0], size


@inline
def slopes(c, y):
    """c'(y) and c''(y), in float64."""
    c1, c2, c3, c4 = c[1][0], c[2][0], c[3][0], c[4][0]
    return c1 + y * (2.0 * c2 + y * (3.0 * c3 + y * 4.0 * c4)), 2.0 * c2 + y * (
        6.0 * c3 + y * 12.0 * c4
    )


@kernel
def slope(c, y):
    """c'(y) as a pair."""
    r = (4.0 * c[4][0], 4.0 * c[4][1])
    for i in range(3):
        n = 3.0 - i
        r = add(mul(r, y), mul((n, 0.0), c[3 - i]))
    return r


@inline
def near(height, first, second, side, room):
    """How far from a point the parabola there has its zero on that side, as a part of `room`; 1
    where it has none.
    """
    first *= side
    below = height <= 0.0
    height, first, second = (-height, -first, -second) if below else (height, first, second)
    square = first * first - 2.0 * second * height
    if square < 0.0 or room == 0.0 or height == 0.0:
        return 1.0
    root = sqrt(square)
    if first > 0.0:
        x = -(first + root) / second if second < 0.0 else room
    else:
        x = 2.0 * height / (root - first) if root > first else room
    return min(abs(x) / room, 1.0)


@kernel
def root(c, inside, outside):
    """The root between `inside`, where c >= 0, and `outside`, where c <= 0; with a bound of its
    error.

    Newton's method between brackets, from the nearer of the zeros of the parabolas at the ends.
    """
    side, room = (1.0, outside - inside) if outside > inside else (-1.0, inside - outside)
    high, _size = roughly(c, inside)
    low, _size = roughly(c, outside)
    first, second = slopes(c, inside)
    from_inside = near(high, first, second, side, room)
    first, second = slopes(c, outside)
    from_outside = near(low, first, second, -side, room)
    y = (
        inside + side * room * from_inside
        if from_inside < from_outside
        else outside - side * room * from_outside
    )
    y = y if y != inside else 0.5 * (inside + outside)
    for _ in range(STEPS):
        height, _size = roughly(c, y)
        first, second = slopes(c, y)
        if height > 0.0:
            inside = y
        else:
            outside = y
        move = height / first
        new = y - move
        if abs(move) > SAME * abs(y) and not (min(inside, outside) < new < max(inside, outside)):
            new = 0.5 * (inside + outside)
            if new == inside or new == outside:
                break
        elif abs(move) <= CLOSE * abs(y) or new == y:
            y = new
            break
        y = new
    pair, size = (y, 0.0), 0.0
    for _ in range(FINE):
        fine, size = value(c, pair)
        first, second = slopes(c, pair[0])
        move = fine[0] / first
        if not abs(move) < SAME * abs(pair[0]):
            break
        pair = add(pair, (-move, 0.0))
        if abs(move * move * second) <= PAIR_SUM_ROUNDOFF * abs(pair[0] * first):
            break
    return pair, 2.0 * PAIR_SUM_ROUNDOFF * (
        size / abs(first) + abs(pair[0])
    ) if first != 0.0 else 1.0
