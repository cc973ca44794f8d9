"""[boundaries] of three axes: curves in the planes of any two, the same as those of a run of two axes."""

import math
import warnings
from itertools import combinations, product

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import survey
from survey.cli import main
from survey.file import reading
from survey.request.workflow import check
from survey.show import boundaries as drawn
from survey.show import figures
from survey.sweep import boundaries, plan


def linear(start, stop, num):
    return {"start": start, "stop": stop, "num": num}


def shifted(damping=0.0, even=True):
    """Mathieu's equation with a shift of a."""
    return survey.hill(
        lambda u, p: p[0] + p[2] - 2.0 * p[1] * np.cos(2.0 * u),
        period=np.pi,
        parameters=("a", "q", "c"),
        even=even,
        damping=damping,
    )


def damped():
    def A(t, p, out):
        out[0, 1], out[1, 0] = 1.0, -(p[0] + p[1] * math.cos(2 * t))
        out[1, 1] = -2 * p[2]

    return survey.floquet(A, period=math.pi, parameters=("a", "q", "c"), states=("x", "v"))


OF_HILL = {"a": linear(-1.0, 5.0, 3), "q": linear(0.5, 1.5, 3), "c": [0.0, 0.5]}
INTEGRALS = {"l": linear(-1.0, 2.0, 2), "beta": linear(-1.5, 1.6, 2), "alpha": linear(-0.7, 0.9, 2)}
STATE = {
    "theta0": linear(0.3, 2.0, 2),
    "p_psi": linear(-0.7, 0.9, 2),
    "p_phi": linear(-1.5, 1.6, 2),
}
AT_REST = {"A": 2.0, "C": 1.0, "epsilon": 0.6, "p_theta0": 0.0, "t": 1.0}
COEFFICIENTS = {"b12": 0.5, "b31": -0.3, "c23": 0.2, "s2": 0.1, "s3": 0.3}
# scene, three axes, other parameters, and which pairs have planes
CASES = {
    "even": (shifted, OF_HILL, {}, 3),
    "not even": (lambda: shifted(even=False), OF_HILL, {}, 1),
    "linear": (
        damped,
        {"a": [1.0, 1.4], "q": linear(0.0, 1.5, 2), "c": linear(0.0, 0.3, 2)},
        {},
        1,
    ),
    "integrals": (lambda: "brun", INTEGRALS, {}, 3),
    "states": (lambda: "brun", STATE, AT_REST, 1),
    "three moments": (
        lambda: "brun_triaxial",
        {"A": [1.2, 1.6], "B": linear(0.9, 1.5, 2), "epsilon": linear(0.2, 0.8, 2)},
        {"C": 1.2, "Omega": 1.0},
        3,
    ),
    "starts": (
        lambda: "gyrostat",
        {"d": [0.2, 0.8], "phi0": linear(-3.0, 3.0, 2), "w0": linear(-3.0, 3.0, 2)},
        COEFFICIENTS,
        1,
    ),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in ("not even", "linear", "states")))
        for name in CASES
    ],
)
def test_planes_of_three_axes_have_the_curves_of_two(name):
    """Those of the last pairs, of which the first axis is not one, to the last bit."""
    scene, axes, fixed, number = CASES[name]
    scene = scene()
    for pair in list(combinations(axes, 2))[::-1][:number]:
        table = {"scene": scene, "axes": axes | fixed, "boundaries": {"plane": list(pair)}}
        workflow = check(table)
        stack = boundaries.find(workflow)
        assert stack.attrs["boundary_planes"] == ", ".join(pair)
        rest = {key: workflow.grid.parameters[key][1].tolist() for key in axes if key not in pair}
        seen = 0
        for values in product(*rest.values()):
            here = dict(zip(rest, values, strict=True))
            two = {key: axes[key] for key in pair} | fixed | here
            one = boundaries.find(check({"scene": scene, "axes": two, "boundaries": {}}))
            own = np.ones(stack.sizes["curve_point"], bool)
            for key, value in here.items():
                own &= stack[f"curve_{key}"].values == value
            for key in (*pair, "position_error"):
                np.testing.assert_array_equal(
                    stack[f"curve_{key}"].values[own], one[f"curve_{key}"].values
                )
            seen += one.sizes["curve_point"]
        assert seen == stack.sizes["curve_point"] > 0


@pytest.fixture(scope="module")
def all_planes(tmp_path_factory):
    """A file with the curves of the planes of every two of three axes."""
    path = tmp_path_factory.mktemp("planes") / "all.nc"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        survey.run(
            {"scene": shifted(), "axes": OF_HILL, "boundaries": {"plane": ["a", "q", "c"]}},
            output=path,
        )
    return path


