"""The Maslov index against the number of characteristic values that Mathieu's equations have passed."""

import math

import numpy as np
import pytest
import xarray as xr

import survey
from survey.measures.floquet.multipliers import MINUS_ONE
from survey.request.workflow import check
from survey.sweep import boundaries

PI = math.pi


def mathieu(t, p, out):
    out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)


def two(t, p, out):
    mathieu(t, p, out)
    out[1, 1] = p[2] - 2 * p[3] * math.cos(2 * t)


def characteristic_values(q, parity):
    """Those of even or odd number, from the matrix that belongs to the series of exp(i k t), k of
    that parity.
    """
    k = np.arange(-60 + parity, 61, 2)
    beside = np.full(k.size - 1, q)
    return np.linalg.eigvalsh(np.diag(k * k) + np.diag(beside, 1) + np.diag(beside, -1))


def passed(a, q):
    """How many characteristic values are below a: of solutions with the period pi, and of those
    that change sign.
    """
    return [int((characteristic_values(q, parity) < a).sum()) for parity in (0, 1)]


@pytest.mark.parametrize("size", [1, 60])
def test_the_index_counts_characteristic_values(size):
    spread = np.random.default_rng(7)
    a, b = spread.uniform(-4.0 * size, size, (2, 120)) + 2.0 * size
    q, r = spread.uniform(-0.4 * size, 0.4 * size, (2, 120))
    names = ["index_plus_one", "index_minus_one"]
    one = survey.floquet(
        K=mathieu, period=PI, parameters=("a", "q"), states="x", structure="symplectic"
    )
    both = survey.floquet(
        K=two, period=PI, parameters=("a", "q", "b", "r"), states=("x", "y"), structure="symplectic"
    )
    given = {
        name: xr.DataArray(values, dims="p")
        for name, values in {"a": a, "q": q, "b": b, "r": r}.items()
    }
    of_one = survey.evaluate(one, a=given["a"], q=given["q"], variables=[*names, "spectral_radius"])
    of_both = survey.evaluate(both, **given, variables=[*names, "spectral_radius"])
    expected = np.array([passed(*each) for each in zip(a, q, strict=True)])
    for found in (of_one, of_both):
        counts = np.stack([found[name] for name in names], axis=1)
        known = np.isfinite(counts)
        assert known[found.spectral_radius < 1e6].all()
        assert np.array_equal(counts[known], expected[known]) and known.mean() > 0.8
        expected += [passed(*each) for each in zip(b, r, strict=True)]
    assert len(np.unique(expected)) > (2 if size == 1 else 12)


def test_its_parity_is_the_sign_of_a_determinant():
    """Of three coupled oscillators with gyroscopic forces: det(M - c) changes its sign wherever a
    pair passes c.
    """
    names = [f"p{k}" for k in range(15)]
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]

    def stiffness(t, p, out):
        for k, (i, j) in enumerate(pairs):
            out[i, j] = out[j, i] = p[k] + p[6 + k] * math.cos(2 * t)

    def rotation(t, p, out):
        for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
            out[i, j], out[j, i] = p[12 + k], -p[12 + k]

    given = {
        "period": PI,
        "parameters": names,
        "states": ("x", "y", "z"),
        "structure": "symplectic",
    }
    scene, spread = survey.floquet(K=stiffness, C=rotation, **given), np.random.default_rng(3)
    p = spread.standard_normal((300, 15)) * spread.choice([0.3, 1.0, 3.0, 10.0], (300, 1))
    p[:, [0, 3, 5]] += spread.uniform(0.0, 20.0, (300, 3))
    values = {name: xr.DataArray(p[:, k], dims="p") for k, name in enumerate(names)}
    found = survey.evaluate(
        scene, **values, variables=["monodromy", "index_plus_one", "index_minus_one"]
    )
    for name, goal, first in (("index_plus_one", 1.0, -1.0), ("index_minus_one", -1.0, 1.0)):
        sign = np.sign(np.linalg.det(found.monodromy.values - goal * np.eye(6)))
        # but where det is lost in rounding
        assert (sign * (-1.0) ** found[name].values == first).mean() > 0.99
        assert len(np.unique(found[name])) > 20


def test_where_a_multiplier_is_1_the_index_is_not_known():
    def free(t, p, out):
        out[0, 0] = p[0]

    scene = survey.floquet(K=free, period=PI, parameters=("a",), states="x", structure="symplectic")
    found = survey.evaluate(
        scene, a=[0.0, 0.5, 1.0, 1.5], variables=["index_plus_one", "index_minus_one"]
    )
    assert np.isnan(found.index_plus_one[0]) and found.index_minus_one[0] == 0
    assert np.isnan(found.index_minus_one[2]) and found.index_plus_one[2] == 1
    assert found.index_minus_one.values[[1, 3]].tolist() == [0, 2]


def test_systems_that_are_not_symplectic_have_none():
    scene = survey.floquet(K=mathieu, period=PI, parameters=("a", "q"), states="x")
    with pytest.raises(survey.BadInput, match="index_plus_one"):
        survey.evaluate(scene, a=1.0, q=0.1, variables=["index_plus_one"])


def test_a_tongue_of_a_millionth_of_the_map_is_drawn():
    scene = survey.floquet(
        K=mathieu, period=PI, parameters=("a", "q"), states="x", structure="symplectic"
    )
    table = {
        "a": {"start": 20.0, "stop": 30.0, "num": 3},
        "q": {"start": 0.0, "stop": 1.0, "num": 3},
    }
    found = boundaries.find(check({"scene": scene, "axes": table, "boundaries": {}}))
    assert found.curve_count.values.tolist() == [97, 97] and "curves_unexplained" not in found.attrs
    assert (found.curve_class == MINUS_ONE).all() and (found.curve_outside == 0).all()
    a, q = (found[f"curve_{name}"].values.reshape(2, 97) for name in "aq")
    error = 10.0 * found.curve_position_error.values.reshape(2, 97)
    assert 0.0 < error.max() < 1e-5
    edges = np.array([characteristic_values(one, 1)[4:6] for one in q[0]]).T
    assert np.array_equal(q[0], q[1]) and 5e-6 < (edges[1] - edges[0]).max() < 2e-5
    assert (abs(np.sort(a, axis=0) - edges) <= error + 1e-11).all()  # of eigenvalues up to 3600


@pytest.mark.slow
def test_where_a_system_jumps_nothing_passes():
    def jumps(t, p, out):
        out[0, 0] = p[0] if p[0] + 0.1 * p[1] < 2.0 else p[0] + 30.0

    scene = survey.floquet(
        K=jumps, period=PI, parameters=("a", "q"), states="x", structure="symplectic"
    )
    table = {"a": {"start": 1.2, "stop": 3.5, "num": 3}, "q": {"start": 0.0, "stop": 1.0, "num": 3}}
    found = boundaries.find(check({"scene": scene, "axes": table, "boundaries": {}}))
    assert found.sizes["curve"] == 0 and found.attrs["curves_unexplained"] >= 95
