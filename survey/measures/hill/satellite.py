"""Planar motions of a satellite, a row each: from what is given to moduli, periods and rho, and no
digit is lost.
"""

from dataclasses import dataclass
from functools import cached_property
from math import pi, sqrt

import numpy as np

from survey.kernels.hill import satellite as motion
from survey.kernels.hill.satellite import complete_integrals, half_periods
from survey.kernels.math.double import split_error
from survey.kernels.math.roundoff import EPS

CLOSE = 1e-17  # of means: what is left of their difference
LYAPUNOV_ULPS = 100  # of the sizes of what makes T times the integral of z


def moduli(point):
    """k, the complement (of 1/k for rotations), what was given, and which it is: no digit is lost
    near k = 1.

    From k, from 1 - k, or from the amplitude asin k.
    """
    if "amplitude" in point:
        amplitude = np.asarray(point["amplitude"], dtype=float)
        return (
            np.sin(amplitude),
            np.cos(amplitude),
            amplitude,
            np.full_like(amplitude, motion.AMPLITUDE),
        )
    with np.errstate(all="ignore"):
        if "one_minus_k" in point:
            given = short = np.asarray(point["one_minus_k"], dtype=float)
            which, high = motion.ONE_MINUS_K, 1 - short
            # a rotation remains one
            k = np.where(short < 0, np.maximum(high, np.nextafter(1, 2)), high)
        else:
            given = k = np.asarray(point["k"], dtype=float)
            which, short = motion.K, 1 - k
        scale = np.maximum(k, 1)
        complement = np.sqrt((abs(short) / scale) * ((1 + k) / scale))
        period = (k < np.inf) & (complement > 0)  # there is none where k = 1
        k, complement = np.where(period, k, np.nan), np.where(period, complement, np.nan)
    return k, complement, given, np.full_like(given, which)


def planar_angle(u, k, kc):
    """The angle x (m) of a planar motion at u (m), sin x = k sn(u, k) or x = am(k u, 1/k), and
    bounds of its error.

    kc is the complement, of 1/k for rotations. DLMF 22.20(ii): am by descending means of 1 and kc.
    """
    small, scale = min(k, 1.0 / k) if k > 0 else 0.0, max(k, 1.0)
    pairs = []
    a = 1.0
    b = kc
    c = small
    while c > CLOSE * a:
        a, b = 0.5 * (a + b), sqrt(a * b)
        c = c * c / (4.0 * a)
        pairs.append(c / a)
    am = 2.0 ** len(pairs) * a * scale * u
    for ratio in reversed(pairs):
        am = 0.5 * (am + np.arcsin(np.clip(ratio * np.sin(am), -1.0, 1.0)))
    if k > 1:
        return am, 16 * EPS * (1.0 + scale * abs(u))
    side = np.hypot(np.cos(am), kc * np.sin(am))
    return np.arctan2(k * np.sin(am), side), 16 * EPS * (1.0 + abs(u))


def rates(inertia_ratio, direction):
    """rho = +-1 / sqrt(3 |1 - alpha|) rounded, and what float64 took from it."""
    with np.errstate(all="ignore"):
        short = 1 - inertia_ratio
        # the rounding of 1 - alpha, exactly (Knuth)
        rest = (1 - (short - (short - 1))) - (inertia_ratio + (short - 1))
        short, rest = abs(short), np.sign(short) * rest
        rho = 1 / np.sqrt(3 * short)
        # one step of Newton's: 1 - 3 rho^2 (short + rest), each product with its own rounding
        square = rho * rho
        triple = 3 * square
        triple_rest = split_error(3.0, square, triple) + 3 * split_error(rho, rho, square)
        total = triple * short
        missing = (1 - total) - (
            split_error(triple, short, total) + (triple * rest + triple_rest * short)
        )
        low = 0.5 * rho * missing
        high = rho + low
        return float(direction) * high, float(direction) * (low - (high - rho))


