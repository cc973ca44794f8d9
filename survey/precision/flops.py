"""Floating-point operations: the measured peak rates of one core, and the number of operations of a
formula.
"""

import time

import numba
import numpy as np

LANES, ROUNDS, REPEATS = 64, 3000, 5
CHAINS, DEPTH = 12, 16  # measured: fewer are limited by the latency of an operation


def rates():
    """Multiply-add pairs per nanosecond: separate, as in survey's kernels, and fused."""
    return {
        "multiply_add_per_ns": _rate(),
        "fused_multiply_add_per_ns": _rate(fastmath={"contract"}),
    }


def _rate(**flags):
    burn = _burner(flags)
    values = np.ones(LANES)
    times = []
    for rounds in [1] + [ROUNDS] * REPEATS:
        start = time.perf_counter()
        burn(values, 0.999, 0.001, rounds)
        times.append(time.perf_counter() - start)
    return CHAINS * DEPTH * LANES * ROUNDS / min(times[1:]) * 1e-9


def _burner(flags):
    """A kernel of independent chains x -> m x + c that stay in registers, lanes innermost as in
    survey's own.
    """
    inline = numba.njit(forceinline=True, **flags)

    @inline
    def turn(x, m, c):
        x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11 = x
        return (x0 * m + c, x1 * m + c, x2 * m + c, x3 * m + c, x4 * m + c, x5 * m + c, x6 * m + c, x7 * m + c,
                x8 * m + c, x9 * m + c, x10 * m + c, x11 * m + c)  # fmt: skip

    @inline
    def four(x, m, c):
        return turn(turn(turn(turn(x, m, c), m, c), m, c), m, c)

    @numba.njit(**flags)
    def burn(values, m, c, rounds):
        for _ in range(rounds):
            for i in range(values.size):
                v = values[i]
                x = (
                    v,
                    2 * v,
                    3 * v,
                    4 * v,
                    5 * v,
                    6 * v,
                    7 * v,
                    8 * v,
                    9 * v,
                    10 * v,
                    11 * v,
                    12 * v,
                )
                x = four(four(four(four(x, m, c), m, c), m, c), m, c)
                values[i] = 0.01 * (
                    x[0]
                    + x[1]
                    + x[2]
                    + x[3]
                    + x[4]
                    + x[5]
                    + x[6]
                    + x[7]
                    + x[8]
                    + x[9]
                    + x[10]
                    + x[11]
                )

    return burn


class Counted:
    """A number that counts the operations it takes part in; signs, magnitudes and comparisons are free."""

    __array_ufunc__ = None  # numpy's scalars leave the operation to this class
    operations = 0

    def _count(self, other=None):
        Counted.operations += 1
        return self

    def _times(self, other):
        # the compiler removes it
        return self if isinstance(other, float) and other == 1.0 else self._count()

    __add__ = __radd__ = __sub__ = __rsub__ = __truediv__ = __rtruediv__ = _count
    __mul__ = __rmul__ = _times

    def __abs__(self):
        return self

    __neg__ = __abs__


def operations(formula):
    """Operations of calling `formula(number)` that depend on the number."""
    Counted.operations = 0
    formula(Counted())
    return Counted.operations
