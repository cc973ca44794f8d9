"""Datasets that users make of surveys are drawn and asked like others, or refused in a line."""

import contextlib

import matplotlib
import numpy as np
import pytest
import xarray as xr

import survey
from survey.errors import BadInput, SurveyError
from survey.viewer.shown import ShownMap

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def bodies():
    return survey.evaluate("libration_elliptic", body=["Sun-Jupiter", "Earth-Moon", "Sun-Mars"])


@pytest.fixture(scope="module")
def samples():
    points = {
        "a": xr.DataArray([0.1, 0.5, 1.2], dims="sample"),
        "q": xr.DataArray([0.1, 0.5, 0.2], dims="sample"),
    }
    return survey.evaluate("mathieu", **points)


@pytest.fixture(scope="module")
def grid():
    return survey.evaluate("mathieu", a=[0.1, 0.5, 1.2], q=[0.1, 0.3])


def test_labels_are_coordinates(bodies):
    assert bodies.survey.point(body="Earth-Moon").parameters["e"] == 0.0549
    assert bodies.survey.point(body=1).parameters["e"] == 0.0549
    axes = bodies.survey.map("a")
    assert [text.get_text() for text in axes.get_xticklabels()] == [
        "Sun-Jupiter",
        "Earth-Moon",
        "Sun-Mars",
    ]
    # names have no order
    assert axes.lines[0].get_linestyle() == "None" and axes.lines[0].get_marker() == "o"
    with pytest.raises(BadInput, match="body: unknown label 'Earth'"):
        bodies.survey.point(body="Earth")
    wide = survey.evaluate("libration_elliptic", mu=bodies.mu, e=[0.0, 0.1])
    assert [text.get_text() for text in wide.survey.map().get_xticklabels()][1] == "Earth-Moon"
    # not that which `mu` brings along
    assert wide.e.dims == ("e",) and wide.e.values.tolist() == [0.0, 0.1]
    finer = wide.survey.zoom(e=(0.02, 0.08), num=4)
    assert (
        finer.body.equals(wide.body)
        and finer.status.dims == wide.status.dims
        and finer.sizes["e"] == 4
    )
    alone = survey.evaluate("libration_elliptic", body="Earth-Moon", e=finer.e)
    np.testing.assert_array_equal(finer.verdict.sel(body="Earth-Moon"), alone.verdict)
    assert float(abs(finer.a.sel(body="Earth-Moon") - alone.a).max()) < 1e-10
    with pytest.raises(BadInput, match="a workflow cannot have an axis of names"):
        wide.survey.zoom(e=(0.02, 0.08), output="x.nc")


def test_dimensions_without_coordinates(samples):
    assert samples.survey.point(sample=2).parameters == {"a": 1.2, "q": 0.2}
    assert (
        samples.survey.map("exponent") is not None
        and samples.survey.slice(sample=0).status.ndim == 0
    )
    with pytest.raises(BadInput, match="it has no coordinate; give a number from 0 to 2"):
        samples.survey.point(sample=3)


@pytest.mark.filterwarnings("ignore:counts")  # that stacked points count twice: a line too
@pytest.mark.parametrize("name", ["bodies", "samples", "grid"])
@pytest.mark.parametrize(
    "ask",
    [
        "map",
        "boundary",
        "areas",
        "counts",
        "names",
        "_repr_html_",
        "margin",
        "zoom",
        "slice",
        "compare",
    ],
)
def test_every_question_is_answered_or_refused_in_a_line(name, ask, request):
    ds = request.getfixturevalue(name)
    with contextlib.suppress(SurveyError):
        getattr(ds.survey, ask)(*([ds] if ask == "compare" else []))
    for made in (xr.concat([ds, ds], "run"), ds.isel({ds.status.dims[0]: slice(None, None, -1)})):
        with contextlib.suppress(SurveyError):
            getattr(made.survey, ask)(*([made] if ask == "compare" else []))


