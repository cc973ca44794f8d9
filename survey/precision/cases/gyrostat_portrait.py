"""The chart of portraits: the multiplier of the first cycle, by references of 18 digits.

A portrait has all equilibria, cycles and ends of branches besides. Peers do less: they are given a
point of that one cycle and its period, and integrate one turn of it, with the integral of f, whose
exponential is the multiplier.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.measures.cylinder import motion
from survey.measures.cylinder.fate import remembered
from survey.methods import taylor
from survey.precision.peers import PeerSystem

SCENE = "gyrostat"
ERROR = "cycle_multiplier"
NOTE = (
    "survey finds all equilibria, all cycles and where every branch ends; peers are given one point of one cycle and "
    "its period, and integrate that turn"
)
MOST = {"rk4": 2, "dop853": 10}  # points that a slow method is timed on
_NAMES = ("b12", "b31", "d", "c23", "s2", "s3")
_QUESTION = {"question": "portrait"}
_POINTS = 100


@cache
def references(_work=None):
    """Systems whose first cycle is a rotation."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("gyrostat_cycles.json")
        .read_text(encoding="utf-8")
    )
    cases = []
    for row in data["cycles"]:
        point = dict(zip(_NAMES, map(float.fromhex, row["p_hex"]), strict=True))
        cases.append((point, _QUESTION, {ERROR: float(row["multiplier"])}, 1))
    return cases


@cache
def works():
    """Random systems that have a cycle."""
    random = np.random.default_rng(1)
    found = []
    while len(found) < _POINTS:
        six = random.normal(size=6) * [1, 1, 2, 2, 3, 3]
        if _first(tuple(six.tolist())) is not None:
            found.append(six)
    return {"scattered": (dict(zip(_NAMES, np.array(found).T, strict=True)), _QUESTION)}


@cache
def _first(six):
    """A point of the first cycle and its period."""
    states, times, _kinds = motion.cycles(remembered(taylor, six))
    return (*states[0], times[0, -1]) if len(states) else None


def system(point, options):
    """One turn of (57) and of the integral of f."""
    rows = np.column_stack(
        [np.ravel(values) for values in np.broadcast_arrays(*(point[name] for name in _NAMES))]
    )
    first = np.array([_first(tuple(row)) for row in rows.tolist()])
    return PeerSystem(
        slope=_slope,
        start=np.column_stack([first[:, :2], np.zeros(len(first))]),
        parameters=rows.astype(float),
        span=first[:, 2].copy(),
        steps=first[:, 2] * (1.0 + abs(rows).sum(axis=1)),
    )


def _slope(state, parameters, sin, cos):
    b12, b31, d = parameters[0], parameters[1], parameters[2]
    c23, s2, s3 = parameters[3], parameters[4], parameters[5]
    s, c = sin(state[0]), cos(state[0])
    f = b12 * c - b31 * s
    return state[1], f * state[1] - d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s, f


def outcome(ends):
    """The multiplier."""
    return {ERROR: np.exp(ends[:, 2])}
