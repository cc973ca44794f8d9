"""The chart of Danby's map as e goes to 1; errors of b by double-doubles."""

from functools import cache

import numpy as np

from survey.precision.cases import libration_elliptic
from survey.precision.known import references as known
from survey.truth.danby import truth

SCENE = "libration_elliptic"
ERROR = "b"
MOST = {"dop853": 200, "rk4": 100}
WORKS = {"1 - e from 0.3 to 1e-2": (-2.0, -0.5), "1 - e from 1e-2 to 1e-4": (-4.0, -2.0)}
system, outcome = libration_elliptic.system, libration_elliptic.outcome


def _points(work, number, seed):
    random = np.random.default_rng(seed)
    return {
        "mu": random.uniform(0.0, 0.05, number),
        "e": 1.0 - 10.0 ** random.uniform(*WORKS[work], number),
    }


@cache
def references(work):
    """Random points of the work's range, to 28 digits."""
    return known(truth, _points(work, 30, 5), {}, ERROR)


@cache
def works():
    """Points that share nothing."""
    return {work: (_points(work, 10_000, 1), {}) for work in WORKS}
