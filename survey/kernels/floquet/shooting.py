"""Boundary value problems along chains of steps, the shots of multiple shooting: bounds of their
solutions.
"""

import math

import numpy as np

from survey.kernels.floquet.steps import copy, multiply, set_identity
from survey.kernels.jit import kernel
from survey.kernels.math.roundoff import EPS

MOST_LOST = 1e-2  # of an entry that is about 1, by rounding


@kernel
def responses(F, delta, first, back, ends, at_end, states, last, time_bar):
    """Fill bounds of the solutions of x_k+1 = F_k x_k + d_k, |d_k| <= delta_k, with conditions at both ends.

    Point i has the steps k from first[i] to first[i + 1]. At their end the states `ends` (m) of x, plus an unknown
    shift of time times a column, are e, |e| <= at_end (N, m); at the beginning x is a combination of unknown columns.
    `back` (N, n + 1, m) times what the ends lack gives x at the beginning and, in its last row, the shift. |x| is
    `states` (steps, n) at most at the steps' beginnings and `last` (N, n) at the end, and the shift `time_bar` (N).
    Infinite where rounding counts.
    """
    n, m = F.shape[1], len(ends)
    A, B, suffix = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    H, start = np.empty((m, n)), np.empty((n + 1, n))
    for i in range(len(first) - 1):
        begin, end = first[i], first[i + 1]
        states[begin:end] = 0.0
        last[i] = 0.0
        time_bar[i] = 0.0
        set_identity(suffix)
        largest, growth, sources = 0.0, 1.0, 0.0
        for source in range(end - 1, begin - 2, -1):  # the last one: what is asked of the ends
            width = n if source >= begin else m
            for a in range(m):
                for c in range(n):
                    H[a, c] = suffix[ends[a], c]
                    if source < begin:
                        H[a, c] = 1.0 if a == c else 0.0
            for r in range(n + 1):
                for c in range(width):
                    total = 0.0
                    for a in range(m):
                        total -= back[i, r, a] * H[a, c]
                    start[r, c] = total
            A[:] = 0.0
            for r in range(n):
                for c in range(width):
                    A[r, c] = start[r, c]
            for c in range(width):
                size = delta[source, c] if source >= begin else at_end[i, c]
                time_bar[i] += abs(start[n, c]) * size
                sources += size
            for k in range(begin, end + 1):
                for r in range(n):
                    total = 0.0
                    for c in range(width):
                        largest = max(largest, abs(A[r, c]))
                        total += abs(A[r, c]) * (
                            delta[source, c] if source >= begin else at_end[i, c]
                        )
                    if k < end:
                        states[k, r] += total
                    else:
                        last[i, r] += total
                if k == end:
                    break
                multiply(F[k], A, 0.0, B)
                A, B = B, A
                if k == source:
                    for r in range(n):
                        A[r, r] += 1.0
            if source >= begin:
                multiply(suffix, F[source], 0.0, B)
                copy(B, suffix)
                for r in range(n):
                    for c in range(n):
                        growth = max(growth, abs(suffix[r, c]))
        # rounding adds to each of the products, and grows as other errors do
        lost = n * (end - begin + m) * EPS * growth * (largest + growth)
        more = lost * sources if lost <= MOST_LOST else math.inf
        states[begin:end] += more
        last[i] += more
        time_bar[i] = time_bar[i] * (1.0 + lost) if lost <= MOST_LOST else math.inf
