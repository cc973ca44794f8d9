"""A variable along one axis shows its error band, and where there is no answer."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from survey import status
from survey.show.profiles import draw_profile

X = np.linspace(1.0, 2.0, 5)


@pytest.fixture
def drawn():
    """The axes with a profile whose third point has no answer."""
    values, bars, codes = X**2, 0.1 * X, np.zeros(X.size, np.int8)
    values[2], bars[2], codes[2] = np.nan, np.nan, status.NO_CONVERGENCE
    words = {"long_name": "square", "units": "1"}
    ds = xr.Dataset(
        {"y": ("x", values, words), "y_error": ("x", bars), "status": ("x", codes)},
        {"x": ("x", X, {"long_name": "side", "units": "1"})},
    )
    figure, axes = plt.subplots()
    draw_profile(axes, ds, ds.y, ds.status, paper=False)
    yield axes
    plt.close(figure)


def test_the_band_is_one_bar_wide_on_either_side(drawn):
    corners = np.concatenate([path.vertices for path in drawn.collections[0].get_paths()])
    for x in X[[0, 1, 3, 4]]:
        heights = corners[np.isclose(corners[:, 0], x), 1]
        assert np.isclose(heights.min(), x**2 - 0.1 * x) and np.isclose(heights.max(), x**2 + 0.1 * x)


def test_points_without_an_answer_are_marked(drawn):
    (marks,) = (line for line in drawn.lines if line.get_label() == "no answer")
    assert marks.get_xdata().tolist() == [X[2]]
