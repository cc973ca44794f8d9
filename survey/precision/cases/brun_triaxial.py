"""The chart of Clebsch's case: w1 of bodies with three unequal moments, at t = 10 and at 100 times
up to it.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.precision.peers import PeerSystem

ERROR = "w1"
LAST, NUMBER, TIMES = 10.0, 4_000, 100
MOST = {"rk4": 4, "dop853": 100}  # points that a slow method is timed on
_QUESTION = {"question": "trajectory"}
_MOMENTS = ("A", "B", "C")
_STATE = tuple(f"{kind}{i}" for kind in ("omega", "gamma") for i in (1, 2, 3))
_NAMES = (*_MOMENTS, "epsilon", *_STATE)


@cache
def references(_work=None):
    """w1 at the last time, of six bodies (error below 1e-27)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("brun_triaxial.json")
        .read_text(encoding="utf-8")
    )
    found = []
    for row in data["trajectories"]:
        body = {name: float.fromhex(text) for name, text in row["hex"].items()} | {"t": row["t"]}
        found.append((body, _QUESTION, {ERROR: float(row[ERROR])}, None))
    return found


def works():
    """Bodies that share nothing, at the last time; fewer of them at all times."""
    random = np.random.default_rng(1)
    first, second = random.uniform(0.6, 1.4, (2, NUMBER))
    third = random.uniform(abs(first - second) + 0.1, first + second - 0.1)
    columns = (
        first,
        second,
        third,
        random.uniform(-1.0, 1.0, NUMBER),
        *random.normal(size=(6, NUMBER)),
    )
    bodies = dict(zip(_NAMES, columns, strict=True))
    rows = {name: values[:100, None] for name, values in bodies.items()}
    dense = rows | {"t": np.linspace(0.0, LAST, TIMES + 1)[None, 1:]}
    return {
        "one time": (bodies | {"t": np.full(NUMBER, LAST)}, _QUESTION),
        f"{TIMES} times": (dense, _QUESTION),
    }


def system(point, options):
    """(1) in w and nu."""
    *columns, span = (
        np.ravel(c) for c in np.broadcast_arrays(*(point[name] for name in (*_NAMES, "t")))
    )
    A, B, C, epsilon, *state = columns
    w, nu = np.stack(state[:3]), np.stack(state[3:])
    shares = [(B - C) / A, (C - A) / B, (A - B) / C]
    return PeerSystem(
        slope=_slope,
        start=np.concatenate([w, nu / np.linalg.norm(nu, axis=0)]).T.copy(),
        parameters=np.column_stack([*shares, epsilon]),
        span=span.astype(float),
        steps=span * (1.0 + abs(w).sum(axis=0)),
    )


def _slope(state, p, _sin, _cos):
    w1, w2, w3, n1, n2, n3 = state[0], state[1], state[2], state[3], state[4], state[5]
    return (
        p[0] * (w2 * w3 - p[3] * (n2 * n3)),
        p[1] * (w3 * w1 - p[3] * (n3 * n1)),
        p[2] * (w1 * w2 - p[3] * (n1 * n2)),
        n2 * w3 - n3 * w2,
        n3 * w1 - n1 * w3,
        n1 * w2 - n2 * w1,
    )


def outcome(ends):
    """w1 at the end of each span."""
    return {ERROR: ends[:, 0]}
