"""The satellite's chart: a row and a map of prolate librations, scattered points; errors by
40-digit references.
"""

import json
from functools import cache
from importlib import resources
from unittest.mock import patch

import numpy as np

from survey.kernels import lanes
from survey.measures.hill import monodromy
from survey.methods import taylor16
from survey.precision.flops import operations
from survey.precision.peers import PeerSystem
from survey.scenes.satellite import Motion, moduli

ERROR = "discriminant"
LIMITED = "taylor16"
_FAMILIES = {"PL": "prolate", "PR": "prolate", "OL": "oblate", "OR": "oblate"}


@cache
def references(_work=None):
    """The reference cases, the same for every work (error of the JSON's own values below 1e-38)."""
    data = json.loads(
        resources.files("survey.reference").joinpath("satellite.json").read_text(encoding="utf-8")
    )
    cases = []
    for row in data["libration"] + data["nasty"] + data["rotation"]:
        point = {"k": float.fromhex(row["k_hex"]), "rho": float.fromhex(row["rho_hex"])}
        cases.append(
            (
                point,
                {"body": _FAMILIES[row["fam"]]},
                {ERROR: float(row["Delta"])},
                int(row["stable"]),
            )
        )
    return cases


def works():
    """A row, two maps, and points that share nothing."""
    random = np.random.default_rng(1)
    scattered = {"k": random.uniform(0.01, 0.99, 30_000), "rho": random.uniform(0.6, 4.0, 30_000)}
    maps = {
        f"map {n}x{m}": (_map(np.linspace(0.0, 0.99, n), m), {})
        for n, m in ((400, 600), (2000, 2000))
    }
    return {"row": (_map(np.array([0.5]), 10_000), {})} | maps | {"scattered": (scattered, {})}


def _map(k, number):
    return {"k": k[:, None], "rho": np.linspace(0.6, 4.0, number)[None, :]}


def system(point, options):
    """Half a period, by symmetry, of x = sqrt(2) w and of y1, y2, as first-order equations.

    w'' = (2 k^2 - 1) w - 2 w^3 for librations and rotations alike: no elliptic function is needed.
    """
    oblate = options.get("body", "prolate") == "oblate"
    rows = np.atleast_1d(point["k"])  # a row's period is computed once
    halves = Motion(*moduli({"k": rows.ravel()}), oblate).period.reshape(rows.shape) / 2
    k, rho, span = (np.ravel(values) for values in np.broadcast_arrays(rows, point["rho"], halves))
    zero, one = np.zeros(k.size), np.ones(k.size)
    constant = rho * rho - k * k if oblate else rho * rho + (1 - k) * (1 + k)
    return PeerSystem(
        slope=_slope,
        start=np.column_stack([np.sqrt(2) * k, zero, one, zero, zero, one]),
        parameters=np.column_stack([2 * k * k - 1, np.sqrt(2) * rho, constant]),
        span=span,
        steps=span * (abs(rho) + k + 1),
    )


def _slope(state, parameters, _sin, _cos):
    square = state[0] ** 2
    z = square + (parameters[1] * state[0] + parameters[2])
    bend = state[0] * (parameters[0] - square)
    return state[1], bend, state[3], -z * state[2], state[5], -z * state[4]


def outcome(ends):
    """The discriminant and, as a user of an integrator would have it, the verdict by |D| > 2."""
    _x, _slope_x, y1, _dy1, _y2, dy2 = ends.T
    discriminant = 2 * (2 * y1 * dy2 - 1)
    return {
        ERROR: discriminant,
        "verdict": np.where(abs(discriminant) > 2, monodromy.UNSTABLE, monodromy.STABLE),
    }


def operations_of(run):
    """Operations of midpoint Taylor's steps, counted from their formulas, while `run()` solves a work."""
    steps = []
    chain, scatter = taylor16.hill_chain, taylor16.hill_scatter

    def counting(samples, c2, h, p, order, starts, ends, out):
        steps.append(samples.shape[1] * int((ends - starts).sum()))
        chain(samples, c2, h, p, order, starts, ends, out)

    def counting_alone(samples, c2, h, p, order, starts, out):
        steps.append(samples.shape[1] * starts.size)
        scatter(samples, c2, h, p, order, starts, out)

    with patch.multiple(taylor16, hill_chain=counting, hill_scatter=counting_alone):
        run()
    return sum(steps) * operations(_one_step)


def _one_step(p):
    """All that `lanes.chain` does per lane and step: the step, two columns with error ellipses,
    zeros and sums.
    """
    matrix = taylor16.hill_step(np.ones(2 * taylor16.WIDTH), 1.0, p, 0.1)
    for _ in range(2):
        lanes.column(matrix, p, p, p, p, p)
        p + 1.0
    return p + lanes.relative(matrix, 0.1)
