"""Planar motions near L4 in the linear equations, circular or elliptic, and the multipliers of a
trace and b.

xi'' - 2 eta' = d1 r xi,   eta'' + 2 xi' = d2 r eta,   r = 1 / (1 + e cos f)
"""

from math import ceil, log2, pi

import numpy as np

from survey.measures import linear_motion
from survey.measures.libration import danby

STEPS, MOST = 240, 60  # steps of half a turn; turns
GROWTH = 5.0


def orbit(mu, e, time):
    """f, xi and eta, from rest in xi = 1, up to f = `time`, with their bounds, as `Trajectory.data`
    holds them.
    """
    matrices, lengths = coefficients(mu, e)
    turns = int(np.clip(ceil(time / (2 * pi) - 1e-9), 1, MOST))
    f, y, bars = linear_motion.fundamental(matrices, lengths, turns)
    kept = f <= time * (1 + 1e-12)
    data = {"f": ("f", f[kept], {"long_name": "true anomaly", "symbol": "f", "units": "rad"})}
    for i, name in enumerate(("xi", "eta")):
        words = f"displacement along the {('first', 'second')[i]} principal axis of the potential"
        data |= linear_motion.value("f", name, rf"\{name}", words, y[kept, i, 0], bars[kept, i, 0])
    return data


def coefficients(mu, e):
    """A of Y' = A Y, Y = (xi, eta, xi', eta'), at the nodes of the steps of a turn (steps, 9, 4,
    4); their lengths.
    """
    d1, d2 = (float(rate[0]) for rate in danby.rates(np.array([mu])))
    height, lengths = _mesh(STEPS, round(0.25 * log2((1.0 + e) / (1.0 - e))))
    r = 1.0 / ((1.0 - e) + e * height)
    r, lengths = (
        np.concatenate([r, linear_motion.mirrored(r)]),
        np.concatenate([lengths, lengths[::-1]]),
    )
    matrices = np.zeros((*r.shape, 4, 4))
    matrices[..., 0, 2] = matrices[..., 1, 3] = 1.0
    matrices[..., 2, 0], matrices[..., 3, 1] = d1 * r, d2 * r
    matrices[..., 2, 3], matrices[..., 3, 2] = 2.0, -2.0
    return matrices, lengths


def _mesh(steps, grade):
    """1 + cos f at the nodes of each step of half a turn (steps, nodes), and the steps' lengths (steps).

    They are even in psi, tan((pi - f) / 2) = 2^-grade tan(psi / 2): between true (0) and eccentric
    anomaly, as r is singular at pi +- i arccosh(1 / e), where steps crowd.
    """
    psi = np.pi * np.arange(steps, -1, -1) / steps
    y = 2.0 * np.arctan(2.0**-grade * np.tan(0.5 * psi))
    y[0] = np.pi
    h = y[:-1] - y[1:]
    return 2.0 * np.sin(0.5 * (y[:-1, None] - h[:, None] * np.array(linear_motion.NODES))) ** 2, h


def multipliers(a, a_bar, b, b_bar):
    """The four zeros of l^4 - a l^3 + b l^2 - a l + 1 and their error bounds: l + 1/l = w, w^2 - a
    w + b - 2 = 0.
    """
    x, d = 0.25 * complex(a) ** 2 - (b - 2.0), 0.5 * abs(a) * a_bar + 0.25 * a_bar**2 + b_bar
    root = np.sqrt(x)
    bar = 0.5 * a_bar + min(np.sqrt(d), d / abs(root) if root else np.inf)
    pairs = [linear_motion.of_trace(0.5 * a + sign * root, bar) for sign in (1, -1)]
    return (np.concatenate(parts) for parts in zip(*pairs, strict=True))
