"""Boundaries along a line and margins of points, against the files' [boundaries], closed forms and
kept values.
"""

import csv
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

import survey
from survey.analysis import edge, point
from survey.errors import BadInput
from survey.share import page
from survey.show import boundaries
from survey.sweep import announce

ROOT = Path(__file__).parents[2]


def test_edges_of_a_row_are_those_of_boundaries(tmp_path):
    asked = {
        "scene": "mathieu",
        "axes": {"q": 1.5, "a": {"start": -3.0, "stop": 30.0, "num": 3}},
        "boundaries": {},
    }
    ds = survey.run(asked, output=tmp_path / "m.nc")
    found = survey.edge("mathieu", along="a", a=(-3.0, 30.0), q=1.5)
    np.testing.assert_array_equal(found.edge, ds.edge_position)
    np.testing.assert_array_equal(found.edge_class, ds.edge_class)
    np.testing.assert_array_equal(found.edge_index, ds.edge_index)
    assert found.attrs["complete"] == 1 and found.edge.attrs["units"] == "1"


@pytest.mark.parametrize(
    ("scene", "along", "ends", "rows"),
    [
        ("satellite", "rho", (0.6, 2.5), {"k": np.linspace(0.0, 0.9, 140), "body": "oblate"}),
        pytest.param(
            "satellite_triaxial",
            "k",
            (0.0, 0.8),
            {
                "A": 0.5,
                "B": xr.DataArray([0.7, 0.8], dims="body_number"),
                "C": xr.DataArray([1.0, 1.1], dims="body_number"),
            },
            marks=pytest.mark.slow,
        ),
        ("libration_elliptic", "mu", (0.0, 0.05), {"e": [0.0, 0.1, 0.5]}),  # one row after another
    ],
)
def test_rows_have_the_boundaries_of_each_alone(scene, along, ends, rows):
    together = survey.edge(scene, along=along, **{along: ends}, **rows)
    arrays = {key: np.asarray(values) for key, values in rows.items() if np.ndim(values)}
    count = len(next(iter(arrays.values())))
    first = 0
    for row in range(count):
        own = {key: values[row] for key, values in arrays.items()}
        alone = survey.edge(scene, along=along, **{along: ends}, **rows | own)
        here = together.isel(place=slice(first, first + alone.place.size))
        first += alone.place.size
        for name in ("edge", "edge_error", "edge_class"):
            np.testing.assert_array_equal(here[name], alone[name])
        for key, value in own.items():
            assert (here[key] == value).all()
    assert first == together.place.size > count and together.rows == count
    assert together.attrs.get("complete") == alone.attrs.get("complete")
    assert together.attrs.get("incomplete_rows", 0) == 0


def test_characteristic_values_of_mathieu():
    """DLMF 28.8 / Abramowitz-Stegun table 20.1: a_0, b_1, a_1, b_2 at q = 5 (to the ten digits
    given there).
    """
    special = pytest.importorskip("scipy.special")
    exact = sorted(
        [
            *(special.mathieu_a(r, 5.0) for r in range(4)),
            *(special.mathieu_b(r, 5.0) for r in range(1, 4)),
        ]
    )
    found = survey.edge("mathieu", along="a", a=(-7.0, 12.0), q=5.0)
    np.testing.assert_allclose(found.edge, [a for a in exact if a < 12.0], atol=1e-9)
    assert (found.edge_error < 1e-12).all()


def test_a_closed_gap_is_two_edges_and_a_marginal_value_between_equal_verdicts_none():
    closed = survey.edge("mathieu", along="a", q=0.0, a=(3.0, 5.0))
    assert closed.edge.size == 2 and (abs(closed.edge - 4.0) <= closed.edge_error).all()
    assert closed.attrs["complete"] == 1
    for scene, along, fixed, verdict in (
        ("mathieu", "q", {"a": 4.0}, "unstable"),
        ("satellite", "rho", {"k": 0.5, "body": "oblate"}, "stable"),
    ):
        found = survey.edge(scene, along=along, **{along: (-0.2, 0.2)}, **fixed)
        assert not found.edge.size and found.attrs["complete"] == 1
        line = survey.evaluate(scene, **{along: [-0.1, 0.0, 0.1]}, **fixed)
        assert line.survey.names().values.tolist() == [verdict, "marginal", verdict]


