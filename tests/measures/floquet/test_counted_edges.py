"""Edges that two pairs of multipliers pass together, held against the same equation by itself."""

from math import cos, pi
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import survey
from survey.measures.floquet import curves
from survey.request.workflow import check
from survey.sweep import boundaries

ROOT = Path(__file__).parents[3]


def stiffness(t, p, out):
    for k in range(len(out)):
        out[k, k] = p[0] + p[1] * cos(2 * t)


def damping(t, p, out):
    for k in range(len(out)):
        out[k, k] = 2 * p[2]


@pytest.mark.parametrize("q", [0.3, 0.8])
def test_two_equal_damped_oscillators_have_the_edges_of_one(q):
    both = survey.floquet(
        K=stiffness, C=damping, period=pi, parameters=("a", "q", "c"), states=("x", "y")
    )
    one = survey.hill(
        lambda t, p: p[0] + p[1] * np.cos(2 * t),
        period=pi, parameters=("a", "q", "c"), even=True, damping="c",
    )  # fmt: skip
    found, known = (survey.edge(s, along="c", c=(0.01, 0.6), a=1.0, q=q) for s in (both, one))
    assert found.edge.size == known.edge.size == 1 and (found.edge_error < 1e-11).all()
    assert (abs(found.edge - known.edge) <= found.edge_error + known.edge_error).all()
    assert found.edge_class.values.tolist() == [2]  # minus_one


@pytest.mark.slow
def test_two_equal_damped_oscillators_have_the_curves_of_one():
    """Every point has an edge of the one oscillator within its error, along an axis or the other."""
    systems = [
        survey.floquet(
            K=stiffness, C=damping, period=pi, parameters=("a", "q", "c"), states=("x", "y")[:n]
        )
        for n in (2, 1)
    ]
    axes = {
        "a": {"start": 0.0, "stop": 5.0, "num": 3},
        "q": {"start": 0.0, "stop": 3.0, "num": 3},
        "c": 0.05,
    }
    both, one = (
        boundaries.find(check({"scene": s, "axes": axes, "boundaries": {}})) for s in systems
    )
    assert set(both.curve_class.values) == set(one.curve_class.values) == {1, 2}
    assert both.curve_position_error.max() < 1e-8
    assert both.curve_count.sum() > 0.8 * one.curve_count.sum()
    assert both.attrs.get("curves_unexplained", 0) <= 10  # at the tips of the tongues; all: 273
    held = np.zeros(both.curve_a.size, bool)
    for axis, width in (("a", 5.0), ("q", 3.0)):
        reach = (both.curve_position_error.values + 1e-13) * width
        x = {name: both[f"curve_{name}"].values for name in ("a", "q")}
        sides = [
            survey.evaluate(
                systems[1],
                **{name: xr.DataArray(v + side * reach * (name == axis), dims="k") for name, v in x.items()},
                c=0.05, rtol=1e-12, variables=["spectral_radius"],
            ).spectral_radius.values
            for side in (-1, 1)
        ]  # fmt: skip
        held |= (sides[0] - 1.0) * (sides[1] - 1.0) <= 0.0
    assert held.all()


def test_two_equal_undamped_oscillators_have_the_edges_of_one():
    both = survey.floquet(
        K=stiffness, period=pi, parameters=("a", "q"), states=("x", "y"), structure="symplectic"
    )
    found = survey.edge(both, along="a", a=(0.2, 5.0), q=0.8)
    known = survey.edge("mathieu", along="a", a=(0.2, 5.0), q=-0.4)
    assert found.edge.size == known.edge.size == 4 and (found.edge_error < 1e-6).all()
    assert (abs(found.edge - known.edge) <= found.edge_error + known.edge_error).all()
    assert found.edge_class.values.tolist() == [2, 2, 1, 1]  # minus_one, plus_one


@pytest.mark.slow
def test_both_edges_of_a_tongue_between_two_points_of_the_lattice_are_found():
    system, given = str(ROOT / "workflows/coupled_mathieu.py"), {"epsilon": 0.3}
    found = survey.edge(system, along="Omega", Omega=(0.2, 5.0), **given)
    first, second = found.edge.values[:2]
    assert (found.edge_error[:2] < 1e-8).all() and second - first < 4e-6
    inside, outside = (
        survey.evaluate(system, Omega=Omega, **given).verdict.values.tolist()
        for Omega in ([0.5 * (first + second)], [first - 1e-5, second + 1e-5])
    )
    assert inside == [0] and outside == [1, 1]


def test_other_multipliers_outside_are_not_those_that_pass_too():
    """Beside a curve that two pairs pass together both are outside the circle, or on it: how many
    others are outside where they pass is not known, and was said to be 2.
    """

    def K(t, p, out):
        out[0, 0] = out[1, 1] = p[0] - 0.2 * p[1]

    scene = survey.floquet(
        K=K, period=1.0, parameters=("a", "b"), states=("x", "y"), structure="symplectic"
    )
    axes = {"a": {"start": -0.5, "stop": 0.7, "num": 3}, "b": {"start": 0.0, "stop": 1.0, "num": 3}}
    ds = boundaries.find(check({"scene": scene, "axes": axes, "boundaries": {}}))
    assert ds.curve_point.size > 100
    off = abs(ds.curve_a - 0.2 * ds.curve_b)
    assert (off <= 1.4 * ds.curve_position_error + 1e-15).all()
    assert np.isnan(ds.curve_outside).all()


