"""Stable manifolds and cycles on maps of initial states, against 35-digit integration, closed forms
and fates.
"""

import mpmath as mp
import numpy as np
import pytest
import xarray as xr
from flow_truth import series

import survey
from survey.errors import Stopped
from survey.measures.cylinder import curves
from survey.measures.cylinder.separatrices import SYSTEM
from survey.measures.square import Square
from survey.scenes import gyrostat

BASE = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
SYSTEMS = [
    BASE,
    BASE | {"s2": 1.5, "d": 2.0},
    {"b12": -0.6, "b31": 0.5, "d": 1.4, "c23": -0.3, "s2": 0.4, "s3": 0.9},
]
SQUARE = Square(np.array([-3.14, -4.0]), np.array([3.14, 4.0]), np.array([False, False]))
SIZE = SQUARE.high - SQUARE.low


def lines(fixed, kind, square=SQUARE):
    """[(points (m, 2), errors (m), equilibrium_phi)] of the curves of a class."""
    found = curves.closed(square, ["phi0", "w0"], fixed, {})
    ends = np.cumsum(found.count)
    parts = [slice(end - n, end) for n, end, code in zip(found.count, ends, found.kind, strict=True)
             if code == curves.CLASSES[kind]]  # fmt: skip
    return [
        (found.parameters[p], found.error[p], found.along["equilibrium_phi"][0][p]) for p in parts
    ]


def rates(six, phi, w):
    b12, b31, d, c23, s2, s3 = six
    s, c = mp.sin(phi), mp.cos(phi)
    return w, (b12 * c - b31 * s) * w - d * s * c - c23 * (c * c - s * s) + s2 * c - s3 * s


def branch(six, near, side, time):
    """States of a saddle's stable branch, each with its series, traced backward in time with mpmath."""
    b12, b31, *_ = six = [mp.mpf(x) for x in six]
    saddle = mp.findroot(lambda x: rates(six, x, 0)[1], near)
    f, fp = (
        b12 * mp.cos(saddle) - b31 * mp.sin(saddle),
        -b12 * mp.sin(saddle) - b31 * mp.cos(saddle),
    )
    dg, ddg = (
        mp.diff(lambda x: rates(six, x, 0)[1], saddle),
        mp.diff(lambda x: rates(six, x, 0)[1], saddle, 2),
    )
    a = (f - mp.sqrt(f * f + 4 * dg)) / 2
    x = side * mp.mpf(10) ** -12
    phi, w, t = saddle + x, a * x + (ddg / 2 + fp * a) / (3 * a - f) * x * x, 0
    while t < time:
        rows = series(six, phi, w, 30)
        largest = max(abs(row[-1]) ** (mp.mpf(1) / 30) for row in rows)
        step = min(1 / (10 * largest), 1)
        yield rows, step
        phi, w = (mp.polyval(row, -step, asc=True) for row in rows)
        t += step


def distances(six, near, side, points, time):
    """How far points are from the branch, in units of the map, as far as it is traced; NaN beyond."""
    off = np.full(len(points), np.nan)
    for rows, step in branch(six, near, side, time):
        here = np.array(
            [[float(mp.polyval(row, -step * k / 4, asc=True)) for row in rows] for k in range(5)]
        )
        for i, (phi, w) in enumerate(points):
            turns = 2 * np.pi * np.round((here[:, 0] - phi) / (2 * np.pi))
            close = np.hypot((here[:, 0] - phi - turns) / SIZE[0], (here[:, 1] - w) / SIZE[1])
            if close.min() > 0.02:
                continue
            k = int(np.argmin(close))
            target, dt = (
                (mp.mpf(phi) + 2 * mp.pi * round(turns[k] / (2 * np.pi)), mp.mpf(w)),
                -step * k / 4,
            )
            for _ in range(8):
                at = [mp.polyval(row, dt, asc=True) for row in rows]
                speed = [v / float(s) for v, s in zip(rates(six, *at), SIZE, strict=True)]
                apart = [(x - y) / float(s) for x, y, s in zip(target, at, SIZE, strict=True)]
                dt += mp.fdot(apart, speed) / mp.fdot(speed, speed)
            if -step * 1.01 <= dt <= step * 0.01:
                off[i] = np.fmin(off[i], float(mp.hypot(*apart)))
    return off


@pytest.mark.parametrize(
    "fixed",
    [*(pytest.param(system, marks=pytest.mark.slow) for system in SYSTEMS[:-1]), SYSTEMS[-1]],
)
def test_stable_manifolds_lie_where_long_integration_has_them(fixed):
    six, checked = [fixed[name] for name in SYSTEM], 0
    with mp.workdps(35):
        for saddle in {float(angles[0]) for *_, angles in lines(fixed, "stable_manifold")}:
            own = [part for part in lines(fixed, "stable_manifold") if part[2][0] == saddle]
            points, errors = (np.concatenate([part[i] for part in own])[::29] for i in (0, 1))
            off = np.fmin(*(distances(six, saddle, side, points, 45) for side in (1, -1)))
            off[off > 1e-3] = np.nan  # next to an earlier winding
            assert not (off > errors).any()
            checked += np.isfinite(off).sum()
    assert checked > 25


