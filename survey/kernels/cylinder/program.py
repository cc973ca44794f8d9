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

from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math import functions
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP
from survey.kernels.unroll import unroll

# Columns of the six parameters: signs and marks, and the mean of f on the circle, 0 where it
# vanishes within rounding.
REVERSED, ON_CIRCLE, MIRRORED, AT_REST, MEAN = 0, 2, 3, 4, 5
BOUND_F, BOUND_G, BOUND_DG, BOUND_DDG = range(6, 10)  # as in `flow`
_ON_F, _ON_G, _ON_DG, _ON_DDG = range(4)  # the same from BOUND_F on
BOUNDS = 4
SHOWN_F, MORE_F, SHOWN_G, MORE_G = range(4, 8)
KNOWN = 8
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
# On a line, f and g are bounded over an interval with as many of their derivatives. What their series
# leave out, as these bound it, is to be at most HIDDEN of them, unless the interval is as narrow as FINE.
DERIVATIVES, HIDDEN, FINE = 6, 1e-3, 1e-6
NEGLIGIBLE = 1e-18  # what changes w by such a share may be left out
WEAK = 1e-9  # of the largest on the circle, where steps have the same limit all round it
UNLIMITED = 1e300  # RADIUS on a circle where f and g cannot have spikes
COARSEST, FINEST = 16, 65536  # pieces of the circle, over which f and g are bounded
LANES = 32  # of them at once
VECTOR = 8  # lanes of vector code


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
        below = abs(function(code, x - r, number) - value)
        above = abs(function(code, x + r, number) - value)
        spread = (below if below > above else above) + 2.0 * EPS * abs(value)
        spread = spread if math.isfinite(below + above) else math.inf  # max drops a NaN
        if code == TAN and math.floor((x - r) / math.pi + 0.5) != math.floor(
            (x + r) / math.pi + 0.5
        ):
            spread = math.inf
    # what libm rounds, and more
    rounding = 0.0 if x == 0.0 and value == 0.0 else 2.0 * EPS * abs(value)
    return (value, spread + rounding) if math.isfinite(value + spread) else (0.0, math.inf)


@kernel
def note(p, numbers, first, end):
    """Note the numbers of the program in the lanes from `first` to `end` - 1 of `numbers` (2 SLOTS,
    LANES), each before the rest that is not in binary64.
    """
    for i in range(_count(p, SLOTS)):
        at = OPERATIONS + WIDTH * i
        code, rest = int(p[at + CODE]), 0.0
        if code == CONSTANT or code == OVER:
            rest = p[at + FIRST]
        elif code == PLUS or code == FROM or code == TIMES:
            rest = p[at + SECOND]
        for q in range(first, end):
            numbers[2 * i, q], numbers[2 * i + 1, q] = p[at + NUMBER], rest


# The balls of many lanes stand in one flat array, middles before radii, LANES of each, so that LLVM
# sees which overlap: a, b, o are where balls begin in B, x where a number does in N.


@unroll
def _ball_set(B, N, x, share, o, i):
    B[o + i], B[o + LANES + i] = share * N[x + i], share * N[x + LANES + i]


@unroll
def _ball_copy(B, a, o, i):
    B[o + i], B[o + LANES + i] = B[a + i], B[a + LANES + i]


@unroll
def _ball_sum(B, a, sign, b, o, i):
    middle = B[a + i] + sign * B[b + i]
    B[o + i] = middle
    B[o + LANES + i] = B[a + LANES + i] + B[b + LANES + i] + ROUNDOFF_UP * abs(middle)


@unroll
def _ball_shift(B, sign, a, N, x, share, o, i):
    middle = sign * B[a + i] + share * N[x + i]
    B[o + i] = middle
    rest = N[x + LANES + i] + ROUNDOFF_UP * abs(middle)
    B[o + LANES + i] = B[a + LANES + i] + share * rest


@unroll
def _ball_scale(B, a, N, x, o, i):
    middle, radius = _product(B[a + i], B[a + LANES + i], N[x + i], N[x + LANES + i])
    B[o + i], B[o + LANES + i] = middle, radius


