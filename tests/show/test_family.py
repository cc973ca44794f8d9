"""Abel solutions drawn as curves: w w' = -phi has the circles w^2 + phi^2 = w0^2, which turn at phi
= +-w0.
"""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import LineCollection

import survey  # noqa: F401 (registers the accessor)
from survey import status
from survey.show import family, figures

TURNING, SEPARATRIX = 16, 18
LEGEND = ["solutions", "initial angle", "turning points"]


@pytest.fixture
def circles():
    """Ten circles with radii from 0.5 to 2.3, the last of which does not turn on the axis."""
    w0, phi = np.linspace(0.5, 2.3, 10), np.linspace(-2.2, 2.2, 45)
    square = w0[:, None] ** 2 - phi**2
    turns = square <= 0
    dims, nothing = ("w0", "phi"), np.full(square.shape, np.nan)
    values = {
        "w": np.sqrt(np.where(turns, np.nan, square)),
        "t": np.where(turns, np.nan, np.arcsin(np.clip(phi / w0[:, None], -1, 1))),
        "phi_turning": np.where(turns, np.sign(phi) * w0[:, None], np.nan),
        "t_turning": np.where(turns, np.sign(phi) * np.pi / 2, np.nan),
    }
    data = {name: (dims, value) for name, value in values.items()}
    data |= {
        f"{name}_error": (dims, np.where(np.isnan(value), nothing, 1e-12))
        for name, value in values.items()
    }
    flags = {"flag_values": np.array([0, 1, 4, TURNING, SEPARATRIX], np.int8),
             "flag_meanings": "ok invalid_parameters step_limit turning separatrix"}  # fmt: skip
    data["status"] = (dims, np.where(turns, TURNING, status.OK).astype(np.int8), flags)
    angle = {"symbol": r"\varphi", "long_name": "angle", "units": "rad"}
    coords = {
        "w0": ("w0", w0, {"long_name": "initial velocity"}),
        "phi": ("phi", phi, angle),
        "phi0": 0.0,
    }
    return xr.Dataset(data, coords, {"title": "Circles", "options": "question=abel"})


def lines(figure):
    (drawn,) = (c for c in figure.axes[0].collections if isinstance(c, LineCollection))
    return drawn, [path.vertices for path in drawn.get_paths()]


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_curves_end_in_their_turning_points_and_follow_the_solution_to_there(circles):
    figure = figures.draw(circles)
    drawn, curves = lines(figure)
    assert len(curves) == 10 and legend(figure) == LEGEND
    for radius, curve in zip(circles.w0.values, curves, strict=True):
        assert (np.diff(curve[:, 0]) > 0).all()
        assert np.hypot(*curve.T) == pytest.approx(radius, abs=0.01)
        ends = (-radius, radius) if radius < 2.2 else (-2.2, 2.2)
        assert tuple(curve[[0, -1], 0]) == pytest.approx(ends)
    (dots,) = (line for line in figure.axes[0].lines if len(line.get_xdata()) == 18)
    assert sorted(dots.get_xdata()) == pytest.approx(
        sorted([*circles.w0.values[:9], *-circles.w0.values[:9]])
    )
    assert not dots.get_ydata().any() and figure.axes[1].get_ylabel() == "initial velocity"
    assert tuple(drawn.get_array()) == tuple(circles.w0.values)


def test_times_turn_at_the_time_of_the_turning_point(circles):
    figure = figures.draw(circles, "t")
    for radius, curve in zip(circles.w0.values[:9], lines(figure)[1], strict=False):
        assert curve[:, 1] == pytest.approx(np.arcsin(curve[:, 0] / radius), abs=0.02)
        assert curve[[0, -1], 1] == pytest.approx([-np.pi / 2, np.pi / 2])


def test_the_direction_of_the_axes_and_the_order_of_the_dimensions_change_nothing(circles):
    expected = lines(figures.draw(circles))[1]
    other = circles.isel(phi=slice(None, None, -1)).transpose("phi", "w0")
    for one, two in zip(expected, lines(figures.draw(other))[1], strict=True):
        assert np.array_equal(one, two)


def test_colours_belong_to_their_curves_on_an_axis_that_is_not_sorted(circles):
    drawn, curves = lines(figures.draw(circles.isel(w0=[3, 9, 0])))
    assert list(drawn.get_array()) == list(circles.w0.values[[0, 3, 9]])
    assert [np.hypot(*curve[0]) for curve in curves] == pytest.approx(
        list(drawn.get_array()), rel=0.05
    )


def test_one_curve_and_none(circles):
    assert len(lines(figures.draw(circles.isel(w0=[2])))[1]) == 1
    circles.status[...], circles.w[...], circles.phi_turning[...] = (
        status.STEP_LIMIT,
        np.nan,
        np.nan,
    )
    assert legend(figures.draw(circles)) == ["solutions", "initial angle", "failed (10)"]


