"""`ds.survey`: each question asked of small surveys, and its answer compared with something it was
not made from.
"""

import json
import math
import os
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import dask.array as da
import matplotlib
import mpmath
import numpy as np
import pytest
import xarray as xr
from scipy import special

import survey
from survey import status
from survey.errors import BadInput
from survey.scenes import gyrostat

matplotlib.use("Agg")
GYROSTAT = "b12", "b31", "d", "c23", "s2", "s3", "phi0", "w0"
FATES = Path(__file__).parent.parent / "results/gyrostat_fate_small.nc"
STATE = {"A": 1.0, "C": 0.5, "epsilon": 3.0, "p_theta0": 0.3}


@pytest.fixture(scope="module")
def mathieu():
    return survey.evaluate("mathieu", a=np.linspace(-1.0, 5.0, 31), q=np.linspace(0.1, 2.0, 20))


@pytest.fixture(scope="module")
def toy():
    """A disc of radius 0.3 that is unstable, in the unit square; some points undecided, failed and
    outside.
    """
    x, y = np.linspace(0, 1, 101), np.linspace(0, 1, 81)
    verdict = np.where(np.hypot(x[:, None] - 0.5, y - 0.5) < 0.3, 0, 1).astype(np.int8)
    state = np.zeros(verdict.shape, np.int8)
    verdict[:3, :3], verdict[-5:, -5:], state[-5:, -5:] = -1, -1, status.STEP_LIMIT
    flags = {
        "flag_values": np.array([-1, 0, 1], np.int8),
        "flag_meanings": "undecided unstable stable",
    }
    return xr.Dataset(
        {"verdict": (("k", "rho"), verdict, flags), "status": (("k", "rho"), state)},
        {"k": x, "rho": y}, {"scene": "satellite", "options": "body=prolate", "title": "A toy map"},
    )  # fmt: skip


def within(value, exact, bar):
    """Is the true error within the bar, which is no wider than some thousand roundings of the
    motion's size?
    """
    return abs(mpmath.mpf(float(value)) - exact) <= float(bar) < 1e-9 * (1 + abs(exact))


def close(one, other, bar):
    """Do two numbers agree within the bar, which is no excuse for anything?"""
    return abs(float(one) - float(other)) <= bar < 1e-6 * (1 + abs(float(other)))


@pytest.mark.parametrize("first", ["survey, xarray", "xarray, survey"])
def test_any_order_of_imports_registers_the_accessor(first):
    code = f"import importlib.util as u, sys; u.find_spec('xarray'); import {first}; xarray.Dataset.survey.map"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_figures_leave_the_backend_of_a_notebook_alone():
    code = "import survey.show.figures, matplotlib; assert matplotlib.get_backend() == 'svg', matplotlib.get_backend()"
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ | {"MPLBACKEND": "svg"})


@pytest.mark.parametrize("wrong", [{"var": "nonsense"}, {"x": "nonsense"}, {"cmap": "nonsense"}])
def test_a_refused_map_leaves_no_figure_and_closes_no_other(toy, wrong):
    import matplotlib.pyplot as plt

    own = plt.figure().subplots()
    before = plt.get_fignums()
    for ax in (None, own):
        with pytest.raises(BadInput):
            toy.survey.map(ax=ax, **wrong)
    assert plt.get_fignums() == before
    plt.close(own.figure)


def test_a_map_marks_what_is_undecided_or_failed_on_any_axes(toy):
    own = toy.survey.map()
    legend = [text.get_text() for text in own.figure.legends[0].get_texts()]
    assert {"undecided (9)", "failed (25)"} < set(legend)
    given = matplotlib.figure.Figure().subplots(1, 2)[1]
    assert toy.survey.map(ax=given) is given
    assert [text.get_text() for text in given.get_legend().get_texts()] == legend


def test_a_slice_is_a_row_of_the_map_and_draws_its_error_band(mathieu):
    row = mathieu.survey.slice(q=1.02)
    xr.testing.assert_identical(row.y1, mathieu.y1.sel(q=1.02, method="nearest"))
    axes = row.survey.map("y1")
    assert axes.get_xlabel() == "characteristic value, $a$" and len(axes.collections) == 1
    assert "verdict_counts" not in row.attrs


