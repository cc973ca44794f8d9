"""[boundaries] with surfaces = true: in the netCDF file, checked, drawn, audited, resumed, refused
in one line.
"""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import survey
from survey.cli import main
from survey.errors import BadInput, Damaged
from survey.file import reading, schema
from survey.file.labels import flag_codes
from survey.measures import isosurfaces
from survey.measures.floquet import surfaces as floquet_surfaces
from survey.request.workflow import check
from survey.show import figures
from survey.show.surfaces import section
from survey.sweep import plan

SCENE = """
from math import cos, pi
PARAMETERS = ("a", "q", "c")
STATES = ("x",)
PERIOD = pi

def K(t, p, out):
    out[0, 0] = p[0] - 2 * p[1] * cos(2 * t)

def C(t, p, out):
    out[0, 0] = 2 * p[2]
"""
AXES = {
    "a": {"start": 0.2, "stop": 2.0, "num": 4},
    "q": {"start": 0.0, "stop": 1.5, "num": 3},
    "c": {"start": 0.02, "stop": 0.3, "num": 3},
}


@pytest.fixture(scope="module", autouse=True)
def coarse():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(isosurfaces, "LINES", 13)
        yield


@pytest.fixture(scope="module")
def workflow(tmp_path_factory):
    scene = tmp_path_factory.mktemp("scene") / "damped_mathieu.py"
    scene.write_text(SCENE)
    return {
        "scene": str(scene), "axes": AXES, "boundaries": {"surfaces": True},
        "output": {"variables": ["verdict"], "figures": ["surfaces", "verdict"]},
    }  # fmt: skip


@pytest.fixture(scope="module")
def path(workflow, tmp_path_factory):
    path = tmp_path_factory.mktemp("surfaces") / "box.nc"
    survey.run(workflow, output=path)
    return path


def verified(path, points):
    with pytest.raises(SystemExit) as end:
        main(["verify", str(path), "--points", str(points)])
    assert end.value.code == 0


def test_a_surface_that_two_pairs_pass_together_is_told_of(path, tmp_path, capsys):
    """Two equal oscillators: no function changes its sign on the one's surface, but a number does."""
    scene = tmp_path / "two.py"
    text = SCENE.replace('("x",)', '("x", "y")')
    for entry in ("out[0, 0] = p[0]", "out[0, 0] = 2 * p[2]"):
        text = text.replace(entry, "out[1, 1] = " + entry)
    scene.write_text(text)
    axes = "".join(
        f"[axes.{name}]\n" + "".join(f"{key} = {value}\n" for key, value in axis.items())
        for name, axis in AXES.items()
    )
    file = tmp_path / "two.toml"
    file.write_text(f'scene = "two.py"\n[boundaries]\nsurfaces = true\n{axes}')
    with pytest.raises(SystemExit) as end:
        main(["run", str(file), "-o", str(tmp_path / "two.nc")])
    assert end.value.code == 0
    assert "a surface is missing on " in capsys.readouterr().err
    with xr.open_dataset(tmp_path / "two.nc") as two, xr.open_dataset(path) as one:
        assert two.sizes["surface"] == 0 and "surfaces_unexplained" not in one.attrs
        assert two.attrs["surfaces_unexplained"] == one.sizes["surface_vertex"]


def test_the_file(path):
    assert reading.check(path) == []
    ds = xr.load_dataset(path)
    schema.surfaces(ds)
    assert (
        ds.attrs["surfaces"] == "a, q, c"
        and ds.attrs["surfaces_left_out"] == 0
        and "boundaries" not in ds.attrs
    )
    assert ds.surface_vertices.sum() == ds.sizes["surface_vertex"] > 100
    assert ds.surface_triangles.sum() == ds.sizes["surface_triangle"]
    assert ds.surface_corners.dims == ("surface_triangle", "corner") and ds.sizes["corner"] == 3
    assert ds.surface_vertices.attrs["sample_dimension"] == "surface_vertex"
    for name in ("surface_a", "surface_q", "surface_c"):
        assert ds[name].attrs["ancillary_variables"] == "surface_position_error"
    assert ds.surface_axis.attrs["flag_meanings"] == "a q c"
    # stability changes across every vertex: a step away on either side along its axis
    x = np.stack([ds[f"surface_{name}"].values for name in "aqc"], axis=1)
    step = 1e-6 * np.eye(3)[ds.surface_axis.values]
    verdicts = [
        survey.evaluate(
            ds.attrs["scene"],
            **{n: xr.DataArray(v, dims="i") for n, v in zip("aqc", side.T, strict=True)},
        )
        for side in (x - step, x + step)
    ]
    low, high = (one.verdict.values for one in verdicts)
    assert ((low != high) & (low >= 0) & (high >= 0)).all()
    table = ds.survey.boundary(kind="minus_one")
    assert table.sizes["place"] == ds.surface_vertices.values[ds.surface_class.values == 2].sum()


