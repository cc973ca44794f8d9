"""The steps of explicit Runge-Kutta methods, once for all systems; the bits are those of the loops
written out.

Others stay apart. Two round in another order: rk4's step of Hill's equation and dop853's of the
flow. Dop853's of Hill's equation is written out, which leaves out the zeros of the tableau and is
faster; that of the whole gyrostat keeps its stages in the table that its error estimate reads.
Linear periodic systems (`kernels.floquet.classical` and
`kernels.floquet.runge_kutta`) have matrices for slopes, of a size that is known when the kernel
runs, and take the steps of many points side by side.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.1.
"""

from survey.kernels.jit import inline
from survey.kernels.unroll import unroll


@inline
def classical(slope, given, at, y, h):
    """One step of order 4 of y' = slope(given, t, y), tuples of float64; `at`: t at its start,
    middle and end.
    """
    half, sixth = 0.5 * h, h / 6.0
    first = slope(given, at[0], y)
    second = slope(given, at[1], _moved(y, half, first))
    third = slope(given, at[1], _moved(y, half, second))
    return _gathered(y, sixth, first, second, third, slope(given, at[2], _moved(y, h, third)))


@unroll
def _moved(y, h, slope):
    return tuple(a + h * b for a, b in zip(y, slope, strict=True))


@unroll
def _gathered(y, sixth, first, second, third, fourth):
    terms = zip(y, first, second, third, fourth, strict=True)
    return tuple(a + sixth * (p + 2.0 * (q + r) + s) for a, p, q, r, s in terms)


@inline
def fundamental(A, stages, slope, given, n, h, state, slopes):
    """Fill `slopes` (stages, n n) of the fundamental matrix of a linear system, by columns, from
    the identity.

    slope(given, i, state, out) fills `out` (n n) with the slopes of `state` (n n; scratch) at stage
    i of the tableau A.
    """
    for i in range(stages):
        for k in range(n * n):
            state[k] = 1.0 if k % (n + 1) == 0 else 0.0
        for j in range(i):
            share = h * A[i, j]
            for k in range(n * n):
                state[k] += share * slopes[j, k]
        slope(given, i, state, slopes[i])
