"""A user's flow, phi' = w, w' = f(phi) w + g(phi): f, g and g' as a program, run on power series
and on balls.

A program is a list of operations, each of which makes one value from earlier ones; the first value
is phi itself. It stands in the row p of a flow after the columns of `flow`: SLOTS to RADIUS, then
WIDTH numbers an operation: its code, the indices of its two operands, and a number. Where a number
is an operand, the rest that binary64 does not hold stands in the column that is not used. The
series of a function h(y) follows from h' y': its second operand is h'. p[REVERSED] is the sign of
f, p[MIRRORED] that of phi and of g: -1 under the symmetries S1 and S2 of `solution`.

A ball is a middle and a radius that covers the range and every rounding: of radius 0 at phi, it
bounds the roundings of f and g alone; over an interval, it bounds f, f', g, g', g'' there.

Source: A. Griewank, A. Walther, Evaluating Derivatives (2008), chapter 13; F. Johansson, Arb:
efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE Trans. Computers 66 (2017)
1281-1292.
"""

import math

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math import functions
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP

# Columns of the six parameters: signs and marks, and the mean of f on the circle, 0 where it
# vanishes within rounding.
REVERSED, ON_CIRCLE, MIRRORED, AT_REST, MEAN = 0, 2, 3, 4, 5
BOUND_F, BOUND_G, BOUND_DG, BOUND_DDG = range(6, 10)  # as in `flow`
_ON_F, _ON_G, _ON_DG, _ON_DDG = range(4)  # the same from BOUND_F on
_BOUNDS = 4
COLUMNS = 10  # of a row of `flow`; what has more is a program
SLOTS, FORCES, F_AT, G_AT, DG_AT, RADIUS, OPERATIONS = range(10, 17)
CODE, FIRST, SECOND, NUMBER, WIDTH = range(5)
# the last four: x + c, c x, c - x, c / x
CONSTANT, ADD, SUBTRACT, MULTIPLY, DIVIDE, PLUS, TIMES, FROM, OVER = range(9)
(
    SIN,
    COS,
    TAN,
    ASIN,
    ACOS,
    ATAN,
    SINH,
    COSH,
    TANH,
    ASINH,
    ACOSH,
    ATANH,
    EXP,
    LOG,
    SQRT,
    ERF,
    POWER,
) = range(9, 26)
LEAST_RADIUS = 1e-9
COARSEST, FINEST = 16, 65536  # pieces of the circle, over which f and g are bounded


@kernel
def function(code, x, number):
    """The function of this code at x; NaN outside its domain."""
    if code != POWER:
        return functions.function(code - SIN, x)
    return x**number if x > 0.0 else math.nan


@inline
def _count(p, column):
    """The number of operations: at least one, even in a row of zeros, which stands for no program."""
    return max(1, int(p[column]))


@inline
def _operation(p, i):
    at = OPERATIONS + WIDTH * i
    return int(p[at + CODE]), int(p[at + FIRST]), int(p[at + SECOND]), p[at + NUMBER]


@kernel
def extend(p, S, n, count):
    """Fill S[i, n], order n of the first `count` values, from the lower orders and order n of phi,
    S[0, n].
    """
    for i in range(1, count):
        code, a, b, number = _operation(p, i)
        value = 0.0
        if code == CONSTANT:
            value = number if n == 0 else 0.0
        elif code == ADD:
            value = S[a, n] + S[b, n]
        elif code == SUBTRACT:
            value = S[a, n] - S[b, n]
        elif code == PLUS:
            value = S[a, n] + number if n == 0 else S[a, n]
        elif code == FROM:
            value = number - S[a, n] if n == 0 else -S[a, n]
        elif code == TIMES:
            value = number * S[a, n]
        elif code == MULTIPLY:
            for k in range(n + 1):
                value += S[a, k] * S[b, n - k]
        elif code == DIVIDE or code == OVER:
            for k in range(1, n + 1):
                value -= S[b, k] * S[i, n - k]
            first = S[a, n] if code == DIVIDE else (number if n == 0 else 0.0)
            value = (first + value) / S[b, 0]
        elif n == 0:
            value = function(code, S[a, 0], number)
        else:
            for k in range(1, n + 1):
                value += k * S[a, k] * S[b, n - k]
            value /= n
        S[i, n] = value