def test_a_point_is_the_nearest_one_with_its_bars_and_reasons(mathieu):
    point = mathieu.survey.point(a=1.02, q=0.49)
    assert point.parameters == {"a": float(mathieu.a[10]), "q": float(mathieu.q[4])}
    assert point.verdict == "unstable" and point.status == "ok"
    assert "y1 y2' = " in point.why and "< 0 at T/2" in point.why
    text = repr(point)
    assert "verdict: unstable" in text and f"+- {float(point.dataset.y1_error):.2g}" in text
    assert "<table>" in point._repr_html_() and "&lt; 0 at T/2" in point._repr_html_()
    assert point.dataset.y1 == mathieu.y1[10, 4]


@pytest.mark.parametrize(
    ("scene", "given", "words"),
    [
        ("mathieu", {"a": 4.0, "q": 0.0}, "exact rule"),
        ("mathieu", {"a": 0.5, "q": 0.1}, "times their error bars"),
        ("mathieu", {"a": 0.5, "q": 0.1, "variables": ["verdict"]}, "does not contain"),
        ("satellite", {"k": [0.5, 1.0], "rho": 1.0}, "invalid_parameters"),
        ("libration", {"mu": 0.012}, "M_ray = -148."),
        ("libration", {"mu": 0.01}, "have the same sign"),
        ("libration", {"mu": 0.05}, "mu > mu_R"),
        ("libration_elliptic", {"mu": 0.05, "e": 0.1}, "is not positive (at 0 two pairs meet)"),
        ("libration_elliptic", {"mu": 0.01, "e": 0.1}, "> 0, and so are"),
        pytest.param(
            "brun",
            STATE | {"theta0": 1.0, "p_psi": 0.6, "p_phi": 0.4},
            "beyond the error bars",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "brun",
            STATE | {"theta0": 1.0, "p_psi": 0.5, "p_phi": 0.5},
            "passes a pole",
            marks=pytest.mark.slow,
        ),
        ("brun", {"l": 1.0, "alpha": 0.2, "beta": 0.1}, "separatrix_distance = "),
    ],
)
def test_every_scene_says_why(scene, given, words):
    ds = survey.evaluate(scene, **given)
    last = {dim: float(ds[dim][-1]) for dim in ds.status.dims}
    assert words in ds.survey.point(**last).why


def test_a_portrait_says_why():
    found = {"K": 0.06, "K_error": 1e-16, "stratum": "G", "verdict": "structurally_stable"}
    found |= {
        "cycle_multiplier": np.array([np.nan, 1.1, 0.95]),
        "cycle_multiplier_error": np.full(3, 1e-12),
    }
    words = "stratum G, K = 0.06 +- 1e-16, the multiplier nearest to 1 is 0.95 +- 1e-12: no margin is within"
    assert gyrostat.why(found).startswith(words)


def test_a_portrait_beside_a_fold_says_so():
    """1.6e-12 beside a fold at which f is 0.03."""
    p = {
        "b12": -0.14140811534218814,
        "b31": 0.23442711423437074,
        "d": 0.09151670328235219,
        "c23": 0.5803500161908991,
        "s2": -0.7045029491084941,
        "s3": 0.7110221663925083,
    }
    portrait = survey.evaluate("gyrostat", question="portrait", **p)
    assert int(portrait.verdict) == -1
    assert "fold of equilibria" in portrait.survey.point().why


def test_a_fate_says_why():
    fates = survey.open(FATES).survey
    assert "limit_phi = 2.6135" in fates.point(phi0=0.3, w0=0.0).why
    assert "K = b12 s3 - b31 s2 = 0.06" in fates.point(phi0=0.3, w0=4.0).why


