"""How large A(t) is on a piece of the period, how fast it varies, and what its rounding may add,
from samples of it.
"""

import math

import numpy as np

from survey.kernels.floquet.program import BASIS, COLUMN, NUMBER, ROW
from survey.kernels.jit import kernel

SWEEPS = 3  # of balancing
MOST_SHIFT = 500.0  # powers of 2 of a unit, in a sweep


@kernel
def samples(terms, values, errors, numbers, doubts, A, E, largest):
    """Fill A (N, m, n, n), its largest entries E of error bounds (N, n, n), and raise `largest` (N,
    n, n) to its own.

    values, errors (B, N or 1, m) are those of the basis functions that `terms` number from 0;
    numbers, doubts (N, count).
    """
    N, m = A.shape[0], A.shape[1]
    bar = np.empty(E.shape[1:])
    for i in range(N):
        A[i] = 0.0
        E[i] = 0.0
        row = i if values.shape[1] > 1 else 0
        for t in range(m):
            bar[:] = 0.0
            own = A[i, t]
            for q in range(len(terms)):
                basis, j, c, k = terms[q, BASIS], terms[q, ROW], terms[q, COLUMN], terms[q, NUMBER]
                x, y = values[basis, row, t], numbers[i, k]
                own[j, c] += x * y
                bar[j, c] += abs(x) * doubts[i, k] + abs(y) * errors[basis, row, t]
            for q in range(len(terms)):
                j, c = terms[q, ROW], terms[q, COLUMN]
                size = abs(own[j, c])
                largest[i, j, c] = max(largest[i, j, c], size)
                E[i, j, c] = max(E[i, j, c], bar[j, c]) if bar[j, c] < math.inf else math.inf


@kernel
def balance(matrices, scale):
    """Fill scale (N, n): see `measures.floquet.monodromy.balanced`; `matrices` (N, n, n) are used up."""
    N, n = scale.shape
    for p in range(N):
        work = matrices[p]
        for i in range(n):
            work[i, i] = 0.0
            scale[p, i] = 1.0
        for _ in range(SWEEPS):
            for i in range(n):
                row = column = 0.0
                for j in range(n):
                    row += work[i, j]
                    column += work[j, i]
                if not (row > 0.0 and column > 0.0 and row < math.inf and column < math.inf):
                    continue
                power = np.rint(0.5 * math.log2(row / column))
                factor = math.ldexp(1.0, int(min(max(power, -MOST_SHIFT), MOST_SHIFT)))
                scale[p, i] *= factor
                for j in range(n):
                    work[i, j] /= factor
                for j in range(n):
                    work[j, i] *= factor


@kernel
def measure(A, E, scale, weights, transform, resolved, size, rate, noise):
    """Fill `size` (N), the largest sum of moduli in a row of A (N, m, n, n) in the units `scale`
    (N, n); `rate` (N), how fast it varies on a piece of length 1; and `noise` (N), twice the
    largest sum of E (N, n, n) in a row. Where A is not finite `size` is NaN.

    The rate stands for 1 / distance of a singularity, or a frequency: the largest k / (1 + ln(max |c| / |c_k|)) of the
    Chebyshev coefficients c_k, twice (see `hill.user_equation`), of a sum of all entries with `weights`; those that are
    not above `resolved` max |c| do not count. `transform` (m, m) gives the c_k.
    """
    N, m, n = A.shape[0], A.shape[1], A.shape[2]
    one, c = np.empty(m), np.empty(m)
    for p in range(N):
        size[p] = noise[p] = 0.0
        finite = True
        for t in range(m):
            one[t] = 0.0
            for i in range(n):
                total = 0.0
                for j in range(n):
                    own = A[p, t, i, j] * (scale[p, j] / scale[p, i])
                    total += abs(own)
                    one[t] += weights[(i * n + j) % len(weights)] * own
                size[p] = max(size[p], total)
                finite = finite and total < math.inf
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += E[p, i, j] * (scale[p, j] / scale[p, i])
            noise[p] = max(noise[p], 2.0 * total) if total < math.inf else math.inf
        size[p] = size[p] if finite else math.nan
        largest = rate[p] = 0.0
        for k in range(m):
            total = 0.0
            for j in range(m):
                total += transform[k, j] * one[j]
            c[k] = abs(total)
            largest = max(largest, c[k])
        for k in range(m):
            if c[k] > resolved * largest:
                rate[p] = max(rate[p], 2.0 * k / (1.0 - math.log(c[k] / largest)))