@kernel
def values(p, phi):
    """f, g, g' at phi."""
    count = _count(p, SLOTS)
    S = np.empty((count, 1))
    S[0, 0] = p[MIRRORED] * phi
    extend(p, S, 0, count)
    f, g = S[int(p[F_AT]), 0], S[int(p[G_AT]), 0]
    return p[REVERSED] * f, p[MIRRORED] * g, S[int(p[DG_AT]), 0]


@kernel
def sample(p, f, g):
    """Fill f and g with their values at evenly spread angles of the circle, from 0 on."""
    for i in range(len(f)):
        f[i], g[i], _dg = values(p, i * (2.0 * math.pi / len(f)))


@kernel
def in_angle(p, phi, f, g):
    """Fill f and g with their Taylor coefficients about phi."""
    count, size = _count(p, FORCES), len(f)
    S = np.zeros((count, size))
    S[0, 0], S[0, 1] = p[MIRRORED] * phi, p[MIRRORED]
    for n in range(size):
        extend(p, S, n, count)
        f[n], g[n] = p[REVERSED] * S[int(p[F_AT]), n], p[MIRRORED] * S[int(p[G_AT]), n]


@kernel
def in_time(p, phi, w, order, x, v, e, y):
    """Fill phi, w, and the integrals e of f and y of g, with the series through (phi, w) up to t^order."""
    count, at_f, at_g = _count(p, FORCES), int(p[F_AT]), int(p[G_AT])
    S = np.empty((count, order + 1))
    x[0], v[0], e[0], y[0] = phi, w, 0.0, 0.0
    for n in range(order):
        S[0, n] = p[MIRRORED] * x[n]
        extend(p, S, n, count)
        total = 0.0
        for k in range(n + 1):
            total += S[at_f, k] * v[n - k]
        r = 1.0 / (n + 1)
        e[n + 1], y[n + 1] = p[REVERSED] * S[at_f, n] * r, p[MIRRORED] * S[at_g, n] * r
        x[n + 1], v[n + 1] = v[n] * r, (p[REVERSED] * total + p[MIRRORED] * S[at_g, n]) * r


@kernel
def along(p, x, f, dg):
    """Fill f and g' with their series in time along the angle x (all of one length)."""
    count = _count(p, SLOTS)
    S = np.empty((count, len(x)))
    for n in range(len(x)):
        S[0, n] = p[MIRRORED] * x[n]
        extend(p, S, n, count)
        f[n], dg[n] = p[REVERSED] * S[int(p[F_AT]), n], S[int(p[DG_AT]), n]


@inline
def _product(a, r, b, s):
    """The ball (a, r) times (b, s)."""
    middle = a * b
    return middle, abs(a) * s + abs(b) * r + r * s + ROUNDOFF_UP * abs(middle)


@inline
def _quotient(a, r, b, s):
    """The ball (a, r) by (b, s)."""
    if not abs(b) > s:
        return 0.0, math.inf
    middle = a / b
    return middle, (r + abs(middle) * s) / (abs(b) - s) + ROUNDOFF_UP * abs(middle)


@kernel
def _function_ball(code, x, r, number):
    """The ball of the function over (x, r): all but sin, cos, cosh are monotone, and cosh dips less
    than it rises.
    """
    value = function(code, x, number)
    if r == 0.0:
        spread = 0.0
    elif code == SIN or code == COS:
        steep = math.cos(x) if code == SIN else math.sin(x)
        spread = min(r, abs(steep) * r + 0.5 * r * r, 1.0 + abs(value))
    else:
        spread = max(
            abs(function(code, x - r, number) - value), abs(function(code, x + r, number) - value)
        )
        spread += 2.0 * EPS * abs(value)
        if code == TAN and math.floor((x - r) / math.pi + 0.5) != math.floor(
            (x + r) / math.pi + 0.5
        ):
            spread = math.inf
    # what libm rounds, and more
    rounding = 0.0 if x == 0.0 and value == 0.0 else 2.0 * EPS * abs(value)
    return (value, spread + rounding) if math.isfinite(value + spread) else (0.0, math.inf)