def test_pictures(path):
    """In perspective, and in the planes of the map, where the sections lie on the surfaces."""
    for name in ("box.png", "box_verdict.png"):
        assert plt.imread(path.with_name(name)).std() > 0.05
    ds = survey.open(path)
    axes = ds.survey.map("surfaces")
    [drawn] = axes.collections
    assert axes.name == "3d" and len(drawn.get_facecolor()) == ds.sizes["surface_triangle"]
    assert axes.get_xlim() == (0.2, 2.0) and [
        t.get_text() for t in axes.figure.legends[0].texts
    ] == ["a multiplier passes \N{MINUS SIGN}1"]
    plt.close("all")
    for place in range(3):
        plane = section(ds, ds.verdict.isel(c=place))
        c = float(ds.c[place])
        assert (abs(plane.curve_c.values - c) < 1e-15).all() and plane.sizes["curve"] == 1
        a, q = (xr.DataArray(plane[f"curve_{name}"].values, dims="i") for name in "aq")
        known = survey.evaluate("mathieu", a=a - c * c, q=q)
        # chords of a coarse lattice
        assert abs(known.discriminant.values + 2 * math.cosh(c * math.pi)).max() < 0.1
        assert np.hypot(np.diff(a), np.diff(q)).max() < 0.3  # points in order
        cut = ds.isel(c=[place])  # as survey plot --at takes it
        assert len(cut.survey.map().lines) == 1
        plt.close("all")
        with pytest.raises(BadInput, match="c has one value here"):
            cut.survey.map("surfaces")
    line = ds.survey.slice(c=0.02).survey.map("verdict").lines
    plt.close("all")
    assert not line  # of two axes: the surfaces belong to three
    assert ds.survey.map().lines  # the first plane
    with pytest.raises(BadInput, match="projection='3d'"):
        ds.survey.map("surfaces", ax=plt.figure().subplots())
    plt.close("all")
    with pytest.raises(BadInput, match="surfaces = true under"):
        figures.draw(ds.drop_vars("surface_vertices"), "surfaces")


def test_a_logarithmic_axis_is_drawn_by_its_logarithm(workflow, tmp_path):
    log = {"c": {"start": 0.02, "stop": 0.3, "num": 3, "spacing": "log"}}
    ds = survey.run(
        workflow | {"axes": AXES | log, "output": {"variables": ["verdict"]}},
        output=tmp_path / "log.nc",
    )
    axes = ds.survey.map("surfaces")
    assert axes.get_zlim() == pytest.approx(np.log10([0.02, 0.3]))
    assert axes.zaxis.get_major_formatter()(-1.0) == "0.1"
    plt.close("all")


def test_verify_solves_vertices_again(path, tmp_path, capsys):
    verified(path, 30)
    assert "30 points, 30 vertices solved again by" in capsys.readouterr().out
    from survey.analysis.audit import audit

    ds = xr.load_dataset(path)
    moved = ds.assign(surface_a=(ds.surface_a + 1e-6).clip(max=2.0))
    complaints = audit(moved, 30)["complaints"]
    # those bracketed along a do not hold any more; a millionth is nothing to the others where the
    # surface is flat
    assert len(complaints) > 10 and all("no minus_one within it" in line for line in complaints)
    with pytest.raises(Damaged, match="surface_class"):
        audit(ds.assign(surface_class=ds.surface_class.copy(data=ds.surface_class.values + 40)), 1)


def test_the_plan(workflow, path):
    planned = plan.plan(check(workflow, output=path))["surfaces"]
    ds = xr.load_dataset(path)
    for dim, key in (
        ("surface_vertex", "bytes_per_vertex"),
        ("surface_triangle", "bytes_per_triangle"),
    ):
        size = sum(v.nbytes for v in ds.variables.values() if v.dims[:1] == (dim,))
        assert planned[key] * ds.sizes[dim] == size
    assert planned["lattice"] == "13 x 13 x 13"