def gyroscopes():
    """q'' + g (q2', -q1') = k q, twice, in canonical coordinates: stable where g^2 > 4 k, on whose
    edge two pairs of multipliers collide in either.
    """

    def A(t, p, out):
        half = 0.5 * p[0]
        for i in (0, 2):
            for at in (i, i + 4):
                out[at, at + 1], out[at + 1, at] = -half, half
            for at in (i, i + 1):
                out[at, at + 4] = 1.0
                out[at + 4, at] = p[1] - half * half

    return survey.floquet(
        A, period=0.5, parameters=("g", "k"), states=list("abcdABCD"), structure="symplectic"
    )


def test_two_equal_collisions_along_a_line():
    """Of one Krein sign, equal multipliers are known to be on the circle where they do not collide."""
    edge = survey.edge(gyroscopes(), along="g", g=(0.5, 4.0), k=1.0)
    assert edge.edge_class.values.tolist() == [4]  # collision
    assert abs(edge.edge[0] - 2.0) <= edge.edge_error[0] < 1e-6


@pytest.mark.slow
def test_two_equal_collisions_on_a_map():
    axes = {"g": {"start": 0.5, "stop": 4.0, "num": 3}, "k": {"start": 0.2, "stop": 2.0, "num": 3}}
    ds = boundaries.find(check({"scene": gyroscopes(), "axes": axes, "boundaries": {}}))
    assert ds.curve_class.values.tolist() == [4] and ds.curve_point.size > 90
    off = abs(ds.curve_g - 2.0 * np.sqrt(ds.curve_k))
    assert (off <= (3.5 + 1.8 / 0.4) * ds.curve_position_error).all()
    assert "curves_unexplained" not in ds.attrs


def test_five_that_pass_together_are_one_edge_and_no_more_is_missing():
    def A(t, p, out):
        for i in range(5):
            out[i, i] = p[0] - 0.1 + cos((i + 1) * t)

    five = survey.floquet(A, period=2 * pi, parameters="a", states=list("vwxyz"))
    found = survey.edge(five, along="a", a=(-1.0, 1.0))
    assert found.edge.size == 1 and abs(found.edge[0] - 0.1) <= found.edge_error[0]
    assert "complete" not in found.attrs


@pytest.mark.slow
def test_past_a_pole_two_multipliers_jump_and_do_not_pass():
    """Both are e^(c / a), inside for a < 0 and outside for a > 0: no edge, and one is said to be missing."""

    def A(t, p, out):
        out[0, 0], out[1, 1] = 1e-3 / p[0] + cos(t), 1e-3 / p[0] + cos(2 * t)

    found = survey.edge(
        survey.floquet(A, period=2 * pi, parameters="a", states=("x", "y")),
        along="a",
        a=(-1.0, 1.5),
    )
    assert found.edge.size == 0 and found.attrs["complete"] == 0


@pytest.mark.parametrize(
    "along, ends, given, narrow",
    [  # a collision beside another edge of the same cell; a tongue of collisions in a cell
        ("k", (0.02, 0.97), {"A": 0.45243163108538553, "B": 0.5827159089463423, "C": 1.0}, 0.96044774),
        pytest.param(
            "yaw_ratio", (-0.95, 0.8388771442043984), {"roll_ratio": 0.8488771442043984, "k": 0.3426454444677417},
            0.81588, marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_every_change_of_verdict_along_a_line_has_its_edge(along, ends, given, narrow):
    found = survey.edge("satellite_triaxial", along=along, **{along: ends}, **given)
    x = np.linspace(*ends, 6001)
    row = survey.evaluate("satellite_triaxial", **{along: x}, **given, variables=["verdict"])
    decided = np.flatnonzero(row.verdict.values >= 0)
    verdict, x = row.verdict.values[decided], x[decided]
    changes = np.flatnonzero(np.diff(verdict))
    assert changes.size >= 4
    edge, error = found.edge.values, found.edge_error.values
    for i in changes:
        assert ((edge + error >= x[i]) & (edge - error <= x[i + 1])).any(), x[i]
    near = abs(edge - narrow).argmin()
    assert abs(edge[near] - narrow) < 5e-5 and found.edge_class.values[near] == 4  # collision
    assert (np.diff(edge) > error[1:] + error[:-1]).all()  # none is there twice


@pytest.mark.parametrize("hole", [0.0, 2e-4])
def test_both_edges_of_a_narrow_tongue_are_found_once(hole):
    """That a spline and a dip show alike; where the function is not finite none of them fails."""

    def parabola(x):
        value = (x[:, 0] - 0.5006) ** 2 - (4e-4) ** 2
        return np.where(abs(x[:, 0] - 0.5006) < hole, np.nan, value), np.full(len(x), 1e-16)

    x = np.stack([np.linspace(0.0, 1.0, 769), np.zeros(769)], axis=1)
    found = curves._crossings(parabola, 1e-16, parabola(x)[0][:, None], across=0.0)
    assert len(found) == 2 if hole == 0.0 else len(found) <= 2
    for x, error in found:
        assert min(abs(x[0, 0] - 0.5002), abs(x[0, 0] - 0.5010)) <= error[0] < 1e-9
