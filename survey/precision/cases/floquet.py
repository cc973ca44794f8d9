"""The chart of a system of one's own: two coupled, damped Mathieu oscillators; errors of the
spectral radius.

    x'' + C x' + (K + e Q cos W t) x = 0,  C = diag(0.02, 0.05), K = diag(1.69, 0.49), Q = (1, 0.7; 0.7, 0.5)

Peers integrate the four columns of the variational equations over a period, with cos W t and sin W
t as states.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.precision.peers import PeerSystem
from survey.request.user_scene import floquet

ERROR = "spectral_radius"
MOST = {"taylor16": 4_000, "dop853": 500}  # points that a slow method is timed on


def _stiffness(t, p, out):
    wave = p[1] * np.cos(p[0] * t)
    out[0, 0], out[1, 1] = 1.69 + wave, 0.49 + 0.5 * wave
    out[0, 1] = out[1, 0] = 0.7 * wave


def _damping(t, p, out):
    out[0, 0], out[1, 1] = 0.02, 0.05


def _period(p):
    return 2.0 * np.pi / p[0]


SCENE = floquet(K=_stiffness, C=_damping, period=_period, parameters=("W", "e"), states=("x", "y"))


@cache
def references(_work=None):
    """The reference points, the same for every work (error below 1e-28)."""
    data = json.loads(
        resources.files("survey.reference").joinpath("floquet_map.json").read_text(encoding="utf-8")
    )
    return [
        ({"W": row["W"], "e": row["e"]}, {}, {ERROR: float(row["spectral_radius"])}, row["stable"])
        for row in data["points"]
    ]


def works():
    """A line, a map, and points that share nothing."""
    random = np.random.default_rng(1)
    scattered = {"W": random.uniform(1.0, 2.6, 20_000), "e": random.uniform(0.0, 0.6, 20_000)}
    line, grid = _map(np.array([0.3]), 10_000), _map(np.linspace(0.0, 0.6, 400), 600)
    return {"line": (line, {}), "map 400x600": (grid, {}), "scattered": (scattered, {})}


def _map(e, number):
    return {"e": e[:, None], "W": np.linspace(1.0, 2.6, number)[None, :]}


def system(point, options):
    """A period of the four columns."""
    W, e = (np.ravel(values) for values in np.broadcast_arrays(point["W"], point["e"]))
    start = np.concatenate([[1.0, 0.0], np.eye(4).ravel()])
    return PeerSystem(
        slope=_slope,
        start=np.tile(start, (e.size, 1)),
        parameters=np.column_stack([W, e]),
        span=2.0 * np.pi / W,
        steps=1.0 / W,
    )


def _slope(state, parameters, _sin, _cos):
    """The columns (x, y, x', y') one after the other."""
    c, s = state[0], state[1]
    W, e = parameters[0], parameters[1]
    wave = e * c
    k1, k2, k3 = 1.69 + wave, 0.49 + 0.5 * wave, 0.7 * wave
    x0, y0, u0, v0, x1, y1, u1, v1 = (
        state[2],
        state[3],
        state[4],
        state[5],
        state[6],
        state[7],
        state[8],
        state[9],
    )
    x2, y2, u2, v2, x3, y3, u3, v3 = (
        state[10], state[11], state[12], state[13], state[14], state[15], state[16], state[17],
    )  # fmt: skip
    return (
        -1.0 * (W * s), W * c,
        u0, v0, -1.0 * (k1 * x0 + k3 * y0) - 0.02 * u0, -1.0 * (k3 * x0 + k2 * y0) - 0.05 * v0,
        u1, v1, -1.0 * (k1 * x1 + k3 * y1) - 0.02 * u1, -1.0 * (k3 * x1 + k2 * y1) - 0.05 * v1,
        u2, v2, -1.0 * (k1 * x2 + k3 * y2) - 0.02 * u2, -1.0 * (k3 * x2 + k2 * y2) - 0.05 * v2,
        u3, v3, -1.0 * (k1 * x3 + k3 * y3) - 0.02 * u3, -1.0 * (k3 * x3 + k2 * y3) - 0.05 * v3,
    )  # fmt: skip


def outcome(ends):
    """The spectral radius and, as a user of an integrator would have it, the verdict."""
    columns = np.swapaxes(ends[:, 2:].reshape(-1, 4, 4), 1, 2)
    radius = abs(np.linalg.eigvals(columns)).max(axis=1)
    return {ERROR: radius, "verdict": (radius < 1.0).astype(int)}
