"""Surfaces of [boundaries] of Floquet systems in three parameters: true surfaces lie within the
position errors.
"""

import math

import numpy as np
import pytest
import xarray as xr
from scipy.special import mathieu_a, mathieu_b

import survey
from survey.measures import isosurfaces
from survey.measures.floquet.curves import CLASSES
from survey.request.workflow import check
from survey.sweep import surfaces


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(isosurfaces, "LINES", 21)


def found(scene, **axes):
    """The dataset of the surfaces; of a pair of numbers the ends of an axis."""
    table = {
        k: {"start": v[0], "stop": v[1], "num": 2} if np.ndim(v) else v for k, v in axes.items()
    }
    return surfaces.find(check({"scene": scene, "axes": table, "boundaries": {"surfaces": True}}))


def vertices(ds, kind, **axes):
    """(the vertices (m, 3), the ends (2, m, 3) of what brackets them) of the surfaces of a class."""
    own = np.repeat(ds.surface_class.values == CLASSES[kind], ds.surface_vertices.values)
    x = np.stack([ds[f"surface_{name}"].values for name in axes], axis=1)[own]
    off, rows = np.zeros_like(x), np.arange(len(x))
    widths = np.array([high - low for low, high in axes.values()])
    axis = ds.surface_axis.values[own]
    off[rows, axis] = ds.surface_position_error.values[own] * widths[axis]
    return x, np.stack([x - off, x + off])


def damped():
    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 2 * p[2]

    return survey.floquet(K=K, C=C, period=math.pi, parameters=("a", "q", "c"), states="x")


def test_damped_mathieus_surfaces():
    """Multipliers exp(-c pi) times Mathieu's at a - c^2 are 1 or -1 where its discriminant is 2
    cosh(c pi).
    """
    axes = {"a": (-0.5, 5.0), "q": (0.0, 4.0), "c": (0.0, 0.4)}
    ds = found(damped(), **axes)
    assert set(ds.surface_class.values) == {CLASSES["plus_one"], CLASSES["minus_one"]}
    assert ds.attrs["surfaces"] == "a, q, c"
    for kind, sign in (("plus_one", 1), ("minus_one", -1)):
        x, ends = vertices(ds, kind, **axes)
        assert len(x) > 400

        def off(x, sign=sign):
            a, q, c = (xr.DataArray(v, dims="i") for v in x.T)
            known = survey.evaluate("mathieu", a=a - c * c, q=q, rtol=1e-13)
            value = sign * known.discriminant.values - 2 * np.cosh(x[:, 2] * math.pi)
            return value, known.discriminant_error.values + 1e-14

        (low, low_bar), (high, high_bar) = off(ends[0]), off(ends[1])
        certain = (abs(low) > low_bar) & (abs(high) > high_bar)
        assert (np.sign(low) == -np.sign(high))[certain].all()  # every one
        assert certain.mean() > 0.3  # a test that could have failed
        middle, _bar = off(x)
        slope = abs(high - low) / abs(ends[1] - ends[0]).max(axis=1)
        assert np.median(abs(middle) / slope) < 1e-12
    # without damping they are Mathieu's own, by SciPy
    x, ends = vertices(ds, "minus_one", **axes)
    flat = (x[:, 2] == 0.0) & (abs(ends[1] - ends[0])[:, 0] > 0.0)
    a, q = x[flat, :2].T
    near = np.min([abs(f(n, q) - a) for n in (1, 3) for f in (mathieu_a, mathieu_b)], axis=0)
    assert flat.sum() > 20 and near.max() < 1e-11
    # the first tongue begins near q = 2 c
    assert (x[:, 1] > 1.99 * x[:, 2] - 1e-9).all()
    assert (ds.surface_outside.values[np.isfinite(ds.surface_outside.values)] == 0).all()


def hopf(t, p, out):
    """A complex pair of growth |p|^2 - 1/4 and a real multiplier of growth z, in turning axes."""
    x, y, z = p
    growth = x * x + y * y + z * z - 0.25
    out[0, 0] = out[1, 1] = growth
    out[0, 1], out[1, 0] = 0.3 - 1.0, 1.0 - 0.3
    out[2, 2] = 0.5 * (z - 0.1) + 0.2 * math.cos(t)


