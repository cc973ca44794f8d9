"""Floquet systems in cells: every point of a decided cell has its verdict; areas lie within their bounds."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import survey
from survey.errors import BadInput
from survey.measures.floquet import cells
from survey.request.workflow import check

WORKFLOWS = Path(survey.__file__).parents[1] / "workflows"


def ran(scene, path, width, **axes):
    table = {
        k: {"start": v[0], "stop": v[1], "num": 3} if np.ndim(v) else v for k, v in axes.items()
    }
    job = {"scene": scene, "axes": table, "refine": {"width": width}, "output": {"figures": []}}
    return survey.run(job, output=path / f"{len(list(path.iterdir()))}.nc").load()


def mathieu(damping):
    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 2 * damping

    given = {"C": C} if damping else {"structure": "symplectic"}
    return survey.floquet(K=K, period=math.pi, parameters=("a", "q"), states="x", **given)


def spring(t, p, out):
    """Two damped Mathieu equations at a and a / 2, in coordinates that mix them."""
    first, second = (k * p[0] - 2 * p[1] * math.cos(2 * t) for k in (1.0, 0.5))
    mean, half = 0.5 * (first + second), 0.5 * (first - second)
    out[0, 0], out[0, 1], out[1, 0], out[1, 1] = mean, half, half, mean


def damping(t, p, out):
    out[0, 0] = out[1, 1] = 0.2


def margin(a, q, c):
    """Where Mathieu's equation with the damping c is stable: |discriminant| < 2 cosh(c pi)."""
    known = survey.evaluate(
        "mathieu", a=xr.DataArray(a - c * c, dims="i"), q=xr.DataArray(q, dims="i"), rtol=1e-12
    )
    return 2 * math.cosh(c * math.pi) - abs(known.discriminant.values)


def inside(ds, random, *names):
    """Random points, one of each decided cell, and the cells' verdicts."""
    decided = ds.cell_verdict.values >= 0
    assert {0, 1} <= set(ds.cell_verdict.values[decided]) and (ds.area_fraction_error < 0.06).all()
    part = random.uniform(0.0, 1.0, (len(names), decided.sum()))
    ends = [[ds[f"cell_{name}_{end}"].values[decided] for end in ("low", "high")] for name in names]
    return [
        low + (high - low) * p for (low, high), p in zip(ends, part, strict=True)
    ], ds.cell_verdict.values[decided]


def test_points_of_decided_cells_have_their_verdict(tmp_path):
    """By the closed form of the damped equation, at three random points of every cell."""
    ds = ran(mathieu(0.12), tmp_path, 0.01, a=(-1.0, 6.0), q=(0.0, 3.0))
    coupled = survey.floquet(
        K=spring, C=damping, period=math.pi, parameters=("a", "q"), states=("x", "y")
    )
    four = ran(coupled, tmp_path, 0.015, a=(0.2, 5.0), q=(0.0, 2.0))
    random = np.random.default_rng(4)
    for _ in range(3):
        (a, q), verdict = inside(ds, random, "a", "q")
        np.testing.assert_array_equal(margin(a, q, 0.12) > 0, verdict == 1)
        (a, q), verdict = inside(four, random, "a", "q")
        both = np.minimum(margin(a, q, 0.1), margin(0.5 * a, q, 0.1))
        np.testing.assert_array_equal(both > 0, verdict == 1)


def test_areas_of_mathieus_map(tmp_path):
    """Those of the built-in scene, within both bounds, which narrow with the cells."""
    known = ran("mathieu", tmp_path, 0.005, a=(-1.0, 6.0), q=(0.0, 3.0))
    errors = []
    for width in (0.02, 0.005):
        ds = ran(mathieu(0.0), tmp_path, width, a=(-1.0, 6.0), q=(0.0, 3.0))
        assert (abs(ds.area - known.area) <= ds.area_error + known.area_error).all()
        errors.append(float(ds.area_error.max()))
    assert errors[1] < 0.4 * errors[0] < 0.4


def test_two_equal_oscillators_are_settled_as_one_is(tmp_path):
    """Their multipliers meet everywhere: J M + (J M)^T is definite where they are on the circle."""

    def K(t, p, out):
        out[0, 0] = out[1, 1] = p[0] - 2 * p[1] * math.cos(2 * t)

    pair = survey.floquet(
        K=K,
        period=math.pi,
        parameters=("a", "q"),
        states=("x", "y"),
        structure="symplectic",
    )
    known = ran(mathieu(0.0), tmp_path, 0.01, a=(-1.0, 6.0), q=(0.0, 3.0))
    ds = ran(pair, tmp_path, 0.01, a=(-1.0, 6.0), q=(0.0, 3.0))
    assert (ds.area_error <= 2.0 * known.area_error.max()).all()
    assert (abs(ds.area - known.area) <= ds.area_error + known.area_error).all()
    assert ds.attrs["refine_points"] <= 2 * known.attrs["refine_points"]
    for _ in range(3):
        (a, q), verdict = inside(ds, np.random.default_rng(6), "a", "q")
        np.testing.assert_array_equal(margin(a, q, 0.0) > 0, verdict == 1)