@pytest.mark.parametrize(
    ("scene", "given"),
    [
        ("mathieu", {"a": 3.0, "q": 0.7}),
        ("mathieu", {"a": 1.0, "q": 0.5}),
        ("satellite", {"k": 0.5, "rho": 1.2, "body": "oblate"}),
        # 173 steps would do for half a period
        ("satellite", {"amplitude": 0.974, "inertia_ratio": 0.69}),
        ("satellite", {"one_minus_k": -0.5, "inertia_ratio": 0.6, "direction": "-1"}),
    ],
)
def test_solutions_of_hills_equation_pass_through_the_factors(scene, given):
    known = survey.evaluate(scene, method="dop853", rtol=1e-12, **given)
    motion = known.survey.trajectory(figure=False)
    (time,) = motion.y1.dims
    half = motion.sel({time: 0.5 * float(known.period)}, method="nearest")
    assert abs(half[time] - 0.5 * known.period) < 1e-12
    for name in ("y1", "y2"):
        assert close(half[name], known[name], float(half[f"{name}_error"] + known[f"{name}_error"]))
    assert close(
        motion.multiplier_real.sum(), known.discriminant, 2 * float(motion.multiplier_error.max())
    )
    size = np.hypot(motion.multiplier_real, motion.multiplier_imag)
    assert (abs(size - 1) <= motion.multiplier_error).all() == (known.verdict == 1)


def test_ones_own_equation_has_points_trajectories_and_zooms():
    def z(u, p):
        return p[0] + p[1] * math.cos(u) + 0.1 * math.sin(2 * u)

    own = survey.hill(z, period=2 * math.pi, parameters=("a", "b"))
    ds = survey.evaluate(own, a=[0.25, 0.5], b=0.3)
    assert "its error bar: |D| > 2" in ds.survey.point(a=0.25).why
    motion = ds.survey.trajectory(a=0.5, figure=False)
    end = motion.sel(u=2 * math.pi, method="nearest")
    assert close(end.y1, ds.y1[1], float(end.y1_error + ds.y1_error[1]))
    xr.testing.assert_equal(ds.survey.zoom(a=(0.25, 0.5)).y1, ds.y1)


def test_options_without_a_motion_are_refused_in_one_line(monkeypatch):
    monkeypatch.setattr(
        "survey.scenes.mathieu.trajectory", lambda point, answer, options, time=None: None
    )
    with pytest.raises(survey.BadInput, match=r"^the scene mathieu draws no trajectory$"):
        survey.evaluate("mathieu", a=1.5, q=0.1).survey.trajectory()