def test_without_friction_manifolds_are_level_curves():
    for fixed in (BASE | {"b12": 0.0, "b31": 0.0}, dict.fromkeys(SYSTEM, 0.0) | {"d": 2.0}):
        d, c23, s2, s3 = (fixed[name] for name in SYSTEM[2:])

        def height(phi, w, d=d, c23=c23, s2=s2, s3=s3):
            s, c = mp.sin(phi), mp.cos(phi)
            return mp.mpf(w) ** 2 / 2 + d * s * s / 2 + c23 * s * c - s2 * s - s3 * c

        with mp.workdps(30):
            for points, errors, angles in lines(fixed, "stable_manifold"):
                saddle = mp.findroot(lambda x: mp.diff(lambda y: height(y, 0), x), float(angles[0]))
                for (phi, w), error in list(zip(points, errors, strict=True))[::7]:
                    slopes = float(mp.diff(lambda x, w=w: height(x, w), phi)) * SIZE[0], w * SIZE[1]
                    gap = abs(float(height(mp.mpf(phi), w) - height(saddle, 0)))
                    assert gap <= error * np.hypot(*slopes) + 2 * error**2 * (SIZE @ SIZE)


@pytest.mark.parametrize("fixed", SYSTEMS)
def test_verdicts_differ_on_both_sides(fixed):
    """All along a curve or nowhere: on both sides of a saddle's stable manifold its two unstable
    branches are met.
    """
    differ, decided = {}, []
    for kind in ("stable_manifold", "unstable_cycle"):
        for points, errors, angles in lines(fixed, kind):
            some = np.arange(1, len(points) - 1, 41)
            along = (points[some + 1] - points[some - 1]) / SIZE
            across = (
                np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None] * SIZE
            )
            sides = []
            for side in (1, -1):
                x = points[some] + side * np.maximum(3 * errors[some], 1e-9)[:, None] * across
                start = {
                    name: xr.DataArray(column, dims="p")
                    for name, column in zip(("phi0", "w0"), x.T, strict=True)
                }
                sides.append(survey.evaluate("gyrostat", **start, **fixed).verdict.values)
            known = np.minimum(*sides) >= 0  # the fates have error bars of their own
            decided += known.tolist()
            differ.setdefault((kind, str(angles[0])), set()).update(
                (sides[0] != sides[1])[known].tolist()
            )
    assert np.mean(decided) > 0.9
    assert all(len(answers) <= 1 for answers in differ.values())
    assert {True} in differ.values() or fixed is SYSTEMS[2]


def test_cycles_are_closed_in_each_copy():
    wide = Square(np.array([0.0, -4.0]), np.array([20.0, 4.0]), SQUARE.log)
    found = lines(SYSTEMS[1], "unstable_cycle", wide)
    assert len(found) == 4
    assert sum(np.allclose(points[0], points[-1], rtol=0, atol=1e-12) for points, *_ in found) == 3
    assert all((errors < 1e-10).all() for _, errors, _ in found)


def test_free_motions_stop_between_two_lines():
    fixed = dict.fromkeys(SYSTEM, 0.0) | {"b12": 0.7, "b31": -0.4}
    for points, errors, _ in lines(fixed, "stable_manifold"):
        phi, w = points.T
        assert np.allclose(
            abs(w - 0.7 * np.sin(phi) + 0.4 * np.cos(phi)), np.hypot(0.7, 0.4), rtol=0, atol=1e-14
        )
        assert (errors < 1e-14).all()


def test_other_axes_are_refused_by_name():
    assert curves.refusal(["phi0", "w0"], gyrostat) is None
    assert curves.refusal(["w0", "phi0", "d"], gyrostat) is None
    assert "phi0" in curves.refusal(["phi0", "d"], gyrostat)
    assert "none" in curves.refusal([], gyrostat)


def test_maps_of_both_orders_and_stacks_have_the_same_curves():
    swapped = Square(SQUARE.low[::-1], SQUARE.high[::-1], SQUARE.log)
    one, two = (
        curves.closed(SQUARE, ["phi0", "w0"], BASE, {}),
        curves.closed(swapped, ["w0", "phi0"], BASE, {}),
    )
    assert (one.parameters == two.parameters[:, ::-1]).all()
    assert (one.error == two.error).all()


def test_a_run_that_stops_at_its_curves_goes_on_from_its_points(tmp_path, monkeypatch):
    axes = {
        "phi0": {"start": -3.0, "stop": 3.0, "num": 7},
        "w0": {"start": -3.0, "stop": 3.0, "num": 5},
    } | BASE
    workflow = {
        "scene": "gyrostat",
        "axes": axes,
        "boundaries": {},
        "output": {"variables": ["verdict"]},
    }
    whole = survey.run(workflow, output=tmp_path / "whole.nc")

    def stop(*_args, **_more):
        raise Stopped("a power cut")

    with monkeypatch.context() as patch:
        patch.setattr(curves, "closed", stop)
        with pytest.raises(Stopped, match="power cut"):
            survey.run(workflow, output=tmp_path / "map.nc")
    monkeypatch.setattr(gyrostat, "solve", stop)  # no point is solved again
    again = survey.run(workflow, output=tmp_path / "map.nc")
    xr.testing.assert_equal(again.drop_attrs(), whole.drop_attrs())
    assert again.sizes["curve"] > 4
