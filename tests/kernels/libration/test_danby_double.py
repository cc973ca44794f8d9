"""Local errors of Danby's problem that all have the worst sign lie within the bars."""

import numpy as np
import pytest

from survey.kernels.libration import danby_double

ERROR = 1e-12


def step(span, steps):
    """exp(h J), J all ones: the columns grow, and every step's errors have the same share in the
    last ones.
    """
    return np.eye(4) + np.expm1(4 * span / steps) / 4


def off(matrix, steps):
    """What is wrong where every step's matrix is too large by ERROR in all entries."""
    right = wrong = np.eye(4)
    total = np.zeros((4, 4))
    for _ in range(steps):  # the difference of the two products, without cancellation
        total, right, wrong = (
            matrix @ total + ERROR * np.ones((4, 4)) @ wrong,
            matrix @ right,
            (matrix + ERROR) @ wrong,
        )
    return total


@pytest.mark.parametrize("steps", [1, 4, 16, 200])
@pytest.mark.parametrize("span", [0.1, 0.5, 1.5])
def test_errors_that_add_up_lie_within_the_bars(steps, span):
    matrix, spread, found = step(span, steps), np.zeros((4, 4)), np.empty(4)
    whole = np.stack([np.eye(4), np.zeros((4, 4))])
    for _ in range(steps):
        danby_double.advance(
            np.stack([matrix, np.zeros((4, 4))]), np.full((4, 4), ERROR), whole, spread
        )
    danby_double.row_bars(spread, steps, found)
    assert (off(matrix, steps).max(axis=1) <= found).all()
