"""Edges of tongues by the Fourier quadratic eigenproblem (scenes/satellite.md): no integrator.

y = sum of a_j cos or sin(f_j u), z = g(u) + 2 rho w(u) + rho^2 with g, w by their cosine series: in
each of the four classes (A0 + rho A1 + rho^2) a = 0, linearised to twice its size.
"""

from functools import cache

import numpy as np
from mpmath import ellipfun, ellipk, mp
from scipy.linalg import eigvals


def edges(body, k, low, high, harmonics):
    """[(position, class as in `hill_edges.CLASSES`)] of the real eigenvalues in [low, high], ascending."""
    period, w, g = coefficients(body, k, 2 * harmonics)
    found = []
    for kind in range(4):
        found += [(rho.real, kind) for rho in eigenvalues(period, w, g, kind, harmonics)
                  if abs(rho.imag) < 1e-9 and low <= rho.real <= high]  # fmt: skip
    return sorted(found)


def eigenvalues(period, w, g, kind, harmonics):
    """All eigenvalues rho of one class: 0 even, 1 odd antiperiodic; 2 even, 3 odd periodic."""
    half, odd = kind < 2, kind % 2 == 1
    j = np.arange(harmonics) + (0.5 if half else 1.0 if odd else 0.0)
    total, apart = np.rint(j[:, None] + j).astype(int), np.rint(abs(j[:, None] - j)).astype(int)
    sign = -1 if odd else 1
    # cos a cos b = (cos(a - b) + cos(a + b)) / 2, sin a sin b = (cos(a - b) - cos(a + b)) / 2
    scale = np.where(j == 0, np.sqrt(0.5), 1.0)
    one, other = (scale[:, None] * (c[apart] + sign * c[total]) * scale for c in (g, w))
    a0, a1 = one - np.diag((2 * np.pi * j / period) ** 2), 2 * other
    eye, zero = np.eye(harmonics), np.zeros((harmonics, harmonics))
    return eigvals(np.block([[zero, eye], [-a0, -a1]]))


def coefficients(body, k, number):
    """The period, and c_0, c_1, ... of w and of z at rho = 0, as series c_0 + 2 c_1 cos ..., by
    mpmath's cn, dn.
    """
    samples = 4 * number
    period, w = motion(k, samples)
    with mp.workdps(20):
        c = 1 - mp.mpf(k) ** 2 if body == "prolate" else -(mp.mpf(k) ** 2)
        z = [float(2 * v * v + c) for v in w]
        w, period = [float(v) for v in w], float(period)
    return period, *(np.fft.rfft(values).real[: 2 * number] / samples for values in (w, z))


@cache
def motion(k, samples):
    """The period, and k cn or k dn at `samples` places in it: even about its middle."""
    with mp.workdps(20):
        m, rotates = (mp.mpf(1) / k**2 if k > 1 else mp.mpf(k) ** 2), k > 1
        period = 2 * ellipk(m) / k if rotates else 4 * ellipk(m)
        scale = k if rotates else 1
        function = ellipfun("dn" if rotates else "cn")
        half = [k * function(scale * period * n / samples, m=m) for n in range(samples // 2 + 1)]
        return period, half + half[-2:0:-1]
