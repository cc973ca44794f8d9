"""The truth of Danby's map lies within its doubt of invariants with mpmath's numbers, also for e near 1."""

import numpy as np
import pytest
from danby_digits import invariants
from mpmath import mp, mpf

from survey.truth import danby
from survey.truth.danby_flow import A_DOUBT, B_DOUBT, A, B


@pytest.mark.parametrize(
    "mu, short",
    [
        (0.01, 0.7),
        pytest.param(0.02, 0.1, marks=pytest.mark.slow),
        pytest.param(1e-3, 1e-3, marks=pytest.mark.slow),
        pytest.param(1e-12, 1e-5, marks=pytest.mark.slow),
        pytest.param(0.3, 1e-6, marks=pytest.mark.slow),
        pytest.param(1e-3, 1e-10, marks=pytest.mark.slow),
        pytest.param(0.3, 1e-14, marks=pytest.mark.slow),
    ],
)
def test_invariants_lie_within_their_doubt(mu, short):
    e = 1.0 - short
    row = danby.solved(np.array([mu]), np.array([e]))[0]
    exact = invariants(mu, e)
    for column, doubt, value in zip((A, B), (A_DOUBT, B_DOUBT), exact, strict=True):
        with mp.workdps(60):
            off = abs(value - (mpf(row[column]) + mpf(row[column + 1])))
            size = 1 + abs(value)
        assert off < 0.1 * row[doubt]
        assert row[doubt] < 1e-9 * size or short < 1e-3
