"""Motions of a gyrostat in its own axes, (w, nu) at given times with error bars: the steps of any
method.

The equations, their series and how errors are carried along are those of
`kernels.cylinder.gyrostat`, in whose tables T and V a step lies; a method brings `begin` (expand at
a state; the step) and `at` (the state within the step).
"""

import math

import numpy as np

from survey.kernels.cylinder.flow import LOW
from survey.kernels.cylinder.gyrostat import (
    FIRST_ORDER,
    INVERSE,
    LAMBDA,
    LAST,
    A,
    B,
    C,
    S,
    carry,
    series,
    variation,
)
from survey.kernels.cylinder.steps import (
    NO_CONVERGENCE,
    OK,
    OVERFLOW,
    STEP_LIMIT,
    TRUST,
    bar,
    finite,
)
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

STATE, FLOATS = 6, 12  # w and nu; and then their bars
# of components, in each of which a step and the initial state err; `bar` counts two for each step
_PAIRS = 3
_FIRST = 4.0 * ROUNDOFF_UP  # rounding of nu, of length 1
# the first line of T that a Runge-Kutta method, whose series are short, may use for its stages
STAGE = LOW + 1
# columns of T[LAST]: truncation error of the step, relative to `size_of`; what a method notes
ERROR, STEP = 0, 5


@kernel
def expanded(G, state, T, V):
    """Fill T and V as far as error bars need them; returns the step that keeps the variational
    equation accurate.
    """
    series(G, state, T, LOW)
    variation(G, T, V)
    size, tangent = 1.0, 1e-300
    for i in range(3):
        size = max(size, abs(state[i]))
    for i in range(STATE):
        for c in range(STATE):
            tangent = max(
                tangent,
                abs(V[LOW, c, i]) * (1.0 / size if i < 3 else 1.0) * (size if c < 3 else 1.0),
            )
    return (FIRST_ORDER / tangent) ** (1.0 / LOW)


@inline
def _product(G, row, a, b, c):
    """A row of G times (a, b, c)."""
    return G[row, 0] * a + G[row, 1] * b + G[row, 2] * c


@inline
def _added(number, G, row, a, b, c):
    """The number and that product, added from the left."""
    return number + G[row, 0] * a + G[row, 1] * b + G[row, 2] * c


@inline
def slope(G, t, y):
    """(w', nu') at y = (w, nu), tuples of six."""
    p, q, r, x, u, v = y
    k0 = _added(G[LAMBDA, 0], G, A, p, q, r)
    k1 = _added(G[LAMBDA, 1], G, A + 1, p, q, r)
    k2 = _added(G[LAMBDA, 2], G, A + 2, p, q, r)
    f0 = _added(G[S, 0], G, B, p, q, r) - _product(G, C, x, u, v)
    f1 = _added(G[S, 1], G, B + 1, p, q, r) - _product(G, C + 1, x, u, v)
    f2 = _added(G[S, 2], G, B + 2, p, q, r) - _product(G, C + 2, x, u, v)
    a = k1 * r - k2 * q + f1 * v - f2 * u
    b = k2 * p - k0 * r + f2 * x - f0 * v
    c = k0 * q - k1 * p + f0 * u - f1 * x
    return (
        _product(G, INVERSE, a, b, c),
        _product(G, INVERSE + 1, a, b, c),
        _product(G, INVERSE + 2, a, b, c),
        u * r - v * q,
        v * p - x * r,
        x * q - u * p,
    )


@inline
def state_of(row):
    """The first six numbers of a row as a tuple."""
    return row[0], row[1], row[2], row[3], row[4], row[5]


@inline
def store(row, y):
    """Write a tuple of six into the first columns of a row."""
    row[0], row[1], row[2], row[3], row[4], row[5] = y


@inline
def size_of(state):
    """What errors of w are relative to."""
    return 1.0 + max(abs(state[0]), max(abs(state[1]), abs(state[2])))


@inline
def _written(state, squares, n, row):
    """state and its bars into `row`; are they small enough to be carried on to first order?"""
    good, size = True, size_of(state)
    for i in range(STATE):
        width = bar(_PAIRS * (n + 1), squares[i, i]) + ROUNDOFF_UP * abs(state[i])
        row[i], row[STATE + i] = state[i], width
        good = good and width < TRUST * (size if i < 3 else 1.0)
    return good


@inline
def trajectories(begin, at, G, starts, times, tolerance, limit, floats, status):
    """Fill floats (rows, n, FLOATS) and status (rows) at ascending times (rows, n) >= 0 of systems
    G (rows, ROWS, 3).
    """
    for i in range(len(G)):
        size = finite(times[i])
        status[i] = _trajectory(
            begin, at, G[i], starts[i], times[i, :size], tolerance, limit, floats[i]
        )


@inline
def _trajectory(begin, at, G, start, times, tolerance, limit, floats):
    T = np.zeros((LAST + 1, 12))
    V = np.zeros((LOW + 1, 6, 12))
    squares = np.zeros((6, 6))
    there = np.empty((6, 6))
    state = start.copy()
    new = np.empty(6)
    J = np.empty((6, 6))
    work = np.empty((6, 6))
    row = np.empty(FLOATS)
    for i in range(3):
        squares[3 + i, 3 + i] = _FIRST * _FIRST
    t, t_low, j, size = 0.0, 0.0, 0, len(times)
    for n in range(1, limit + 1):
        if j == size:
            return OK
        h = begin(G, state, tolerance, T, V)
        if not (h > 0.0 and math.isfinite(h)):
            return OVERFLOW
        while j < size and (times[j] - t) - t_low < h:
            dt = (times[j] - t) - t_low
            at(G, T, dt, new)
            for i in range(6):  # an assignment of arrays takes seconds to compile
                for k in range(6):
                    there[i, k] = squares[i, k]
            carry(G, T, V, dt, there, J, work)
            if not _written(new, there, n, row):
                return NO_CONVERGENCE
            for i in range(FLOATS):
                floats[j, i] = row[i]
            j += 1
        at(G, T, h, new)
        carry(G, T, V, h, squares, J, work)
        for i in range(6):
            state[i] = new[i]
        if not _written(state, squares, n, row):
            return NO_CONVERGENCE if math.isfinite(state[0] + state[1] + state[2]) else OVERFLOW
        high = t + h
        t_low += h - (high - t)
        t = high
    return STEP_LIMIT
