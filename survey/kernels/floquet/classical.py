"""The propagators of linear systems x' = A(t) x over many steps by the classical Runge-Kutta
method, of order 4.

Each step is two half steps, checked by one full step; their difference / (2^4 - 1), twice, bounds
the local error.
"""

import math

import numpy as np

from survey.kernels.floquet.program import BASIS, COLUMN, NUMBER, ROW, extend
from survey.kernels.floquet.steps import add_times, copy, multiply, set_identity
from survey.kernels.jit import kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

NODES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
RICHARDSON = 2.0 / 15.0
SUMS = 24.0  # roundings of an entry of a step, beside those of its products


@kernel
def factors(
    operations,
    signs,
    inside,
    order,
    used,
    terms,
    numbers,
    scale,
    noise,
    n,
    point,
    middle,
    half,
    F,
    error,
    doubt,
):
    """As `steps.factors`; the nodes of one step take the places of the lanes there."""
    S, V = np.zeros((len(operations), 1, NODES.size)), np.empty((numbers.shape[1], NODES.size))
    t, zero, A = np.empty(NODES.size), np.zeros(NODES.size), np.empty((NODES.size, n, n))
    work = np.empty((3, n, n))
    first = np.empty((n, n))
    second = np.empty((n, n))
    one_step = np.empty((n, n))
    for task in range(len(point)):
        i, h = point[task], 2.0 * half[task]
        for node in range(NODES.size):
            t[node] = middle[task] + half[task] * (2.0 * NODES[node] - 1.0)
            for k in range(numbers.shape[1]):
                V[k, node] = numbers[i, k]
        extend(operations, signs, inside, order, V, t, zero, S, 0)
        A[:] = 0.0
        for q in range(len(terms)):
            row, column = terms[q, ROW], terms[q, COLUMN]
            weight = numbers[i, terms[q, NUMBER]] * (scale[i, column] / scale[i, row])
            for node in range(NODES.size):
                A[node, row, column] += weight * S[terms[q, BASIS], 0, node]
        _step(A[0], A[1], A[2], 0.5 * h, work, first)
        _step(A[2], A[3], A[4], 0.5 * h, work, second)
        _step(A[0], A[2], A[4], h, work, one_step)
        multiply(second, first, 0.0, F[task])
        largest = off = norm = 0.0
        for j in range(n):
            for c in range(n):
                largest = max(largest, abs(F[task, j, c]))
                off = max(off, abs(F[task, j, c] - one_step[j, c]))
                for node in range(NODES.size):
                    norm = max(norm, abs(A[node, j, c]))
        rounding = ROUNDOFF_UP * (SUMS + 2.0 * n + SUMS * n * h * norm) * largest
        total = RICHARDSON * off + rounding + h * noise[i] * n * largest
        error[task] = n * total if math.isfinite(total) else math.inf
        doubt[task] = error[task] * (1.0 + n * largest)


@kernel
def _step(start, middle, end, h, work, out):
    """Fill out (n, n) with one step of X' = A X from the identity, A at its start, middle and end."""
    slope, state, weighted = work[0], work[1], work[2]
    copy(start, slope)
    copy(start, weighted)
    for stage in range(3):
        set_identity(state)
        add_times(h if stage == 2 else 0.5 * h, slope, state)
        multiply(end if stage == 2 else middle, state, 0.0, slope)
        add_times(1.0 if stage == 2 else 2.0, slope, weighted)
    set_identity(out)
    add_times(h / 6.0, weighted, out)
