"""Local errors that all have the worst sign lie within the bars, and no bar underflows."""

import numpy as np
import pytest

from survey.kernels import lanes


def bars(matrix, steps, h):
    """y1, y1', y2, y2' after equal steps, and their bars."""
    columns, total, out = [(1.0, 0.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0, 0.0)], 0.0, np.empty(10)
    for _ in range(steps):
        columns = [lanes.column(matrix, *column) for column in columns]
        total += lanes.relative(matrix, h)
    (y1, v1, s1, _, w1), (y2, v2, s2, _, w2) = columns
    lanes.bars(s1, w1, s2, w2, steps, total, out)
    return np.array([y1, v1, y2, v2]), out[4:8]


@pytest.mark.parametrize("steps", [1, 4, 16, 1000])
@pytest.mark.parametrize("span", [0.1, 1.5, 5.0])
def test_errors_that_add_up_lie_within_the_bars(steps, span):
    """y'' = y, every step too large by 1 + error: the results are, by (1 + error)^steps."""
    h, error = span / steps, 1e-12
    c, s = np.cosh(h), np.sinh(h)
    values, found = bars((c, s, s, c, error * c, error * s, error * s), steps, h)
    assert (np.expm1(steps * np.log1p(error)) * values <= found * (1 + 1e-9)).all()


@pytest.mark.parametrize("size", [1e-100, 1e-160, 1e-200, 1e-240])
def test_bars_keep_their_size_where_squares_underflow(size):
    """y'' = -z y, z tiny and known to 1e-15: y1' = -z t."""
    steps, h = 8, 0.2
    _values, found = bars((1.0, h, -size * h, 1.0, 1e-15, 1e-15 * h, 1e-15 * size * h), steps, h)
    assert 1e-15 * size * steps * h <= found[1] < 1e-14 * size * steps * h


def test_no_bar_falls_to_zero():
    _values, found = bars((1.0, 0.2, 0.0, 1.0, 0.0, 0.0, 0.0), 8, 0.2)
    assert (found > 0).all() and (found < 1e-250).all()
