"""Brun's chart over time: u at 100 times of each motion; errors by mpmath's Taylor series, 25 digits."""

from functools import cache

import numpy as np
from mpmath import mp

from survey.precision.peers import PeerSystem

SCENE = "brun"
ERROR = "u"
LAST, NUMBER, TIMES = 10.0, 400, 100
MOST = {"chebyshev": 400, "agm": 40_000}
_NAMES = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")


def _states(number, seed):
    random = np.random.default_rng(seed)
    values = (
        random.uniform(1.0, 3.0, number), random.uniform(0.3, 1.7, number), random.uniform(-1.0, 1.0, number),
        random.uniform(0.5, 2.5, number), random.uniform(0.2, 1.0, number), random.uniform(0.6, 2.0, number),
        random.uniform(-0.5, 0.5, number),
    )  # fmt: skip
    return dict(zip(_NAMES, values, strict=True))


@cache
def references(_work=None):
    """u at the last time: u'' = P'(u) / (2 A^2), (S2)."""
    found = []
    states = _states(6, 5)
    for i in range(6):
        point = {name: float(values[i]) for name, values in states.items()}
        with mp.workdps(30):
            A, C, epsilon, theta, p, b, a = (mp.mpf(point[name]) for name in _NAMES)
            sin, u0 = mp.sin(theta), mp.cos(theta)
            k = epsilon * A * (A - C)
            L = p**2 + ((b - a * u0) / sin) ** 2 - k * u0 * u0 + a * a

            def slope(_t, y, A=A, k=k, L=L, a=a, b=b):
                bend = -4 * k * y[0] ** 3 + 2 * (k - L) * y[0] + 2 * a * b
                return [y[1], bend / (2 * A * A)]

            end = mp.odefun(slope, 0, [u0, -sin * p / A], tol=mp.mpf(10) ** -25)(mp.mpf(LAST))
        found.append((point | {"t": LAST}, {}, {ERROR: float(end[0])}, None))
    return found


@cache
def works():
    """Motions that share nothing, at the same times each; and one time each."""
    states = _states(NUMBER, 1)
    rows = {name: values[:, None] for name, values in states.items()}
    grid = rows | {"t": np.linspace(0.0, LAST, TIMES)[None, :]}
    return {f"{TIMES} times": (grid, {}), "one time": (states | {"t": np.full(NUMBER, LAST)}, {})}


def system(point, options):
    """u, u' and nothing else: a quartic's motion."""
    shape = np.broadcast_shapes(*(np.shape(values) for values in point.values()))
    values = {name: np.ravel(np.broadcast_to(v, shape)) for name, v in point.items()}
    A = values["A"]
    sin = np.sin(values["theta0"])
    u0 = np.cos(values["theta0"])
    k = values["epsilon"] * A * (A - values["C"])
    a, b, p = values["p_phi"], values["p_psi"], values["p_theta0"]
    L = p**2 + ((b - a * u0) / sin) ** 2 - k * u0 * u0 + a * a
    rates = np.column_stack([-2.0 * k, k - L, a * b]) / (A * A)[:, None]
    return PeerSystem(
        _slope,
        np.column_stack([u0, -sin * p / A]),
        rates,
        values["t"],
        values["t"] * (1.0 + abs(L)),
    )


def _slope(state, parameters, _sin, _cos):
    u = state[0]
    return state[1], u * (parameters[0] * (u * u) + parameters[1]) + parameters[2]


def outcome(ends):
    """u at the end of each span."""
    return {ERROR: ends[:, 0]}