@unroll
def _ball_add(B, a, b, factor, rounding, o, i):
    """Add factor times the product; `rounding`: that of the sum, as a share of it."""
    middle, radius = _product(B[a + i], B[a + LANES + i], B[b + i], B[b + LANES + i])
    B[o + i] = B[o + i] + factor * middle
    B[o + LANES + i] = B[o + LANES + i] + abs(factor) * (radius + rounding * abs(middle))


@unroll
def _ball_square(B, a, o, i):
    """That of a square, which is not negative."""
    size, radius = abs(B[a + i]), B[a + LANES + i]
    low = 0.5 * ((size - radius) + abs(size - radius))
    low, high = 0.5 * low * low, 0.5 * (size + radius) * (size + radius)
    B[o + i], B[o + LANES + i] = high + low, (high - low) + 2.0 * ROUNDOFF_UP * (high + low)


@unroll
def _ball_share(B, below, o, i):
    B[o + i], B[o + LANES + i] = B[o + i] / below, B[o + LANES + i] / below


def _product(a, r, b, s):
    """The ball (a, r) times (b, s)."""
    middle = a * b
    return middle, abs(a) * s + abs(b) * r + r * s + ROUNDOFF_UP * abs(middle)


@inline
def _quotient(a, r, b, s):
    """The ball (a, r) by (b, s)."""
    middle = a / b
    radius = (r + abs(middle) * s) / (abs(b) - s) + ROUNDOFF_UP * abs(middle)
    return (middle, radius) if abs(b) > s else (0.0, math.inf)


@inline
def _extend_balls(p, numbers, known, lanes, width, orders, B, n):
    """As `extend`, on balls: those of B of order n, but where known[i], in `width` lanes; functions
    only in the first `lanes`.
    """
    share = 1.0 if n == 0 else 0.0
    for i in range(1, _count(p, FORCES)):
        if known[i]:
            continue
        code, a, b, number = _operation(p, i)
        x, o, step = 2 * LANES * i, 2 * LANES * (orders * i + n), 2 * LANES
        one, two = step * orders * a, step * orders * b  # of order 0
        if code == CONSTANT:
            for q in range(width):
                _ball_set(B, numbers, x, share, o, q)
        elif code == ADD or code == SUBTRACT:
            sign = 1.0 if code == ADD else -1.0
            for q in range(width):
                _ball_sum(B, one + step * n, sign, two + step * n, o, q)
        elif code == PLUS or code == FROM:
            sign = 1.0 if code == PLUS else -1.0
            for q in range(width):
                _ball_shift(B, sign, one + step * n, numbers, x, share, o, q)
        elif code == TIMES:
            for q in range(width):
                _ball_scale(B, one + step * n, numbers, x, o, q)
        elif code == DIVIDE:
            for q in range(width):
                _ball_copy(B, one + step * n, o, q)
        elif code == OVER:
            for q in range(width):
                _ball_set(B, numbers, x, share, o, q)
        elif code == MULTIPLY or n > 0:
            for q in range(width):
                _ball_set(B, numbers, x, 0.0, o, q)
        else:
            for q in range(lanes):
                B[o + q], B[o + LANES + q] = _function_ball(
                    code, B[one + q], B[one + LANES + q], number
                )
        if code == DIVIDE or code == OVER:
            for k in range(1, n + 1):
                before = step * (orders * i + n - k)
                for q in range(width):
                    _ball_add(B, two + step * k, before, -1.0, (n + 1) * ROUNDOFF_UP, o, q)
            for q in range(width):
                own, low = np.uint64(o + q), np.uint64(two + q)  # else no vector code
                r, s = own + np.uint64(LANES), low + np.uint64(LANES)
                wide = B[r] + n * ROUNDOFF_UP * abs(B[own])
                B[own], B[r] = _quotient(B[own], wide, B[low], B[s])
        elif code == MULTIPLY and a == b and n == 0:
            for q in range(width):
                _ball_square(B, one, o, q)
        elif code == MULTIPLY:
            for k in range(n + 1):
                for q in range(width):
                    _ball_add(B, one + step * k, two + step * (n - k), 1.0, n * ROUNDOFF_UP, o, q)
        elif code > OVER and n > 0:
            for k in range(1, n + 1):
                rounding = (n + 1) * ROUNDOFF_UP
                for q in range(width):
                    _ball_add(B, one + step * k, two + step * (n - k), float(k), rounding, o, q)
            for q in range(width):
                _ball_share(B, float(n), o, q)
        for q in range(width):
            own = np.uint64(o + q)
            r = own + np.uint64(LANES)
            B[r] = B[r] if math.isfinite(B[own]) else math.inf


