"""[boundaries] in a workflow: edges in the netCDF file as ragged arrays, drawn over the map."""

from concurrent.futures import ThreadPoolExecutor

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from hill_qep import edges as eigenproblem

import survey
from survey.cli import main
from survey.errors import Stopped
from survey.file import reading
from survey.measures.hill import curves as hill_curves
from survey.request.workflow import check
from survey.show import figures
from survey.sweep import boundaries, plan

WORKFLOW = {
    "scene": "satellite",
    "options": {"body": "oblate"},
    "axes": {
        "k": {"start": 0.1, "stop": 0.8, "num": 5},
        "rho": {"start": 0.3, "stop": 2.2, "num": 60},
    },
    "output": {"variables": ["verdict"]},
    "boundaries": {},
}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("boundaries") / "map.nc"
    survey.run(WORKFLOW, output=path)
    return path


def test_the_edges_lie_where_the_verdict_changes(path):
    ds = xr.load_dataset(path)
    assert reading.check(path) == [] and ds.edge_count.attrs["sample_dimension"] == "edge"
    assert (
        ds.edge_complete.values.tolist() == [1] * 5 and int(ds.edge_count.sum()) == ds.sizes["edge"]
    )
    ends = np.cumsum(ds.edge_count.values)
    for row, (last, number) in enumerate(zip(ends, ds.edge_count.values, strict=True)):
        own = ds.edge_position.values[last - number : last]
        assert (np.diff(own) >= 0).all()
        # an odd number of edges between neighbours of the map is a change of the verdict
        inside = np.histogram(own, ds.rho.values)[0]
        np.testing.assert_array_equal(inside % 2 == 1, np.diff(ds.verdict.values[row]) != 0)
    assert (ds.edge_position_error < 1e-12).all()


def test_the_plan_counts_rows_and_bytes(path):
    planned, ds = plan.plan(check(WORKFLOW, output=path))["edges"], xr.load_dataset(path)
    assert planned["rows"] == ds.sizes["k"]
    for dim, key in (("edge", "bytes_per_edge"), ("curve_point", "bytes_per_curve_point")):
        assert planned[key] * ds.sizes[dim] == sum(
            v.nbytes for v in ds.variables.values() if v.dims == (dim,)
        )


def test_the_tongue_n_2_opens_with_half_the_square(path):
    """Oblate tongue n = 2: k^2 / 2 wide about 1 + k^2 / 12 (satellite.md: What is known)."""
    ds = xr.load_dataset(path)
    first = slice(0, int(ds.edge_count[0]))
    own = ds.edge_position.values[first][ds.edge_index.values[first] == 2]
    assert own.size == 2
    np.testing.assert_allclose([np.ptp(own), own.mean() - 1], [0.01 / 2, 0.01 / 12], rtol=0.03)


def test_each_edge_lies_on_its_curve(path):
    ds = xr.load_dataset(path)
    assert (
        ds.curve_count.attrs["sample_dimension"] == "curve_point"
        and int(ds.curve_count.sum()) == ds.curve_k.size
    )
    assert (ds.curve_complete == 1).all() and (ds.curve_position_error < 1e-13).all()
    assert (ds.edge_curve >= 0).all()
    np.testing.assert_array_equal(ds.edge_class, ds.curve_class[ds.edge_curve])
    np.testing.assert_array_equal(ds.edge_index, ds.curve_index[ds.edge_curve])
    ends = np.cumsum(ds.curve_count.values)
    k = np.repeat(ds.k.values, ds.edge_count.values)
    for edge in range(ds.sizes["edge"]):
        last, number = (
            values[int(ds.edge_curve[edge])] for values in (ends, ds.curve_count.values)
        )
        own = slice(last - number, last)
        order = np.argsort(ds.curve_k.values[own])
        along = np.interp(k[edge], ds.curve_k.values[own][order], ds.curve_rho.values[own][order])
        assert abs(along - ds.edge_position.values[edge]) < 2e-3