def test_near_gives_the_neighbours():
    everything = survey.edge("satellite", along="rho", rho=(0.6, 2.5), k=0.5)
    near = survey.edge("satellite", along="rho", near=1.2, k=0.5)
    below, above = (
        everything.edge[everything.edge < 1.2].max(),
        everything.edge[everything.edge > 1.2].min(),
    )
    bar = float(everything.edge_error.max()) + float(near.edge_error.max())
    np.testing.assert_allclose(near.edge, [below, above], atol=bar, rtol=0)
    verdicts = survey.evaluate(
        "satellite", k=0.5, rho=[float(near.edge[0]) + s for s in (-1e-9, 1e-9)]
    ).verdict
    assert set(verdicts.values) == {0, 1}


def test_the_whole_domain_of_an_amplitude():
    found = survey.edge("satellite", along="amplitude", inertia_ratio=0.19)
    assert (np.diff(found.edge) > 0).all() and found.edge.size > 5
    at = float(found.edge[0])
    verdicts = survey.evaluate(
        "satellite", amplitude=[at - 1e-9, at + 1e-9], inertia_ratio=0.19
    ).verdict.values
    assert set(verdicts) == {0, 1}


def test_danbys_curves_agree_with_the_kept_table(tmp_path):
    with (ROOT / "results" / "libration_elliptic_boundaries.csv").open() as file:
        kept = {(row["curve"], row["e"]): row for row in csv.DictReader(file)}
    found = survey.edge("libration_elliptic", along="mu", mu=(0.001, 0.06), e=0.1)
    names = found.edge_class.attrs["flag_meanings"].split()
    assert [names[code] for code in found.edge_class.values] == ["B", "A", "KC"]
    for name, at, bar in zip(
        ["B", "A", "KC"], found.edge.values, found.edge_error.values, strict=True
    ):
        row = kept[name, "0.1"]
        assert abs(at - float(row["mu"])) <= bar + float(row["mu_error"]) and bar < 1e-12
    axes = {
        "e": {"start": 0.0, "stop": 0.4, "num": 3},
        "mu": {"start": 0.001, "stop": 0.06, "num": 3},
    }
    ds = survey.run(
        {"scene": "libration_elliptic", "axes": axes, "boundaries": {}}, output=tmp_path / "d.nc"
    )
    table = ds.survey.boundary(kind="KC")
    sides = [
        survey.evaluate("libration_elliptic", e=table.e, mu=table.mu + s).verdict.values
        for s in (-1e-9, 1e-9)
    ]
    inside = (table.e.values > 0.0) & (table.e.values < 0.31)
    assert inside.sum() > 10 and (sides[0][inside] == 1).all() and (sides[1][inside] == 0).all()


def test_the_line_of_closed_curves_and_a_run_of_one_axis(tmp_path):
    numbers = {"alpha": 0.3, "beta": 0.2, "ratio": 1.3}
    found = survey.edge("brun", along="l", l=(-2.0, 3.0), sign="1", **numbers)
    axes = {"l": {"start": -2.0, "stop": 3.0, "num": 5}, **numbers}
    ds = survey.run(
        {"scene": "brun", "options": {"sign": "1"}, "axes": axes, "boundaries": {}},
        output=tmp_path / "b.nc",
    )
    np.testing.assert_array_equal(ds.edge_position, found.edge)
    assert ds.survey.boundary(kind="separatrix").sizes["place"] == 1
    at = float(found.edge[found.edge_class == 1][0])
    near = survey.evaluate(
        "brun", l=[at - 1e-6, at + 1e-6], sign="1", **numbers
    ).separatrix_distance
    assert (abs(near) < 3e-6).all()


