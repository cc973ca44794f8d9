"""Motions on separatrices in closed form: the unstable upright rotation, and the loops that leave a saddle and return.

In units A = k = 1, P = -(u - u0)^2 (u^2 + 2 u0 u + c): with x = rate t, kappa = rate^2,

    u = u0 + kappa / D,   D = 2 u0 + sigma sqrt(4 u0^2 + kappa) cosh x,   sigma = +-1 for the two loops

and 1 / (e - u) = 1/(e - u0) + kappa / [(e - u0) ((e - u0) D - kappa)], e = +-1, has an elementary integral. A loop is
at its end, farthest from u0, at t = 0; psi and phi are 0 there.

Source: derived in `scenes/brun.md`, from (S2) and (S4).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from survey.kernels.math.roundoff import EPS

SAMPLES = 401  # at which saddles are looked for
BISECTIONS = 60


def upright(found, those, times, turning, drift):
    """`found` with the upright rotation, u = 1, in the rows `those` (n): psi' = turning, phi' = turning + drift (n)."""
    psi = np.where(those[:, None], turning[:, None] * times, 0.0)
    phi = np.where(those[:, None], (turning + drift)[:, None] * times, 0.0)
    size = abs(psi) + abs(drift[:, None] * times)
    exact = {"u": (1.0 + 0.0 * psi, 0.0 * psi), "psi": (psi, 4.0 * EPS * abs(psi)), "phi": (phi, 16.0 * EPS * size)}
    for name, values in exact.items():
        for key, value in zip((name, f"{name}_error"), values, strict=True):
            found[key] = np.where(those[:, None], value, found[key])
    return found


def saddles(alpha, beta):
    """u0 (n) in (-1/3, 1/3) of the saddles with these momenta (n), k > 0, and error bounds; NaN where none is found.

    There is one at most; one nearer to a minimum than the samples are to one another is not seen.
    """
    known = (abs(alpha) < 2.0) & (abs(beta) < 2.0)  # cusps bound the region: its momenta are smaller
    alpha, beta = np.where(known, alpha, 0.0), np.where(known, beta, 0.0)
    low = np.full(alpha.shape, np.nan)
    nodes = np.linspace(-1.0 / 3.0, 1.0 / 3.0, SAMPLES)
    before = _force(nodes[0], alpha, beta)
    for one, other in pairwise(nodes):
        after = _force(other, alpha, beta)
        low = np.where((before <= 0.0) & (after > 0.0) & known, one, low)
        before = after
    high = low + nodes[1] - nodes[0]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = _force(middle, alpha, beta) <= 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    u = 0.5 * (low + high)
    slope = -(alpha**2 + beta**2) + 2.0 * alpha * beta * u + (1.0 - u * u) * (1.0 - 5.0 * u * u)
    noise = 8.0 * EPS * ((abs(alpha) + abs(beta)) ** 2 + abs(u))
    with np.errstate(divide="ignore", invalid="ignore"):
        return u, noise / abs(slope) + EPS


def _force(u, alpha, beta):
    """F of the mathematics page, which is an increasing zero at a saddle."""
    return (alpha - beta * u) * (beta - alpha * u) + u * (1.0 - u * u) ** 2


def _square(u, alpha, beta, sign):
    """rate^2 = P''(u) / 2 at a double root u, with L from P(u) = 0."""
    level = (alpha**2 + beta**2 - 2.0 * alpha * beta * u) / (1.0 - u * u) - sign * u * u
    return -6.0 * sign * u * u + sign - level


def growth(alpha, beta, sign):
    """Growth rates (n) of the unstable precessions with these momenta, signs of k (n), and bounds; NaN: there is none.

    For k < 0 those are upright rotations, alpha = +-beta, and the rate is sqrt(4 - alpha^2).
    """
    u, bar = saddles(alpha, beta)
    u = np.where(sign > 0, u, np.nan)
    upright = (sign < 0) & (abs(alpha) == abs(beta)) & (abs(alpha) < 2.0)
    square = np.where(upright, (2.0 - alpha) * (2.0 + alpha), _square(u, alpha, beta, 1.0))
    # to first order the energy of the saddle does not depend on its place
    off = np.where(upright, 0.0, 12.0 * (abs(u) + bar) * bar) + 32.0 * EPS * (1.0 + alpha**2 + beta**2)
    with np.errstate(invalid="ignore"):
        clear = square > 2.0 * off
        value = np.where(clear, np.sqrt(square), np.nan)
        return value, np.where(clear, value - np.sqrt(square - off) + 4.0 * EPS * value, np.nan)


@dataclass(frozen=True)
class Loop:
    """The motion from the saddle u0 and back, the loop of the greater excursion; alpha and beta differ in size.

    Where alpha = +-beta it would pass a pole.
    """

    u0: float
    bar: float
    alpha: float
    beta: float
    drift: float

    @cached_property
    def kappa(self):
        """rate^2."""
        return _square(self.u0, self.alpha, self.beta, 1.0)

    @property
    def rate(self):
        """The rate at which the saddle is left, its growth rate."""
        return float(np.sqrt(self.kappa))

    @cached_property
    def _root(self):
        return np.sqrt(4.0 * self.u0**2 + self.kappa)

    @cached_property
    def side(self):
        """sigma of the loop: the one whose end is farther from u0."""
        return 1.0 if self.u0 <= 0.0 else -1.0

    def motion(self, t):
        """{name: values, name_error: bars} of u, psi, phi at times t (m)."""
        x = np.minimum(abs(t) * self.rate, 700.0)
        D = 2.0 * self.u0 + self.side * self._root * np.cosh(x)
        u = self.u0 + self.kappa / D
        minus, plus = (self._integral(end, t) for end in (1.0, -1.0))
        # psi' = ((b - a) / (1 - u) + (b + a) / (1 + u)) / 2
        one, two = 0.5 * (self.beta - self.alpha) * minus, -0.5 * (self.beta + self.alpha) * plus
        psi, phi = one + two, two - one + self.drift * t
        loss = (self.bar + 64.0 * EPS) / self.kappa  # of the rate and the place of the saddle
        off = loss * (1.0 + abs(t) * self.rate)
        turned = abs(one) + abs(two) + abs(self.drift * t)
        size = off * (abs(self.beta) + abs(self.alpha)) * (1.0 + abs(t)) / (1.0 - abs(u).max()) ** 2
        out = {"u": (u, off * (1.0 + 0.0 * t)), "psi": (psi, size + 64 * EPS * turned)}
        out["phi"] = phi, size + 64 * EPS * turned
        return {
            key: part for name, pair in out.items() for key, part in zip((name, f"{name}_error"), pair, strict=True)
        }

    def _integral(self, end, t):
        """The integral of 1 / (end - u) from 0 to t."""
        away, kappa = end - self.u0, self.kappa
        p, q = 2.0 * self.u0 * away - kappa, self.side * self._root * away
        # integral of dx / (p + q cosh x) from 0 to x, |q| > |p| as the loop does not reach the pole
        y = np.tanh(0.5 * t * self.rate)
        wide = np.sqrt((q - p) * (q + p))
        return t / away + kappa / away * (2.0 / wide) * np.arctan((q - p) / wide * y) / self.rate