@kernel
def extend_balls(p, B, n):
    """As `extend`, on balls: fill B[i, n] = (middle, radius)."""
    for i in range(1, _count(p, SLOTS)):
        code, a, b, number = _operation(p, i)
        m = r = 0.0
        if code == CONSTANT:
            if n == 0:
                m, r = number, p[OPERATIONS + WIDTH * i + FIRST]
        elif code == ADD or code == SUBTRACT:
            m = B[a, n, 0] + (B[b, n, 0] if code == ADD else -B[b, n, 0])
            r = B[a, n, 1] + B[b, n, 1] + ROUNDOFF_UP * abs(m)
        elif code == PLUS or code == FROM:
            m, r = B[a, n, 0] if code == PLUS else -B[a, n, 0], B[a, n, 1]
            if n == 0:
                m += number
                r += p[OPERATIONS + WIDTH * i + SECOND] + ROUNDOFF_UP * abs(m)
        elif code == TIMES:
            m, r = _product(B[a, n, 0], B[a, n, 1], number, p[OPERATIONS + WIDTH * i + SECOND])
        elif code == MULTIPLY:
            for k in range(n + 1):
                c, s = _product(B[a, k, 0], B[a, k, 1], B[b, n - k, 0], B[b, n - k, 1])
                m += c
                r += s + n * ROUNDOFF_UP * abs(c)
        elif code == DIVIDE or code == OVER:
            if code == DIVIDE:
                m, r = B[a, n, 0], B[a, n, 1]
            elif n == 0:
                m, r = number, p[OPERATIONS + WIDTH * i + FIRST]
            for k in range(1, n + 1):
                c, s = _product(B[b, k, 0], B[b, k, 1], B[i, n - k, 0], B[i, n - k, 1])
                m -= c
                r += s + (n + 1) * ROUNDOFF_UP * abs(c)
            m, r = _quotient(m, r + n * ROUNDOFF_UP * abs(m), B[b, 0, 0], B[b, 0, 1])
        elif n == 0:
            m, r = _function_ball(code, B[a, 0, 0], B[a, 0, 1], number)
        else:
            for k in range(1, n + 1):
                c, s = _product(B[a, k, 0], B[a, k, 1], B[b, n - k, 0], B[b, n - k, 1])
                m += k * c
                r += k * (s + (n + 1) * ROUNDOFF_UP * abs(c))
            m, r = m / n, r / n
        B[i, n, 0], B[i, n, 1] = m, (r if math.isfinite(m) else math.inf)


@inline
def _largest(B, i, n):
    """The largest of |the ball|, NaN taken for infinity."""
    size = abs(B[i, n, 0]) + B[i, n, 1]
    return size if size >= 0.0 else math.inf


@kernel
def ball(p, phi, radius, orders, B):
    """Fill B (SLOTS, orders, 2) with the Taylor coefficients of every value over the angles within
    `radius` of phi.
    """
    for n in range(orders):
        B[0, n, 0] = p[MIRRORED] * phi if n == 0 else (p[MIRRORED] if n == 1 else 0.0)
        B[0, n, 1] = radius if n == 0 else 0.0
        extend_balls(p, B, n)


@kernel
def bounds(p, phi, radius, B, out):
    """Raise `out` (_BOUNDS) to bounds of |f| and |f'|, of |g|, of |g'|, of |g''| within `radius` of phi.

    The first two also bound what rounds f and g there, in roundoffs: `steps` takes them for the
    sizes of their terms.
    """
    f, g = int(p[F_AT]), int(p[G_AT])
    ball(p, phi, 0.0, 1, B)
    rounded_f, rounded_g = B[f, 0, 1] / ROUNDOFF_UP, B[g, 0, 1] / ROUNDOFF_UP
    ball(p, phi, radius, 3, B)
    out[_ON_F] = max(out[_ON_F], rounded_f, 1.0001 * max(_largest(B, f, 0), _largest(B, f, 1)))
    out[_ON_G] = max(out[_ON_G], rounded_g, 1.0001 * _largest(B, g, 0))
    out[_ON_DG] = max(out[_ON_DG], 1.0001 * _largest(B, g, 1))
    out[_ON_DDG] = max(out[_ON_DDG], 2.0001 * _largest(B, g, 2))


