"""Mathieu's chart: a row, a map, scattered points, and large a and q; errors of the discriminant by
double-doubles.
"""

from functools import cache

import numpy as np

from survey.precision.known import references as known
from survey.precision.peers import PeerSystem
from survey.truth.hill import mathieu

ERROR = "discriminant"
SMALL, LARGE = (0.0, 20.0, 10.0), (-50.0, 2000.0, 700.0)  # least and greatest a, greatest q
ALL = ("map 400x600, all outputs",)


@cache
def _group(large):
    random = np.random.default_rng(3)
    low, high, most = LARGE if large else SMALL
    points = {
        "a": random.uniform(max(low, 0.0), high, 60),
        "q": random.uniform(0.0, most / (3 if large else 1), 60),
    }
    return known(mathieu, points, {}, ERROR)


def references(work):
    """Random points of the work's ranges, to 28 digits."""
    return _group(work.startswith("large"))


@cache
def works():
    """A row, a map for the verdict and for all outputs, points that share nothing, and large ones."""
    random = np.random.default_rng(1)
    scattered = {
        "a": random.uniform(*SMALL[:2], 30_000),
        "q": random.uniform(0.0, SMALL[2], 30_000),
    }
    large = {
        "a": random.uniform(0.0, LARGE[1], 3_000),
        "q": random.uniform(0.0, LARGE[2] / 3, 3_000),
    }
    grid = _map(np.linspace(0.0, SMALL[2], 400), 600)
    return {
        "row": (_map(np.array([3.0]), 10_000), {}), "map 400x600": (grid, {}), "map 400x600, all outputs": (grid, {}),
        "scattered": (scattered, {}), "large a, q": (large, {}),
    }  # fmt: skip


def _map(q, number):
    return {"q": q[:, None], "a": np.linspace(*SMALL[:2], number)[None, :]}


def system(point, options):
    """A quarter of the cosine's turn, by symmetry: y1, y2 over half a period, with cos 2t and sin
    2t as states.
    """
    a, q = (np.ravel(values) for values in np.broadcast_arrays(point["a"], point["q"]))
    start = np.tile([1.0, 0.0, 1.0, 0.0, 0.0, 1.0], (a.size, 1))
    span = np.full(a.size, np.pi / 2)
    return PeerSystem(
        _slope, start, np.column_stack([a, 2.0 * q]), span, np.sqrt(abs(a) + 2.0 * abs(q))
    )


def _slope(state, parameters, _sin, _cos):
    c, s = state[0], state[1]
    z = parameters[0] - parameters[1] * c
    return -2.0 * s, 2.0 * c, state[3], -1.0 * (z * state[2]), state[5], -1.0 * (z * state[4])


def outcome(ends):
    """The discriminant and, as a user of an integrator would have it, the verdict by |D| > 2."""
    _cosine, _sine, y1, _dy1, _y2, dy2 = ends.T
    discriminant = 2.0 * (2.0 * y1 * dy2 - 1.0)
    return {ERROR: discriminant, "verdict": (abs(discriminant) < 2.0).astype(int)}
