"""Periodic orbits and their monodromy matrices a second way, with estimates of errors: for methods
that offer `orbit_motion`, as `survey verify` asks for one.

The state and the variational equation are integrated together over the period, in equal steps, and
in twice as many; the difference estimates the error. What x(T) - x(0) leaves, times the inverse of
dx(T)/dx(0) - 1, is how far the orbit is; M is taken to change with it as with a shift by SHIFT of
each state.
"""

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures.floquet import monodromy
from survey.measures.floquet.existence import ShownOrbits, deflated
from survey.measures.floquet.newton import applied, bordered, inverse

DENSER = 4  # steps, relative to those of the Taylor series
SHIFT = 1e-6  # relative to the largest state
ROUNDINGS = 16  # of a step


def recomputed(programs, numbers, x, T, plane, steps, method, symmetry=None):
    """As `existence.certified`: ShownOrbits, of orbits near x (N, n), T (N), or half of it."""
    N, n = x.shape
    count = DENSER * np.maximum(steps, 8)
    shift = SHIFT * abs(x).max(axis=1, keepdims=True) + 1e-300
    with np.errstate(all="ignore"):
        rough, half = _motion(method, programs, numbers, x, T, count)
        X, M = _motion(method, programs, numbers, x, T, 2 * count)
        other = _motion(method, programs, numbers, x + shift, T, count)[1]
        size = ROUNDINGS * EPS * count[:, None]
        dX = abs(X - rough) + size * abs(X)
        dM = abs(M - half) + size[:, :, None] * abs(M).max(axis=(1, 2), keepdims=True)
        moved = abs(other - half) / shift[:, :, None]
        value, slope, off = X - x, M - np.eye(n), dX
        if symmetry is not None:
            f_end = programs.slopes(numbers, T, X)[0]
            value, slope = symmetry.linearised(X, M, 2.0 * f_end, x, x)
            # these states are 0 at the end, where rounding of others on the way has grown
            grown = (
                ROUNDINGS
                * EPS
                * (count[:, None] + abs(M).sum(axis=2))
                * abs(X).max(axis=1, keepdims=True)
            )
            off = np.zeros((N, n + 1))
            off[:, : symmetry.ends.size] = (dX + grown)[:, symmetry.ends]
        elif plane is not None:
            f_end = programs.slopes(numbers, T, X)[0]
            planar = (plane[0] * (x - plane[1])).sum(axis=1)[:, None]
            value = np.concatenate([value, planar], axis=1)
            off = np.concatenate([off, abs(plane[0] * x).sum(axis=1)[:, None] * EPS], axis=1)
            slope = bordered(slope, f_end, plane[0])
        B = inverse(slope)
        step = -applied(B, value)
        away = 2.0 * (abs(step) + applied(abs(B), off))
        dx, dT = away[:, :n], away[:, n] if plane is not None else 4 * EPS * T
        E = dM + moved * dx.max(axis=1)[:, None, None]
        time_bar = np.zeros(N) if plane is None else dT
        at_end = programs.along(
            programs.A, numbers, T[:, None], X[:, :, None], np.zeros((N, n, 1))
        )[0][:, 0]
        E = E + time_bar[:, None, None] * _product(abs(at_end), abs(M))
        judged, bounds = M, E
        if plane is not None:
            f, df = programs.slopes(numbers, np.zeros(N), x, dx)
        if plane is not None and symmetry is None:
            judged, bounds = deflated(M, E, f, df)
        x, T = x + step[:, :n], T if plane is None else T + step[:, n]
        good = np.isfinite(E).all(axis=(1, 2)) & np.isfinite(dx).all(axis=1)
        good &= (dx < 1e-3 * abs(x).max(axis=1, keepdims=True) + 1e-12).all(axis=1)
        others = monodromy.Matrices.plain(judged, bounds)
        if symmetry is not None:
            M, E, others = symmetry.matrices(M, E, f, df, symmetry.block(M), symmetry.block(E))
            T, dT = 2.0 * T, 2.0 * dT
        return ShownOrbits(good, x, dx, T, dT, M, E, (x * x).sum(axis=1), others)


def _product(A, B):
    return (A[:, :, :, None] * B[:, None, :, :]).sum(axis=2)


def _motion(method, programs, numbers, x, T, steps):
    X = np.empty_like(x)
    M = np.empty((*x.shape, x.shape[1]))
    A = programs.A
    given = (
        np.ascontiguousarray(numbers[0]),
        programs.states_at,
        np.ascontiguousarray(x),
        np.ascontiguousarray(T),
    )
    method.orbit_motion(A.operations, A.signs, A.inside, A.order, A.terms, *given, steps, X, M)
    return X, M
