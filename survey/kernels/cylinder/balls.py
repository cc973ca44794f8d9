"""A user's flow as a program (`program`), run on balls.

A ball is a middle and a radius that covers the range and every rounding: of radius 0 at phi, it
bounds the roundings of f and g alone; over an interval, it bounds f and g and their derivatives
there.

Source: F. Johansson, Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE
Trans. Computers 66 (2017) 1281-1292.
"""

import math

import numpy as np

from survey.kernels.cylinder.program import (
    ADD,
    CONSTANT,
    COS,
    DIVIDE,
    FORCES,
    FROM,
    MIRRORED,
    MULTIPLY,
    OVER,
    PLUS,
    SECH_SQUARED,
    SIN,
    SLOTS,
    SUBTRACT,
    TAN,
    TIMES,
    function,
    note,
    number_of,
    operation,
)
from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP
from survey.kernels.unroll import unroll

UNDERFLOW = 1e-322  # more than what a function rounds near 0
LANES = 32  # balls at once
VECTOR = 8  # lanes of vector code


@part
def _function_ball(code, x, r, number):
    """The ball of the function over (x, r): all but sin, cos, cosh and 1/cosh^2 are monotone, and cosh dips
    less than it rises.
    """
    value = function(code, x, number)
    size = abs(value)
    if r == 0.0:
        spread = 0.0
    elif code == SIN or code == COS:
        steep = math.cos(x) if code == SIN else math.sin(x)
        spread = min(r, abs(steep) * r + 0.5 * r * r, 1.0 + abs(value))
    else:
        wide = r + ROUNDOFF_UP * (abs(x) + r)  # as the ends are rounded
        low, high = function(code, x - wide, number), function(code, x + wide, number)
        below, above = abs(low - value), abs(high - value)
        spread = below if below > above else above
        size = max(size, max(abs(low), abs(high)))
        if code == SECH_SQUARED and wide > abs(x):
            spread, size = max(spread, 1.0 - value), 1.0
        spread = spread if math.isfinite(below + above) else math.inf  # max drops a NaN
        if code == TAN and math.floor((x - wide) / math.pi + 0.5) != math.floor(
            (x + wide) / math.pi + 0.5
        ):
            spread = math.inf
    # what libm rounds, and more: 1/cosh^2 takes five more operations
    rounding = (4.0 if code == SECH_SQUARED else 2.0) * EPS * size + UNDERFLOW
    rounding = 0.0 if x == 0.0 and value == 0.0 else rounding
    return (value, spread + rounding) if math.isfinite(value + spread) else (0.0, math.inf)


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
    for i in range(1, number_of(p, FORCES)):
        if known[i]:
            continue
        code, a, b, _number = operation(p, i)
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
        elif code == SECH_SQUARED and n > 0:
            for q in range(width):
                _ball_shift(B, -1.0, two + step * n, numbers, x, 0.0, o, q)
        elif code == MULTIPLY or n > 0:
            for q in range(width):
                _ball_set(B, numbers, x, 0.0, o, q)
        else:
            for q in range(lanes):
                B[o + q], B[o + LANES + q] = _function_ball(
                    code, B[one + q], B[one + LANES + q], numbers[x + q]
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
        elif code > OVER and code != SECH_SQUARED and n > 0:
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
def largest(B, at):
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
    value that f and g need, over the angles within `radius` (lanes) of phi (lanes); those `known`
    stand there already.
    """
    lanes, orders = len(phi), len(B) // (2 * LANES * number_of(p, SLOTS))
    # a short loop of known length would be unrolled, not vector code
    width = (lanes + VECTOR - 1) // VECTOR * VECTOR
    for q in range(lanes):
        _angles(p, phi[q], radius[q], orders, B, q)
    for n in range(orders):
        _extend_balls(p, numbers, known, lanes, width, orders, B, n)


@kernel
def balls_of_one(p, numbers, known, phi, radius, B):
    """As `balls`, of the first lane: less code by far, and three times as fast."""
    orders = len(B) // (2 * LANES * number_of(p, SLOTS))
    _angles(p, phi, radius, orders, B, 0)
    for n in range(orders):
        _extend_balls(p, numbers, known, 1, 1, orders, B, n)


@kernel
def ball(p, phi, radius, orders, B):
    """As `balls`, of one lane: B (SLOTS, orders, 2), of which the first FORCES are filled."""
    count = number_of(p, SLOTS)
    numbers, flat = np.empty((2 * count, LANES)), np.empty(count * orders * 2 * LANES)
    note(p, numbers, 0, 1)
    balls_of_one(p, numbers.ravel(), np.zeros(count, np.bool_), phi, radius, flat)
    for i in range(number_of(p, FORCES)):
        for n in range(orders):
            at = 2 * LANES * (orders * i + n)
            B[i, n, 0], B[i, n, 1] = flat[at], flat[at + LANES]