@inline
def _largest(B, at):
    """The largest of |the ball|, NaN taken for infinity."""
    size = abs(B[at]) + B[at + LANES]
    return size if size >= 0.0 else math.inf


@inline
def _angles(p, phi, radius, orders, B, q):
    """Fill lane q of the first value, the angles within `radius` of phi."""
    for n in range(orders):
        at = 2 * LANES * n + q
        B[at] = p[MIRRORED] * phi if n == 0 else (p[MIRRORED] if n == 1 else 0.0)
        B[at + LANES] = radius if n == 0 else 0.0


@kernel
def balls(p, numbers, known, phi, radius, B):
    """Fill B, flat (SLOTS, orders, 2, LANES), middles and radii of the Taylor coefficients of every
    value over the angles within `radius` (lanes) of phi (lanes); `known` ones stand there already.
    """
    lanes, orders = len(phi), len(B) // (2 * LANES * _count(p, SLOTS))
    # a short loop of known length would be unrolled, not vector code
    width = (lanes + VECTOR - 1) // VECTOR * VECTOR
    for q in range(lanes):
        _angles(p, phi[q], radius[q], orders, B, q)
    for n in range(orders):
        _extend_balls(p, numbers, known, lanes, width, orders, B, n)


@kernel
def balls_of_one(p, numbers, known, phi, radius, B):
    """As `balls`, of the first lane: less code by far, and three times as fast."""
    orders = len(B) // (2 * LANES * _count(p, SLOTS))
    _angles(p, phi, radius, orders, B, 0)
    for n in range(orders):
        _extend_balls(p, numbers, known, 1, 1, orders, B, n)


@kernel
def ball(p, phi, radius, orders, B):
    """As `balls`, of one lane: B (SLOTS, orders, 2)."""
    count = _count(p, SLOTS)
    numbers, flat = np.empty((2 * count, LANES)), np.empty(count * orders * 2 * LANES)
    note(p, numbers, 0, 1)
    balls_of_one(p, numbers.ravel(), np.zeros(count, np.bool_), phi, radius, flat)
    for i in range(count):
        for n in range(orders):
            at = 2 * LANES * (orders * i + n)
            B[i, n, 0], B[i, n, 1] = flat[at], flat[at + LANES]


@kernel
def raised(p, points, over, q, out):
    """Raise `out` (BOUNDS) to bounds of |f| and |f'|, of |g|, of |g'|, of |g''| in lane q of the
    balls `over`, of three orders or more.

    The first two also bound what rounds f and g at its middle, as the balls `points` of one order
    have it, in roundoffs: `steps` takes them for the sizes of their terms.
    """
    f, g, step = int(p[F_AT]), int(p[G_AT]), 2 * LANES
    rounded_f, rounded_g = points[step * f + LANES + q], points[step * g + LANES + q]
    orders = len(over) // len(points)
    at_f, at_g = orders * step * f + q, orders * step * g + q
    most_f = 1.0001 * max(_largest(over, at_f), _largest(over, at_f + step))
    out[_ON_F] = max(out[_ON_F], rounded_f / ROUNDOFF_UP, most_f)
    out[_ON_G] = max(out[_ON_G], rounded_g / ROUNDOFF_UP, 1.0001 * _largest(over, at_g))
    out[_ON_DG] = max(out[_ON_DG], 1.0001 * _largest(over, at_g + step))
    out[_ON_DDG] = max(out[_ON_DDG], 2.0001 * _largest(over, at_g + 2 * step))


