"""The chart of fates: where motions of gyrostats end; errors of the limit, by long integrations and
roots in 40 digits.

Peers integrate every motion to t = 200, by which time those of the references have settled, and
infer the fate from the state there. Undecided verdicts are not wrong, and have no error.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.precision.cases import gyrostat
from survey.scene import Request
from survey.scenes import gyrostat as scene

SCENE = "gyrostat"
ERROR = "limit_phi"
NOTE = (
    "survey decides each fate with a certificate, for all time; peers integrate to t = 200 and tell the fate from the "
    "state there"
)
MOST = {"rk4": 8, "dop853": 40}  # points that a slow method is timed on
_NAMES = ("b12", "b31", "d", "c23", "s2", "s3", "phi0", "w0")
_QUESTION = {"question": "fate"}
_SPAN, _AT_REST = 200.0, 1e-2
_EQUILIBRIUM, _UP, _DOWN = 0, 5, 6  # verdicts
_SYSTEM = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
_CASES = {
    "one system, 60x40 states": "random",
    "scattered": "random",
    "beside separatrices": "separatrix",
}


@cache
def _group(name):
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("gyrostat_fates.json")
        .read_text(encoding="utf-8")
    )
    cases = []
    for row in data[name]:
        numbers = map(float.fromhex, (*row["p_hex"], row["phi0_hex"], row["w0_hex"]))
        point = dict(zip(_NAMES, numbers, strict=True))
        cases.append((point, _QUESTION, {ERROR: float(row[ERROR])}, _EQUILIBRIUM))
    return cases


def references(work):
    """The reference cases of the work's kind: all end in an attracting equilibrium."""
    return _group(_CASES[work])


@cache
def works():
    """A map of one system, systems and states that share nothing, and states 1e-4 to 1e-13 off one
    stable branch.
    """
    random = np.random.default_rng(1)
    fixed = {name: np.full((1, 1), value) for name, value in _SYSTEM.items()}
    grid = fixed | {
        "phi0": np.linspace(-3.1, 3.1, 60)[:, None],
        "w0": np.linspace(-3.0, 3.0, 40)[None],
    }
    rows = random.normal(size=(8, 200)) * np.array([1, 1, 2, 2, 3, 3, 1, 1])[:, None]
    scattered = dict(zip(_NAMES, rows, strict=True))
    branch = {name: np.array([value]) for name, value in _SYSTEM.items()}
    branch |= {"phi0": np.linspace(3.0, 4.4, 200), "saddle": np.array([2.0]), "t": np.zeros(1)}
    options = {"question": "trajectory", "separatrix": "stable", "side": "left"}
    w = scene.solve(branch, Request(options))["w"]
    off = random.choice([-1.0, 1.0], w.size) * 10.0 ** random.uniform(-13.0, -4.0, w.size)
    beside = {name: branch[name] for name in _NAMES[:7]} | {"w0": w + off}
    return {
        work: (point, _QUESTION)
        for work, point in zip(_CASES, (grid, scattered, beside), strict=True)
    }


def system(point, options):
    """(57) in time, for long."""
    return gyrostat.system(point | {"t": np.array([_SPAN])}, options)


def outcome(ends):
    """The angle at the end, and the fate as its velocity has it: at rest, or turning."""
    phi, w = ends.T
    turning = np.where(w > 0.0, _UP, _DOWN)
    return {
        ERROR: phi % (2 * np.pi),
        "verdict": np.where(np.abs(w) < _AT_REST, _EQUILIBRIUM, turning),
    }
