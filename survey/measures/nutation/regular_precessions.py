"""The regular precessions of nutations as a surface over l, alpha, beta, and where one of these is
a number, as curves.

Scaled, s = sgn k, y = A psi', z = A phi' (reduced), both in units of sqrt|k|: double roots u, |u| <= 1, of P (S2) are

    alpha = z (1 - s y^2),  beta = y (1 - s z^2),  l = y^2 + z^2 - 3 s y^2 z^2,  u = -s y z                  (S18)

A cut of it consists of parts that one parameter runs through, each without cancellation
(S19)-(S21), so that errors are those of a few roundings. Equation numbers: `scenes/brun.md`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation.wells import TINY


@dataclass
class Part:
    """A curve (y, z) = at(t), low <= t <= high; `at` gives their relative errors, too."""

    at: Callable
    low: float
    high: float


def surface(y, z, ry, rz, s):
    """(S18): {name: (value, error bound)} of AXES and ALONG at y, z with relative errors `ry`, `rz`."""
    yy, zz, both = y * y, z * z, ry + rz + 3.0 * ROUNDOFF
    u = np.clip(-s * y * z, -1.0, 1.0)
    return {
        "l": (
            yy + zz - 3.0 * s * yy * zz,
            2.0 * (yy * (ry + 2.0 * ROUNDOFF) + zz * (rz + 2.0 * ROUNDOFF) + 3.0 * yy * zz * both),
        ),
        "alpha": (
            z * (1.0 - s * yy),
            abs(z) * ((rz + 4.0 * ROUNDOFF) * (1.0 + yy) + 2.0 * yy * ry),
        ),
        "beta": (y * (1.0 - s * zz), abs(y) * ((ry + 4.0 * ROUNDOFF) * (1.0 + zz) + 2.0 * zz * rz)),
        "u": (u, abs(u) * (ry + rz + ROUNDOFF)),
        "precession_rate": (y, abs(y) * ry),
        "reduced_spin_rate": (z, abs(z) * rz),
        "nutation_square": (
            yy + zz - s * (1.0 - 3.0 * yy * zz),
            2.0
            * (
                yy * (ry + 2.0 * ROUNDOFF)
                + zz * (rz + 2.0 * ROUNDOFF)
                + 3.0 * yy * zz * both
                + ROUNDOFF
            ),
        ),
    }


def parts(third, value, s, most):
    """The Parts of the surface where the parameter `third` has this value; |y| and |z| up to about
    `most` at least.
    """
    if third == "l":
        return _of_energy(value, s)
    own = _of_momentum(value, s, 1.0 + most)
    return own if third == "alpha" else [_swapped(part) for part in own]


def _of_momentum(a, s, most):
    """alpha = a (S19), (S20)."""
    if s < 0.0:
        low, high = _ranges(a)
        inner = [(-low, low)] if low < high else []
        ranges = [*inner, (-most, -high), (high, most)] if low < high else [(-most, most)]
        return [Part(_oblate(a), *np.arcsinh(ends)) for ends in ranges if ends[0] < ends[1]]
    if abs(a) < TINY:
        return [Part(lambda t: (t, 0.0 * t, ROUNDOFF, ROUNDOFF), -most, most)] + [
            Part(lambda t, y=y: (y + 0.0 * t, t, ROUNDOFF, ROUNDOFF), -1.0, 1.0)
            for y in (1.0, -1.0)
        ]
    last, first = np.arcsinh(2.0 / abs(a)), 2.0 * np.arctanh(1.0 / most)
    outer = [Part(_far(a, side), first, last) for side in (1.0, -1.0)] if first < last else []
    return [Part(_between(a), -last, last), *outer]


def _ranges(a):
    """y between which |u| > 1 (s = -1): (y-, y+), equal where there are none."""
    if abs(a) <= 2.0:
        return 1.0, 1.0
    low = 2.0 / (abs(a) + np.sqrt((abs(a) - 2.0) * (abs(a) + 2.0)))
    return low, 1.0 / low


def _oblate(a):
    """y = sinh t, z = a / (1 + y^2)."""

    def at(t):
        y = np.sinh(t)
        return y, a / (1.0 + y * y), 0.0 * y, 3.0 * ROUNDOFF + 0.0 * y

    return at


def _root(a, t):
    """u = (|a|/2) sinh t, and Z = (|a| + sqrt(a^2 + 4 u^2))/2."""
    u = np.clip(0.5 * abs(a) * np.sinh(t), -1.0, 1.0)
    return u, 0.5 * (abs(a) + np.hypot(a, 2.0 * u))


def _between(a):
    """|y| < 1: z = sgn(a) Z, y = -u/z (S19)."""

    def at(t):
        u, root = _root(a, t)
        z = np.copysign(root, a)
        return -u / z, z, 4.0 * ROUNDOFF, 3.0 * ROUNDOFF

    return at


def _far(a, side):
    """|y| > 1: z = -sgn(a) u^2/Z, y = -u/z."""

    def at(t):
        u, root = _root(a, t)
        return (
            np.copysign(1.0, a) * side * root / u,
            -np.copysign(u * (u / root), a),
            4.0 * ROUNDOFF,
            5.0 * ROUNDOFF,
        )

    return at


def _of_energy(l, s):  # noqa: E741
    """l given (S21): the lesser (or, on some parts, the greater) of |y|, |z| as parameter, both
    ways and signs.
    """
    partner = _partner(l, s)
    found = []
    for kind, low, high in _energy_ranges(l, s):
        both_signs = kind == "lesser"
        low, high = (-np.sqrt(high), np.sqrt(high)) if both_signs else (np.sqrt(low), np.sqrt(high))
        for own, other in product((1.0,) if both_signs else (1.0, -1.0), (1.0, -1.0)):
            part = Part(_signed(partner, own, other), low, high)
            found += [part, _swapped(part)]
    return found


def _energy_ranges(l, s):  # noqa: E741
    """(which of |y|, |z| is the parameter, least, greatest square of it)."""
    if s < 0.0:
        if l < 0.0:
            return []
        equal = l / (1.0 + np.sqrt(1.0 + 3.0 * l))
        return [("lesser", 0.0, min(equal, _pole(l - 3.0)) if l > 5.0 else equal)]
    if l < -1.0:
        return []
    square = _one_minus_thrice(l)
    pole, rest = _pole(l + 3.0), np.sqrt(abs(square))
    if square > 0.0:
        inner = [("lesser", 0.0, l / (1.0 + rest))] if l >= 0.0 else []
        return [*inner, ("greater", (1.0 + rest) / 3.0, 1.0 / pole)]
    if rest < 1.0:  # past the corner of the hyperbola
        return [("lesser", 0.0, (1.0 - rest) / 3.0), ("greater", (1.0 + rest) / 3.0, 1.0 / pole)]
    return [("lesser", 0.0, pole)]


def _one_minus_thrice(x):
    """1 - 3 x, exact where terms cancel."""
    return (0.5 - x) + (0.5 - 2.0 * x)


def _pole(half):
    """The lesser root of X^2 - `half` X + 1, where |u| = 1."""
    return 2.0 / (half + np.sqrt(max((half - 2.0) * (half + 2.0), 0.0)))


def _partner(l, s):  # noqa: E741
    """The other of |y|, |z|, exact but for 3 roundings at a point half a rounding from x."""

    def at(x):
        with np.errstate(all="ignore"):
            other = np.sqrt(np.maximum((l - x * x) / _one_minus_thrice(s * x * x), 0.0))
        return np.where(np.isfinite(other), other, 0.0)

    return at


def _signed(partner, own, other):
    def at(t):
        return own * t, other * partner(t), ROUNDOFF, 4.0 * ROUNDOFF

    return at


def _swapped(part):
    """Duality: y and z, alpha and beta exchanged."""

    def at(t):
        z, y, rz, ry = part.at(t)
        return y, z, ry, rz

    return Part(at, part.low, part.high)