@kernel
def bounded(p, points, over, q, radius, w, out):
    """Fill `out` (KNOWN) with the bounds that hold within `radius` in lane q, see `raised`, and the
    sizes of the series of f and of g, the middles of `over`, each before what it leaves out at most.
    Returns `hidden`.
    """
    for k in range(KNOWN):
        out[k] = 0.0
    raised(p, points, over, q, out)
    if not math.isfinite(out.sum()):
        return 0.0 if radius < LEAST_RADIUS else math.inf
    f, more_f = _shown(over, int(p[F_AT]), q, radius)
    g, more_g = _shown(over, int(p[G_AT]), q, radius)
    out[SHOWN_F], out[MORE_F], out[SHOWN_G], out[MORE_G] = f, more_f, g, more_g
    return hidden(f, more_f, g, more_g, radius, w)


@inline
def hidden(f, more_f, g, more_g, radius, w):
    """How much of f w + g series of these sizes leave out at most, within the radius, by these
    bounds: up to 1, little enough.
    """
    w = abs(w) + math.sqrt(radius * g)
    enough = HIDDEN * (f * w + g) + NEGLIGIBLE * w * w / radius + 1e-300
    share = (more_f * w + more_g) / enough
    return 0.0 if radius < FINE else (share if share >= 0.0 else math.inf)


@inline
def _shown(over, value, q, radius):
    """Sizes of the series of a value, and of what it leaves out, within the radius of lane q."""
    at, power, size = 2 * LANES * (DERIVATIVES + 1) * value + q, 1.0, 0.0
    for _ in range(DERIVATIVES):
        size += power * abs(over[at])
        at += 2 * LANES
        power *= radius
    return size, power * _largest(over, at)


@inline
def _middles(pieces, out):
    """Fill out (pieces) with the middles of as many pieces of the circle; returns the radius of one."""
    half = math.pi / pieces
    for i in range(pieces):
        out[i] = (2 * i + 1) * half - math.pi
    return 1.0001 * half


@inline
def _agree(p, out, first):
    """Write the bounds `out` into p; are they finite, and near those that p had, if these are not
    the first?
    """
    near = not first
    for k in range(BOUNDS):
        near = near and math.isfinite(out[k]) and p[BOUND_F + k] <= 2.0 * out[k]
        p[BOUND_F + k] = out[k]
    return near


@splice
def _bound_finely(p, numbers, middles, radii, bounds):
    """Lower the bounds over the whole circle in p, which are the largest `bounds` (n, BOUNDS) of its
    pieces: those with more than half of the largest are divided by four, until no bound falls to less
    than half by that.
    """
    count, near = _count(p, SLOTS), False
    points, over = np.zeros(count * 2 * LANES), np.zeros(count * 6 * LANES)
    known, none, out = np.zeros(count, np.bool_), np.zeros(LANES), np.empty(BOUNDS)
    narrowest = radii[0]
    while not near and len(radii) <= FINEST and narrowest > 1.01 * math.pi / FINEST:
        large, left = np.zeros(len(radii), np.bool_), len(radii)
        for i in range(len(radii)):
            for k in range(BOUNDS):
                large[i] |= not bounds[i, k] <= 0.5 * p[BOUND_F + k] or bounds[i, k] == math.inf
            left -= large[i]
        size = left + 4 * (len(radii) - left)
        finer, narrower, lower = np.empty(size), np.empty(size), np.zeros((size, BOUNDS))
        stays, part = 0, left  # what stays comes first
        for i in range(len(radii)):
            if large[i]:
                for j in range(4):
                    finer[part + j] = middles[i] + (0.5 * j - 0.75) * radii[i]
                    narrower[part + j] = 0.250001 * radii[i]
                part += 4
            else:
                finer[stays], narrower[stays] = middles[i], radii[i]
                for k in range(BOUNDS):
                    lower[stays, k] = bounds[i, k]
                stays += 1
        for first in range(left, size, LANES):
            phi = finer[first : first + LANES]
            balls(p, numbers, known, phi, none, points)
            balls(p, numbers, known, phi, narrower[first : first + LANES], over)
            for q in range(len(phi)):
                raised(p, points, over, q, lower[first + q])
        for k in range(BOUNDS):
            out[k] = 0.0
            for i in range(size):
                out[k] = max(out[k], lower[i, k])
        near = _agree(p, out, False)
        middles, radii, bounds = finer, narrower, lower
        for i in range(size):
            narrowest = min(narrowest, radii[i])