@kernel
def bound_circle(p):
    """Write bounds over the whole circle into p, within a factor of 2; infinite where no FINEST
    pieces bound them.
    """
    B, out, pieces, near = np.empty((_count(p, SLOTS), 3, 2)), np.empty(_BOUNDS), COARSEST, False
    while not near and pieces <= FINEST:
        half = math.pi / pieces
        for k in range(_BOUNDS):
            out[k] = 0.0
        for i in range(pieces):
            bounds(p, (2 * i + 1) * half - math.pi, 1.0001 * half, B, out)
        near = pieces > COARSEST
        for k in range(_BOUNDS):
            near = near and math.isfinite(out[k]) and p[BOUND_F + k] <= 2.0 * out[k]
            p[BOUND_F + k] = out[k]
        pieces *= 4


@kernel
def _periodic(p, angles):
    """Are f and g the same, within their rounding, at these angles and 2 pi further on?"""
    near, far = np.empty((_count(p, SLOTS), 1, 2)), np.empty((_count(p, SLOTS), 1, 2))
    for phi in angles:
        ball(p, phi, 0.0, 1, near)
        ball(p, phi + 2.0 * math.pi, 0.0, 1, far)
        for at, steep in ((int(p[F_AT]), p[BOUND_F]), (int(p[G_AT]), p[BOUND_DG])):
            most = 2.0 * (near[at, 0, 1] + far[at, 0, 1]) + 4e-15 * steep
            if not abs(near[at, 0, 0] - far[at, 0, 0]) <= most:
                return False
    return True


@kernel
def complete(rows, angles):
    """Fill in AT_REST and, on a circle, the bounds of programs; NaN where a number is not finite, or
    f and g have no bounds or, by these angles, not the period 2 pi.
    """
    for p in rows:
        good = True
        for k in range(OPERATIONS, len(p)):
            good &= math.isfinite(p[k])
        if good:
            B, g = np.empty((_count(p, SLOTS), 1, 2)), int(p[G_AT])
            ball(p, 0.0, 0.0, 1, B)
            p[AT_REST] = 1.0 if B[g, 0, 0] == 0.0 and B[g, 0, 1] == 0.0 else 0.0
            if p[ON_CIRCLE] > 0.0:
                bound_circle(p)
                for k in range(_BOUNDS):
                    good &= math.isfinite(p[BOUND_F + k])
                good = good and _periodic(p, angles)
        if not good:
            p[:] = math.nan


@kernel
def bound_near(p, phi):
    """Write bounds near phi into p, and how near: p[RADIUS], twice the last one, or less where they
    are not finite.
    """
    B, out, near = np.empty((_count(p, SLOTS), 3, 2)), np.empty(_BOUNDS), False
    p[RADIUS] = min(4.0 * p[RADIUS], 0.5 * (1.0 + abs(phi)))
    while not near:
        p[RADIUS] *= 0.5
        for k in range(_BOUNDS):
            out[k] = 0.0
        bounds(p, phi, p[RADIUS], B, out)
        near = math.isfinite(out.sum()) or p[RADIUS] < LEAST_RADIUS
    for k in range(_BOUNDS):
        p[BOUND_F + k] = out[k]


@kernel
def longest_step(p, w):
    """A step on which phi stays within p[RADIUS], where the bounds hold: |w| stays below 2 |w| +
    sqrt(RADIUS g).
    """
    root = math.sqrt(p[RADIUS] * p[BOUND_G]) + 1e-300
    most = 2.0 * abs(w) + root
    return min(p[RADIUS] / most, (abs(w) + root) / (p[BOUND_F] * most + p[BOUND_G] + 1e-300))