@dataclass(frozen=True)
class Motion:
    """The planar motions of the rows: k, the complement, what was given and which, and what follows
    from them.
    """

    k: np.ndarray
    kc: np.ndarray
    given: np.ndarray
    which: np.ndarray
    oblate: bool

    @cached_property
    def integrals(self):
        """K and E of the smaller of k and 1/k."""
        return complete_integrals(np.minimum(self.k, 1 / np.maximum(self.k, 1)), self.kc)

    @cached_property
    def rotates(self):
        return self.k > 1

    @cached_property
    def columns(self):
        """The rows as `kernels.hill.satellite` takes them."""
        columns = np.empty((self.k.size, motion.ROW))
        columns[:, motion.MODULUS], columns[:, motion.COMPLEMENT] = self.k, self.kc
        columns[:, motion.HALF], columns[:, motion.OBLATE] = self.half[0], self.oblate
        columns[:, motion.GIVEN], columns[:, motion.WHICH] = self.given, self.which
        return columns

    @cached_property
    def half(self):
        """The half period, rounded, and what float64 took from it."""
        return half_periods(self.k, self.kc)

    @property
    def period(self):
        return 2 * self.half[0]

    @cached_property
    def rate(self):
        """1 / distance of the poles of w from the real axis: K' or K'/k."""
        conjugate, _ = complete_integrals(self.kc, np.minimum(self.k, 1 / np.maximum(self.k, 1)))
        return np.maximum(self.k, 1) / conjugate

    def lyapunov(self, rho, period):
        """Does Lyapunov's criterion (corrected: T int z <= 4, and z >= 0) certify stability,
        rounding aside?
        """
        still, sizes, drift = self._of_lyapunov(period)
        total = ((1 + LYAPUNOV_ULPS * EPS) * period**2)[:, None] * (rho * rho)
        if drift.any():
            total += drift[:, None] * rho + (LYAPUNOV_ULPS * EPS * drift)[:, None] * abs(rho)
        certain = total <= (4 - still - LYAPUNOV_ULPS * EPS * sizes)[:, None]
        return certain & self._nonnegative(rho) if self.oblate else certain

    def lyapunov_integral(self, rho, period):
        """T times the integral of z over T, and a bound of its rounding."""
        still, sizes, drift = self._of_lyapunov(period)
        grows = (period**2)[:, None] * (rho * rho)
        total, size = still[:, None] + grows, sizes[:, None] + grows
        if drift.any():
            total, size = total + drift[:, None] * rho, size + drift[:, None] * abs(rho)
        return total, LYAPUNOV_ULPS * EPS * size

    def _of_lyapunov(self, period):
        """Of each row, the part of T times the integral of z that is free of rho, its rounding, and what
        rho is multiplied by, 2 pi T in rotations, where am advances by pi.
        """
        first, second = self.integrals
        k, c = self.k, -(self.k**2) if self.oblate else (1 - self.k) * (1 + self.k)
        squares = np.where(self.rotates, 2 * k * second, 4 * (second - self.kc**2 * first))
        still = period * (2 * squares + c * period)
        sizes = period * (2 * squares + (k**2 + 1) * period)
        return still, sizes, np.where(self.rotates, 2 * pi * period, 0.0)

    def range_of_z(self, rho):
        """The least and the greatest z along the motion, and a bound of their rounding."""
        k = self.k[:, None]
        low = np.where(self.rotates[:, None], k * self.kc[:, None], -k)
        c = -k * k if self.oblate else (1 - k) * (1 + k)

        def z(w):
            return 2 * w * w + 2 * rho * w + rho * rho + c

        bar = 32 * EPS * (rho * rho + k * k + 1)
        return z(np.clip(-rho / 2, low, k)), np.maximum(z(low), z(k)), bar

    def zhukovskii(self, rho, period):
        """Does n^2 pi^2 / T^2 <= z <= (n + 1)^2 pi^2 / T^2, for one n = 0, 1, ..., certify stability?"""
        least, greatest, bar = self.range_of_z(rho)
        unit = (period[:, None] / pi) ** 2
        off = unit * (bar + 32 * EPS * abs(greatest))
        n = np.floor(np.sqrt(np.maximum(unit * least - off, 0.0)))
        return (least > bar) & (unit * greatest + off < (n + 1) ** 2)

    def _nonnegative(self, rho):
        """z > 0 all along an oblate body's motion: the least of 2 w^2 + 2 rho w + rho^2 - k^2 over
        the range of w.
        """
        k = self.k[:, None]
        low = np.where(self.rotates[:, None], k * self.kc[:, None], -k)
        w = np.clip(-rho / 2, low, k)
        least = 2 * w * w + 2 * rho * w + rho * rho - k * k
        return least > 16 * EPS * (rho * rho + k * k)