def test_three_axes_have_boundaries_on_every_plane(tmp_path):
    (tmp_path / "z.py").write_text(
        "from math import cos, pi\nPARAMETERS = ('a', 'q', 'c')\nPERIOD = pi\nEVEN = True\n"
        "def z(u, p):\n    return p[0] + p[2] - 2 * p[1] * cos(2 * u)\n"
    )
    axes = {"c": {"values": [0.0, 0.5]}, "q": {"start": 0.5, "stop": 1.5, "num": 3},
            "a": {"start": -1.0, "stop": 5.0, "num": 3}}  # fmt: skip
    ds = survey.run(
        {"scene": str(tmp_path / "z.py"), "axes": axes, "boundaries": {}}, output=tmp_path / "o.nc"
    )
    assert ds.edge_count.dims == ("c", "q") and int(ds.edge_count.sum()) == ds.sizes["edge"]
    table = ds.survey.boundary()
    planes = [table.isel(place=np.flatnonzero(table.c.values == c)) for c in (0.0, 0.5)]
    for c, plane in zip((0.0, 0.5), planes, strict=True):
        special = pytest.importorskip("scipy.special")
        at = plane.isel(
            place=np.flatnonzero((plane["index"].values == 1) & (plane.kind.values == 0))
        )
        expected = special.mathieu_a(1, at.q.values)
        other = special.mathieu_b(1, at.q.values)
        off = np.minimum(abs(at.a.values + c - expected), abs(at.a.values + c - other))
        assert at.a.size > 2 and (off < 1e-8).all()
    with pytest.warns(UserWarning, match="lie in planes of c and a, not of q and a"):
        assert ds.survey.slice(c=0.5).survey.map() is not None


def test_a_plane_that_crosses_those_of_the_curves_holds_none(tmp_path, monkeypatch):
    """Curves found on planes of a and r, of which a plane of a and q has points alone."""
    hill = survey.hill(
        lambda u, p: p[0] + p[1] * np.cos(2 * u) + p[2] * np.cos(4 * u),
        period=np.pi,
        parameters=("a", "q", "r"),
        even=True,
    )
    axes = {
        "a": {"start": 0.0, "stop": 4.0, "num": 9},
        "q": {"values": [0.5, 1.0]},
        "r": {"values": [0.0, 1.0]},
    }
    ds = survey.run({"scene": hill, "axes": axes, "boundaries": {}}, output=tmp_path / "o.nc")
    assert ds.attrs["boundaries"] == "r" and (ds.curve_r.values == 1.0).any()
    assert not boundaries.curves_of(boundaries.in_plane(ds, ds.verdict.isel(r=1)))
    here = boundaries.in_plane(ds, ds.verdict.isel(q=1))
    assert boundaries.curves_of(here) and (here.curve_q.values == 1.0).all()
    assert here.sizes["curve_point"] == (ds.curve_q.values == 1.0).sum()
    part = ds.survey.slice(q=1.0)
    np.testing.assert_array_equal(part.curve_a, here.curve_a)
    assert part.survey.boundary().sizes["place"] == here.sizes["curve_point"]
    assert len(part.survey.map().lines) == here.sizes["curve"]
    assert ds.survey.slice(r=1.0).sizes["curve"] == 0 and "curve_count" not in ds.survey.slice(
        q=1.0, r=1.0
    )
    chosen = point.plane(ds, {"q": "1"})  # as --at q=1 does
    assert chosen.status.dims == ("a", "r", "q")
    seen = []
    monkeypatch.setattr(
        page, "_curves", lambda ds, axes: seen.append(ds) or {"curves": [], "edges": []}
    )
    monkeypatch.setattr(page, "_series", lambda *_: (None, "of points"))
    page.made(chosen)
    assert len(seen) == 1 and (seen[0].curve_q.values == 1.0).all()
    assert seen[0].sizes["curve"] == here.sizes["curve"]


