"""Positions of permanent rest of a whole body: w = 0, (C nu - s) x nu = 0, |nu| = 1.

These are the stationary points of nu.C nu/2 - s.nu on the sphere: nu_i = s_i / (c_i - mu) in the axes of C, where
sum s_i^2 / (c_i - mu)^2 = 1: convex between its poles, so that two roots, one double root or none lie between two
of them, and one beyond each end; and where s_i = 0 also mu = c_i with nu_i from |nu| = 1. From 2 to 6, or a curve.

Source: W. Gander, G. H. Golub, U. von Matt, Linear Algebra Appl. 114/115 (1989) 815.
"""

import math
from itertools import pairwise

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF
from survey.measures.body.system import ROUNDING

MOST = 6


def find(system):
    """(positions nu (n, 3), their bars (n)); None where they fill a curve, or rounding leaves their
    number open.
    """
    c, axes = np.linalg.eigh(system.C)
    s = axes.T @ system.s
    size = np.abs(c).max() + np.abs(s).max()
    if size == 0.0:
        return None
    tiny = ROUNDING * size
    axes, s = _merged(c, axes, s, tiny)
    s = np.where(np.abs(s) <= tiny, 0.0, s)
    equal = np.abs(np.subtract.outer(c, c)) <= tiny
    found = [_position(c, s, mu) for mu in _levels(c, s, tiny)]
    if any(one is None for one in found):
        return None
    for i in np.flatnonzero(s == 0.0):
        others = (np.arange(3) != i) & (s != 0.0)
        if (equal[i] & (np.arange(3) != i)).any():
            twin = np.flatnonzero(equal[i] & (np.arange(3) != i))
            if (s[twin] != 0.0).any():
                continue  # the pole of its twin: no solution there
            nu = np.where(others & ~equal[i], s / np.where(equal[i], 1.0, c - c[i]), 0.0)
            if nu @ nu < 1.0 + 1e-12:
                return None  # a circle of them
            continue
        nu = np.where(others, s / np.where(others, c - c[i], 1.0), 0.0)
        rest = 1.0 - nu @ nu
        if abs(rest) <= 1e-12:
            return None
        if rest > 0.0:
            for sign in (1.0, -1.0):
                found.append(nu + sign * math.sqrt(rest) * np.eye(3)[i])
    rows = [_polished(system, axes @ nu) for nu in found]
    if not rows or len(rows) > MOST or any(bar > 1e-6 for _nu, bar in rows):
        return None
    rows.sort(key=lambda row: tuple(np.round(row[0], 9)))
    return np.array([nu for nu, _bar in rows]), np.array([bar for _nu, bar in rows])


def _merged(c, axes, s, tiny):
    """Axes of C in which s has at most one component in each eigenspace."""
    axes, s, i = axes.copy(), s.copy(), 0
    while i < 3:
        j = i + 1
        while j < 3 and c[j] - c[i] <= tiny:
            j += 1
        if j - i > 1 and np.abs(s[i:j]).max() > tiny:
            basis = np.linalg.qr(np.column_stack([s[i:j], np.eye(j - i)]))[0][:, : j - i]
            axes[:, i:j] = axes[:, i:j] @ basis
            s[i:j] = basis.T @ s[i:j]
            s[i + 1 : j] = 0.0
        i = j
    return axes, s


def _levels(c, s, tiny):
    """The roots mu; None among them for a double root within rounding."""
    poles = c[s != 0.0]
    weights = s[s != 0.0]
    if not poles.size:
        return
    length = math.sqrt(weights @ weights)

    def value(mu):
        return float(np.sum((weights / (poles - mu)) ** 2)) - 1.0

    def slope(mu):
        return float(np.sum(weights**2 / (poles - mu) ** 3))

    yield _bisected(value, poles[0] - 1.01 * length - tiny, poles[0], rising=True)
    yield _bisected(value, poles[-1], poles[-1] + 1.01 * length + tiny, rising=False)
    for low, high in pairwise(poles):
        if high - low <= tiny:
            continue
        least = _bisected(slope, low, high, rising=True)
        if abs(value(least)) < 1e-11:
            yield None
        elif value(least) < 0.0:
            yield _bisected(value, low, least, rising=False)
            yield _bisected(value, least, high, rising=True)


def _bisected(function, low, high, rising):
    """Where a monotone function changes sign; it is not evaluated at the ends, which may be poles."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if (function(middle) > 0.0) == rising:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def _position(c, s, mu):
    """nu at a root, in the axes of C."""
    return None if mu is None else np.where(s != 0.0, s / np.where(s != 0.0, c - mu, 1.0), 0.0)


def _polished(system, nu):
    """nu after Newton's steps on the sphere, and its bar."""
    size = np.abs(system.C).max() + np.abs(system.s).max()
    nu, bar = nu / math.sqrt(nu @ nu), math.inf
    for _ in range(4):
        force = system.C @ nu - system.s
        tangent = np.linalg.svd(nu[None, :])[2][1:].T
        hessian = tangent.T @ (system.C - (nu @ force) * np.eye(3)) @ tangent
        try:
            inverse = np.linalg.inv(hessian)
        except np.linalg.LinAlgError:
            return nu, math.inf
        step = -tangent @ (inverse @ (tangent.T @ force))
        nu = nu + step
        nu = nu / math.sqrt(nu @ nu)
        bar = 4.0 * np.linalg.norm(inverse, 2) * ROUNDOFF * 12.0 * size + 4.0 * ROUNDOFF
    return nu, bar + 2.0 * float(np.abs(step).max())
