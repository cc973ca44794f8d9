"""The satellite's chart in its four families, in narrow tongues and near k = 1; errors by double-doubles."""

from functools import cache

import numpy as np

from survey.analysis.edge import edge
from survey.precision.cases import satellite
from survey.precision.known import references as known
from survey.truth.hill import satellite as truth

SCENE = "satellite"
ERROR = "discriminant"
LIMITS = {"librations": (0.01, 0.99), "rotations": (1.05, 6.0)}  # of k
WIDE = {"librations": (0.6, 4.0), "rotations": (-12.0, 6.0)}  # of rho
ALL = ("prolate librations, all outputs",)
_NUMBER = 4_000
system, outcome = satellite.system, satellite.outcome


@cache
def _tongues(body, number, seed):
    """Points in and beside the third tongue, whose width is k^3 / 8: from 1e-12 to 1e-3."""
    random = np.random.default_rng(seed)
    k = 10.0 ** np.linspace(-3.7, -0.7, 24)
    centre = np.sqrt(1.25) if body == "prolate" else 1.5
    ends = [
        edge("satellite", along="rho", rho=(centre - 4 * m * m, centre), k=m, body=body).edge.values
        for m in k
    ]
    which = random.integers(0, k.size, number)
    low, high = np.array([[x[0], x[-1]] for x in ends])[which].T
    return {"k": k[which], "rho": low + random.uniform(-0.5, 1.5, number) * (high - low)}


@cache
def _points(work, number, seed):
    """(points, body) of a work."""
    random = np.random.default_rng(seed)
    body, kind = work.split(",")[0].split(" ")[:2]
    if "tongues" in work:
        return _tongues(body, number, seed), body
    if "near k = 1" in work:
        short = random.choice([-1.0, 1.0], number) * 10.0 ** random.uniform(-14.0, -3.0, number)
        return {"k": 1.0 - short, "rho": random.uniform(-3.0, 3.0, number)}, body
    k, rho = random.uniform(*LIMITS[kind], number), random.uniform(*WIDE[kind], number)
    return {"k": k, "rho": rho}, body


WORKS = (
    "prolate librations", "prolate librations, all outputs", "oblate librations", "prolate rotations",
    "oblate rotations", "prolate librations, narrow tongues", "prolate motions, near k = 1",
)  # fmt: skip


@cache
def references(work):
    """Random points of the work's kind, to 28 digits."""
    if work in ALL:
        return references(work.removesuffix(", all outputs"))
    points, body = _points(work, 40, 7)
    return known(truth("k", False, 1, body == "oblate"), points, {"body": body}, ERROR)


@cache
def works():
    """Points that share nothing, of every family."""
    found = {work: _points(work, _NUMBER, 1) for work in WORKS}
    return {work: (points, {"body": body}) for work, (points, body) in found.items()}
