"""The flow on the cylinder by other means: Taylor series with mpmath; polar coordinates about a
focus, by SciPy.
"""

import math
from itertools import pairwise

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def series(six, phi, w, order):
    """Taylor coefficients of phi and w in time."""
    b12, b31, d, c23, s2, s3 = six
    sine, cosine, phi, w = [mp.sin(phi)], [mp.cos(phi)], [phi], [w]
    for n in range(order):
        cw, sw, cs, cc, ss = (
            mp.fdot(x, y[::-1])
            for x, y in ((cosine, w), (sine, w), (cosine, sine), (cosine, cosine), (sine, sine))
        )
        rate = b12 * cw - b31 * sw - d * cs - c23 * (cc - ss) + s2 * cosine[n] - s3 * sine[n]
        for row, value in zip((sine, cosine, phi, w), (cw, -sw, w[n], rate), strict=True):
            row.append(value / (n + 1))
    return phi, w


def exact(six, phi, w, t, digits=30, float_out=True):
    """phi and w at t by Taylor series with mpmath, of an order of one for each digit."""
    with mp.workdps(digits):
        six, phi, w, left = list(map(mp.mpf, six)), mp.mpf(phi), mp.mpf(w), mp.mpf(t)
        while left:
            rows = series(six, phi, w, digits)
            largest = max(
                abs(c) ** (mp.mpf(1) / n) for row in rows for n, c in list(enumerate(row))[-2:]
            )
            step = mp.sign(left) * min(abs(left), 1 / (10 * largest))
            phi, w = (mp.fdot(row, [step**n for n in range(digits + 1)]) for row in rows)
            left -= step
        return [float(phi), float(w)] if float_out else [phi, w]


def zeros_beside_a_focus(six, phi, w, times):
    """How often w changes sign before each time: in time to t = 10, then as the angle about the
    focus reached tells.

    With x = rho cos a, w = rho sin a, u = ln rho, about the focus at e: g(e + x) without
    cancellation, so that rho may be as small as it likes.
    """
    b12, b31, d, c23, s2, s3 = six

    def parts(x):
        """f(e + x), and g(e + x) / x as sin and cos differ from those at e."""
        half, whole = math.sin(x / 2) / x, math.sin(x) / x
        sine, cosine = 2 * math.cos(e + x / 2) * half, -2 * math.sin(e + x / 2) * half
        double_sine, double_cosine = (
            2 * math.cos(2 * e + x) * whole,
            -2 * math.sin(2 * e + x) * whole,
        )
        g = -d / 2 * double_sine - c23 * double_cosine + s2 * cosine - s3 * sine
        return b12 * math.cos(e + x) - b31 * math.sin(e + x), g

    def rates(_t, y):
        s, c = math.sin(y[0]), math.cos(y[0])
        f, g = parts(math.exp(max(y[1], -300.0)) * c or 1e-300)
        turn = f * s + g * c
        return [c * turn - s * s, s * c + s * turn]

    def force(x):
        s, c = math.sin(x), math.cos(x)
        return -d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s

    first = 10.0
    early = solve_ivp(
        lambda _t, y: [y[1], (b12 * math.cos(y[0]) - b31 * math.sin(y[0])) * y[1] + force(y[0])],
        (0, first), [phi, w], "DOP853", rtol=1e-13, atol=1e-13, dense_output=True,
    )  # fmt: skip
    sign = np.sign(early.sol(np.linspace(0, first, 20001))[1])
    counts = [
        int(np.count_nonzero(np.diff(sign[: 1 + int(2000 * t)]))) for t in times if t <= first
    ]
    x, v = early.y[:, -1]
    lattice = np.linspace(x - 1.5, x + 1.5, 301)
    falls = [(a, b) for a, b in pairwise(lattice) if force(a) > 0 > force(b)]
    roots = [brentq(force, a, b, xtol=1e-16) for a, b in falls]
    e = min(roots, key=lambda root: abs(root - x))
    angle = math.atan2(v, x - e)
    late = [t for t in times if t > first]
    run = solve_ivp(rates, (first, late[-1]), [angle, math.log(math.hypot(x - e, v))], "DOP853",
                    t_eval=late, rtol=1e-12, atol=1e-12)  # fmt: skip
    base = int(np.count_nonzero(np.diff(sign)))
    return counts + [
        base + int(abs(math.floor(a / math.pi) - math.floor(angle / math.pi))) for a in run.y[0]
    ]


def roots(six):
    """The complex angles at which g = 0, a root as often as its multiplicity says: from a
    polynomial in exp(i phi).
    """
    with mp.workdps(60):
        d, c23, s2, s3 = map(mp.mpf, six[2:])
        a, b = mp.mpc(-c23, d / 2) / 2, mp.mpc(s2, s3) / 2
        row = [a, b, 0, mp.conj(b), mp.conj(a)] if a != 0 else [b, 0, mp.conj(b)]
        if a == b == 0:
            return []
        return [mp.mpc(0, -1) * mp.log(z) for z in mp.polyroots(row, maxsteps=2000, extraprec=600)]


def is_real(phi):
    """Is the imaginary part of a root no more than what is left of 60 digits at a triple one?"""
    return abs(phi.imag) < mp.mpf(10) ** -18