def test_two_oscillators(tmp_path):
    """The example: strongly stable cells and unstable ones, by points, and by `survey verify`."""
    scene = str(WORKFLOWS / "coupled_mathieu.py")
    ds = ran(scene, tmp_path, 0.01, Omega=(0.8, 1.6), epsilon=(0.02, 0.4))
    (Omega, epsilon), verdict = inside(ds, np.random.default_rng(5), "Omega", "epsilon")
    points = {"Omega": xr.DataArray(Omega, dims="i"), "epsilon": xr.DataArray(epsilon, dims="i")}
    np.testing.assert_array_equal(
        survey.evaluate(scene, method="dop853", **points).verdict.values, verdict
    )


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_signs_of_margins_without_structure(n):
    """All are positive where the spectral radius is below 1, one is negative where it is above;
    bounds hold.
    """
    random = np.random.default_rng(n)
    M = random.standard_normal((2000, n, n))
    radius = abs(np.linalg.eigvals(M)).max(axis=1)
    M *= (random.uniform(0.3, 1.8, 2000) / radius)[:, None, None]
    radius = abs(np.linalg.eigvals(M)).max(axis=1)
    values, bars = cells.margins(M, np.full(M.shape, 1e-14), "none")
    np.testing.assert_array_equal((values > bars).all(axis=1), radius < 1)
    np.testing.assert_array_equal((values < -bars).any(axis=1), radius > 1)
    E = 1e-5 * abs(random.standard_normal(M.shape))
    values, bars = cells.margins(M, E, "none")
    moved, _bars = cells.margins(M + E * random.uniform(-1, 1, M.shape), np.zeros_like(E), "none")
    assert (abs(moved - values) <= bars).all()


@pytest.mark.parametrize("m", [1, 2, 3])
def test_signs_of_margins_of_symplectic_matrices(m):
    """Multipliers of different angles on the circle, or two of them off it with their mirror images."""
    random = np.random.default_rng(m)
    angles = np.cumsum(random.uniform(0.1, 3.0 / m, (400, m)), axis=1)
    values = np.exp(1j * angles)
    loses = np.arange(400) % 2 == 1
    if m > 1:  # two angles become one complex pair and its mirror image
        values[loses, 0] *= 1.3
        values[loses, 1] = 1 / values[loses, 0].conj()
    else:
        values[loses, 0] = 1.3
    M = np.zeros((400, 2 * m, 2 * m))
    for k in range(400):
        A = random.standard_normal((2 * m, 2 * m))
        c = np.poly(
            np.concatenate(
                [values[k], values[k].conj() if m > 1 or not loses[k] else 1 / values[k]]
            )
        ).real
        companion = np.eye(2 * m, k=-1)
        companion[0] = -c[1:]
        M[k] = A @ companion @ np.linalg.inv(A)
    values, bars = cells.margins(M, 1e-14 * abs(M), "symplectic")
    stable, unstable = (values > bars).all(axis=1), (values < -bars).any(axis=1)
    assert not (stable & loses).any() and not (unstable & ~loses).any()
    assert (stable | unstable).mean() > 0.99  # badly conditioned coordinates may leave some open


def test_where_there_are_none():
    def branching(t, p, out):
        out[0, 0] = p[0] * (1.0 if p[1] > 0.5 else 2.0) - math.cos(t)

    def A(t, p, out):
        out[0, 0] = p[0] - p[1]
        for j in range(1, len(out)):
            out[0, j] = 1.0

    axes = {"a": {"start": 0.1, "stop": 1.0, "num": 3}, "b": {"start": 0.1, "stop": 1.0, "num": 3}}
    given = {"period": 2 * math.pi, "parameters": ("a", "b"), "states": ("x", "y")}
    cases = [
        (
            survey.floquet(K=branching, **given | {"states": "x"}),
            "a branch of the code depends on one",
        ),
        (survey.floquet(A, **given, conserved=(0.0, 1.0)), "CONSERVED: a multiplier is 1"),
        (
            survey.floquet(A, **given | {"states": tuple(f"x{k}" for k in range(13))}),
            "up to 12 states, not of 13",
        ),
    ]
    for scene, words in cases:
        with pytest.raises(BadInput, match=words):
            check({"scene": scene, "axes": axes, "refine": {"width": 0.1}})
    duffing = {
        "omega": {"start": 1.0, "stop": 2.0, "num": 3},
        "F": {"start": 0.1, "stop": 0.2, "num": 3},
    }
    with pytest.raises(BadInput, match="not for periodic orbits"):
        check({"scene": str(WORKFLOWS / "duffing.py"), "axes": duffing, "refine": {"width": 0.1}})
