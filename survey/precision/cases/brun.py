"""Brun's chart: precession in one period of random initial states, and of hard ones; errors by
60-digit references.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.precision.peers import PeerSystem
from survey.scene import Request
from survey.scenes import brun

ERROR = "precession"
MOST = {"chebyshev": 200}  # points that a slow method is timed on
_POINTS = 100_000  # as in a block of a map
_STATE = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
# the family of references of each work and its least distance: nearer a pole some peers do not come
# to an end
_WORKS = {
    "initial states": ("", 0.0),
    "near separatrices": ("separatrix", 1e-8),
    "passing poles closely": ("pole", 1e-2),
    "near regular precessions": ("precession", 1e-8),
}


def states(family):
    """[(distance, parameters, {output: exact value}, {output: floor})] of a family (error below 1e-35)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("brun_distances.json")
        .read_text(encoding="utf-8")
    )
    return [
        (
            row["distance"],
            dict(zip(_STATE, map(float.fromhex, row["state_hex"]), strict=True)),
            row["values"],
            row["floors"],
        )
        for row in data[family]
    ]


@cache
def references(work):
    """The reference cases, or the family of states that belongs to the work."""
    family, least = _WORKS[work]
    if family:
        rows = [row for row in states(family) if least < 1.1 * row[0] < 0.2]
        return [(point, {}, {ERROR: float(exact[ERROR])}, 1) for _, point, exact, _ in rows]
    data = json.loads(
        resources.files("survey.reference").joinpath("brun.json").read_text(encoding="utf-8")
    )
    cases = []
    for case in data["cases"]:
        point = {key: float.fromhex(value) for key, value in case["inputs_hex"].items()}
        point |= {"epsilon": point.pop("eps")}
        cases.append((point, {}, {ERROR: float(case["delta_psi_per_T"])}, 1))
    return cases


def works():
    """Initial states that share nothing: any, and near what takes digits away, at small distances."""
    random = np.random.default_rng(1)
    n = _POINTS
    size = 10.0 ** random.uniform(-0.5, 0.5, n)
    body = {"A": size, "C": size * random.uniform(0.05, 1.99, n)}
    theta, (p, b, a) = random.uniform(0.1, 3.04, n), random.normal(size=(3, n))
    field = random.choice([-1.0, 1.0], n) * 10.0 ** random.uniform(-2.0, 1.0, n)
    close, past = 10.0 ** random.uniform(-8.0, -2.0, n), 10.0 ** random.uniform(-2.0, -1.0, n)
    any_state = body | {"epsilon": field, "theta0": theta, "p_theta0": p, "p_psi": b, "p_phi": a}
    spin = random.choice([-1.0, 1.0], n) * random.uniform(0.5, 2.0, n)
    passing = any_state | {
        "p_phi": spin,
        "p_psi": random.choice([-1.0, 1.0], n) * spin * (1.0 + past),
    }
    k = abs(field)
    hill = random.uniform(-0.3, 0.3, n)
    wide = 0.5 * k * np.sqrt((1 - hill**2) * (1 - 9 * hill**2)) * random.uniform(-0.9, 0.9, n)
    at_hill = _upright(
        body, k, hill, np.sqrt(0.5 * k * (1 - 3 * hill**2) + wide), np.sqrt(k * close)
    )
    valley = random.uniform(-0.9, 0.9, n)
    in_valley = _upright(
        body, k, valley, np.sqrt(k) * random.uniform(1.5, 5.0, n), np.sqrt(k) * close
    )
    return dict(
        zip(
            _WORKS, ((point, {}) for point in (any_state, at_hill, passing, in_valley)), strict=True
        )
    )


def _upright(body, k, u, y, p_theta):
    """States beside the regular precession at u with A psi' = y (S8)."""
    epsilon = k / (body["A"] * (body["A"] - body["C"]))
    return body | {"epsilon": epsilon, "theta0": np.arccos(u), "p_theta0": p_theta, "p_psi": y - k * u * u / y,
                   "p_phi": u * (y - k / y)}  # fmt: skip


def system(point, options):
    """One period, which the peers are given, from the initial state: u, u' and both angles, phi
    less its drift.

    Measured with heyoka: theta with its sine and cosine, or the Euler-Poisson equations, take
    longer.
    """
    shape = np.broadcast_shapes(*(np.shape(values) for values in point.values()))
    flat = {name: np.broadcast_to(values, shape).ravel() for name, values in point.items()}
    period = brun.solve(flat, Request({}, variables=frozenset({"period"})))["period"]
    a, b = flat["p_phi"] / flat["A"], flat["p_psi"] / flat["A"]
    u, sine, p = np.cos(flat["theta0"]), np.sin(flat["theta0"]), flat["p_theta0"] / flat["A"]
    k = flat["epsilon"] * (1.0 - flat["C"] / flat["A"])
    level = p * p + ((b - a * u) / sine) ** 2 - k * u * u + a * a
    zero = np.zeros(u.size)
    return PeerSystem(
        slope=_slope,
        start=np.column_stack([u, -sine * p, zero, zero]),
        parameters=np.column_stack([2.0 * k, k - level, a * b, 0.5 * (b - a), 0.5 * (b + a)]),
        span=period,
        steps=period * np.sqrt(abs(k) + abs(level)),
    )


def _slope(state, parameters, _sin, _cos):
    u, v = state[0], state[1]
    up = parameters[3] * (1.0 / (1.0 - u))
    down = parameters[4] * (1.0 / (1.0 + u))
    return v, parameters[2] + u * (parameters[1] - parameters[0] * u**2), up + down, down - up


def outcome(ends):
    """The advance of psi."""
    return {ERROR: ends[:, 2]}
