"""The propagators of linear systems x' = A(t) x over many steps by DOP853: an independent check of
`steps`.

The local error is that of the embedded pair, entry by entry, and the rounding of the sums.
"""

import math

import numpy as np

from survey.kernels.floquet.program import (
    ADDED,
    BASIS,
    COLUMN,
    FACTOR,
    FIRST,
    LAST,
    NUMBER,
    ROW,
    extend,
)
from survey.kernels.floquet.steps import lanes_of
from survey.kernels.jit import kernel
from survey.kernels.math.dop853 import E3, E5, STAGES, A, B, C, combined
from survey.kernels.math.roundoff import ROUNDOFF_UP

SAFETY = 1.0  # of the estimate, which is of lower order
WEIGHT = float(np.abs(B).sum())


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
    """As `steps.factors`."""
    lanes, size = lanes_of(n), n * n
    S, V = np.zeros((len(operations), 1, lanes)), np.empty((numbers.shape[1], lanes))
    W, K = np.empty((len(terms), lanes)), np.empty((STAGES + 1, size, lanes))
    Y, t, norm = np.empty((size, lanes)), np.empty(lanes), np.empty(lanes)
    zero, e5, e3 = np.zeros(lanes), np.empty((size, lanes)), np.empty((size, lanes))
    for start in range(0, len(point), lanes):
        for lane in range(lanes):
            task = min(start + lane, len(point) - 1)
            i = point[task]
            for k in range(numbers.shape[1]):
                V[k, lane] = numbers[i, k]
            for k in range(len(terms)):
                W[k, lane] = numbers[i, terms[k, NUMBER]] * (
                    scale[i, terms[k, COLUMN]] / scale[i, terms[k, ROW]]
                )
        norm[:] = 0.0
        for stage in range(STAGES + 1):
            for lane in range(lanes):
                task = min(start + lane, len(point) - 1)
                where = 1.0 if stage == STAGES else C[stage]
                t[lane] = middle[task] + half[task] * (2.0 * where - 1.0)
            extend(operations, signs, inside, order, V, t, zero, S, 0)
            for q in range(size):
                own = Y[q]
                own[:] = 0.0
                for k in range(stage):
                    weight = B[k] if stage == STAGES else A[stage, k]
                    if weight != 0.0:
                        slope = K[k, q]
                        for lane in range(lanes):
                            own[lane] += weight * slope[lane]
                one = 1.0 if q % (n + 1) == 0 else 0.0
                for lane in range(lanes):
                    own[lane] = one + 2.0 * half[min(start + lane, len(point) - 1)] * own[lane]
            new = K[stage]
            new[:] = 0.0
            for q in range(len(terms)):
                row = terms[q, ROW] * n
                column = terms[q, COLUMN] * n
                weight = W[q]
                basis = S[terms[q, BASIS], 0]
                for c in range(n):
                    one, two = new[row + c], Y[column + c]
                    for lane in range(lanes):
                        one[lane] += weight[lane] * basis[lane] * two[lane]
            for q in range(size):
                own = new[q]
                for lane in range(lanes):
                    norm[lane] = max(norm[lane], abs(own[lane]))
        e5[:], e3[:] = 0.0, 0.0
        for k in range(STAGES + 1):
            for q in range(size):
                slope, fifth, third = K[k, q], e5[q], e3[q]
                for lane in range(lanes):
                    fifth[lane] += E5[k] * slope[lane]
                    third[lane] += E3[k] * slope[lane]
        for lane in range(min(lanes, len(point) - start)):
            task = start + lane
            h, largest, off = 2.0 * half[task], 0.0, 0.0
            for q in range(size):
                F[task, q // n, q % n] = Y[q, lane]
                largest = max(largest, abs(Y[q, lane]))
                off = max(off, h * combined(abs(e5[q, lane]), abs(e3[q, lane])))
            rounding = ROUNDOFF_UP * ((n + 24.0) * WEIGHT * h * norm[lane] + largest)
            total = SAFETY * off + rounding + h * noise[point[task]] * n * largest
            error[task] = n * total if math.isfinite(total) else math.inf
            doubt[task] = error[task] * (1.0 + n * largest)


@kernel
def motion(operations, signs, inside, order, terms, numbers, states_at, x0, span, steps, X, M):
    """Fill X (N, n), the states of x' = f(t, x) at t = span (N) from x0 at 0, and M = dX/dx0 (N, n,
    n).

    In steps[i] equal steps; numbers (N, count), states_at (n): where the states stand among them, as in
    `flow.flow`.
    """
    n = x0.shape[1]
    S = np.zeros((len(operations), 1, 1))
    V = np.empty((numbers.shape[1], 1))
    t = np.empty(1)
    zero = np.zeros(1)
    y, K, new = np.empty((n, n + 1)), np.empty((STAGES, n, n + 1)), np.empty((n, n + 1))
    for i in range(len(x0)):
        for k in range(numbers.shape[1]):
            V[k, 0] = numbers[i, k]
        y[:] = 0.0
        for c in range(n):  # the state, then the columns of M
            y[c, 0], y[c, c + 1] = x0[i, c], 1.0
        h = span[i] / steps[i]
        for step in range(steps[i]):
            for stage in range(STAGES + 1):
                for r in range(n):
                    for c in range(n + 1):
                        total = 0.0
                        for k in range(stage):
                            total += (B[k] if stage == STAGES else A[stage, k]) * K[k, r, c]
                        new[r, c] = y[r, c] + h * total
                if stage == STAGES:
                    break
                t[0] = (step + C[stage]) * h
                for c in range(n):
                    V[states_at[c], 0] = new[c, 0]
                extend(operations, signs, inside, order, V, t, zero, S, 0)
                own = K[stage]
                own[:] = 0.0
                for c in range(n):
                    for k in range(operations[order[c], FIRST], operations[order[c], LAST]):
                        own[c, 0] += S[inside[k, ADDED], 0, 0] * V[inside[k, FACTOR], 0]
                for q in range(len(terms)):
                    value = S[terms[q, BASIS], 0, 0] * V[terms[q, NUMBER], 0]
                    for c in range(n):
                        own[terms[q, ROW], c + 1] += value * new[terms[q, COLUMN], c + 1]
            for r in range(n):
                for c in range(n + 1):
                    y[r, c] = new[r, c]
        for r in range(n):
            X[i, r] = y[r, 0]
            for c in range(n):
                M[i, r, c] = y[r, c + 1]
