"""The chart of the normal form at L4, order 6: below mu_R, beside poles, mu to 0; errors by
60-digit closed forms.
"""

from functools import cache

import numpy as np

from survey.precision.known import references as known
from survey.truth.libration import truth

ERROR = "c"
POLES = (0.0135160160224525267, 0.0242938971420523216, 0.0385208965045513970)  # mu2, mu1, mu_R
_NUMBER = 20_000


def _points(work, number, seed):
    random = np.random.default_rng(seed)
    if work == "below mu_R":
        return {"mu": random.uniform(1e-4, 0.0384, number)}
    if work == "mu to 0":
        return {"mu": 10.0 ** random.uniform(-12.0, -3.0, number)}
    side = np.where(random.random(number) < 0.5, -1.0, 1.0)
    pole = random.choice(POLES, number)
    side[pole == POLES[2]] = -1.0
    return {"mu": pole + side * 10.0 ** random.uniform(-9.0, -4.0, number)}


@cache
def references(work):
    """Random points of the work's kind."""
    return known(truth, _points(work, 30, 5), {}, ERROR)


@cache
def works():
    """Mass ratios that share nothing."""
    return {
        work: (_points(work, _NUMBER, 1), {}) for work in ("below mu_R", "beside poles", "mu to 0")
    }