@inline
def _periodic(p, points, first, many):
    """Are f and g the same, within their rounding, at angles and 2 pi further on? In `points` these
    are the lanes of one batch and of the next.
    """
    for q in range(first, first + many):
        for at, steep in ((int(p[F_AT]), p[BOUND_F]), (int(p[G_AT]), p[BOUND_DG])):
            near = 2 * LANES * at + q
            far = near + many
            most = 2.0 * (points[near + LANES] + points[far + LANES]) + 4e-15 * steep
            if not abs(points[near] - points[far]) <= most:
                return False
    return True


@kernel
def _unchanged(p, last, known):
    """Fill `known` with which values of the program p are those of the program in `last`."""
    count = _count(p, SLOTS)
    for i in range(1, count):
        known[i] = True
        for k in range(OPERATIONS + WIDTH * i, OPERATIONS + WIDTH * (i + 1)):
            known[i] &= p[k] == last[k]
    found = True
    while found:  # sin and cos need each other
        found = False
        for i in range(1, count):
            code, a, b, _number = _operation(p, i)
            of_one = code == CONSTANT or code == OVER or known[a]
            of_two = code == CONSTANT or code == PLUS or code == FROM or code == TIMES or known[b]
            if known[i] and not (of_one and of_two):
                known[i], found = False, True


@kernel
def sampled(rows, out):
    """Fill out (rows, 2, n) with f and g of programs, all of one length, at n evenly spread angles of the
    circle, from 0 on; rows whose bounds are not finite are left as they are. What does not depend on
    parameters is found once for all rows.
    """
    if len(rows) == 0:
        return
    n, count, signed = out.shape[2], _count(rows[0], FORCES), math.nan
    S, known = np.empty((count, n)), np.zeros(_count(rows[0], SLOTS), np.bool_)
    last = np.full(rows.shape[1], math.nan)
    for r in range(len(rows)):
        p = rows[r]
        if not math.isfinite(p[BOUND_F]):
            continue
        known[0] = p[MIRRORED] == signed
        _unchanged(p, last, known)
        signed = p[MIRRORED]
        for k in range(len(p)):
            last[k] = p[k]
        for j in range(n if not known[0] else 0):
            S[0, j] = signed * (j * (2.0 * math.pi / n))
        for i in range(1, count):
            if not known[i]:
                _sample(p, i, S)
        f, g = S[int(p[F_AT])], S[int(p[G_AT])]
        for j in range(n):
            out[r, 0, j], out[r, 1, j] = p[REVERSED] * f[j], signed * g[j]


@splice
def _sample(p, i, S):
    """Fill S[i] with the i-th value at all angles, as `extend` finds it at one."""
    code, a, b, number = _operation(p, i)
    for j in range(S.shape[1]):
        one, two = S[a, j], S[b, j]
        if code == ADD:
            value = one + two
        elif code == SUBTRACT:
            value = one - two
        elif code == MULTIPLY:
            value = one * two
        elif code == DIVIDE:
            value = one / two
        elif code == PLUS:
            value = one + number
        elif code == TIMES:
            value = number * one
        elif code == FROM:
            value = number - one
        elif code == OVER:
            value = number / two
        elif code == CONSTANT:
            value = number
        else:
            value = function(code, one, number)
        S[i, j] = value