@pytest.mark.parametrize("mu", [0.01, 0.05])
def test_the_orbit_beside_l4_is_the_exponential_of_the_matrix(mu):
    motion = survey.evaluate("libration", mu=mu).survey.trajectory(figure=False)
    with mpmath.workdps(25):
        s = mpmath.sqrt(1 - 3 * mpmath.mpf(mu) * (1 - mpmath.mpf(mu)))
        matrix = mpmath.matrix(
            [[0, 0, 1, 0], [0, 0, 0, 1], [1.5 * (1 + s), 0, 0, 2], [0, 1.5 * (1 - s), -2, 0]]
        )
        for i in (1, motion.sizes["f"] // 2, -1):
            exact = mpmath.expm(matrix * mpmath.mpf(float(motion.f[i])))
            for j, name in enumerate(("xi", "eta")):
                assert within(motion[name][i], exact[j, 0], motion[f"{name}_error"][i])


@pytest.mark.parametrize("k", [0.3, 0.999])
def test_the_second_solution_of_lames_equation_is_sn_within_its_bars(k):
    motion = survey.evaluate("satellite", k=k, rho=0.0).survey.trajectory(figure=False)
    with mpmath.workdps(25):
        for i in range(1, motion.sizes["u"], motion.sizes["u"] // 20):
            exact = mpmath.ellipfun("sn", mpmath.mpf(float(motion.u[i])), k=mpmath.mpf(k))
            assert within(motion.y2[i], exact, motion.y2_error[i])


@pytest.mark.parametrize(("a", "q"), [(3.0, 0.7), (-2.0, 4.0)])
def test_solutions_of_mathieus_equation_are_within_their_bars(a, q):
    motion = survey.evaluate("mathieu", a=a, q=q).survey.trajectory(figure=False, time=2.0)
    with mpmath.workdps(25):
        exact = mpmath.odefun(
            lambda t, y: [y[1], -(a - 2 * q * mpmath.cos(2 * t)) * y[0]], 0, [1, 0]
        )
        for i in (1, motion.sizes["t"] // 2, -1):
            assert within(
                motion.y1[i], exact(mpmath.mpf(float(motion.t[i])))[0], motion.y1_error[i]
            )


def test_multipliers_of_the_elliptic_problem_are_those_of_its_monodromy():
    from survey.measures import linear_motion
    from survey.measures.libration import motion as libration_motion

    ds = survey.evaluate("libration_elliptic", mu=[0.01, 0.05], e=0.3)
    for mu in ds.mu.values:
        motion = ds.survey.trajectory(mu=mu, figure=False)
        found = motion.multiplier_real.values + 1j * motion.multiplier_imag.values
        matrices, lengths = libration_motion.coefficients(mu, 0.3)
        _, y, bars = linear_motion.fundamental(matrices, lengths, 1)
        point = ds.sel(mu=mu)
        assert close(np.trace(y[-1]), point.a, np.trace(bars[-1]) + float(point.a_error))
        off = abs(found[:, None] - np.linalg.eigvals(y[-1]))  # each is near one, and one near each
        off = np.append(off.min(axis=0), off.min(axis=1))
        assert (off < 1e-7 * abs(found).max() + motion.multiplier_error.max().item()).all()
        assert motion.attrs["panels"] == "plane eta xi; multipliers"


def test_the_orbit_of_a_gyrostat_ends_where_its_reference_does():
    case = json.loads((files("survey.reference") / "gyrostat_trajectories.json").read_text())[
        "trajectories"
    ][0]
    numbers = [float.fromhex(case[key]) for key in ("phi0_hex", "w0_hex")]
    given = dict(zip(GYROSTAT, [*map(float.fromhex, case["p_hex"]), *numbers], strict=True))
    ds = survey.evaluate("gyrostat", question="trajectory", t=1.0, **given)
    motion = ds.survey.trajectory(time=float(case["t"]), figure=False).isel(t=-1)
    for name in ("phi", "w"):
        assert within(motion[name], mpmath.mpf(case[name]), motion[f"{name}_error"])


@pytest.mark.parametrize(
    "given",
    [
        {"theta0": 1.0, "p_psi": 0.6, "p_phi": 0.4, **STATE},
        {"theta0": 1.0, "p_psi": 0.5, "p_phi": 0.5, **STATE},  # passes the upper pole
        {"theta0": 2.0, "p_psi": 0.5, "p_phi": -0.5, **STATE},  # and the lower one
        {"l": 1.0, "alpha": 0.2, "beta": 0.1},
        {"l": 1.0, "alpha": 0.2, "beta": 0.3, "sign": "-1"},
    ],
)
def test_the_axis_of_a_body_moves_on_the_sphere_without_jumps(given):
    ds = survey.evaluate("brun", **given)
    motion = ds.survey.trajectory()
    path = np.stack([motion[f"axis_{name}"] for name in "xyz"])
    speed = np.linalg.norm(np.diff(path), axis=0) / np.diff(motion.t)
    np.testing.assert_allclose((path**2).sum(axis=0), 1.0, atol=1e-12)
    assert np.abs(np.diff(speed)).max() < 0.1 * speed.max()
    low, high = (
        float(np.nanmin(ds.u_min)),
        float(ds.u_max.values.ravel()[np.nanargmin(ds.u_min.values.ravel())]),
    )
    assert motion.u.min() == pytest.approx(low, abs=1e-5) and motion.u.max() == pytest.approx(
        high, abs=1e-5
    )


def test_the_boundary_between_points_holds_the_true_one(mathieu):
    places = mathieu.survey.boundary()
    lowest = places.where((places.q_error == 0) & (places.a > 2.5), drop=True)
    assert lowest.place.size > 20
    for a, bar, q in zip(lowest.a.values, lowest.a_error.values, lowest.q.values, strict=True):
        edges = [special.mathieu_a(2, q), special.mathieu_b(2, q)]
        assert min(abs(a - edge) for edge in edges) <= bar


@pytest.fixture(scope="module")
def tongues(tmp_path_factory):
    """A file with edges, curves and cells."""
    workflow = {
        "scene": "mathieu", "title": "Tongues", "boundaries": {}, "refine": {"width": 0.1},
        "axes": {"q": {"start": 0.5, "stop": 1.5, "num": 4}, "a": {"start": 2.5, "stop": 6.0, "num": 6}},
    }  # fmt: skip
    path = tmp_path_factory.mktemp("tongues") / "tongues.nc"
    survey.run(workflow, output=path)
    return path


def test_the_boundary_in_a_file_is_chosen_by_class_and_index(tongues):
    ds = survey.open(tongues)
    edge = ds.survey.boundary(kind="even_periodic", index=2)
    off = abs(edge.a.values - special.mathieu_a(2, edge.q.values))
    assert edge.place.size > 4 and (off <= 3.5 * edge.position_error + 1e-9).all()
    rows = ds.drop_vars([name for name in ds if name.startswith("curve")]).survey.boundary(index=2)
    assert sorted(np.unique(rows.q)) == ds.q.values.tolist() and rows.place.size == 8
    with pytest.raises(BadInput, match="unknown kind 'even'"):
        ds.survey.boundary(kind="even")


def test_a_zoom_is_the_same_workflow_on_a_part(tongues, tmp_path):
    ds = survey.open(tongues)
    finer = ds.survey.zoom(q=(0.5, 1.0), num=3)
    assert (
        finer.sizes["q"] == 3 and finer.a.identical(ds.a) and {"curve_count", "area"} <= set(finer)
    )
    written = finer.survey.zoom(q=(0.5, 0.75), num={"q": 2}, output=tmp_path / "part.nc")
    assert (
        survey.open(tmp_path / "part.nc").attrs["title"]
        == written.attrs["title"]
        == "Tongues, a part, a part"
    )
    assert (finer.survey.compare(written).y1_excess <= 1).all()
    row = ds.survey.slice(q=0.8).survey.zoom(a=(3.0, 4.0))
    assert (
        row.sizes["a"] == 6
        and set(row.edge_position.dims) == {"edge"}
        and float(row.q) == float(ds.q[1])
    )


def test_points_without_axes_have_no_part_to_zoom_into():
    points = {"mu": [0.01, 0.02, 0.03], "e": [0.1, 0.1, 0.2]}
    along = {key: xr.DataArray(values, dims="k") for key, values in points.items()}
    ds = survey.evaluate("libration_elliptic", **along)
    for ranges in ({}, {"mu": (0.01, 0.02)}):
        with pytest.raises(
            survey.BadInput, match=r"^zoom: k only counts points, of mu, e: they do not lie"
        ):
            ds.survey.zoom(**ranges)
    with pytest.raises(survey.BadInput, match=r"^zoom: this survey has no axis"):
        survey.evaluate("libration_elliptic", mu=0.01, e=0.1).survey.zoom()


def test_tuples_are_axes_as_lists_are(tmp_path):
    for number, k in enumerate(((0.1, 0.2), {"values": (0.1, np.float64(0.2))})):
        axes = {"k": k, "rho": 1.2}
        ds = survey.run({"scene": "satellite", "axes": axes}, output=tmp_path / f"{number}.nc")
        assert ds.k.values.tolist() == [0.1, 0.2]
    assert survey.evaluate("satellite", k=(0.1, 0.2), rho=1.2).sizes == {"k": 2}


def test_a_zoom_beyond_the_map_is_solved_and_said(mathieu, recwarn):
    inside = mathieu.survey.zoom(a=(-1.0, 5.0), num=3)
    assert not recwarn.list
    with pytest.warns(
        UserWarning, match=r"zoom: a = \(4, 7\) extends beyond the map's -1 to 5; it is solved"
    ) as said:
        beyond = mathieu.survey.zoom(a=(4.0, 7.0), num=4)
    assert said[0].filename == __file__ and "\n" not in str(said[0].message)
    assert float(beyond.a.max()) == 7.0 and int(beyond.status.sum()) == 0 and inside.sizes["a"] == 3
    with pytest.raises(BadInput, match=r"axes\.a has an end 2e\+12, outside its domain"):
        mathieu.survey.zoom(a=(0.0, 2e12))


def test_every_curve_lies_in_a_cell_that_is_left_undecided(tongues):
    ds = survey.open(tongues)
    curves = ds.survey.boundary()
    cells = ds.drop_vars(
        [name for name in ds if name.startswith(("edge_", "curve_", "fold_"))]
    ).survey.boundary()
    inside = np.ones((curves.sizes["place"], cells.sizes["place"]), bool)
    for axis in ds.status.dims:
        off = abs(curves[axis].values[:, None] - cells[axis].values)
        inside &= off <= cells[f"{axis}_error"].values + 1e-12
    assert inside.any(axis=1).all() and float(cells[f"{axis}_error"].max()) > 0


def test_areas_of_points_and_cells(toy, tongues):
    found = toy.survey.areas()
    disc = found.sel(area_verdict="unstable")
    assert abs(disc.area - 0.09 * math.pi) <= disc.area_error < 0.04
    assert list(found.area_verdict) == ["undecided", "unstable", "stable", "no_answer"]
    assert float(found.area_fraction.sum()) == pytest.approx(1)
    undecided = found.sel(area_verdict="undecided")
    assert 0 < undecided.area - undecided.area_error + 1e-3 and undecided.area < 2e-3
    ds = survey.open(tongues)
    cells, points = (
        ds.survey.areas(),
        ds.drop_vars([name for name in ds if "area" in name]).survey.areas(),
    )
    off = abs(cells.area - points.area).sel(area_verdict="stable")
    assert off <= (cells.area_error + points.area_error).sel(area_verdict="stable")
    assert float(cells.area.sum()) == pytest.approx(3.5, abs=float(2 * cells.area_error.sum()))


def test_a_comparison_finds_what_is_beyond_the_bars_and_nothing_else(mathieu):
    other = survey.evaluate(
        "mathieu", a=mathieu.a.values[::2], q=mathieu.q.values, rtol=1e-9, method="dop853"
    )
    same = mathieu.survey.compare(other)
    assert same.sizes == {"a": 16, "q": 20} and same.attrs["summary"].endswith(
        "are within their error bars"
    )
    assert "method: auto and dop853" in same.attrs["unlike"] and (same.y1_excess <= 1).all()
    spoiled = other.copy(deep=True)
    bars = mathieu.y1_error.astype(float) + mathieu.y1_error
    spoiled["y1"] = mathieu.y1.isel(a=slice(None, None, 2)) + 0.5 * bars
    spoiled["y1_error"] = mathieu.y1_error.isel(a=slice(None, None, 2))
    spoiled["y1"][3, 4] += 10 * bars[6, 4]
    spoiled["verdict"][0, 0], spoiled["verdict"][0, 1] = 1 - other.verdict[0, 0], -1
    found = mathieu.survey.compare(spoiled)
    assert np.argwhere((found.y1_excess > 1).values).tolist() == [[3, 4]]
    assert found.y1_excess[3, 4] == pytest.approx(10.5, rel=0.01) and (found.y2_excess <= 1).all()
    assert found.verdict_differs.values[0, :3].tolist() == [2, 1, 0]
    assert "verdicts differ at 1, one is undecided at 1" in found.attrs["summary"]


class Counted:
    """An array that counts what is read of it."""

    def __init__(self, array):
        self.array, self.read, self.shape, self.dtype, self.ndim = (
            array,
            0,
            array.shape,
            array.dtype,
            array.ndim,
        )

    def __getitem__(self, where):
        part = self.array[where]
        self.read += part.size
        return part


def test_lazy_files_are_read_in_part(mathieu, tmp_path):
    counted = {name: Counted(v.values) for name, v in mathieu.data_vars.items()}
    lazy = mathieu.copy(data={name: da.from_array(c, chunks=(5, 5)) for name, c in counted.items()})
    point = lazy.survey.point(a=1.0, q=0.5)
    assert all(0 < c.read <= 25 for c in counted.values()) and point.verdict == "unstable"
    assert lazy.survey.slice(q=0.5).y1.chunks and lazy.survey.compare(mathieu).y1_excess.chunks
    mathieu.to_netcdf(tmp_path / "map.nc")
    with xr.open_dataset(tmp_path / "map.nc", chunks={}) as ds:
        ds.survey.map()
        ds.survey.map("y1")
        xr.testing.assert_identical(ds.survey.areas(), mathieu.survey.areas())
        xr.testing.assert_identical(ds.survey.boundary(), mathieu.survey.boundary())
        ds.survey.trajectory(a=1.0, q=0.5)
        assert ds.survey.zoom(a=(0.0, 1.0), num=3).sizes == {"a": 3, "q": 20}


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda s: s.point(a=1.0), "q is missing"),
        (lambda s: s.point(a=9.0, q=1.0), "a = 9 lies outside the map: give a number from -1 to 5"),
        (lambda s: s.point(b=1.0), "unknown axis 'b'"),
        (lambda s: s.slice(a="x"), "give one number"),
        (lambda s: s.map("y3"), "unknown variable 'y3'"),
        (lambda s: s.map(style="poster"), "unknown style 'poster'"),
        (lambda s: s.map(style="paper", width="triple"), "unknown width 'triple'"),
        (lambda s: s.boundary(index=2), "this survey does not record the index of its boundaries"),
        (lambda s: s.where(["stable", "unstable"]), "give the name of one verdict or status"),
        (lambda s: s.zoom(), "give a range"),
        (lambda s: s.zoom(a=(2.0, 1.0)), "the lower one first"),
        (lambda s: s.zoom(a=(0.0, 1.0), num=1), "num = 1"),
        (lambda s: s.trajectory(a=1.0, q=0.5, time=-1.0), "time = -1.0"),
        (lambda s: s.trajectory(a=1.0, q=0.5, time="20"), "time = '20': give a positive number"),
        (lambda s: s.compare(3), "give the dataset"),
        (
            lambda s: s.compare(survey.evaluate("mathieu", a=7.5, q=1.0)),
            "no value of a is common to both",
        ),
        (lambda s: s.compare(survey.evaluate("libration", mu=0.01)), "the scenes differ"),
        (lambda s: s.slice(q=1.0).survey.slice(a=1.0).survey.areas(), "two values or more"),
        (
            lambda s: s._ds.isel(a=[0, 1, 1, 2]).survey.areas(),
            "values of a must increase, or decrease",
        ),
    ],
)
def test_what_cannot_be_answered_is_said_in_one_line(mathieu, ask, words):
    with pytest.raises(BadInput) as said:
        ask(mathieu.survey)
    assert words in str(said.value) and "\n" not in str(said.value)


def test_a_foreign_dataset_is_refused():
    with pytest.raises(BadInput, match="not written by survey"):
        xr.Dataset({"t": ("x", [1.0])}).survey.map()


def test_a_coordinate_that_is_no_parameter_is_told_what_to_do():
    ds = survey.evaluate("mathieu", a=[0.5, 1.0], q=[0.1, 0.2]).rename(a="aa")
    for ask in (
        lambda: ds.survey.margin(aa=1.0, q=0.1),
        lambda: ds.survey.trajectory(aa=1.0, q=0.1, figure=False),
        lambda: ds.survey.zoom(aa=(0.5, 1.0), num=3),
    ):
        with pytest.raises(
            survey.BadInput, match=r"no coordinate a, .*: .* such as ds\.rename\(aa='a'\)"
        ):
            ask()
