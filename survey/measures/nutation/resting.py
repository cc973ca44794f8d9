"""States that rest on an unstable precession, as far as double-double tells: u, psi and phi at
times, with bars.

Beside a saddle u0, in units A = |k| = 1, x = u - u0 obeys x'' = P'(u) / 2 = rate^2 x - 6 u0 x^2 - 2 x^3 but for
a shift of L that is of second order: while |x| <= REACH rate^2 it is at most (|x| + |x'| / rate) at first times
exp((1 + 4 REACH) rate t), |u0| < 1/3. Beside the upright rotation (k < 0) the same holds of 1 -+ u, of which p_psi =
+-p_phi makes P a multiple. Times at which bars would go beyond that stay without an answer.

Source: derived, from (S2) and (S4) of `scenes/brun.md`.
"""

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures.nutation import separatrix

REACH = 2e-3
_PI_SHORT = 1e-32  # 1 + cos of the float64 next to pi, and more


def at_times(found, those, points, times, drift):
    """`found` (u, psi, phi and bars, each (n, m)) with the answers of the rows `those` (n) of the
    states (n, STATE).

    drift: a (1/C - 1/A).
    """
    rows = np.flatnonzero(those)
    if not rows.size:
        return found
    size_a, size_c, epsilon, theta, p_theta, b, a = points[rows].T
    k = epsilon * size_a * (size_a - size_c)
    size = np.sqrt(np.abs(k))
    with np.errstate(all="ignore"):
        alpha, beta, t = a / size, b / size, times[rows] * (size / size_a)[:, None]
        saddle, first, rate = _saddle(
            alpha, beta, np.cos(theta), np.abs(p_theta) * np.sin(theta) / size
        )
        pole = np.where(theta == 0.0, 1.0, np.where(theta == np.pi, -1.0, 0.0))
        pole = np.where((k < 0.0) & (b == pole * a) & (p_theta == 0.0), pole, 0.0)
        up = pole != 0.0
        saddle, first = (
            np.where(up, pole, np.where(k > 0.0, saddle, np.nan)),
            np.where(up, _first(pole), first),
        )
        rate = np.where(up, np.sqrt(np.maximum(4.0 - alpha**2, 0.0) + 8.0 * EPS), rate)
        grown = np.where(
            first[:, None] > 0.0, np.exp((1.0 + 4.0 * REACH) * rate[:, None] * np.abs(t)), 1.0
        )
        off = np.where(
            first[:, None] * grown <= REACH * rate[:, None] ** 2, first[:, None] * grown, np.nan
        )
        one, two = 0.5 * _part(beta - alpha, 1.0 - saddle), 0.5 * _part(beta + alpha, 1.0 + saddle)
        steep = _part(np.abs(one), np.abs(1.0 - saddle)) + _part(np.abs(two), np.abs(1.0 + saddle))
        turned = 4.0 * steep[:, None] * off * np.minimum(np.abs(t), 1.0 / rate[:, None])
    own = drift[rows][:, None] * times[rows]
    psi, phi = (one + two)[:, None] * t, (two - one)[:, None] * t
    noise = 32.0 * EPS * (np.abs(one) + np.abs(two))[:, None] * np.abs(t) + turned
    answers = {
        "u": (saddle[:, None] + 0.0 * off, off),
        "psi": (psi + 0.0 * off, noise),
        "phi": (phi + own + 0.0 * off, noise + 32.0 * EPS * np.abs(own)),
    }
    for name, pair in answers.items():
        for key, values in zip((name, f"{name}_error"), pair, strict=True):
            found[key][rows] = values
    return found


def _saddle(alpha, beta, u, speed):
    """u0, a bound of what the state (u, |u'|) is off it, in u and u' over the rate, and a bound of
    the rate.
    """
    saddle, bar = separatrix.saddles(alpha, beta)
    rate, width = separatrix.growth(alpha, beta, np.ones_like(alpha))
    first = np.abs(u - saddle) + 4.0 * bar + 2.0 * EPS + 1.01 * speed / rate
    # with the shift of L
    first = np.where(first <= REACH * rate**2, first * (1.0 + 8.0 * first), np.nan)
    return saddle, first, rate + width


def _first(pole):
    return np.where(pole > 0.0, 0.0, _PI_SHORT)


def _part(over, under):
    """over / under, 0 where `over` is 0."""
    return np.where(over == 0.0, 0.0, over / under)


def rotations(states, u, off):
    """sin theta, p_theta and (p_psi - p_phi u) / sin theta, and bars, each (n, m), of `states` (n,
    STATE) that rest at u.

    u and its bar `off`: (n, m), as from `at_times`.
    """
    size_a, size_c, epsilon, _theta, _p_theta, b, a = states.T[:, :, None]
    # no unstable precession leaves faster
    rate = 2.0 * np.sqrt(np.abs(epsilon * size_a * (size_a - size_c)))
    sine = np.sqrt((1.0 - u) * (1.0 + u))
    up = sine == 0.0
    high = np.sqrt(2.0 * off)  # the sine at a pole
    with np.errstate(all="ignore"):
        across = np.where(up, 0.0, (b - a * u) / sine)
        tilt = np.where(up, high, 1.5 * off / sine)
        turned = np.where(up, np.abs(a) * high, (np.abs(a) + np.abs(across)) * 1.5 * off / sine)
        fast = rate * np.where(up, high, 1.5 * off / sine)
        noise = 16.0 * EPS * (np.abs(a) + np.abs(b))
    values = sine, 0.0 * sine, across
    bars = tilt + 4.0 * EPS * sine, fast, turned + np.where(up, 0.0, noise)
    return np.stack([np.stack(values), np.stack(bars)])