def test_a_run_that_stops_goes_on(workflow, path, tmp_path, monkeypatch):
    """What is done is kept, and the file has the same bits."""
    output, sharp, calls = tmp_path / "box.nc", floquet_surfaces.Functions.sharp, []

    def stopped(self, x, kind):
        calls.append(len(x))
        if len(calls) > 2:
            raise KeyboardInterrupt
        return sharp(self, x, kind)

    monkeypatch.setattr(floquet_surfaces.Functions, "sharp", stopped)
    with pytest.raises(KeyboardInterrupt):
        survey.run(workflow, output=output)
    kept = {file.name for file in (tmp_path / "box.nc.blocks").glob("surfaces-*.extra")}
    assert len(kept) == 13
    monkeypatch.setattr(floquet_surfaces.Functions, "sharp", sharp)

    def never(self, x):
        raise AssertionError("the lattice is known")

    monkeypatch.setattr(floquet_surfaces.Functions, "on_lattice", never)
    ds = survey.run(workflow, output=output)
    other = xr.load_dataset(path)
    for name in other.data_vars:
        np.testing.assert_array_equal(ds[name].values, other[name].values)


def test_hills_edges(tmp_path):
    """y'' + (a + q cos 2u + r cos 4u) y = 0: edges are eigenvalues of Fourier matrices, by numpy."""

    scene = survey.hill(
        lambda u, p: p[0] + p[1] * math.cos(2 * u) + p[2] * math.cos(4 * u),
        period=math.pi, parameters=("a", "q", "r"), even=True,
    )  # fmt: skip
    axes = {
        "a": {"start": -1.0, "stop": 5.5, "num": 3}, "q": {"start": 0.1, "stop": 2.0, "num": 2},
        "r": {"start": -1.0, "stop": 1.0, "num": 2},
    }  # fmt: skip
    ds = survey.run(
        {"scene": scene, "axes": axes, "boundaries": {"surfaces": True}},
        output=tmp_path / "hill.nc",
    )

    def eigenvalues(kind, q, r, size=30):
        """a of solutions sum c_k cos or sin of (2 k + s) u, s = 0 or 1."""
        parity, anti = kind.split("_")
        s = 1 if anti == "antiperiodic" else 0
        k = np.arange(size) + (1 if parity == "odd" and not s else 0)
        n, sign = 2 * k + s, 1 if parity == "even" else -1
        # -y'' - z y: 2 cos(2 j u) cos(n u) = cos((n + 2 j) u) + cos((n - 2 j) u), and reflections
        # at 0
        H = np.diag(n.astype(float) ** 2)
        for amplitude, shift in ((q, 2), (r, 4)):
            for row, m in enumerate(n):
                for target, factor in ((m + shift, 1), (m - shift, 1)):
                    factor = factor if target >= 0 else sign
                    place = np.flatnonzero(n == abs(target))
                    if place.size and not (target == 0 and sign < 0):
                        H[place[0], row] -= 0.5 * amplitude * factor
        return np.sort(np.linalg.eigvals(H).real)

    names = {code: name for name, code in flag_codes(ds.surface_class.attrs).items()}
    kinds = np.repeat(ds.surface_class.values, ds.surface_vertices.values)
    assert len(set(kinds)) == 4
    for i in range(0, len(kinds), 7):
        a, q, r = (float(ds[f"surface_{name}"][i]) for name in "aqr")
        off = abs(eigenvalues(names[kinds[i]], q, r) - a).min()
        assert off < 1e-8
    verified(tmp_path / "hill.nc", 10)


def changed(ds, name, values=None, **attributes):
    variable = ds[name].copy(data=ds[name].values if values is None else values)
    return ds.assign({name: variable.assign_attrs(attributes)})