def test_a_curve_between_the_rows_is_found_and_its_fold_in_the_file(tmp_path):
    """Oblate tongue n = 2: its upper edge has its greatest rho, 1.149, between these rows of rho."""
    axes = {"rho": {"values": [1.1487, 1.1493]}, "k": {"start": 0.3, "stop": 0.95, "num": 4}}
    ds = survey.run(
        WORKFLOW | {"axes": axes, "boundaries": {"axis": "k"}, "output": {}},
        output=tmp_path / "fold.nc",
    )
    assert ds.sizes["fold"] == 1 and ds.fold_rho.attrs["ancillary_variables"] == "fold_rho_error"
    assert int(ds.curve_index[int(ds.fold_curve[0])]) == 2
    assert 1.1487 < float(ds.fold_rho[0]) < 1.1493 and float(ds.fold_rho_error[0]) < 1e-12
    assert float(ds.fold_k_error[0]) < 1e-9


def test_the_bits_are_the_same_on_any_number_of_threads_and_in_any_order():
    workflow = check(WORKFLOW, output="unused.nc")

    def shuffled(task, numbers, what):
        with ThreadPoolExecutor(3) as pool:
            return list(pool.map(task, reversed(numbers)))[::-1]

    one, other = boundaries.find(workflow), boundaries.find(workflow, shuffled)
    xr.testing.assert_identical(one, other)


def test_they_are_drawn_over_the_map(path):
    ds = survey.open(path)
    figure = figures.draw(ds)
    drawn = sum(line.get_xydata().shape[0] for line in figure.axes[0].lines)
    assert drawn == ds.sizes["curve_point"] and len(figure.axes[0].lines) == ds.sizes["curve"]
    assert figure.legends[0].get_texts()[-1].get_text().startswith("edges: even dark")
    plt.close(figure)


def test_a_map_without_tongues_has_empty_curves(tmp_path):
    axes = {
        "q": {"start": 0.0, "stop": 0.1, "num": 3},
        "a": {"start": -3.0, "stop": -2.0, "num": 4},
    }
    ds = survey.run(
        {"scene": "mathieu", "axes": axes, "boundaries": {}}, output=tmp_path / "none.nc"
    )
    assert (
        ds.sizes["edge"] == ds.sizes["curve"] == ds.sizes["fold"] == 0
        and (ds.edge_complete == 1).all()
    )
    figures.draw(survey.open(tmp_path / "none.nc"))
    plt.close("all")


@pytest.mark.slow
def test_rows_through_a_value_where_tongues_accumulate(tmp_path, capsys):
    """Inertia ratio 1 is left out, and named; all other edges are those of the eigenproblem in rho,
    both bodies'.
    """
    (tmp_path / "through.toml").write_text(
        'scene = "satellite"\naxes.amplitude.values = [0.3, 1.1]\n'
        "axes.inertia_ratio = {start = 0.0, stop = 2.0, num = 20}\n"
        'boundaries.axis = "inertia_ratio"\noutput.variables = ["verdict"]\n'
    )
    with pytest.raises(SystemExit, match="0"):
        main(["run", str(tmp_path / "through.toml"), "-o", str(tmp_path / "through.nc")])
    assert (
        "edges: not searched for inertia_ratio from 0.998 to 1.002, where they accumulate"
        in capsys.readouterr().err
    )
    ds = xr.load_dataset(tmp_path / "through.nc")
    assert (
        ds.attrs["edge_left_out"] == "inertia_ratio from 0.998 to 1.002"
        and ds.edge_complete.values.all()
    )
    row = np.repeat([0, 1], ds.edge_count.values)
    alpha, kind, error = (
        ds.edge_position.values,
        ds.edge_class.values,
        ds.edge_position_error.values,
    )
    for number, amplitude in enumerate(ds.amplitude.values):
        for body, side in (("prolate", alpha < 1), ("oblate", alpha > 1)):
            own = (row == number) & side
            rho = 1 / np.sqrt(3 * abs(1 - alpha[own]))
            true = np.array(eigenproblem(body, np.sin(amplitude), 3**-0.5, 0.006**-0.5, 64))
            order, other = np.lexsort((rho, kind[own])), np.lexsort(true.T)
            np.testing.assert_array_equal(kind[own][order], true[other, 1])
            assert (
                abs(rho[order] - true[other, 0])
                <= 1e-12 + 1.5 * rho[order] ** 3 * error[own][order]
            ).all()


