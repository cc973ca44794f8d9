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
        assert np.isclose(heights.min(), x**2 - 0.1 * x) and np.isclose(
            heights.max(), x**2 + 0.1 * x
        )


def test_points_without_an_answer_are_marked(drawn):
    (marks,) = (line for line in drawn.lines if line.get_label() == "no answer")
    assert marks.get_xdata().tolist() == [X[2]]


def profile(x, **variables):
    """The axes of a profile of the first of the variables."""
    words = {"long_name": "quantity", "units": "1"}
    data = {name: ("x", values, words | more) for name, (values, more) in variables.items()}
    ds = xr.Dataset(data | {"status": ("x", np.zeros(x.size, np.int8))}, {"x": ("x", x, words)})
    figure, axes = plt.subplots()
    draw_profile(axes, ds, ds[next(iter(variables))], ds.status, paper=False)
    plt.close(figure)
    return axes


def test_a_verdict_of_a_single_point_is_ringed_and_named():
    x = np.linspace(0.0, 1.0, 101)
    verdict = np.where(x < 0.6, 1, 0).astype(np.int8)
    verdict[37] = 2
    flags = {
        "flag_values": np.array([0, 1, 2], np.int8),
        "flag_meanings": "unstable stable resonant",
    }
    axes = profile(x, verdict=(verdict, flags))
    rings = [line for line in axes.lines if line.get_marker() == "o"]
    assert [line.get_xdata().tolist() for line in rings] == [[x[37]]]
    assert [text.get_text() for text in axes.texts] == ["0.37"]
    whole = profile(x, verdict=(np.where(x < 0.6, 1, 0).astype(np.int8), flags))
    assert not whole.texts and not [line for line in whole.lines if line.get_marker() == "o"]


def test_poles_are_gaps_with_marks_on_a_symmetric_logarithmic_axis():
    x = np.linspace(0.0, 1.0, 2001)
    axes = profile(x, y=(1.0 / (x - 0.30007), {}))
    assert axes.get_yscale() == "symlog"
    (pole,) = (line for line in axes.lines if line.get_label() == "pole")
    assert abs(pole.get_xdata()[0] - 0.30007) < 1e-3
    (curve,) = (line for line in axes.lines if line.get_label() == "$y$")
    assert np.isnan(np.asarray(curve.get_ydata(), float)).sum() == 1
    assert profile(x, y=(np.sin(20 * x), {})).get_yscale() == "linear"  # zeros are no poles
    assert profile(x, y=(1e4 * np.sin(20 * x), {})).get_yscale() == "linear"


@pytest.mark.parametrize("number", [40, 60, 100, 1000])
def test_a_pole_between_few_points_is_seen_and_no_point_lost(number):
    """The neighbours need not be far from the median."""
    x = np.linspace(0.001, 0.038, number)
    y = 2.0 + 0.5 / (x - 0.0243) + 1e-4 / (0.0385 - x) ** 2
    axes = profile(x, y=(y, {}), y_error=(np.full(number, 0.1), {}))
    assert len(axes.collections[0].get_paths()) == 2  # the band has the gap too
    (pole,) = (line for line in axes.lines if line.get_label() == "pole")
    assert abs(pole.get_xdata()[0] - 0.0243) < x[1] - x[0]
    shown = axes.lines[0].get_ydata()
    assert np.isnan(shown).sum() == 1 and shown[np.isfinite(shown)].tolist() == y.tolist()


def test_noise_and_coarse_oscillations_have_no_poles():
    x, random = np.linspace(0.0, 1.0, 2001), np.random.default_rng(3)
    waves = [np.sin(step * np.arange(2001)) for step in np.linspace(0.1, 3.1, 31)]
    for y in (random.normal(size=2001), np.sign(x - 0.5), *waves):
        assert [line for line in profile(x, y=(y, {})).lines if line.get_label() == "pole"] == []


@pytest.mark.parametrize("values", [[0, 0, 1, 2, 1], [3, 3, 3, 3, 3], [0, 1, np.nan, 1, 40]])
def test_counts_are_steps_with_integer_ticks(values):
    comment = {"comment": "-2 where it does not apply"}
    axes = profile(X, y=(np.array(values), comment))
    low, high = axes.get_ylim()
    ticks = [tick for tick in axes.get_yticks() if low <= tick <= high]
    assert ticks and all(tick == round(tick) for tick in ticks)
    assert axes.lines[0].get_drawstyle() == "steps-mid"
    assert profile(X, y=(X, {})).lines[0].get_drawstyle() == "default"


def test_a_name_without_a_symbol_is_no_formula():
    x = np.arange(5.0)
    for given in ({}, {"symbol": "resonance_order"}):
        axes = profile(x, resonance_order=(x, given))
        assert axes.lines[0].get_label() == "resonance_order"


def test_boundaries_on_the_only_axis_are_lines_by_kind():
    """Edges of tongues look as on maps and share an entry of the legend; others are dotted and bear
    their names.
    """
    kinds = {
        "flag_values": np.array([0, 2, 9], np.int8),
        "flag_meanings": "even_antiperiodic even_periodic a02_is_0",
    }
    ds = xr.Dataset(
        {
            "y": ("x", X**2, {"long_name": "square", "units": "1"}),
            "status": ("x", np.zeros(X.size, np.int8)),
            "edge_count": ((), 3),
            "edge_position": ("edge", [1.1, 1.5, 1.8]),
            "edge_class": ("edge", np.array([2, 0, 9], np.int8), kinds),
        },
        {"x": ("x", X, {"long_name": "side", "units": "1"})},
        {"boundaries": "x"},
    )
    figure, axes = plt.subplots()
    draw_profile(axes, ds, ds.y, ds.status, paper=False)
    lines = {line.get_xdata()[0]: line for line in axes.lines if len(set(line.get_xdata())) == 1}
    assert sorted(lines) == [1.1, 1.5, 1.8]
    assert [lines[x].get_linestyle() for x in sorted(lines)] == ["-", "--", ":"]
    assert sum("even dark" in text.get_text() for text in axes.get_legend().get_texts()) == 1
    assert [(text.get_text().strip(), text.xy[0]) for text in axes.texts] == [("a02 is 0", 1.8)]
    plt.close(figure)
    figure, axes = plt.subplots()
    draw_profile(axes, ds.assign_attrs(boundaries="z"), ds.y, ds.status, paper=False)
    assert len(axes.lines) == 1
    plt.close(figure)
