"""The chart of Danby's map: a row, a map and scattered points up to e = 0.7; errors of b by
30-digit references.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.measures.libration import danby
from survey.precision.peers import PeerSystem

ERROR = "b"
LARGEST = 0.7  # of e
MOST = {"dop853": 200, "rk4": 300}


@cache
def references(_work=None):
    """The reference points in the range of the works, the same for every work (error below 1e-31)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("libration_elliptic.json")
        .read_text(encoding="utf-8")
    )
    return [
        ({"mu": row["mu"], "e": row["e"]}, {}, {ERROR: float(row["b"])}, row["stable"])
        for row in data["points"]
        if row["e"] <= LARGEST
    ]


def works():
    """A row, a map, and points that share nothing."""
    random = np.random.default_rng(1)
    scattered = {"mu": random.uniform(0.0, 0.05, 30_000), "e": random.uniform(0.0, LARGEST, 30_000)}
    row, grid = _map(np.array([0.3]), 10_000), _map(np.linspace(0.0, LARGEST, 400), 600)
    return {"row": (row, {}), "map 400x600": (grid, {}), "scattered": (scattered, {})}


def _map(e, number):
    return {"e": e[:, None], "mu": np.linspace(0.0, 0.05, number)[None, :]}


def system(point, options):
    """Half a period, by symmetry, of the four columns in f; cos f and sin f are states too.

    Measured with heyoka: in the eccentric anomaly it takes a fifth longer.
    """
    e, mu = (np.ravel(values) for values in np.broadcast_arrays(point["e"], point["mu"]))
    start = np.concatenate([[1.0, 0.0], np.eye(4).ravel()])
    return PeerSystem(
        slope=_slope,
        start=np.tile(start, (e.size, 1)),
        parameters=np.column_stack([e, *danby.rates(mu)]),
        span=np.full(e.size, np.pi),
        steps=e + mu,
    )


def _slope(state, parameters, _sin, _cos):
    """The columns (x, q, p, m) one after the other; written out, as every peer compiles it by itself."""
    c, s = state[0], state[1]
    x1, q1, p1, m1 = state[2], state[3], state[4], state[5]
    x2, q2, p2, m2 = state[6], state[7], state[8], state[9]
    x3, q3, p3, m3 = state[10], state[11], state[12], state[13]
    x4, q4, p4, m4 = state[14], state[15], state[16], state[17]
    e, d1, d2 = parameters[0], parameters[1], parameters[2]
    r = 1.0 / (1.0 + e * c)
    dx1, dx2, dx3, dx4 = p1 - m1, p2 - m2, p3 - m3, p4 - m4
    dm1, dm2, dm3, dm4 = x1 - q1, x2 - q2, x3 - q3, x4 - q4
    return (
        -1.0 * s, c,
        dx1, -1.0 * dx1 - d2 * (r * m1), d1 * (r * x1) - dm1, dm1,
        dx2, -1.0 * dx2 - d2 * (r * m2), d1 * (r * x2) - dm2, dm2,
        dx3, -1.0 * dx3 - d2 * (r * m3), d1 * (r * x3) - dm3, dm3,
        dx4, -1.0 * dx4 - d2 * (r * m4), d1 * (r * x4) - dm4, dm4,
    )  # fmt: skip


def outcome(ends):
    """b and, as a user of an integrator would have it, the verdict by a and b."""
    columns = ends[:, 2:].reshape(-1, 4, 4)
    first, last = columns[:, :2, :2], columns[:, 2:, 2:]
    t = (first * last).sum(axis=(1, 2))
    product = np.linalg.det(first) * np.linalg.det(last)
    a, b = 4 * t - 4, 6 - 8 * t + 16 * product
    stable = (b + 2 * a + 2 > 0) & (b - 2 * a + 2 > 0) & (a * a - 4 * b + 8 > 0) & (abs(a) < 4)
    return {ERROR: b, "verdict": stable.astype(int)}