@pytest.mark.parametrize(
    ("name", "axis"),
    # k = 1 would be the middle one of the columns that are searched
    [
        ("k", {"start": 0.0, "stop": 2.0, "num": 41}),
        ("one_minus_k", {"start": 0.5, "stop": -0.5, "num": 40}),
    ],
)
def test_rows_through_the_separatrix(tmp_path, name, axis):
    """On both sides of k = 1 the edges lie where the verdict changes, and no column is searched on it."""
    axes = {"rho": {"values": [-1.2, 0.6, 1.5]}, name: axis}
    ds = survey.run(
        {"scene": "satellite", "axes": axes, "boundaries": {"axis": name}},
        output=tmp_path / "both.nc",
    )
    low, high = map(float, ds.attrs["edge_left_out"].removeprefix(f"{name} from ").split(" to "))
    assert ds.edge_complete.values.all()
    middle = (1.0 - axis["start"]) / (axis["stop"] - axis["start"]) if name == "k" else 0.5
    pieces = boundaries._pieces(
        check({"scene": "satellite", "axes": axes, "boundaries": {"axis": name}}), name
    )
    assert (abs(boundaries._columns(pieces) - middle) > 1e-4).all() and boundaries._columns(
        pieces
    ).size == 9
    ends = np.cumsum(ds.edge_count.values)
    places = np.sort(ds[name].values)
    own = [
        ds.edge_position.values[last - count : last]
        for last, count in zip(ends, ds.edge_count.values, strict=True)
    ]
    for side in (places[places < low], places[places > high]):
        for row, rho in enumerate(ds.rho.values):
            inside = np.histogram(own[row], side)[0]
            verdicts = survey.evaluate(
                "satellite", **{name: side}, rho=rho, variables=["verdict"]
            ).verdict.values
            np.testing.assert_array_equal(inside % 2 == 1, np.diff(verdicts) != 0)


def test_what_is_left_out_across_the_rows_is_reported(tmp_path):
    axes = {
        "k": {"start": 0.8, "stop": 1.2, "num": 6},
        "rho": {"start": 1.0, "stop": 1.2, "num": 9},
    }
    ds = survey.run(
        {"scene": "satellite", "axes": axes, "boundaries": {"axis": "rho"}},
        output=tmp_path / "across.nc",
    )
    low, high = map(float, ds.attrs["edge_left_out"].removeprefix("k from ").split(" to "))
    assert (low, high) == (0.9996, 1.0004)
    inside = (ds.curve_k.values > low + 1e-9) & (ds.curve_k.values < high - 1e-9)
    assert (
        ds.sizes["curve"] > 0
        and not inside.any()
        and ds.attrs["curves_lost"] == (ds.curve_complete == 0).sum()
    )


def test_a_value_that_rounds_to_the_one_left_out(tmp_path):
    axes = {"one_minus_k": {"values": [-0.5, 1e-17, 0.5]}, "rho": 1.2}
    asked = {"scene": "satellite", "axes": axes, "boundaries": {}}
    ((_, low), (high, _)) = boundaries._parts(check(asked), "one_minus_k")
    assert low < 0 < high < 1e-14
    assert int(survey.run(asked, output=tmp_path / "near.nc").edge_complete) == 1


@pytest.mark.slow
def test_lost_curves_are_reported(tmp_path, capsys):
    """Edges of an oblate body near the separatrix lie closer together than float64 can follow."""
    (tmp_path / "lost.toml").write_text(
        'scene = "satellite"\noptions.body = "oblate"\naxes.rho = {start = 0.1, stop = 3.0, num = 5}\n'
        'axes.k = {start = 0.1, stop = 0.9999999, num = 4}\nboundaries.axis = "rho"\noutput.variables = ["verdict"]\n'
    )
    with pytest.raises(SystemExit, match="0"):
        main(["run", str(tmp_path / "lost.toml"), "-o", str(tmp_path / "lost.nc")])
    lost = int((xr.load_dataset(tmp_path / "lost.nc").curve_complete == 0).sum())
    assert lost > 1 and f"edges: {lost} curves could not be followed" in capsys.readouterr().err


def test_no_edge_is_missed_at_the_end_of_an_axis(tmp_path):
    """Edges accumulate towards 1 - k = 1e-12, on an axis 5e11 times as long: two for each tongue
    passed in all.
    """
    for low, rho in ((1e-9, 1.5), (1e-12, 1.5), (1e-12, 0.7)):
        axes = {"one_minus_k": {"start": low, "stop": 0.5, "num": 4}, "rho": rho}
        ds = survey.run(
            {"scene": "satellite", "axes": axes, "boundaries": {}},
            output=tmp_path / f"{low}-{rho}.nc",
        )
        assert int(ds.edge_complete) == 1
        tongues = np.floor(2 * ds.rotation_number.values)
        assert (ds.verdict.values[[0, -1]] == 1).all() and int(ds.edge_count) == 2 * (
            tongues[0] - tongues[-1]
        )