def test_margins_are_the_distances_to_the_edges():
    ds = survey.evaluate("satellite", k=[0.3, 0.5], rho=1.2)
    found = ds.survey.margin(k=0.5)
    assert found.parameter.values.tolist() == ["k", "rho"]
    near = survey.edge("satellite", along="rho", near=1.2, k=0.5).edge.values
    assert float(found.edge.sel(parameter="rho")) == near[abs(near - 1.2).argmin()]
    np.testing.assert_array_equal(found.distance, found.edge - found.value)
    text = repr(ds.survey.point(k=0.5))
    assert (
        f"rho = {float(found.edge.sel(parameter='rho')):.6g} +- " in text
        and "nearest boundaries" in text
    )


def test_margins_that_take_long_have_a_bar(monkeypatch, capsys):
    monkeypatch.setattr(announce, "is_watched", lambda: True)
    monkeypatch.setattr(
        announce, "console", lambda: Console(file=sys.stderr, force_terminal=True, width=120)
    )
    ds = survey.evaluate("mathieu", a=2.0, q=1.5)
    capsys.readouterr()
    ds.survey.margin()
    assert "parameters" not in capsys.readouterr().err  # a moment's work
    monkeypatch.setattr(edge, "_seconds", lambda *_: 60.0)
    ds.survey.margin()
    assert "2/2" in (said := capsys.readouterr().err) and "parameters" in said


def test_boundaries_of_a_gyrostats_fates():
    """Fates on both sides of the stable manifolds differ, and between them they do not."""
    system = {"phi0": 0.5, "b12": 0.7, "b31": -0.4, "d": 1.1, "s2": 0.5}
    found = survey.edge("gyrostat", along="w0", near=1.0, question="fate", **system)
    low, high = found.edge.values
    assert (found.edge_error < 1e-9).all() and found.edge_class.values.tolist() == [0, 0]
    w0 = [low - 1e-7, low + 1e-7, high - 1e-7, high + 1e-7]
    fates = survey.evaluate("gyrostat", w0=w0, question="fate", **system)
    below, first, last, above = zip(
        fates.verdict.values, fates.limit_phi.values.round(6), strict=True
    )
    assert first == last and below != first and above != last


@pytest.mark.slow
def test_folds_of_a_gyrostats_equilibria_lie_on_the_astroid():
    """g = -d cos sin + s2 cos - s3 sin: equilibria meet where s2^(2/3) + s3^(2/3) = d^(2/3)."""
    found = survey.edge(
        "gyrostat", along="s2", s2=(0.2, 1.0), question="portrait", b12=0.7, b31=-0.4, d=1.0, s3=0.1
    )
    names = found.edge_class.attrs["flag_meanings"].split()
    (fold,) = [k for k, code in enumerate(found.edge_class.values) if names[code] == "fold"]
    assert (
        abs(found.edge.values[fold] - (1.0 - 0.1 ** (2 / 3)) ** 1.5)
        <= found.edge_error.values[fold]
        < 1e-10
    )


@pytest.mark.slow
def test_the_homoclinic_curve_of_an_own_abel_equation():
    """I = 0.2545..., the current at which a junction's branch returns to its saddle: the bracket of
    josephson_curve.
    """
    rows = (ROOT / "results" / "josephson_curve.md").read_text().splitlines()
    (row,) = [line.split("|") for line in rows if line.startswith("| 0.2 |")]
    scene = str(ROOT / "workflows" / "josephson.py")
    found = survey.edge(scene, along="I", I=(0.2, 0.3), question="portrait", a=0.2)
    assert found.edge.size == 1
    assert (
        abs(float(found.edge[0]) - float(row[2]))
        <= float(row[3]) + float(found.edge_error[0]) + 1e-10
    )


