"""Unstable branches of the saddles: w(x) = a1 x + a2 x^2 + ..., x = phi - phi_s, solves w w' = f w
+ g (57).
"""

import math

import numpy as np

from survey.kernels.cylinder.equilibria import ANGLE, BAR, KIND, SADDLE, F
from survey.kernels.cylinder.flow import (
    B12,
    B31,
    BOUND_DDG,
    BOUND_DG,
    BOUND_F,
    C23,
    S2,
    S3,
    D,
    values,
)
from survey.kernels.cylinder.program import COLUMNS, in_angle
from survey.kernels.cylinder.records import START_PHI, START_PHI_BAR, START_W, START_W_BAR
from survey.kernels.jit import for_constants, inline, kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

ORDER = 16
TRUNCATION = 1e-17  # of the series, relative
FURTHEST = 0.1  # rad from the saddle


@inline
def _forces_of_gyrostat(p, phi, f, g):
    s, c = math.sin(phi), math.cos(phi)
    s2, c2 = 2.0 * s * c, (c - s) * (c + s)
    one, two = 1.0, 1.0  # 1/n! and 2^n/n!
    for n in range(ORDER + 1):
        f[n] = one * (p[B12] * c - p[B31] * s)
        g[n] = one * (p[S2] * c - p[S3] * s) - two * (0.5 * p[D] * s2 + p[C23] * c2)
        s, c, s2, c2 = c, -s, c2, -s2
        one, two = one / (n + 1), two * 2.0 / (n + 1)
    g[0] = 0.0


@for_constants(_forces_of_gyrostat)
def forces(p, phi, f, g):
    """Taylor coefficients of f and of g about phi, where g = 0."""
    if len(p) == COLUMNS:
        _forces_of_gyrostat(p, phi, f, g)
        return
    in_angle(p, phi, f, g)
    g[0] = 0.0


@kernel
def unstable(p, eqs, count, starts, furthest, kind):
    """Fill `starts` (START_PHI to START_W_BAR) with a point of each unstable branch, two per
    saddle; their number.

    They are at most `furthest` (rad) from the saddle. Of repelling nodes (`kind`) they are the
    branches that leave fastest.
    """
    f, g, a = np.zeros(ORDER + 1), np.zeros(ORDER + 1), np.zeros(ORDER + 1)
    size = 0
    for i in range(count):
        if eqs[i, KIND] != kind or (kind != SADDLE and eqs[i, F] <= 0.0):
            continue
        phi, slip = eqs[i, ANGLE], eqs[i, BAR]
        forces(p, phi, f, g)
        _f, _g, dg = values(p, phi)
        spread = math.sqrt(f[0] * f[0] + 4.0 * dg)
        a[1] = 0.5 * (f[0] + spread) if f[0] > 0.0 else 2.0 * dg / (spread - f[0])
        for n in range(2, ORDER + 1):
            known = g[n]
            for j in range(1, n):
                known += f[n - j] * a[j]
            for j in range(2, n):
                known -= a[j] * (n + 1 - j) * a[n + 1 - j]
            a[n] = known / ((n + 1) * a[1] - f[0])
        reach = furthest
        for n in (ORDER - 1, ORDER):
            reach = min(reach, (TRUNCATION * a[1] / (abs(a[n]) + 1e-300)) ** (1.0 / (n - 1)))
        slope = slip * (p[BOUND_F] * a[1] + p[BOUND_DDG]) + 4.0 * ROUNDOFF_UP * (
            p[BOUND_F] * a[1] + p[BOUND_DG]
        )
        for side in (-1.0, 1.0):
            x, w = side * reach, 0.0
            for n in range(ORDER, 0, -1):
                w = (w + a[n]) * x
            starts[size, START_PHI], starts[size, START_W] = phi + x, w
            starts[size, START_PHI_BAR] = slip + 4.0 * ROUNDOFF_UP
            starts[size, START_W_BAR] = (
                20.0 * ROUNDOFF_UP * abs(w) + 2.0 * reach * slope / spread + 2.0 * a[1] * slip
            )
            size += 1
    return size


def of_saddles(p, eqs, starts):
    """As `unstable`, of the saddles among all equilibria."""
    return unstable(p, eqs, len(eqs), starts, FURTHEST, SADDLE)