def test_what_is_no_survey_is_reported(grid):
    with pytest.raises(BadInput, match=r"stacked along z: restore its axes with \.unstack"):
        grid.stack(z=("a", "q")).survey.map()
    with pytest.raises(BadInput, match="this is a dataset, not a workflow"):
        survey.run(grid)
    with pytest.raises(BadInput, match="this is a dataset, not a scene"):
        survey.evaluate(grid)
    wide = np.linspace(0, 1, 10**6)
    with pytest.raises(BadInput, match="points do not fit in memory"):
        survey.evaluate("mathieu", a=wide, q=wide)
    with pytest.raises(BadInput, match="an address, a scheduler file, or a"):
        survey.run({"scene": "mathieu", "axes": {"a": 1.0, "q": 0.1}}, output="x.nc", scheduler=3)


def test_a_client_is_a_scheduler(tmp_path):
    distributed = pytest.importorskip("distributed")
    asked = {"scene": "mathieu", "axes": {"a": {"values": [1.0, 2.0]}, "q": 0.1}}
    with distributed.Client(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as client:
        ds = survey.run(asked, output=tmp_path / "o.nc", scheduler=client)
        assert client.submit(lambda: 1).result() == 1  # it is still its owner's
    with pytest.raises(BadInput, match=r"this dask\.distributed Client is closed"):
        survey.run(asked, output=tmp_path / "other.nc", scheduler=client)
    np.testing.assert_array_equal(
        ds.verdict, survey.evaluate("mathieu", a=[1.0, 2.0], q=0.1).verdict
    )


def test_what_evaluate_returns_is_a_file_like_others_once_saved(bodies, grid, tmp_path, program):
    for ds, name in ((grid, "grid.nc"), (bodies, "bodies.nc")):
        ds.to_netcdf(tmp_path / name)
        saved = survey.open(tmp_path / name)
        assert saved.survey.counts() == ds.survey.counts() and saved.survey.map() is not None
        assert program("info", name).returncode == 0
    assert (
        survey.open(tmp_path / "bodies.nc").survey.point(body="Earth-Moon").parameters["e"]
        == 0.0549
    )
    bodies.expand_dims(e0=[0.0, 1.0]).to_netcdf(tmp_path / "two.nc")
    with pytest.raises(
        BadInput, match="the axis body holds names, and a viewer shows axes of numbers"
    ):
        ShownMap(tmp_path / "two.nc")
    done = program("verify", "grid.nc", "--points", "3")
    assert (
        "sound except for the digest" in done.stdout
        and "there is no digest grid.nc.sha256" in done.stderr
    )


def test_points_on_no_grid_have_no_areas(samples):
    for question in (samples.survey.areas, samples.survey.boundary):
        with pytest.raises(
            BadInput, match="sample only counts points, of a, q: they do not lie on a grid"
        ):
            question()


def test_an_axis_of_one_value_is_a_fixed_parameter_in_pictures(grid):
    axes = grid.isel(q=[1]).survey.map("discriminant")
    assert "$a$" in axes.get_xlabel() and "$q = 0.3$" in axes.get_title()
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), grid.discriminant.isel(q=1))
    other = grid.isel(q=[1]).survey.map("discriminant", x="q")
    assert "$q$" in other.get_xlabel() and "$a$" in other.get_ylabel()


def test_two_fixed_axes_leave_a_row(tmp_path, program):
    axes = {
        "c": {"values": [0.0, 0.1]},
        "q": {"values": [0.1, 0.3]},
        "a": {"start": 0.0, "stop": 2.0, "num": 9},
    }
    (tmp_path / "z.py").write_text(
        "from math import cos, pi\nPARAMETERS = ('a', 'q')\nPERIOD = pi\nEVEN = True\nDAMPING = 'c'\n"
        "def z(u, p):\n    return p[0] - 2 * p[1] * cos(2 * u)\n"
    )
    survey.run({"scene": str(tmp_path / "z.py"), "axes": axes}, output=tmp_path / "o.nc")
    from survey.analysis.point import plane

    row = plane(survey.open(tmp_path / "o.nc"), {"q": "0.3", "c": "0.1"})
    assert row.status.dims == ("a",)
    assert (
        program("plot", "o.nc", "--at", "q=0.3", "--at", "c=0.1", "--var", "exponent").returncode
        == 0
    )