@kernel
def complete(rows, angles):
    """Fill in AT_REST and, on a circle, the bounds of programs, all of one length; NaN where a number
    is not finite, or f and g have no bounds or, by these angles, not the period 2 pi.

    Bounds are within a factor of 2, of 4 COARSEST pieces of the circle or more: infinite where pieces
    as narrow as one of FINEST do not bound f and g. What does not depend on parameters is found once
    for all rows.
    """
    if len(rows) == 0:
        return
    circle, count = rows[0, ON_CIRCLE] > 0.0, _count(rows[0], SLOTS)
    # batches: 0; the angles; the pieces of the circle, COARSEST and 4 COARSEST of them
    batches, many, pieces = 5 if circle else 1, len(angles), 5 * COARSEST
    at, radii, none = np.zeros(5 * LANES), np.zeros(5 * LANES), np.zeros(LANES)
    lanes = np.array([1, 2 * many, LANES, LANES, pieces - 2 * LANES])
    points, over = np.zeros((5, count * 2 * LANES)), np.zeros((5, count * 6 * LANES))
    numbers, out = np.zeros((2 * count, LANES)), np.empty(BOUNDS)
    known, last = np.zeros(count, np.bool_), np.full(rows.shape[1], math.nan)
    for k in range(many):
        at[LANES + k], at[LANES + many + k] = angles[k], angles[k] + 2.0 * math.pi
    first, end = 2 * LANES + COARSEST, 2 * LANES + pieces
    radii[2 * LANES : first] = _middles(COARSEST, at[2 * LANES : first])
    radii[first:end] = _middles(4 * COARSEST, at[first:end])
    for p in rows:
        good = True
        for k in range(OPERATIONS, len(p)):
            good &= math.isfinite(p[k])
        if good:
            known[0] = True
            _unchanged(p, last, known)
            for k in range(len(p)):
                last[k] = p[k]
            note(p, numbers, 0, LANES)
            for k in range(batches):
                phi = at[k * LANES : k * LANES + lanes[k]]
                balls(p, numbers.ravel(), known, phi, none, points[k])
                if k > 1:
                    balls(p, numbers.ravel(), known, phi, radii[k * LANES :], over[k])
            g = 2 * LANES * int(p[G_AT])
            p[AT_REST] = 1.0 if points[0, g] == 0.0 and points[0, g + LANES] == 0.0 else 0.0
        if good and circle:
            near = False
            for first, end in ((0, COARSEST), (COARSEST, pieces)):
                out[:] = 0.0
                for q in range(first, end):
                    k = 2 + q // LANES
                    raised(p, points[k], over[k], q % LANES, out)
                near = _agree(p, out, first == 0)
            if not near:
                bounds = np.zeros((pieces - COARSEST, BOUNDS))
                for q in range(COARSEST, pieces):
                    k = 2 + q // LANES
                    raised(p, points[k], over[k], q % LANES, bounds[q - COARSEST])
                first = 2 * LANES + COARSEST
                place = slice(first, first + len(bounds))
                _bound_finely(p, numbers.ravel(), at[place], radii[place], bounds)
            for k in range(BOUNDS):
                good &= math.isfinite(p[BOUND_F + k])
            good = good and _periodic(p, points[1], 0, many)
        if not good:
            p[:] = math.nan