def test_of_many_curves_some_hundreds_are_drawn_evenly(circles, monkeypatch):
    monkeypatch.setattr(family, "MOST", 4)
    figure = figures.draw(circles)
    assert list(lines(figure)[0].get_array()) == pytest.approx([0.5, 1.1, 1.7, 2.3])
    assert legend(figure)[0] == "4 of 10 solutions"


def test_curves_without_turning_points_in_the_file_end_where_they_are_known(circles):
    figure = figures.draw(circles[["w", "w_error", "status"]])
    assert legend(figure) == LEGEND[:2]
    assert all(np.isin(curve[:, 0], circles.phi.values).all() for curve in lines(figure)[1])


@pytest.mark.parametrize("style", ["screen", "paper"])
def test_ends_that_are_left_open_are_ringed_and_counted(circles, style):
    circles.status[8, 43:], circles.status[0, 40:] = SEPARATRIX, status.STEP_LIMIT
    circles.phi_turning[8, 43:] = np.nan
    circles.status[0, :10], circles.w[0] = status.STEP_LIMIT, np.nan
    circles.status[4], circles.w[4] = status.INVALID_PARAMETERS, np.nan
    figure = figures.draw(circles, style=style)
    counted = ["separatrix (1)", "failed (1)", "outside the domain (1)"]
    counted = counted if style == "screen" else [label.partition(" (")[0] for label in counted]
    assert legend(figure)[-3:] == counted
    rings = [
        line.get_xydata()
        for line in figure.axes[0].lines
        if line.get_markeredgecolor() == "#D40000"
    ]
    ((place,),) = (ring for ring in rings if len(ring))
    assert place[0] == pytest.approx(circles.phi.values[circles.w[8].notnull().values].max())


def test_error_bars_are_drawn_where_they_are_seen(circles):
    circles.w_error[3] = 0.1
    figure = figures.draw(circles)
    assert "error bars" in legend(figure) and len(figure.axes[0].collections) == 2


def test_a_second_parameter_leaves_its_first_value_and_maps_the_turning_points_of_the_last_angle(
    circles,
):
    two = xr.concat([circles, circles.assign(w=circles.w + 1)], "d").assign_coords(d=[1.0, 2.0])
    two = two.transpose("w0", "d", "phi")
    figure = figures.draw(two)
    assert "d = 1 (1 of 2)" in figure.axes[0].get_title().replace("$", "")
    assert [c.shape for c in lines(figure)[1]] == [c.shape for c in lines(figures.draw(circles))[1]]
    figure = figures.draw(two, "phi_turning")
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().shape == (2, 10) and legend(figure) == ["does not apply"]
    assert mesh.get_array()[0, :9].data == pytest.approx(circles.w0.values[:9])
    assert "= 2.2$ (45 of 45)" in figure.axes[0].get_title()


def test_one_parameter_has_its_turning_points_as_a_curve(circles):
    (curve, *_) = figures.draw(circles, "phi_turning").axes[0].lines
    assert curve.get_ydata()[:9] == pytest.approx(circles.w0.values[:9])


def test_at_one_angle_w_is_a_map_whose_grey_points_turn_before_it(circles):
    two = xr.concat([circles, circles], "d").assign_coords(d=[1.0, 2.0]).transpose("w0", "d", "phi")
    two.status[3, 1, 25], two.w[3, 1, 25] = SEPARATRIX, np.nan
    two.status[2, 1, 25], two.w[2, 1, 25] = status.STEP_LIMIT, np.nan
    figure = figures.draw(two.isel(phi=25))
    assert legend(figure) == ["separatrix (1)", "failed (1)"]
    labels = legend(figures.draw(two.isel(phi=[35])))
    assert labels == ["turning (10)"]


def test_ticks_are_multiples_of_pi():
    halves = [family._multiple_of_pi(n) for n in (-3, -2, -1, 0, 1, 2, 3, 4)]
    assert halves == [
        r"$-3\pi/2$",
        r"$-\pi$",
        r"$-\pi/2$",
        "$0$",
        r"$\pi/2$",
        r"$\pi$",
        r"$3\pi/2$",
        r"$2\pi$",
    ]


def test_the_accessor_chooses_an_angle_and_draws_a_map(circles):
    two = xr.concat([circles, circles], "d").assign_coords(d=[1.0, 2.0]).transpose("w0", "d", "phi")
    two.attrs["scene"] = "gyrostat"
    axes = two.survey.slice(phi=1.3).survey.map("w")
    assert axes.collections[0].get_array().shape == (2, 10) and "1.3" in axes.get_title()
    plt.close("all")