def test_damaged_files_are_refused(path):
    ds = xr.load_dataset(path)
    corners, counts = ds.surface_corners.values, ds.surface_vertices.values
    far, negative = corners.copy(), corners.copy()
    far[0, 0], negative[-1, 2] = ds.sizes["surface_vertex"], -1
    wrong = {
        "surface_corners": [
            changed(ds, "surface_corners", far), changed(ds, "surface_corners", negative),
            changed(ds, "surface_corners", corners.astype(float)), ds.isel(corner=[0, 1]),
        ],
        "surface_vertices": [
            changed(ds, "surface_vertices", counts + 1), changed(ds, "surface_vertices", -counts),
            changed(ds, "surface_vertices", counts.astype(float)),
        ],
        "surface_triangles": [changed(ds, "surface_triangles", ds.surface_triangles.values * 2**20)],
        "surface_class": [
            changed(ds, "surface_class", ds.surface_class.values + 9), changed(ds, "surface_class", flag_values=3.5)
        ],
        "surface_axis": [
            changed(ds, "surface_axis", ds.surface_axis.values + 1), changed(ds, "surface_axis", flag_meanings="a q b")
        ],
        "surface_a": [
            changed(ds, "surface_a", ds.surface_a.values * np.nan), ds.drop_vars("surface_a"),
            changed(ds, "surface_a", ds.surface_a.values * 1e300),
        ],
        "surface_position_error": [changed(ds, "surface_position_error", -ds.surface_position_error.values - 1)],
        "surfaces": [ds.assign_attrs(surfaces="a, b, c"), ds.isel(c=0)],
    }  # fmt: skip
    for name, files in wrong.items():
        for file in files:
            with pytest.raises(
                Damaged, match=name if name != "surface_class" else "surface_class|flag_"
            ):
                schema.surfaces(file)
            if "surface_vertices" in file and file.status.ndim == 3:
                with pytest.raises(Damaged):
                    figures.draw(file, "surfaces")


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"axes": {"a": AXES["a"], "q": AXES["q"], "c": 0.1}}, "exactly three axes"),
        ({"axes": AXES | {"c": {"values": [0.1]}}}, r"exactly three axes .* not a \(4\), q \(3\), c \(1\)"),
        ({"boundaries": {"surfaces": True, "axis": "a"}}, r"boundaries\.axis"),
        ({"boundaries": {"surfaces": 1}}, r"boundaries\.surfaces = 1"),
        ({"boundaries": {"surface": True}}, "unknown key boundaries.surface; did you mean 'surfaces'|surfaces"),
        ({"boundaries": {}}, r"output\.figures: there are no surfaces"),
        ({"scene": "gyrostat", "options": {"question": "portrait"}, "axes": {
            "d": AXES["a"], "s2": AXES["a"], "s3": AXES["a"]}, "output": {}}, "no boundary surfaces are known"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(workflow, changes, words):
    with pytest.raises(BadInput, match=words) as refused:
        check(workflow | changes)
    assert "\n" not in str(refused.value)


def test_names_that_would_hide_a_variable(workflow):
    def A(t, p, out):
        out[0, 0] = p[0] + p[1] + p[2]

    scene = survey.floquet(A, period=1.0, parameters=("angle", "q", "c"), states="x")
    axes = {"angle" if name == "a" else name: axis for name, axis in AXES.items()}
    with pytest.raises(BadInput, match="an axis named angle"):
        check({"scene": scene, "axes": axes, "boundaries": {"surfaces": True}})


def test_proofs_and_orbits_have_none(workflow):
    with pytest.raises(BadInput, match="cannot be proved"):
        check(workflow, proves=True)

    def f(t, x, p, out):
        out[0], out[1] = x[1], -p[0] * x[1] - x[0] - p[1] * x[0] ** 3 + p[2] * math.cos(t)

    scene = survey.orbit(
        f, states=("x", "v"), period=2 * math.pi, parameters=("a", "q", "c"), start=(0.0, 0.0)
    )
    with pytest.raises(
        BadInput, match="periodic orbits, and surfaces are available only for linear systems"
    ):
        check({"scene": scene, "axes": AXES, "boundaries": {"surfaces": True}})


def test_a_box_without_surfaces(workflow, tmp_path):
    axes = AXES | {
        "a": {"start": 0.2, "stop": 0.3, "num": 2},
        "q": {"start": 0.0, "stop": 0.05, "num": 2},
    }
    ds = survey.run(workflow | {"axes": axes}, output=tmp_path / "empty.nc")
    assert (
        ds.sizes["surface"] == ds.sizes["surface_triangle"] == 0
        and ds.attrs["surfaces_left_out"] == 0
    )
    assert ds.survey.boundary().sizes["place"] == 0
    verified(tmp_path / "empty.nc", 2)


def test_zoom_keeps_the_surfaces(path):
    ds = survey.open(path)
    part = ds.survey.zoom(a=(0.5, 1.5), num=3)
    assert part.attrs["surfaces"] == "a, q, c" and part.surface_a.values.min() >= 0.5
