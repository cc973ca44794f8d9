"""The rotation of a rigid satellite on a circular orbit in three dimensions, by quaternions: no
linearisation.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipk

STEP = 1e-30  # of complex derivatives


def monodromies(A, B, C, k, direction, rtol=1e-12):
    """M (N, 4, 4) in e1, e2, P1, P2 of N planar motions (arrays): derivatives of the body's motion
    over a period.

    All points and the four directions are integrated at once, over the period as unit of time, from
    complex starts.
    """
    A, B, C, k, direction = np.broadcast_arrays(A, B, C, k, direction)
    rate = np.sqrt(3 * (B - A) / C)
    turns = k > 1
    with np.errstate(all="ignore"):
        period = np.where(turns, 2 * ellipk(1 / k**2) / k, 4 * ellipk(np.minimum(k, 1) ** 2)) / rate
    a, b = A / C, B / C
    q = 1 / rate + np.where(turns, direction, 1) * k  # at the vertical
    start = np.zeros((7, 4, len(k)), complex)
    e, P = 1j * STEP * np.eye(4)[:2, :, None], 1j * STEP * np.eye(4)[2:, :, None]
    start[0] = rate * (P[0] - 0.5 * q * e[1]) / a
    start[1] = rate * (P[1] + 0.5 * q * e[0]) / b
    start[2] = rate * q
    # n = (-e2, e1, 1) in the body: the turn by -e of the inertial axes
    start[3], start[4], start[5] = 1.0, 0.5 * e[0], 0.5 * e[1]
    moments = A, B, C

    def slopes(s, y):
        w, Q = y.reshape(7, 4, -1)[:3], y.reshape(7, 4, -1)[3:]
        t = s * period
        r = turned(Q, (np.cos(t), np.sin(t), 0.0))
        own = [
            ((moments[j] - moments[i]) * (w[i] * w[j] - 3.0 * r[i] * r[j])) / moments[m]
            for m, (j, i) in enumerate(((1, 2), (2, 0), (0, 1)))
        ]
        return np.concatenate([np.stack([*own]), multiplied(Q, w) / 2]).reshape(-1) * np.tile(
            period, 28
        )

    end = solve_ivp(
        slopes, (0.0, 1.0), start.reshape(-1), method="DOP853", rtol=rtol, atol=1e-14
    ).y[:, -1]
    w, Q = end.reshape(7, 4, -1)[:3], end.reshape(7, 4, -1)[3:]
    n = turned(Q, (0.0, 0.0, 1.0))
    e = np.stack([n[1].imag, -n[0].imag]) / STEP
    w = w.imag / STEP / rate
    P = np.stack([a * w[0] + 0.5 * q * e[1], b * w[1] - 0.5 * q * e[0]])
    return np.concatenate([e, P]).transpose(2, 0, 1)


def turned(Q, v):
    """The inertial vector v in the body's axes, Q* v Q, for quaternions Q (4, ...) of length 1."""
    s, x, y, z = Q
    return (
        (s * s + x * x - y * y - z * z) * v[0]
        + 2 * (x * y + s * z) * v[1]
        + 2 * (x * z - s * y) * v[2],
        2 * (x * y - s * z) * v[0]
        + (s * s - x * x + y * y - z * z) * v[1]
        + 2 * (y * z + s * x) * v[2],
        2 * (x * z + s * y) * v[0]
        + 2 * (y * z - s * x) * v[1]
        + (s * s - x * x - y * y + z * z) * v[2],
    )


def multiplied(Q, w):
    """Q times the pure quaternion w."""
    s, x, y, z = Q
    return np.stack([
        -x * w[0] - y * w[1] - z * w[2],
        s * w[0] + y * w[2] - z * w[1],
        s * w[1] + z * w[0] - x * w[2],
        s * w[2] + x * w[1] - y * w[0],
    ])  # fmt: skip
