"""Motions on separatrices in closed form: the loops that leave an unstable precession and return.

In units A = k = 1, P = -(u - u0)^2 (u^2 + 2 u0 u + c): with x = rate t, kappa = rate^2,

    u = u0 + kappa / D,   D = 2 u0 + sigma sqrt(4 u0^2 + kappa) cosh x,   sigma = +-1 for the two loops

(k = -1: from the upright rotation u0 = +-1, kappa = -u0 (4 - alpha^2), D = 2 + |alpha| cosh x), and 1 / (e - u) =
1/(e - u0) + kappa / [(e - u0) ((e - u0) D - kappa)], e = +-1, has an elementary integral. A loop is at its end,
farthest from u0, at t = 0; psi and phi are 0 there.

Source: derived in `scenes/brun.md`, from (S2) and (S4).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from survey.kernels.math.roundoff import EPS

SAMPLES = 401  # at which saddles are looked for
BISECTIONS = 60


def saddles(alpha, beta):
    """u0 (n) in (-1/3, 1/3) of the saddles with these momenta (n), k > 0, and error bounds; NaN
    where none is found.

    There is one at most; one nearer to a minimum than the samples are to one another is not seen.
    """
    # cusps bound the region: its momenta are smaller
    known = (abs(alpha) < 2.0) & (abs(beta) < 2.0)
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
    """Growth rates (n) of the unstable precessions with these momenta, signs of k (n), and bounds;
    NaN: there is none.

    For k < 0 those are upright rotations, alpha = +-beta, and the rate is sqrt(4 - alpha^2).
    """
    u, bar = saddles(alpha, beta)
    u = np.where(sign > 0, u, np.nan)
    upright = (sign < 0) & (abs(alpha) == abs(beta)) & (abs(alpha) < 2.0)
    square = np.where(upright, (2.0 - alpha) * (2.0 + alpha), _square(u, alpha, beta, 1.0))
    # to first order the energy of the saddle does not depend on its position
    off = np.where(upright, 0.0, 12.0 * (abs(u) + bar) * bar) + 32.0 * EPS * (
        1.0 + alpha**2 + beta**2
    )
    with np.errstate(invalid="ignore"):
        clear = square > 2.0 * off
        value = np.where(clear, np.sqrt(square), np.nan)
        return value, np.where(clear, value - np.sqrt(square - off) + 4.0 * EPS * value, np.nan)


@dataclass(frozen=True)
class Loop:
    """u = u0 + kappa / D, D = level + swing cosh(rate t), which leaves u0, an unstable precession,
    and returns.

    On a motion that passes a pole, |alpha| = |beta|, psi and phi go without the jumps of pi that they have there.
    """

    u0: float
    bar: float
    kappa: float
    level: float
    swing: float
    alpha: float
    beta: float
    drift: float

    @property
    def rate(self):
        """The rate at which u0 is left."""
        return float(np.sqrt(abs(self.kappa)))

    def motion(self, t):
        """{name: values, name_error: bars} of u, psi, phi at times t (m)."""
        x = np.minimum(abs(t) * self.rate, 700.0)
        away = (
            self.kappa / (self.level + self.swing * np.cosh(x))
            if self.swing
            else self.u0 * (np.tanh(0.5 * t * self.rate) - 1.0)
        )
        u = self.u0 + away
        # psi' = ((b - a) / (1 - u) + (b + a) / (1 + u)) / 2
        half = {1.0: 0.5 * (self.beta - self.alpha), -1.0: 0.5 * (self.beta + self.alpha)}
        parts = {end: end * c * self._integral(end, t) if c else 0.0 * t for end, c in half.items()}
        psi, phi = parts[1.0] + parts[-1.0], parts[-1.0] - parts[1.0] + self.drift * t
        loss = (self.bar + 64.0 * EPS) / abs(self.kappa)  # of the rate and the position of u0
        off = loss * (1.0 + abs(t) * self.rate)
        turned = abs(parts[1.0]) + abs(parts[-1.0]) + abs(self.drift * t)
        steep = sum(2.0 * abs(c) / abs(end - u).min() ** 2 for end, c in half.items() if c)
        size = off * steep * (1.0 + abs(t)) + 64 * EPS * turned
        return {
            "u": u,
            "u_error": off,
            "psi": psi,
            "psi_error": size,
            "phi": phi,
            "phi_error": size,
        }

    def _integral(self, end, t):
        """The integral of 1 / (end - u) from 0 to t."""
        away, kappa = end - self.u0, self.kappa
        p, q = self.level * away - kappa, self.swing * away
        # integral of dx / (p + q cosh x) from 0 to x, |q| > |p| as the loop does not reach the pole
        y = np.tanh(0.5 * t * self.rate)
        wide = np.sqrt((q - p) * (q + p))
        return t / away + kappa / away * (2.0 / wide) * np.arctan((q - p) / wide * y) / self.rate


def loop(alpha, beta, sign, drift):
    """The Loop of these momenta that goes farther, or None: there is none, or none that is seen
    (see `saddles`).

    With k < 0 it leaves an upright rotation; alpha = beta = 0 then is a passage from one to the
    other.
    """
    if sign < 0:
        if abs(alpha) != abs(beta) or abs(alpha) >= 2.0:
            return None
        pole = 1.0 if alpha == beta else -1.0
        return Loop(
            pole,
            0.0,
            -pole * (2.0 - abs(alpha)) * (2.0 + abs(alpha)),
            2.0,
            abs(alpha),
            alpha,
            beta,
            drift,
        )
    saddle, bar = (float(x[0]) for x in saddles(np.array([alpha]), np.array([beta])))
    kappa = _square(saddle, alpha, beta, 1.0)
    if not kappa > 0.0:
        return None
    side = 1.0 if saddle <= 0.0 else -1.0  # of the loop whose end is farther from u0
    return Loop(
        saddle,
        bar,
        kappa,
        2.0 * saddle,
        side * np.sqrt(4.0 * saddle**2 + kappa),
        alpha,
        beta,
        drift,
    )
