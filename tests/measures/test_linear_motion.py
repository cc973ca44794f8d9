"""Local errors of a linear motion that all have the worst sign lie within the bars."""

import numpy as np
import pytest

from survey.measures import linear_motion

ERROR = 1e-12


@pytest.mark.parametrize("size", [2, 4])
@pytest.mark.parametrize("span", [0.1, 0.5, 1.5])
def test_errors_that_add_up_lie_within_the_bars(span, size):
    """Steps exp(h J), J all ones, too large by ERROR in all entries."""
    steps, ones = 100, np.ones((size, size))
    matrix = np.eye(size) + np.expm1(size * span / steps) / size
    _y, bars = linear_motion._chain(
        np.tile(matrix, (steps, 1, 1)), np.tile(ERROR * ones, (steps, 1, 1)), ones, 1
    )
    wrong, total = np.eye(size), np.zeros((size, size))
    for n in range(steps):
        total, wrong = matrix @ total + ERROR * ones @ wrong, (matrix + ERROR) @ wrong
        assert (total <= bars[n + 1]).all()
