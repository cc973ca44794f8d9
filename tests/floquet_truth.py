"""Linear periodic systems whose multipliers are known exactly, for tests.

x = R(t) y with y' = B y, R(t) turning the planes of states (0, 1), (2, 3), ... once in 2 pi: x' =
A(t) x with A = R' R^-1 + R B R^-1, and the multipliers are exp(2 pi l), l the eigenvalues of B: any
matrix, normal or not.
"""

import math

import mpmath
import numpy as np
import xarray as xr

import survey

PERIOD = 2 * math.pi


def rotating(n):
    """The scene; its parameters b0, b1, ... are the entries of B (n x n), row by row."""

    def A(t, p, out):
        R = np.zeros((n, n), dtype=object)
        for k in range(n):
            R[k, k] = 1.0
        for k in range(0, n - 1, 2):
            R[k, k] = R[k + 1, k + 1] = math.cos(t)
            R[k, k + 1], R[k + 1, k] = -math.sin(t), math.sin(t)
        B = np.array([p[k] for k in range(n * n)], dtype=object).reshape(n, n)
        out[:] = R @ B @ R.T
        for k in range(0, n - 1, 2):
            out[k, k + 1] -= 1.0
            out[k + 1, k] += 1.0

    names = [f"b{k}" for k in range(n * n)]
    return survey.floquet(A, period=PERIOD, parameters=names, states=[f"x{k}" for k in range(n)])


def evaluated(n, B, **options):
    """The dataset of the matrices B (N, n, n), along the dimension `i`."""
    values = {f"b{k}": xr.DataArray(B.reshape(len(B), -1)[:, k], dims="i") for k in range(n * n)}
    return survey.evaluate(rotating(n), **values, **options)


def multipliers(B):
    """The multipliers of one B, to 30 digits; the period is the binary64 number PERIOD."""
    with mpmath.workdps(30 + 20 * len(B)):
        found = mpmath.eig(mpmath.matrix(B.tolist()), left=False, right=False)
        return [mpmath.exp(mpmath.mpf(PERIOD) * value) for value in found]


def hard(n, number, seed):
    """Matrices B (number, n, n): simple, oscillating, next to the edge of stability, defective, far
    from normal.
    """
    rng = np.random.default_rng(seed)
    B = np.empty((number, n, n))
    for k in range(number):
        kind = k % 5
        block = np.diag(0.3 * rng.normal(size=n))
        if kind in (1, 2, 4):
            for i in range(0, n - 1, 2):
                turn, growth = rng.normal(), rng.normal() * 10.0 ** rng.uniform(-12, -1)
                block[i : i + 2, i : i + 2] = [[growth, turn], [-turn, growth]]
        if kind == 2:
            edge = np.linalg.eigvals(block).real.max()
            block -= (edge + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-12, -5)) * np.eye(n)
        if kind == 3 and n > 1:
            block = np.diag(np.full(n, block[0, 0]))
            block[0, 1] = 1.0
        basis = np.linalg.qr(rng.normal(size=(n, n)))[0]
        if kind == 4:
            basis = (
                basis
                @ np.diag(10.0 ** rng.uniform(-2, 2, n))
                @ np.linalg.qr(rng.normal(size=(n, n)))[0]
            )
        B[k] = basis @ block @ np.linalg.inv(basis)
    return B
