"""The chart of a whole gyrostat: w1 of bodies that share nothing, at t = 10 and at 100 times up to
it.

The motions are those of the six Euler-Poisson equations (1)-(6), off the invariant set too; errors
by references of 25 digits.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.measures.body.system import ENTRIES, NAMES
from survey.precision.peers import PeerSystem

ERROR = "w1"
LAST, NUMBER, TIMES = 10.0, 4_000, 100
MOST = {"rk4": 4, "dop853": 100}  # points that a slow method is timed on
_QUESTION = {"question": "trajectory"}
_KEYS = tuple(ENTRIES)


def _bodies():
    random = np.random.default_rng(1)
    shape, tensors = random.normal(size=(NUMBER, 3, 3)), random.normal(size=(2, NUMBER, len(_KEYS)))
    A = np.eye(3) + 0.2 * shape @ shape.swapaxes(1, 2)
    entries = [[A[:, i, j] for i, j in ENTRIES.values()], *(0.3 * part.T for part in tensors)]
    values = {
        f"{name}{key}": v
        for name, part in zip("ABC", entries, strict=True)
        for key, v in zip(_KEYS, part, strict=True)
    }
    for name, size in (("lambda", 0.5), ("s", 0.5), ("omega", 1.0), ("gamma", 1.0)):
        values |= {f"{name}{i}": v for i, v in enumerate(size * random.normal(size=(3, NUMBER)), 1)}
    return {name: values[name] for name in NAMES}


@cache
def references(_work=None):
    """w1 at the last time, of six bodies (error below 1e-22)."""
    data = json.loads(
        resources.files("survey.reference").joinpath("gyrostat_body.json").read_text()
    )
    found = []
    for row in data["trajectories"]:
        body = {name: float.fromhex(text) for name, text in row["hex"].items()} | {"t": row["t"]}
        found.append((body, _QUESTION, {ERROR: float(row[ERROR])}, None))
    return found


def works():
    """Bodies that share nothing, at the last time; fewer of them at all times."""
    bodies = _bodies()
    rows = {name: values[:100, None] for name, values in bodies.items()}
    dense = rows | {"t": np.linspace(0.0, LAST, TIMES + 1)[None, 1:]}
    return {
        "one time": (bodies | {"t": np.full(NUMBER, LAST)}, _QUESTION),
        f"{TIMES} times": (dense, _QUESTION),
    }


def system(point, options):
    """The six equations, in w and nu, with the inverse of A among the parameters."""
    *columns, span = np.broadcast_arrays(*(point[name] for name in (*NAMES, "t")))
    values = {name: np.ravel(column) for name, column in zip(NAMES, columns, strict=True)}
    A = np.empty((span.size, 3, 3))
    for key, (i, j) in ENTRIES.items():
        A[:, i, j] = A[:, j, i] = values[f"A{key}"]
    inverse = np.linalg.inv(A)
    inverses = [inverse[:, i, j] for i, j in ENTRIES.values()]
    tensors = [values[f"{name}{key}"] for name in "ABC" for key in _KEYS]
    w, nu = (np.stack([values[f"{name}{i}"] for i in (1, 2, 3)]) for name in ("omega", "gamma"))
    rest = [values[f"{name}{i}"] for name in ("lambda", "s") for i in (1, 2, 3)]
    span = span.ravel().astype(float)
    return PeerSystem(
        slope=_slope,
        start=np.concatenate([w, nu / np.linalg.norm(nu, axis=0)]).T.copy(),
        parameters=np.column_stack([*inverses, *tensors, *rest]),
        span=span,
        steps=span * (1.0 + abs(w).sum(axis=0)),
    )


def _slope(state, p, _sin, _cos):
    """Symmetric tensors by their entries 11, 22, 33, 12, 23, 31, from p[0]: of A^-1, A, B, C; then
    lambda, s.
    """
    w1, w2, w3, n1, n2, n3 = state[0], state[1], state[2], state[3], state[4], state[5]
    h1 = p[6] * w1 + p[9] * w2 + p[11] * w3 + p[24]
    h2 = p[9] * w1 + p[7] * w2 + p[10] * w3 + p[25]
    h3 = p[11] * w1 + p[10] * w2 + p[8] * w3 + p[26]
    g1 = p[12] * w1 + p[15] * w2 + p[17] * w3 - (p[18] * n1 + p[21] * n2 + p[23] * n3) + p[27]
    g2 = p[15] * w1 + p[13] * w2 + p[16] * w3 - (p[21] * n1 + p[19] * n2 + p[22] * n3) + p[28]
    g3 = p[17] * w1 + p[16] * w2 + p[14] * w3 - (p[23] * n1 + p[22] * n2 + p[20] * n3) + p[29]
    m1 = h2 * w3 - h3 * w2 + g2 * n3 - g3 * n2
    m2 = h3 * w1 - h1 * w3 + g3 * n1 - g1 * n3
    m3 = h1 * w2 - h2 * w1 + g1 * n2 - g2 * n1
    return (
        p[0] * m1 + p[3] * m2 + p[5] * m3,
        p[3] * m1 + p[1] * m2 + p[4] * m3,
        p[5] * m1 + p[4] * m2 + p[2] * m3,
        n2 * w3 - n3 * w2,
        n3 * w1 - n1 * w3,
        n1 * w2 - n2 * w1,
    )


def outcome(ends):
    """w1 at the end of each span."""
    return {ERROR: ends[:, 0]}
