"""Gauss-Chebyshev quadrature of nutations between their turning points, u = middle + half width cos x.

The nearest singularities (the other roots of P, the poles) tell how many nodes are needed. Domain: away from separatrices and near passages of poles, where it
needs many nodes; `no_convergence` beyond MOST. The independent check.

Source: DLMF 3.5(v); integrals (S3), (S4), (S15) of `scenes/brun.md`.
"""

from math import cos, exp, inf, log1p, pi, sqrt

import numpy as np

from survey.kernels import nutation as nu
from survey.kernels.jit import inline, kernel

ORDER = 0  # no steps: convergence is exponential
SERVES = ("nutation",)
EPS = nu.EPS
FIRST, MOST = 8, 2**15
FULL = 38.0  # the first neglected coefficient is exp(-FULL)


@inline
def rate(row):
    """Logarithm of the sum of the half axes of the ellipse about [ul, uh], scaled to [-1, 1], without singularities."""
    width, total, k, bend = row[nu.WIDTH], row[nu.SUM], row[nu.K], row[nu.BEND]
    if width <= 0.0:
        return inf
    poles = 2.0 * min(row[nu.HIGH_PLUS] if row[nu.MINUS] != 0.0 else 2.0,
                      row[nu.LOW_MINUS] if row[nu.PLUS] != 0.0 else 2.0) / width  # fmt: skip
    least = log1p(poles + sqrt(poles * (2.0 + poles)))
    if k == 0.0:
        return least
    if k * bend < 0.0:  # real roots of Q: their distances from the ends, each from their product
        spread = sqrt(-bend / k)
        high, low = 2.0 * row[nu.HIGH] + total, 2.0 * row[nu.LOW] + total
        near = min(row[nu.Q_HIGH] / (abs(high) + spread), row[nu.Q_LOW] / (abs(low) + spread)) * 2.0 / abs(k)
        gap = 2.0 * near / width
        return min(least, log1p(gap + sqrt(gap * (2.0 + gap))))
    y = sqrt(bend / k) / width
    x = 2.0 * abs(total) / width
    sides = 0.5 * (sqrt((x + 1.0) ** 2 + y * y) + sqrt((x - 1.0) ** 2 + y * y))
    height = sides - 1.0 if sides - 1.0 > 1e-6 else 0.5 * y * y
    return min(least, log1p(height + sqrt(height * (2.0 + height))))


@inline
def sums(row, n, out):
    """T/A, the halves of the advances, the action, and the rounding of Q relative to it, by n nodes in x = 0..pi."""
    low, high, bow = row[nu.Q_LOW], row[nu.Q_HIGH], row[nu.K] * row[nu.WIDTH] ** 2
    minus, plus = row[nu.MINUS], row[nu.PLUS]
    time = up = down = action = rough = 0.0
    for i in range(n):
        c = cos((i + 0.5) * (0.5 * pi / n))  # of x/2: both weights without cancellation
        s = cos((n - i - 0.5) * (0.5 * pi / n))
        c, s = c * c, s * s
        square = low * s + high * c - bow * s * c
        root = sqrt(square)
        to_plus = row[nu.LOW_PLUS] * s + row[nu.HIGH_PLUS] * c
        to_minus = row[nu.LOW_MINUS] * s + row[nu.HIGH_MINUS] * c
        time += 1.0 / root
        up += 1.0 / (to_plus * root) if minus != 0.0 else 0.0
        down += 1.0 / (to_minus * root) if plus != 0.0 else 0.0
        action += s * c * root / (to_plus * to_minus)
        rough = max(rough, (low * s + high * c + abs(bow) * s * c) / square)
    step = pi / n
    out[0], out[1], out[2] = 2.0 * step * time, step * up * minus, step * down * plus
    out[3], out[4] = row[nu.WIDTH] ** 2 * step * action / pi, rough


@inline
def periods_of(row, n, speed, half, whole, out):
    """See `agm.periods_of`; the error of n nodes follows from the difference to half of them."""
    sums(row, n // 2, half)
    sums(row, n, whole)
    noise = row[nu.NOISE_LOW] + row[nu.NOISE_HIGH] + (16.0 + 2.0 * sqrt(float(n))) * EPS * whole[4]
    seen, missed = exp(-speed * n), exp(-2.0 * speed * n)
    for i in range(4):
        half[i] = 10.0 * (abs(whole[i] - half[i]) * seen + abs(whole[i]) * missed) + noise * abs(whole[i])
    out[0], out[1], out[2], out[3] = whole[0], whole[1] + whole[2], whole[2] - whole[1], whole[3]
    out[4], out[5], out[6], out[7] = half[0], half[1] + half[2], half[1] + half[2], half[3]


@kernel
def nutation_periods(rows, kinds, tolerance, out):
    """See `agm.nutation_periods`."""
    half, whole = np.empty(5), np.empty(5)
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            speed = rate(rows[i])
            n = FIRST
            while 2.0 * n * speed < FULL and n <= MOST:
                n *= 2
            if n <= MOST:
                periods_of(rows[i], n, speed, half, whole, out[i])
