"""Gershgorin's discs of a matrix that is nearly diagonal in given coordinates, and powers of a
matrix, with bounds.

See `measures.floquet.multipliers`. The loops fix the order of every sum: the same bits in any
block.
"""

import math

import numpy as np

from survey.kernels.floquet.steps import copy
from survey.kernels.jit import kernel
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP

ROUNDINGS = 4.0  # of a product of complex numbers


@kernel
def couplings(M, E, extra, centre, V, W, coupling):
    """Fill coupling (N, n, n), bounds of |V^-1 M* V - diag(centre)| for every M* with |M* - M| <= E; W is V^-1 nearly.

    `extra` (N, n, n) bounds what |W (M* - M) V| has besides. M, E are real, centre (N, n), V, W (N, n, n) complex. With
    R = W V - 1, V^-1 = (1 + R)^-1 W, and the entries of
    |(1 + R)^-1 - 1| are below |R| + rho / (1 - rho) max of their column, rho the largest sum of a row of |R|.
    """
    N, n = centre.shape
    G, MV = np.empty((n, n), np.complex128), np.empty((n, n), np.complex128)
    R, wide, size, rest = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    most, tall, flat = np.empty(n), np.empty((n, n)), np.empty((n, n))  # tall, flat: |V| and |W|
    u = ROUNDINGS * (n + 2) * ROUNDOFF_UP
    for p in range(N):
        for i in range(n):
            for j in range(n):
                tall[i, j], flat[i, j] = abs(V[p, i, j]), abs(W[p, i, j])
        for i in range(n):
            for j in range(n):
                total, bound = 0.0 + 0.0j, 0.0
                for k in range(n):
                    total += M[p, i, k] * V[p, k, j]
                    bound += (E[p, i, k] + 2.0 * u * abs(M[p, i, k])) * tall[k, j]
                MV[i, j], rest[i, j] = total, bound
        rho = 0.0
        most[:] = 0.0
        for i in range(n):
            row = 0.0
            for j in range(n):
                total, other, moduli, bound = 0.0 + 0.0j, 0.0 + 0.0j, 0.0, 0.0
                for k in range(n):
                    total += W[p, i, k] * MV[k, j]
                    other += W[p, i, k] * V[p, k, j]
                    moduli += flat[i, k] * tall[k, j]
                    bound += flat[i, k] * rest[k, j]
                if i == j:
                    other -= 1.0
                bound += extra[p, i, j]
                G[i, j], wide[i, j], R[i, j] = total, bound, abs(other) + u * moduli
                size[i, j] = abs(total) + bound
                row += R[i, j]
                most[j] = max(most[j], R[i, j])
            rho = max(rho, row)
        beyond = rho / (1.0 - rho) if rho < 1.0 else math.inf
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += (R[i, k] + beyond * most[k]) * size[k, j]
                off = G[i, j] - centre[p, i] if i == j else G[i, j]
                coupling[p, i, j] = abs(off) + wide[i, j] + total
                if not math.isfinite(coupling[p, i, j]):
                    coupling[p, i, j] = math.inf


@kernel
def powers(M, E, number, may_be_stable, verdict):
    """Decide the verdict (N) by M^2, M^4, ..., `number` squarings: 1 if a norm is below 1, 0 if a
    trace exceeds n.
    """
    N, n = M.shape[0], M.shape[1]
    A, B, X, Y = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for p in range(N):
        copy(M[p], A)
        copy(E[p], X)
        for _ in range(number):
            norm = trace = spread = 0.0
            for i in range(n):
                row = 0.0
                for j in range(n):
                    row += abs(A[i, j]) + X[i, j]
                norm = max(norm, row)
                trace += A[i, i]
                spread += X[i, i]
            if may_be_stable and norm * (1.0 + n * EPS) < 1.0:
                verdict[p] = 1
                break
            if abs(trace) - spread > n * (1.0 + 2.0 * n * EPS):
                verdict[p] = 0
                break
            if not norm < 1e150:
                break
            for i in range(n):
                for j in range(n):
                    total = bound = 0.0
                    for k in range(n):
                        total += A[i, k] * A[k, j]
                        one, two = abs(A[i, k]), abs(A[k, j])
                        bound += (
                            one * X[k, j]
                            + X[i, k] * two
                            + X[i, k] * X[k, j]
                            + (n + 1) * ROUNDOFF_UP * one * two
                        )
                    B[i, j], Y[i, j] = total, bound * (1.0 + 4.0 * n * EPS)
            A, B, X, Y = B, A, Y, X
