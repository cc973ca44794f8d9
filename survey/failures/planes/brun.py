"""Brun's problem: separatrices, poles, regular precessions, tiny fields."""

import numpy as np

from survey.failures.plane import Plane, few, logarithmic, plain, two_sided
from survey.truth import brun

ABOUT = """Beside a separatrix the period grows as a logarithm of the distance, and the effect on it of rounding in the
integrals as its inverse; where the axis passes close to a pole, precession and spin turn by half a turn in no time;
beside a regular precession two roots merge; in a tiny field every result is a small difference. `auto` takes
arithmetic-geometric means, and double-double where rtol is missed or a verdict is open."""
SOURCE = "Truth: trapezoidal sums in double-double; beside separatrices elliptic integrals to 120 digits."


def planes(share):
    return [_separatrix(share), _pole(share), _precession(share), _states(share), _field(share)]


def _at_double_root(u, y, sign):
    """(l, alpha, beta) where P has a double root at u, with y = the rate of precession there."""
    alpha, beta = u * (y - sign / y), y - sign * u * u / y
    return y * y * (1 - u * u) - sign * u * u + alpha * alpha, alpha, beta


def _separatrix(share):
    x, away = two_sided("distance $l - l_s$", np.linspace(-15.0, -1.0, few(share, 12)))
    u = np.linspace(-0.32, 0.32, few(share, 13))
    y = np.sqrt(0.5 * (1 - 3 * u * u) + 0.3 * 0.5 * np.sqrt((1 - u * u) * (1 - 9 * u * u)))
    level, alpha, beta = (values[:, None] for values in _at_double_root(u, y, 1))
    return _scaled(
        "beside the separatrix",
        x,
        plain("$u$ of the saddle", u),
        1,
        level + away[None],
        alpha,
        beta,
    )


def _pole(share):
    x, away = two_sided(r"$\beta / \alpha - 1$", np.linspace(-15.0, -1.0, few(share, 12)))
    alpha = np.linspace(-3.0, 8.0, few(share, 14))
    size = 10.0 ** alpha[:, None]
    beta = size * (1 + away[None])
    level = np.maximum(size, beta) ** 2 * 1.5 + 1.0
    return _scaled(
        "passing a pole closely", x, logarithmic(r"$\alpha$", alpha), -1, level, size, beta
    )


def _precession(share):
    away, u = np.linspace(-15.0, -0.5, few(share, 22)), np.linspace(-0.97, 0.97, few(share, 14))
    level, alpha, beta = (values[:, None] for values in _at_double_root(u, 1.3 + 0.0 * u, -1))
    axes = logarithmic("$l$ above its least value", away), plain("$u$ of the regular precession", u)
    return _scaled("beside regular precessions", *axes, -1, level + 10.0 ** away[None], alpha, beta)


def _scaled(title, x, y, sign, level, alpha, beta):
    given = {"l": level, "alpha": alpha, "beta": beta, "ratio": 0.7}
    return Plane(title, x, y, "brun", given, brun.integrals(sign), SOURCE, {"sign": str(sign)})


def _states(share):
    theta, near = np.linspace(-12.0, 0.4, few(share, 20)), np.linspace(-16.0, 0.3, few(share, 14))
    given = {
        "A": 1.3,
        "C": 0.8,
        "epsilon": 0.4,
        "theta0": 10.0 ** theta[None],
        "p_theta0": 0.3,
        "p_phi": 0.9,
    }
    given["p_psi"] = 0.9 * (1 + 10.0 ** near[:, None])
    axes = logarithmic(r"$\theta_0$", theta), logarithmic(r"$p_\psi / p_\varphi - 1$", near)
    return Plane("states beside the pole", *axes, "brun", given, brun.states, SOURCE)


def _field(share):
    y, field = two_sided(r"$\epsilon$", np.linspace(-24.0, 1.0, few(share, 8)))
    spin = np.linspace(-2.0, 8.0, few(share, 20))
    given = {
        "A": 1.3,
        "C": 0.8,
        "epsilon": field[:, None],
        "theta0": 1.1,
        "p_theta0": 0.5,
        "p_psi": 1.3,
    }
    given["p_phi"] = 10.0 ** spin[None]
    axes = logarithmic(r"spin $p_\varphi$", spin), y
    return Plane("tiny fields, fast spin", *axes, "brun", given, brun.states, SOURCE)
