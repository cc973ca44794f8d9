"""The chart of satellites with three unequal moments: the spectral radius of librations out of
plane.

Peers integrate the libration x and the four columns of the canonical equations over a period, in u.
"""

import json
from functools import cache
from importlib import resources

import numpy as np
from scipy.special import ellipk

from survey.precision.peers import PeerSystem

ERROR = "spectral_radius"
MOST = {"taylor16": 2_000, "dop853": 300, "rk4": 30}  # points that a slow method is timed on
_NAMES = ("roll_ratio", "yaw_ratio", "amplitude")
_ON_CIRCLE = 1e-9


@cache
def references(_work=None):
    """Eight librations, the same for every work (error below 1e-25)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("satellite_triaxial.json")
        .read_text(encoding="utf-8")
    )
    return [
        (
            {name: float.fromhex(text) for name, text in row["hex"].items()},
            {},
            {ERROR: float(row[ERROR])},
            row["stable"],
        )
        for row in data["points"]
    ]


def works():
    """A line and a map of one roll ratio, and points that share nothing."""
    random = np.random.default_rng(1)
    columns = (
        random.uniform(0.1, 0.9, 5_000),
        random.uniform(-0.6, 0.05, 5_000),
        random.uniform(0.05, 1.2, 5_000),
    )
    scattered = dict(zip(_NAMES, columns, strict=True))
    return {
        "line": (_map(np.array([-0.3]), 10_000), {}),
        "map 400x600": (_map(np.linspace(-0.6, 0.6, 400), 600), {}),
        "scattered": (scattered, {}),
    }


def _map(yaw, number):
    return {
        "roll_ratio": np.full((1, 1), 0.8),
        "yaw_ratio": yaw[:, None],
        "amplitude": np.linspace(0.05, 1.2, number)[None, :],
    }


def system(point, options):
    """A period of a libration and of the four columns."""
    roll, yaw, amplitude = (
        np.ravel(v) for v in np.broadcast_arrays(*(point[name] for name in _NAMES))
    )
    rest, k = 1.0 - roll * yaw, np.sin(amplitude)
    a, b, off = (1.0 - roll) / rest, (1.0 - yaw) / rest, (roll - yaw) / rest
    columns = np.tile(np.eye(4).ravel(), (k.size, 1))
    span = 4.0 * ellipk(k * k)
    return PeerSystem(
        slope=_slope,
        start=np.column_stack([0.0 * k, k, columns]),
        parameters=np.column_stack([
            1.0 / np.sqrt(3.0 * off), 1.0 / a, 1.0 / b, (1.0 - b) / off, (1.0 - a) / off, (1.0 - 0.5 * (a + b)) / off,
        ]),
        span=span,
        steps=span,
    )  # fmt: skip


def _slope(state, p, sin, cos):
    """x, dx/du, then the columns (e1, e2, P1, P2) one after the other."""
    s, c, q = sin(state[0]), cos(state[0]), p[0] + state[1]
    both, square = s * c, q * q
    one, two = (1.0 - 0.5 * p[1]) * q, (1.0 - 0.5 * p[2]) * q
    m1 = 0.25 * p[2] * square + p[3] * (s * s)
    m2 = 0.25 * p[1] * square + p[4] * (c * c)
    m3 = p[5] * both

    def column(e1, e2, p1, p2):
        return (
            p[1] * p1 + one * e2,
            p[2] * p2 - two * e1,
            two * p2 - m1 * e1 - m3 * e2,
            -1.0 * (one * p1) - m2 * e2 - m3 * e1,
        )

    return (
        state[1], -1.0 * both,
        *column(state[2], state[3], state[4], state[5]), *column(state[6], state[7], state[8], state[9]),
        *column(state[10], state[11], state[12], state[13]), *column(state[14], state[15], state[16], state[17]),
    )  # fmt: skip


def outcome(ends):
    """The spectral radius and, as a user of an integrator would have it, the verdict."""
    radius = abs(np.linalg.eigvals(np.swapaxes(ends[:, 2:].reshape(-1, 4, 4), 1, 2))).max(axis=1)
    return {ERROR: radius, "verdict": (radius < 1.0 + _ON_CIRCLE).astype(int)}