def test_a_file_may_hold_the_planes_of_every_two_axes(all_planes):
    assert reading.check(all_planes) == []
    ds = xr.load_dataset(all_planes)
    assert ds.attrs["boundary_planes"] == "a, q; a, c; q, c"
    for at in ({"c": 0.5}, {"q": 1.0}, {"a": -1.0}):
        one = {**OF_HILL, **at}
        two = boundaries.find(check({"scene": shifted(), "axes": one, "boundaries": {}}))
        part = ds.survey.slice(**at)
        for key in set(OF_HILL) - set(at):
            np.testing.assert_array_equal(part[f"curve_{key}"], two[f"curve_{key}"])
        axes = part.survey.map()
        assert len(axes.lines) == two.sizes["curve"] > 0
        plt.close(axes.figure)
    # an edge of a row along c is on a curve of its plane of a and c: a straight line, where a + c is constant
    places = np.repeat(np.arange(ds.edge_count.size), ds.edge_count.values.ravel())
    a = np.unravel_index(places, ds.edge_count.shape)[0]
    curve = np.repeat(np.arange(ds.sizes["curve"]), ds.curve_count.values)
    for edge in np.flatnonzero(ds.edge_curve.values >= 0):
        own = curve == ds.edge_curve.values[edge]
        order = np.argsort(ds.curve_a.values[own])
        points = (ds[name].values[own][order] for name in ("curve_a", "curve_c"))
        here = np.interp(ds.a.values[a[edge]], *points, left=np.nan, right=np.nan)
        assert abs(here - ds.edge_position.values[edge]) < 1e-9
    # folds in the planes of which they are
    assert set(np.unique(ds.curve_q.values[np.isin(curve, ds.fold_curve.values)])) >= set(
        np.unique(ds.fold_q.values[ds.fold_q_error.values == 0.0])
    )


def test_pictures_show_a_plane_of_curves_or_say_where_they_lie(tmp_path, capsys):
    path = str(tmp_path / "map.nc")
    workflow = {"scene": shifted(), "axes": OF_HILL, "boundaries": {"plane": ["q", "c"]}}
    ds = survey.run(workflow, output=path)
    axes = ds.survey.map()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$q$", "$c$") and len(axes.lines) > 0
    plt.close(axes.figure)
    words = r"lie in planes of q and c, not of a and q; run the workflow with plane = \['a', 'q'\]"
    for asked in (lambda: ds.survey.map(x="a", y="q"), ds.survey.slice(c=0.5).survey.map):
        with pytest.warns(UserWarning, match=words):
            axes = asked()
        assert len(axes.lines) == 0
        plt.close(axes.figure)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        axes = ds.survey.slice(a=2.0).survey.map()
        plt.close(axes.figure)
        axes = ds.survey.slice(c=0.5).survey.map(boundaries=False)
        plt.close(axes.figure)
    capsys.readouterr()
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["plot", path, "-o", str(tmp_path / "c.png"), "--at", "c=0.5"])
    assert "planes of q and c, not of a and q" in capsys.readouterr().err
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["plot", path, "-o", str(tmp_path / "a.png"), "--at", "a=2"])
    assert "planes" not in capsys.readouterr().err
    # a finer part of a plane has its curves, that of another has none
    finer = ds.survey.slice(a=2.0).survey.zoom(q=(0.6, 1.4), num=3)
    assert finer.sizes["curve"] > 0 and "boundary_planes" not in finer.attrs


def test_files_without_the_attribute_are_drawn_as_before(tmp_path):
    ds = survey.run(
        {"scene": shifted(), "axes": OF_HILL, "boundaries": {}}, output=tmp_path / "m.nc"
    )
    old = ds.drop_attrs(deep=False).assign_attrs(
        {key: value for key, value in ds.attrs.items() if key != "boundary_planes"}
    )
    assert ds.attrs["boundary_planes"] == "a, c"
    assert drawn.planes_of(old) == drawn.planes_of(ds) == (("a", "c"),)
    assert drawn.plane_of(old) == ["a", "c"]
    figure = figures.draw(old, "verdict")
    assert len(figure.axes[0].lines) > 0
    plt.close(figure)


def test_the_plan_counts_the_maps():
    def seconds(names):
        table = {"scene": shifted(), "axes": OF_HILL, "boundaries": {"plane": names}}
        return plan.estimates(check(table))[0]["further"]

    assert seconds(["a", "q"]) < seconds(["q", "c"]) < seconds(["a", "q", "c"])


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"plane": ["a"]}, r"boundaries.plane = \['a'\]: give two different axes"),
        ({"plane": ["a", "a"]}, "give two different axes"),
        ({"plane": []}, "give two different axes"),
        ({"plane": ["a", "cc"]}, "boundaries.plane: unknown axis 'cc'; did you mean 'c'"),
        (
            {"plane": "a"},
            r"it must be a list, such as --set 'boundaries.plane=\[\"NAME\", \"OTHER\"\]'",
        ),
        ({"axis": ["a", "c"]}, "it must be the name of one axis; plane names the two axes"),
        ({"plane": ["a", "q"], "axis": "c"}, "must be one of the axes of boundaries.plane, a, q"),
        ({"plane": ["a", "q"], "surfaces": True}, "surfaces lie in no plane"),
    ],
)
def test_what_is_no_plane_is_refused(table, words):
    with pytest.raises(survey.BadInput, match=words) as refused:
        check({"scene": shifted(), "axes": OF_HILL, "boundaries": table})
    assert "\n" not in str(refused.value)


def test_a_plane_without_curves_names_one_that_has_them():
    axes = CASES["starts"][1] | COEFFICIENTS
    for table in ({}, {"plane": ["d", "w0"]}):
        with pytest.raises(
            survey.BadInput, match=r"set plane = \['phi0', 'w0'\] under \[boundaries\]"
        ):
            check({"scene": "gyrostat", "axes": axes, "boundaries": table})