def test_what_has_no_boundaries_is_reported():
    for match, keywords in (
        ("unknown parameter 'kk'", {"along": "kk", "rho": 1.0}),
        (r"a value of rho, or a range as rho=\(low, high\)", {"along": "rho", "k": 0.5}),
        (r"give a range as rho=\(low, high\)", {"along": "rho", "k": 0.5, "near": (0, 3)}),
        ("rho is missing", {"along": "k", "near": 0.3}),
        (r"so give a range \(low, high\)", {"along": "rho", "k": 0.5, "rho": 1.0}),
        ("near = 1.0: it applies to a single row", {"along": "rho", "near": 1.0, "k": [0.1, 0.2]}),
        (r"^edge: give a range as rho=\(low, high\)$", {"along": "rho", "k": [0.1, 0.2]}),
        ("k = -1 is outside its domain", {"along": "rho", "rho": (1, 2), "k": [0.1, -1.0]}),
        ("k = \\['x'\\]: it must be a real number", {"along": "rho", "rho": (1, 2), "k": ["x"]}),
        (
            "k: its dimension 'rho' is the parameter along which",
            {"along": "rho", "rho": (1, 2), "k": xr.DataArray([0.1, 0.2], dims="rho")},
        ),
    ):
        with pytest.raises(BadInput, match=match):
            survey.edge("satellite", **keywords)
    with pytest.raises(BadInput, match="no boundaries are known for the scene gyrostat_body"):
        survey.edge("gyrostat_body", along="lambda1")
    with pytest.raises(BadInput, match="boundaries are known only along mu, not on periods"):
        survey.edge("libration", along="periods", near=1e9, mu=0.01, order="8")
    with pytest.raises(
        BadInput,
        match="available for the scene gyrostat; its parameters are the outputs reduced_NAME",
    ):
        survey.edge(
            "gyrostat_integrable", along="w0", near=1.0, case="elliptic", C22=0.5, C33=0.3, S2=0.2
        )


@pytest.mark.parametrize(
    ("scene", "along", "match"),
    [
        ("satellite", "amplitude_deg", r"physical input, .*; search along amplitude \(rad\)$"),
        ("satellite", "A", r"search along inertia_ratio \(no unit\)$"),
        ("libration_elliptic", "m2", r"search along mu \(no unit\)$"),
        ("libration_elliptic", "body", r"search along mu \(no unit\) or e \(no unit\)$"),
        ("libration", "period", r"'period' \(allowed: mu\)$"),  # nothing is known along periods
    ],
)
def test_what_can_be_searched_is_named(scene, along, match):
    with pytest.raises(BadInput, match=match):
        survey.edge(scene, along=along)


def test_margins_of_own_linear_periodic_systems():
    """The nearest change of the verdict, and none between; a rotor of twelve states too."""
    point = {"omega": 20.0, "damping": 4000.0, "lost": 1.0}
    scene = str(ROOT / "workflows" / "ground_resonance.py")
    found = survey.edge(scene, along="omega", omega=(15.0, 25.0), damping=4000.0, lost=1.0)
    assert found.edge.size == 1 and found.edge_error < 1e-6
    at, bar = float(found.edge[0]), float(found.edge_error[0])
    sides = survey.evaluate(
        scene, **point | {"omega": [at - 2.0 * bar, at + 2.0 * bar]}
    ).verdict.values
    assert sides.tolist() == [1, 0]


def test_a_margin_is_that_of_the_nearest_boundary():
    """Further pieces do not lose what nearer ones found: scanned by the verdict of Mathieu's damped
    equations.
    """
    scene = str(ROOT / "workflows" / "ion_trap.py")
    point = {"q": 0.7, "a": 0.1, "k": 0.05}
    margin = survey.evaluate(scene, **point).survey.margin()
    for name, value in point.items():
        at, bar = (
            float(margin.edge.sel(parameter=name)),
            float(margin.edge_error.sel(parameter=name)),
        )
        side = np.sign(at - value)
        line = [at - 3e-9 * side - bar * side, at + 3e-9 * side + bar * side]
        assert survey.evaluate(scene, **point | {name: line}).verdict.values.tolist() == [1, 0]
        between = np.linspace(2.0 * value - at if name != "k" else 0.0, at, 203)[1:-1]
        assert (survey.evaluate(scene, **point | {name: between}).verdict == 1).all()