@kernel
def limit_to_shown(rows):
    """Limit RADIUS of programs on the circle, all of one length, to the half-width of pieces that show all
    that f and g have in them, where their bounds are finite: pieces of LONGEST, or shorter ones where
    these leave out more than HIDDEN, and than WEAK of the largest.
    """
    if len(rows) == 0:
        return
    count, orders, pieces = _count(rows[0], SLOTS), DERIVATIVES + 1, 4 * LANES
    over, known = np.zeros((4, count * orders * 2 * LANES)), np.zeros(count, np.bool_)
    finer, numbers = np.zeros(count * orders * 2 * LANES), np.zeros((2 * count, LANES))
    at, sizes, last = np.empty(pieces), np.empty((4, pieces)), np.full(rows.shape[1], math.nan)
    longest = _middles(pieces, at)
    wide = np.full(LANES, longest)
    for r in range(len(rows)):
        p = rows[r]
        if not math.isfinite(p[BOUND_F]):
            continue
        known[0] = True
        _unchanged(p, last, known)
        for k in range(len(p)):
            last[k] = p[k]
        note(p, numbers, 0, LANES)
        f, g, N = int(p[F_AT]), int(p[G_AT]), numbers.ravel()
        for k in range(4):
            balls(p, N, known, at[k * LANES : (k + 1) * LANES], wide, over[k])
            for q in range(LANES):
                i = k * LANES + q
                sizes[0, i], sizes[1, i] = _shown(over[k], f, q, longest)
                sizes[2, i], sizes[3, i] = _shown(over[k], g, q, longest)
        weak_f, weak_g = WEAK * sizes[0].max(), WEAK * sizes[2].max()
        phi, left = at.copy(), 0
        for i in range(pieces):
            if not _all_shown(sizes[0, i], sizes[1, i], sizes[2, i], sizes[3, i], weak_f, weak_g):
                phi[left], left = at[i], left + 1
        radius, none = longest, np.zeros(count, np.bool_)
        while left > 0 and radius > FINE and left < FINEST:
            radius *= 0.5
            inner, narrow = np.empty(2 * left), np.full(LANES, 1.0001 * radius)
            for i in range(left):
                inner[2 * i], inner[2 * i + 1] = phi[i] - radius, phi[i] + radius
            phi, size, left = np.empty(len(inner)), len(inner), 0
            for first in range(0, size, LANES):
                some = inner[first : first + LANES]
                balls(p, N, none, some, narrow, finer)
                for q in range(len(some)):
                    own_f, more_f = _shown(finer, f, q, radius)
                    own_g, more_g = _shown(finer, g, q, radius)
                    if not _all_shown(own_f, more_f, own_g, more_g, weak_f, weak_g):
                        phi[left], left = some[q], left + 1
        if radius < longest:
            p[RADIUS] = min(p[RADIUS], radius)


@inline
def _all_shown(f, more_f, g, more_g, weak_f, weak_g):
    """Do series of these sizes leave out little enough of f and of g?"""
    return more_f <= HIDDEN * f + weak_f and more_g <= HIDDEN * g + weak_g


@inline
def wider(left_out):
    """By what factor the radius may change where so much is left out: see `hidden`."""
    return min(max((0.1 / (left_out + 1e-300)) ** (1.0 / DERIVATIVES), 0.25), 2.0)


@kernel
def bound_near(p, phi, w):
    """Write bounds near phi into p, and how near: p[RADIUS], twice the last one, or less where they
    do not show f w + g.
    """
    count, out = _count(p, SLOTS), np.empty(KNOWN)
    numbers, known = np.empty((2 * count, LANES)), np.zeros(count, np.bool_)
    points = np.empty(count * 2 * LANES)
    over = np.empty(len(points) * (DERIVATIVES + 1))
    note(p, numbers, 0, 1)
    N, radius = numbers.ravel(), min(4.0 * p[RADIUS], 2.0 * (1.0 + abs(phi)))
    balls_of_one(p, N, known, phi, 0.0, points)
    left_out = math.inf
    while left_out > 1.0:
        radius *= 0.5
        balls_of_one(p, N, known, phi, radius, over)
        left_out = bounded(p, points, over, 0, radius, w, out)
    p[RADIUS] = radius
    for k in range(BOUNDS):
        p[BOUND_F + k] = out[k]


@inline
def leaving_at_most(factor, most_f, most_g, radius, w):
    root = math.sqrt(radius * most_g) + 1e-300
    most = factor * w + root
    return max(most / radius, (most_f * most + most_g) / ((factor - 1.0) * w + root))


@inline
def leaving(most_f, most_g, radius, w):
    """A rate: for the time 1 / rate, phi stays within the radius where |f| and |g| are below these
    bounds, since |w| stays below a multiple of its first value and of sqrt(radius g).
    """
    return min(
        leaving_at_most(1.25, most_f, most_g, radius, w),
        leaving_at_most(2.0, most_f, most_g, radius, w),
    )


@kernel
def longest_step(p, w):
    """A step on which phi stays within p[RADIUS], where the bounds hold."""
    return 1.0 / leaving(p[BOUND_F], p[BOUND_G], p[RADIUS], abs(w))
