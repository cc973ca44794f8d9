"""A user's flow, phi' = w, w' = f(phi) w + g(phi): f, g and g' as a program, and its power series.

A program is a list of operations, each of which makes one value from earlier ones; the first value
is phi itself. It stands in the row p of a flow after the columns of `flow`: SLOTS to RADIUS, then
WIDTH numbers an operation: its code, the indices of its two operands, and a number. Where a number
is an operand, the rest that binary64 does not hold stands in the column that is not used. The
series of a function h(y) follows from h' y': its second operand is h' (of 1/cosh^2, tanh^2). p[REVERSED] is the sign of
f, p[MIRRORED] that of phi and of g: -1 under the symmetries S1 and S2 of `solution`.

Source: A. Griewank, A. Walther, Evaluating Derivatives (2008), chapter 13.
"""

import math

import numpy as np

from survey.kernels.jit import inline, kernel, part, splice
from survey.kernels.math import functions

# Columns of the six parameters: signs and marks, and the mean of f on the circle, 0 where it
# vanishes within rounding.
REVERSED, ON_CIRCLE, MIRRORED, AT_REST, MEAN = 0, 2, 3, 4, 5
BOUND_F, BOUND_G, BOUND_DG, BOUND_DDG = range(6, 10)  # as in `flow`
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
    SECH_SQUARED,  # 1 - tanh^2, accurate also where tanh rounds to 1
) = range(9, 27)
UNLIMITED = 1e300  # RADIUS on a circle where f and g cannot have spikes


@kernel
def function(code, x, number):
    """The function of this code at x; NaN outside its domain."""
    if code == SECH_SQUARED:
        return functions.sech_squared(x)
    if code != POWER:
        return functions.function(code - SIN, x)
    return x**number if x > 0.0 else math.nan


@inline
def number_of(p, column):
    """The number of operations: at least one, even in a row of zeros, which stands for no program."""
    return max(1, int(p[column]))


@inline
def operation(p, i):
    at = OPERATIONS + WIDTH * i
    return int(p[at + CODE]), int(p[at + FIRST]), int(p[at + SECOND]), p[at + NUMBER]


@kernel
def extend(p, S, n, count):
    """Fill S[i, n], order n of the first `count` values, from the lower orders and order n of phi,
    S[0, n].
    """
    for i in range(1, count):
        code, a, b, number = operation(p, i)
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
        elif code == SECH_SQUARED:
            value = -S[b, n]
        else:
            for k in range(1, n + 1):
                value += k * S[a, k] * S[b, n - k]
            value /= n
        S[i, n] = value


@kernel
def values(p, phi):
    """f, g, g' at phi."""
    count = number_of(p, SLOTS)
    S = np.empty((count, 1))
    S[0, 0] = p[MIRRORED] * phi
    extend(p, S, 0, count)
    f, g = S[int(p[F_AT]), 0], S[int(p[G_AT]), 0]
    return p[REVERSED] * f, p[MIRRORED] * g, S[int(p[DG_AT]), 0]


@kernel
def in_angle(p, phi, f, g):
    """Fill f and g with their Taylor coefficients about phi."""
    count, size = number_of(p, FORCES), len(f)
    S = np.zeros((count, size))
    S[0, 0], S[0, 1] = p[MIRRORED] * phi, p[MIRRORED]
    for n in range(size):
        extend(p, S, n, count)
        f[n], g[n] = p[REVERSED] * S[int(p[F_AT]), n], p[MIRRORED] * S[int(p[G_AT]), n]


@part
def in_time(p, phi, w, order, x, v, e, y):
    """Fill phi, w, and the integrals e of f and y of g, with the series through (phi, w) up to t^order."""
    count, at_f, at_g = number_of(p, FORCES), int(p[F_AT]), int(p[G_AT])
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


@part
def along(p, x, f, dg):
    """Fill f and g' with their series in time along the angle x (all of one length)."""
    count = number_of(p, SLOTS)
    S = np.empty((count, len(x)))
    for n in range(len(x)):
        S[0, n] = p[MIRRORED] * x[n]
        extend(p, S, n, count)
        f[n], dg[n] = p[REVERSED] * S[int(p[F_AT]), n], S[int(p[DG_AT]), n]


@part
def note(p, numbers, first, end):
    """Note the numbers of the program in the lanes from `first` to `end` - 1 of `numbers` (2 SLOTS,
    LANES), each before the rest that is not in binary64.
    """
    for i in range(number_of(p, SLOTS)):
        at = OPERATIONS + WIDTH * i
        code, rest = int(p[at + CODE]), 0.0
        if code == CONSTANT or code == OVER:
            rest = p[at + FIRST]
        elif code == PLUS or code == FROM or code == TIMES:
            rest = p[at + SECOND]
        for q in range(first, end):
            numbers[2 * i, q], numbers[2 * i + 1, q] = p[at + NUMBER], rest


@part
def unchanged(p, last, known):
    """Fill `known` with which values of the program p are those of the program in `last`, which then
    becomes p.
    """
    count = number_of(p, SLOTS)
    for i in range(1, count):
        known[i] = True
        for k in range(OPERATIONS + WIDTH * i, OPERATIONS + WIDTH * (i + 1)):
            known[i] &= p[k] == last[k]
    found = True
    while found:  # sin and cos need each other
        found = False
        for i in range(1, count):
            code, a, b, _number = operation(p, i)
            of_one = code == CONSTANT or code == OVER or known[a]
            of_two = code == CONSTANT or code == PLUS or code == FROM or code == TIMES or known[b]
            if known[i] and not (of_one and of_two):
                known[i], found = False, True
    for k in range(len(p)):
        last[k] = p[k]


@kernel
def sampled(rows, out):
    """Fill out (rows, 2, n) with f and g of programs, all of one length, at n evenly spread angles of the
    circle, from 0 on; rows whose bounds are not finite are left as they are. What does not depend on
    parameters is found once for all rows.
    """
    if len(rows) == 0:
        return
    n, count, signed = out.shape[2], number_of(rows[0], FORCES), math.nan
    S, known = np.empty((count, n)), np.zeros(number_of(rows[0], SLOTS), np.bool_)
    last = np.full(rows.shape[1], math.nan)
    for r in range(len(rows)):
        p = rows[r]
        if not math.isfinite(p[BOUND_F]):
            continue
        known[0] = p[MIRRORED] == signed
        unchanged(p, last, known)
        signed = p[MIRRORED]
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
    code, a, b, number = operation(p, i)
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