def test_a_map_of_one_row_has_edges_and_no_curves(tmp_path, recwarn):
    axes = {"q": {"values": [1.0]}, "a": {"start": -1.0, "stop": 10.0, "num": 4}}
    ds = survey.run(
        {"scene": "mathieu", "axes": axes, "boundaries": {"axis": "a"}}, output=tmp_path / "one.nc"
    )
    assert ds.edge_count.values.tolist() == [7] and "curve_count" not in ds and not recwarn.list
    plt.close(figures.draw(ds))


def test_a_row_of_its_own(tmp_path):
    axes = {"a": {"start": -1.0, "stop": 10.0, "num": 4}, "q": 1.0}
    ds = survey.run(
        {"scene": "mathieu", "axes": axes, "boundaries": {"axis": "a"}}, output=tmp_path / "row.nc"
    )
    assert ds.edge_index.values.tolist() == [0, 1, 1, 2, 2, 3, 3] and int(ds.edge_complete) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"axes": WORKFLOW["axes"] | {"rho": {"values": [0.5]}}},
            "boundaries: the axis rho has one value, but edges need a range",
        ),
        (
            {"boundaries": {"axis": "rhoo"}},
            r"boundaries.axis: unknown axis 'rhoo'; did you mean 'rho'",
        ),
        ({"boundaries": {"axes": "rho"}}, r"unknown key boundaries.axes; did you mean 'axis'"),
        (
            {"axes": {"k": 0.5, "rho": 1.0}},
            r"boundaries: they are drawn along an axis, and there is none",
        ),
        (
            {
                "scene": "brun",
                "axes": {"l": 0.5, "alpha": 0.1, "beta": 0.2, "ratio": {"values": [0.2, 0.8]}},
                "options": {"sign": "1"},
            },
            r"no boundaries are known along ratio: curves are known on two or three axes of l, alpha, beta",
        ),
    ],
)
def test_what_cannot_be_is_refused(changes, words):
    with pytest.raises(survey.BadInput, match=words):
        survey.run(WORKFLOW | {"output": {}} | changes)


def test_rows_whose_edges_are_known_are_kept_by_a_run_that_stops(path, tmp_path, monkeypatch):
    def stop(*_):
        raise Stopped("a power cut")

    with monkeypatch.context() as patch:
        patch.setattr(hill_curves, "trace", stop)
        with pytest.raises(Stopped, match="power cut"):
            survey.run(WORKFLOW, output=tmp_path / "map.nc")
    monkeypatch.setattr(boundaries, "_row_solver", stop)  # none is to be found again
    again = survey.run(WORKFLOW, output=tmp_path / "map.nc")
    xr.testing.assert_equal(again.drop_attrs(), xr.load_dataset(path).drop_attrs())


def test_progress_of_several_maps_is_reported_by_the_map():
    """And the curves, found on threads, are those of one map after another."""
    scene = survey.hill(
        lambda u, p: p[0] - 2.0 * p[1] * np.cos(2.0 * u) - p[2],
        period=np.pi,
        parameters=("a", "q", "c"),
        even=True,
    )
    axes = {
        "q": {"start": 0.1, "stop": 1.0, "num": 2},
        "a": {"start": -1.0, "stop": 5.0, "num": 3},
        "c": [0.0, 0.5, 1.0],
    }
    stack = check({"scene": scene, "axes": axes, "boundaries": {"axis": "a"}})
    told = []

    def each(task, items, what):
        told.append((what, len(items)))
        with ThreadPoolExecutor(3) as pool:
            return list(pool.map(task, items))

    found = boundaries.find(stack, each)
    assert told == [("parts of the edges", 1), ("maps of the curves", 3)]
    told.clear()
    one = {**axes, "c": 0.5}
    middle = boundaries.find(
        check({"scene": scene, "axes": one, "boundaries": {"axis": "a"}}), each
    )
    assert told[0] == ("parts of the edges", 1) and "maps of the curves" not in dict(told)
    of_middle = found.curve_c.values == 0.5
    for name in ("curve_a", "curve_q", "curve_position_error"):
        np.testing.assert_array_equal(found[name][of_middle], middle[name])