def test_neimark_sackers_sphere_and_a_plane():
    scene = survey.floquet(
        hopf, period=2 * math.pi, parameters=("x", "y", "z"), states=tuple("abc")
    )
    axes = {"x": (-0.7, 0.8), "y": (-0.6, 0.7), "z": (-0.75, 0.65)}
    ds = found(scene, **axes)
    x, ends = vertices(ds, "neimark_sacker", **axes)
    growth = (ends**2).sum(axis=2) - 0.25
    assert (growth[0] * growth[1] <= 1e-30).all() and len(x) > 500
    own = ds.surface_class.values == CLASSES["neimark_sacker"]
    [count], [triangles] = ds.surface_vertices.values[own], ds.surface_triangles.values[own]
    assert count - triangles // 2 == 2  # a whole sphere: V - E + F with E = 3 F / 2
    inside = np.repeat(own, ds.surface_vertices.values)
    known = np.isfinite(ds.surface_outside.values[inside])
    assert (ds.surface_outside.values[inside] == (x[:, 2] > 0.1))[
        known
    ].all() and known.mean() > 0.9
    angle = abs(math.remainder(0.7 * 2 * math.pi, 2 * math.pi))
    off = abs(ds.surface_angle.values[inside] - angle)
    assert (off <= ds.surface_angle_error.values[inside]).all()
    x, ends = vertices(ds, "plus_one", **axes)
    assert (abs(x[:, 2] - 0.1) <= abs(ends[1] - x)[:, 2]).all() and ds.attrs[
        "surfaces_left_out"
    ] == 0


def test_krein_collisions():
    """x'' - 2 g y' - a x = 0, y'' + 2 g x' - b y = 0: frequencies meet at 2 g = sqrt(a) + sqrt(b)."""

    def K(t, p, out):
        out[0, 0], out[1, 1] = -p[1], -p[2]

    def C(t, p, out):
        out[0, 1], out[1, 0] = -2 * p[0], 2 * p[0]

    scene = survey.floquet(
        K=K, C=C, period=1.1, parameters=("g", "a", "b"), states=("x", "y"), structure="symplectic"
    )  # fmt: skip
    axes = {"g": (0.3, 1.2), "a": (0.1, 0.9), "b": (0.2, 1.1)}
    ds = found(scene, **axes)
    assert set(ds.surface_class.values) == {CLASSES["collision"]}
    x, ends = vertices(ds, "collision", **axes)
    off = 2 * ends[..., 0] - np.sqrt(ends[..., 1]) - np.sqrt(ends[..., 2])
    assert (off[0] * off[1] <= 1e-30).all() and len(x) > 300
    assert (ds.surface_outside.values == 0).all()


def test_a_logarithmic_axis_and_a_fixed_parameter():
    """c log-spaced, a fixed: vertices are positions in the logarithm, errors a part of its range."""
    low, high = 1e-3, 0.5
    table = {
        "a": 1.0,
        "q": {"start": 0.0, "stop": 1.5, "num": 3},
        "c": {"start": low, "stop": high, "num": 5, "spacing": "log"},
    }
    table["s"] = {"start": 0.5, "stop": 2.0, "num": 2}

    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[3] * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 2 * p[2]

    scene = survey.floquet(K=K, C=C, period=math.pi, parameters=("a", "q", "c", "s"), states="x")
    ds = surfaces.find(check({"scene": scene, "axes": table, "boundaries": {"surfaces": True}}))
    q, c, s = (ds[f"surface_{name}"].values for name in "qcs")
    assert ds.attrs["surfaces"] == "q, c, s" and c.min() == low and len(q) > 100
    known = survey.evaluate(
        "mathieu", a=xr.DataArray(1.0 - c * c, dims="i"), q=xr.DataArray(q * s, dims="i"), rtol=1e-13
    )  # fmt: skip
    off = abs(-known.discriminant.values - 2 * np.cosh(c * math.pi))
    assert off.max() < 1e-8 and np.median(off) < 1e-11