def _verdict_changes(point, along, low, high):
    """Where the verdict changes between neighbours, bisected by `evaluate` alone."""
    line = np.linspace(low, high, 801)
    verdict = survey.evaluate("brun_triaxial", **point | {along: line}).verdict.values
    known = np.flatnonzero(verdict >= 0)
    found = []
    for i, j in pairwise(known):
        if verdict[i] != verdict[j]:
            a, b = line[i], line[j]
            for _ in range(45):
                middle = 0.5 * (a + b)
                here = int(survey.evaluate("brun_triaxial", **point | {along: middle}).verdict)
                a, b = (middle, b) if here == verdict[i] else (a, middle)
            found.append(0.5 * (a + b))
    return found


@pytest.mark.parametrize("epsilon", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_permanent_rotations_in_clebschs_case(epsilon):
    """Along each parameter: (7) for Omega, and where the verdicts change, no more and no fewer."""
    # with C the least moment and epsilon < 0, or A the largest and epsilon > 0, there is a critical
    # rate
    point = {
        "A": 2.0,
        "B": 1.5,
        "C": 1.0,
        "epsilon": epsilon,
        "Omega": 0.98,
        "axis": "A" if epsilon > 0.0 else "C",
    }
    ranges = {
        "A": (0.51, 2.49),
        "B": (1.01, 2.99),
        "C": (0.51, 2.6),
        "epsilon": (-3.0, 3.0),
        "Omega": (-3.0, 3.0),
    }
    for along, (low, high) in ranges.items():
        fixed = {name: value for name, value in point.items() if name != along}
        found = survey.edge("brun_triaxial", along=along, **fixed, **{along: (low, high)})
        expected = _verdict_changes(point, along, low, high)
        assert (
            found.edge.size == len(expected)
            and found.attrs["complete"] == 1
            and (found.edge_error < 1e-12).all()
        )
        np.testing.assert_allclose(found.edge, expected, atol=1e-11, rtol=0)
    rate = float(survey.evaluate("brun_triaxial", **point).critical_rate)
    exact = np.sin(np.arcsin(np.sqrt(0.75)) + np.arcsin(np.sqrt(0.5)))
    assert epsilon < 0.0 or abs(rate - exact) < 1e-15
    margin = survey.evaluate("brun_triaxial", **point).survey.margin()
    assert abs(float(margin.edge.sel(parameter="Omega")) - rate) < 1e-14
    assert set(margin.parameter.values) == set(ranges)


@pytest.mark.slow
def test_margins_of_orbits_along_all_parameters():
    """From a fold in the damping, or the force, that in the frequency, along which orbits are
    continued, is back.
    """
    scene = str(ROOT / "workflows" / "duffing.py")
    margin = survey.evaluate(scene, omega=1.5, F=0.3, zeta=0.05).survey.margin()
    assert (
        set(margin.parameter.values) == {"omega", "F", "zeta"} and (margin.edge_error < 1e-12).all()
    )
    for name in ("F", "zeta"):
        at = {"F": 0.3, "zeta": 0.05} | {name: float(margin.edge.sel(parameter=name))}
        back = survey.edge(scene, along="omega", omega=(1.2, 1.8), **at)
        assert abs(back.edge.values - 1.5).min() < 1e-10


def test_a_margin_that_cannot_be_found_says_why():
    motion = survey.evaluate("brun_triaxial", question="trajectory", A=1.0, B=1.5, C=2.0, t=3.0)
    with pytest.raises(
        BadInput,
        match=r"brun_triaxial: no boundaries are known along A: question = trajectory has no",
    ):
        motion.survey.margin()


def test_edge_takes_physical_input_and_says_what_it_searched():
    shape = {"A": 2.0, "B": 2.0, "C": 1.0}
    found = survey.edge("satellite", along="amplitude", **shape)
    expected = survey.edge("satellite", along="amplitude", inertia_ratio=0.5)
    np.testing.assert_array_equal(found.edge, expected.edge)
    low, high = found.attrs["searched"]
    assert low == 0.0 and 0.99 * np.pi / 2 < high < np.pi / 2
    beyond = survey.edge(
        "satellite", along="amplitude", amplitude=(1.2, 0.9999999 * np.pi / 2), **shape
    )
    # they accumulate at the end of the domain
    assert beyond.edge.max() > high and found.attrs["complete"] == 1
    assert survey.edge("libration_elliptic", along="e", body="Earth-Moon").edge.size == 1
    near = survey.edge("satellite", along="rho", near=1.2, k=0.5).attrs["searched"]
    assert near[0] < 1.03 and near[1] > 1.6
    with pytest.raises(survey.BadInput, match="inertia_ratio is given twice"):
        survey.edge("satellite", along="inertia_ratio", amplitude=0.5, **shape)
    bodies = survey.edge("libration_elliptic", along="e", body=["Earth-Moon", "Sun-Jupiter"])
    assert bodies.body.values.tolist() == ["Earth-Moon", "Sun-Jupiter"]


@pytest.mark.parametrize("e", [0.6, 0.9, 0.99, 0.999])
def test_narrow_strips_beside_mu_0_end_too(e):
    """They are narrower than the distance between two lines of a search over all mass ratios."""
    (edge,) = survey.edge("libration_elliptic", along="mu", e=e).edge.values
    around = survey.evaluate("libration_elliptic", mu=edge * np.array([0.999, 1.001]), e=e)
    assert around.verdict.values.tolist() == [1, 0]
    here = survey.evaluate("libration_elliptic", mu=0.2, e=e).survey.margin()
    assert float(here.edge.sel(parameter="mu")) == pytest.approx(edge, abs=1e-12)


def test_on_a_map_of_all_mass_ratios_stability_ends_up_to_its_border(tmp_path):
    axes = {
        "mu": {"start": 0.0, "stop": 0.5, "num": 5},
        "e": {"start": 0.0, "stop": 0.9, "num": 5},
    }
    ds = survey.run(
        {"scene": "libration_elliptic", "axes": axes, "boundaries": {}}, output=tmp_path / "d.nc"
    )
    assert float(ds.curve_e.max()) > 0.89
    assert float(abs(ds.curve_mu).min()) < 2e-4
    step = 1e-3 * ds.curve_mu.values
    beside = survey.evaluate(
        "libration_elliptic",
        mu=xr.DataArray(np.stack([ds.curve_mu - step, ds.curve_mu + step]), dims=("side", "at")),
        e=xr.DataArray(ds.curve_e.values, dims="at"),
    ).verdict.values
    assert (beside[0] != beside[1]).mean() > 0.9  # not where A and B meet, or at the tip


@pytest.mark.parametrize(("e", "names"), [(0.1, ["B", "A", "KC"]), (0.33, ["B"]), (0.5, ["B"])])
def test_danbys_curves_are_named_where_the_verdict_changes_alone(e, names):
    """Beyond the tip, at e = 0.3145, A goes on between unstable motions."""
    found = survey.edge("libration_elliptic", along="mu", e=e)
    words = found.edge_class.attrs["flag_meanings"].split()
    assert [words[code] for code in found.edge_class.values] == names
    verdicts = survey.evaluate(
        "libration_elliptic", e=e, mu=np.sort([*(found.edge - 1e-6), *(found.edge + 1e-6)])
    ).verdict
    assert (verdicts[::2].values != verdicts[1::2].values).all()


def test_a_point_outside_the_domain_has_no_margin():
    """No body has these moments of inertia: A > B + C."""
    point = survey.evaluate("brun_triaxial", A=2.4, B=1.0, C=1.1, Omega=0.5)
    with pytest.raises(BadInput, match=r"^margin: there is none at this point: .*exceed the sum"):
        point.survey.margin()


@pytest.mark.parametrize("along", ["s3", pytest.param("b12", marks=pytest.mark.slow)])
def test_the_exact_edge_of_a_gyrostats_ends_is_found_whatever_the_signs(along):
    """K = b12 s3 - b31 s2 = 0, a hyperbola whose border on the line's narrow map is reached by
    rounding alone.
    """
    for b12, b31, s2 in (
        (-0.85, 0.42, -1.05),
        (0.85, 0.42, -1.05),
        (-1.38, 0.086, 0.42),
        (0.28, -0.72, 0.033),
    ):
        exact = b31 * s2 / b12
        given = {"b31": b31, "d": 0.92, "c23": 1.39, "s2": s2} | (
            {"b12": b12} if along == "s3" else {"s3": exact}
        )
        at = exact if along == "s3" else b12
        found = survey.edge(
            "gyrostat", question="portrait", along=along, **{along: (at - 0.1, at + 0.15)}, **given
        )
        names = found.edge_class.attrs["flag_meanings"].split()
        ends = found.edge.values[
            found.edge_class.values == found.edge_class.attrs["flag_values"][names.index("ends")]
        ]
        assert abs(ends - at).min(initial=np.inf) < 1e-12


def test_a_point_says_how_its_margins_are_found_where_that_takes_seconds():
    point = survey.evaluate("gyrostat", phi0=0.3, w0=0.5, b12=0.7, b31=-0.4, d=1.1, s2=0.5)
    assert "ds.survey.margin()" in repr(point.survey.point())


@pytest.mark.parametrize("sign", ["1", "-1"])
def test_lines_of_bruns_problem_meet_all_at_which_wells_begin_or_join(sign):
    """Curves end where the line is, which rounding hides: many were left out."""
    random = np.random.default_rng(4)
    for _ in range(6):
        point = dict(zip(("l", "alpha", "beta"), random.uniform(-0.8, 0.8, 3), strict=True))
        for along in point:
            fixed = {key: value for key, value in point.items() if key != along}
            found = survey.edge("brun", along=along, sign=sign, **fixed, **{along: (-2.0, 2.0)})
            line = np.linspace(-2.0, 2.0, 401)
            ds = survey.evaluate("brun", sign=sign, **fixed, **{along: line})
            wells = np.isfinite(ds.period.values.reshape(line.size, -1)).sum(axis=1)
            for i in np.flatnonzero(np.diff(wells)):
                inside = (found.edge > line[i]) & (found.edge < line[i + 1])
                assert inside.any() and float(found.edge_error[inside].max()) < 1e-11


def test_a_line_meets_both_edges_of_narrow_tongues():
    """Where pairs of multipliers collide and part again within 1e-4 of the axis: beside each edge the
    verdicts differ, and no function changes its sign between the points of a search.
    """
    scene, epsilon = ROOT / "workflows/coupled_mathieu.py", 0.2162394190794506
    found = survey.edge(scene, along="Omega", Omega=(0.3, 3.0), epsilon=epsilon)
    about = found.edge_class.attrs
    codes = dict(zip(about["flag_meanings"].split(), about["flag_values"], strict=True))
    collisions = found.edge.values[found.edge_class.values == codes["collision"]]
    low, high = collisions.reshape(-1, 2)[:2].T
    assert (high - low < [2e-4, 6e-3]).all()
    # those at -1 are passed at once, out and back: bracketed by an index, not by a change of sign
    touched = found.edge_class.values == codes["minus_one"]
    assert (found.edge_error[~touched] < 1e-8).all() and (found.edge_error < 1e-7).all()
    off = 1e-6
    omega = np.stack([low - off, low + off, high - off, high + off])
    verdicts = survey.evaluate(scene, Omega=omega.ravel(), epsilon=epsilon).survey.names()
    expected = np.array(["stable", "unstable", "unstable", "stable"])
    assert (verdicts.values.reshape(omega.shape) == expected[:, None]).all()
