"""A quartic in double-double, (c0, .., c4) as pairs: its value, and its root between two places."""

from math import sqrt

from survey.kernels.double import add, mul
from survey.kernels.jit import inline, kernel

UNIT = 2.0**-98  # of the sum of |terms|: the rounding of a value, the coefficients' own included
STEPS = 200
SAME = 1e-10  # steps that are smaller, relative, need no bracket


@kernel
def value(c, y):
    """c(y) as a pair, and the sum of |terms|."""
    r, size = c[4], abs(c[4][0])
    for i in range(4):
        r = add(mul(r, y), c[3 - i])
        size = size * abs(y[0]) + abs(c[3 - i][0])
    return r, size


@inline
def slopes(c, y):
    """c'(y) and c''(y), in float64."""
    c1, c2, c3, c4 = c[1][0], c[2][0], c[3][0], c[4][0]
    return c1 + y * (2.0 * c2 + y * (3.0 * c3 + y * 4.0 * c4)), 2.0 * c2 + y * (6.0 * c3 + y * 12.0 * c4)


@kernel
def slope(c, y):
    """c'(y) as a pair."""
    r = (4.0 * c[4][0], 4.0 * c[4][1])
    for i in range(3):
        n = 3.0 - i
        r = add(mul(r, y), mul((n, 0.0), c[3 - i]))
    return r


@inline
def near(level, first, second, side, room):
    """How far from a place the parabola there has its zero on that side, as a part of `room`; 1 where it has none."""
    first *= side
    below = level <= 0.0
    level, first, second = (-level, -first, -second) if below else (level, first, second)
    square = first * first - 2.0 * second * level
    if square < 0.0 or room == 0.0:
        return 1.0
    root = sqrt(square)
    if first > 0.0:
        x = -(first + root) / second if second < 0.0 else room
    else:
        x = 2.0 * level / (root - first) if root > first else room
    return min(abs(x) / room, 1.0)


@kernel
def root(c, inside, outside):
    """The root between `inside`, where c >= 0, and `outside`, where c <= 0; with a bound of its error.

    Newton's method between brackets, from the nearer of the zeros of the parabolas at the ends.
    """
    side, room = (1.0, outside - inside) if outside > inside else (-1.0, inside - outside)
    high, _size = value(c, (inside, 0.0))
    low, _size = value(c, (outside, 0.0))
    first, second = slopes(c, inside)
    from_inside = near(high[0], first, second, side, room)
    first, second = slopes(c, outside)
    from_outside = near(low[0], first, second, -side, room)
    y = inside + side * room * from_inside if from_inside < from_outside else outside - side * room * from_outside
    y = (y if y != inside else 0.5 * (inside + outside), 0.0)
    for _ in range(STEPS):
        level, size = value(c, y)
        first, second = slopes(c, y[0])
        if level[0] > 0.0:
            inside = y[0]
        else:
            outside = y[0]
        move = level[0] / first
        new = y[0] - move
        if abs(move) > SAME * abs(y[0]) and not (min(inside, outside) < new < max(inside, outside)):
            middle = 0.5 * (inside + outside)
            if middle == inside or middle == outside:
                break
            y = (middle, 0.0)
            continue
        y = add(y, (-move, 0.0))
        if abs(move * move * second) <= UNIT * abs(y[0] * first) or abs(level[0]) <= 0.01 * UNIT * size:
            break
    level, size = value(c, y)
    first, second = slopes(c, y[0])
    return y, 2.0 * UNIT * (size / abs(first) + abs(y[0])) if first != 0.0 else 1.0
