"""The gyrostat's chart: trajectories to t = 20 of random systems and states; errors by references
of 30 digits.
"""

import json
from functools import cache
from importlib import resources
from unittest.mock import patch

import numpy as np

from survey.kernels.cylinder import lockstep
from survey.methods import taylor
from survey.precision.flops import Counted
from survey.precision.peers import PeerSystem

ERROR = "phi"
LIMITED = "taylor"
MOST = {"rk4": 4, "dop853": 40, "full": 20}  # points that a slow method is timed on
_NAMES = ("b12", "b31", "d", "c23", "s2", "s3", "phi0", "w0")
_TIME = 20.0
_POINTS = 20_000
_QUESTION = {"question": "trajectory"}
_CASES = {"trajectory": "trajectories", "b = 0": "still", "g = 0": "free", "(61)": "trigonometric"}


@cache
def references(work):
    """The reference cases of the work's kind (error of the JSON's own values below 1e-29)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("gyrostat_trajectories.json")
        .read_text(encoding="utf-8")
    )
    cases = []
    for row in data[_CASES[work]]:
        numbers = map(float.fromhex, (*row["p_hex"], row["phi0_hex"], row["w0_hex"]))
        point = dict(zip(_NAMES, numbers, strict=True)) | {"t": float(row["t"])}
        cases.append((point, _QUESTION, {ERROR: float(row[ERROR])}, None))
    return cases


def works():
    """Systems and states that share nothing: any, and those which have a closed form."""
    random = np.random.default_rng(1)
    rows = random.normal(size=(8, _POINTS))
    rows[6] = random.uniform(-np.pi, np.pi, _POINTS)
    point = dict(zip(_NAMES, rows, strict=True)) | {"t": np.array([_TIME])}
    still = point | {"b12": np.zeros(1), "b31": np.zeros(1)}
    free = point | dict.fromkeys(("d", "c23", "s2", "s3"), np.zeros(1))
    points = (point, still, free, _trigonometric(random))
    return {work: (point, _QUESTION) for work, point in zip(_CASES, points, strict=True)}


def _trigonometric(random):
    """Rotations that meet (61) with mu = 3/2 exactly: b12, b31 and n are multiples of 1/64 and phi0 is 0."""
    b12, b31 = random.integers(-64, 65, (2, _POINTS)) / 64.0
    n = np.ceil(64.0 * (1.6 * np.hypot(b12, b31) + random.uniform(0.1, 2.0, _POINTS))) / 64.0
    n *= random.choice([-1.0, 1.0], _POINTS)
    values = (b12, b31, -0.75 * (b12**2 - b31**2), -0.75 * b12 * b31, 0.5 * n * b12, 0.5 * n * b31)
    return dict(zip(_NAMES, (*values, np.zeros(1), 1.5 * b31 + n), strict=True)) | {
        "t": np.array([_TIME])
    }


def system(point, options):
    """(57) in time."""
    *rows, span = np.broadcast_arrays(*(np.atleast_1d(point[name]) for name in (*_NAMES, "t")))
    rows = np.column_stack([values.ravel() for values in rows])
    return PeerSystem(
        slope=_slope,
        start=np.ascontiguousarray(rows[:, 6:]),
        parameters=np.ascontiguousarray(rows[:, :6]),
        span=span.ravel().astype(float),
        steps=span.ravel() * (abs(rows).sum(axis=1) - abs(rows[:, 6])),
    )


def _slope(state, parameters, sin, cos):
    b12, b31, d = parameters[0], parameters[1], parameters[2]
    c23, s2, s3 = parameters[3], parameters[4], parameters[5]
    s, c = sin(state[0]), cos(state[0])
    return state[1], (b12 * c - b31 * s) * state[1] - d * c * s - c23 * (
        c * c - s * s
    ) + s2 * c - s3 * s


def outcome(ends):
    """The angle at the end."""
    return {ERROR: ends[:, 0]}


class _Counted(Counted):
    """Takes part in comparisons too, and a square root counts as one operation."""

    def __float__(self):
        self._count()
        return 1.0

    def __lt__(self, other):
        return False

    __gt__ = __le__ = __ge__ = __lt__


def operations_of(run):
    """Operations of the steps in lock step, counted from their formulas, while `run()` solves a work."""
    steps = []
    trajectories = taylor.flow_trajectories

    def counting(*arguments):
        steps.append(trajectories(*arguments))

    with patch.object(taylor, "flow_trajectories", counting):
        run()
    return sum(steps) * _one_step()


def _one_step():
    """All that `lockstep.trajectories` does per lane and step."""
    plain = {
        name: value.py_func for name, value in vars(lockstep).items() if hasattr(value, "py_func")
    }
    number = _Counted()
    work = np.full((lockstep.ROWS, lockstep.LANES), number, dtype=object)
    Counted.operations = 0
    with patch.multiple(lockstep, **plain):
        lockstep.step(*lockstep.split(work), number)
    return Counted.operations / lockstep.LANES
