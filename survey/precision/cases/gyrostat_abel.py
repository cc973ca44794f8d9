"""The chart of Abel's equation: w(phi) of random gyrostats after a turn, at 121 angles of it, and
beside where it ends.

Peers integrate dw/dphi = f + g / w and dt/dphi = 1 / w (57), all three of whose works keep w > 0.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.measures.cylinder import solution
from survey.methods import taylor
from survey.precision.peers import PeerSystem

SCENE = "gyrostat"
ERROR = "w"
MOST = {"rk4": 4, "dop853": 40}  # points that a slow method is timed on
_NAMES = ("b12", "b31", "d", "c23", "s2", "s3", "phi0", "w0")
_QUESTION = {"question": "abel"}
_POINTS = 20_000
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 121)
_CASES = {
    "one turn": "turn",
    "121 angles of a turn": "angles",
    "0.9999 of the way to where it turns": "steep",
}


@cache
def references(work):
    """The reference cases of the work's kind (error of the JSON's own values below 1e-29)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("gyrostat_abel.json")
        .read_text(encoding="utf-8")
    )
    cases = []
    for row in data[_CASES[work]]:
        numbers = map(
            float.fromhex, (*row["p_hex"], row["phi0_hex"], row["w0_hex"], row["phi_hex"])
        )
        cases.append(
            (
                dict(zip((*_NAMES, "phi"), numbers, strict=True)),
                _QUESTION,
                {ERROR: float(row[ERROR])},
                None,
            )
        )
    return cases


@cache
def works():
    """Systems and states that share nothing; those of the second work start at phi = 0, so they
    share their angles.
    """
    random = np.random.default_rng(1)
    turn = _rows(random.uniform(-0.5, 0.5, (6, _POINTS)), random, (2.5, 5.0))
    angles = {name: values[: _POINTS // 20, None] for name, values in turn.items()} | {
        "phi0": np.zeros((1, 1))
    }
    steep = _rows(random.normal(size=(6, 2 * _POINTS)), random, (0.3, 1.5))
    rows = np.column_stack([steep[name] for name in _NAMES])
    floats, status = solution.abel(taylor, rows, rows[:, rc.PHI0, None] + 40.0, 1e-8)
    turning = np.flatnonzero(status[:, 0] == solution.TURNING)[:_POINTS]
    steep = {name: values[turning] for name, values in steep.items()}
    near = steep["phi0"] + 0.9999 * (floats[turning, 0, rc.VALUE] - steep["phi0"])
    points = (
        turn | {"phi": turn["phi0"] + 2.0 * np.pi},
        angles | {"phi": _ANGLES[None]},
        steep | {"phi": near},
    )
    return {work: (point, _QUESTION) for work, point in zip(_CASES, points, strict=True)}


def _rows(six, random, fast):
    """Systems, and starts anywhere with w0 between two numbers."""
    count = six.shape[1]
    values = (*six, random.uniform(-np.pi, np.pi, count), random.uniform(*fast, count))
    return dict(zip(_NAMES, values, strict=True))


def system(point, options):
    """(57) over phi: phi itself, w and t; where the last axis is that of the angles, one solution
    serves them.
    """
    dense = np.ndim(point["phi"]) > 1
    samples = np.ravel(point["phi"]) if dense else None
    columns = [
        np.ravel(values) for values in np.broadcast_arrays(*(point[name] for name in _NAMES))
    ]
    rows = np.column_stack(columns)
    start = np.column_stack([rows[:, rc.PHI0], rows[:, rc.W0], np.zeros(len(rows))])
    span = (
        np.full(len(rows), samples[-1])
        if dense
        else np.broadcast_to(point["phi"], len(rows)) - rows[:, rc.PHI0]
    )
    return PeerSystem(
        slope=_slope,
        start=start,
        parameters=np.ascontiguousarray(rows[:, :6]),
        span=span.astype(float),
        steps=abs(rows[:, :6]).sum(axis=1) / rows[:, rc.W0],
        samples=samples / samples[-1] if dense else None,
    )


def _slope(state, parameters, sin, cos):
    b12, b31, d = parameters[0], parameters[1], parameters[2]
    c23, s2, s3 = parameters[3], parameters[4], parameters[5]
    s, c, v = sin(state[0]), cos(state[0]), 1.0 / state[1]
    g = s2 * c - s3 * s - d * c * s - c23 * (c * c - s * s)
    return 1.0 + 0.0 * v, (b12 * c - b31 * s) + g * v, v


def outcome(ends):
    """w at the angles."""
    return {ERROR: ends[..., 1].ravel()}
