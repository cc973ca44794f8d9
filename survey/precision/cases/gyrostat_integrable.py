"""The chart of the integrable cases: phi at t = 20 where it is an elliptic function, and where (49)
gives phi'.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.precision.peers import PeerSystem

ERROR = "phi"
LAST, NUMBER = 20.0, 10_000
MOST = {"rk4": 20, "dop853": 400}  # points that a slow method is timed on
_ELLIPTIC = ("A11", "C22", "C33", "C23", "S2", "S3", "phi0", "w0")
_INCLINED = ("A11", "B12", "B31", "theta0", "n", "phi0")


@cache
def _cases(case):
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("gyrostat_integrable.json")
        .read_text(encoding="utf-8")
    )
    found = []
    for row in data["trajectories"]:
        if row["case"] == case:
            point = {name: float.fromhex(text) for name, text in row["hex"].items()} | {
                "t": row["t"]
            }
            found.append((point, {"case": case}, {ERROR: float(row[ERROR])}, None))
    return found


def references(work):
    """phi at the last time, six motions of the work's case (error below 1e-26)."""
    return _cases(work)


def works():
    """Motions that share nothing."""
    random = np.random.default_rng(1)
    time = np.full(NUMBER, LAST)
    start = random.uniform(-np.pi, np.pi, NUMBER)
    moment = random.uniform(0.5, 2.0, NUMBER)
    five, rate = random.normal(size=(5, NUMBER)), random.normal(scale=1.5, size=NUMBER)
    elliptic = dict(zip(_ELLIPTIC, (moment, *five, start, rate), strict=True))
    tilt = random.uniform(0.2, 1.4, NUMBER)
    inclined = dict(zip(_INCLINED, (moment, *five[:2], tilt, rate, start), strict=True))
    points = {"elliptic": elliptic, "inclined": inclined}
    return {case: (point | {"t": time}, {"case": case}) for case, point in points.items()}


def system(point, options):
    """A11 phi'' = -(C22 - C33) sin 2phi / 2 - C23 cos 2phi + S2 cos phi - S3 sin phi; inclined: (49)."""
    p = {name: np.ravel(values).astype(float) for name, values in point.items()}
    inclined, over = options["case"] == "inclined", 1.0 / p["A11"]
    if inclined:
        tilt = np.sin(p["theta0"])
        parameters = [p["B12"] * tilt * over, p["B31"] * tilt * over, p["n"] * over]
        start = [p["phi0"]]
    else:
        parameters = [(p["C22"] - p["C33"]) * over, p["C23"] * over, p["S2"] * over, p["S3"] * over]
        start = [p["phi0"], p["w0"]]
    return PeerSystem(
        slope=_inclined if inclined else _elliptic,
        start=np.column_stack(start),
        parameters=np.column_stack(parameters),
        span=p["t"],
        steps=sum(abs(values) for values in parameters) + abs(start[-1]) * (not inclined),
    )


def _elliptic(state, p, sin, cos):
    s, c = sin(state[0]), cos(state[0])
    return state[1], p[2] * c - p[3] * s - p[0] * (s * c) - p[1] * (c * c - s * s)


def _inclined(state, p, sin, cos):
    return (p[0] * sin(state[0]) + p[1] * cos(state[0]) + p[2],)


def outcome(ends):
    """phi at the end of each span."""
    return {ERROR: ends[:, 0]}
