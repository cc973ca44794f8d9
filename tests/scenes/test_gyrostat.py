"""The scene: shapes, statuses, what applies where, the same bits in any block, and plain Python as
the slow twin.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import survey
from survey.kernels.cylinder import records as rc
from survey.methods import taylor
from survey.scene import Request
from survey.scenes import gyrostat
from survey.status import INVALID_PARAMETERS, OK
from survey.sweep import cost

SIX = dict(
    zip(("b12", "b31", "d", "c23", "s2", "s3"), (0.7, -0.4, 1.1, 0.3, 0.5, -0.2), strict=True)
)


def solve(question, method="auto", rtol=1e-10, **values):
    point = {
        name: np.asarray(value, float)
        for name, value in (SIX | {"phi0": 0.0, "w0": 0.0} | values).items()
    }
    if question == "portrait":
        del point["phi0"], point["w0"]
    size = max(array.ndim for array in point.values())
    point = {
        name: array.reshape((1,) * (size - array.ndim) + array.shape)
        for name, array in point.items()
    }
    return gyrostat.solve(point, Request({"question": question}, method, rtol))


@pytest.mark.parametrize("method", ["auto", pytest.param("dop853", marks=pytest.mark.slow)])
def test_w_alone_is_that_of_a_survey_with_times(method):
    """Random systems at angles on both sides, some of which are beyond turning points."""
    random = np.random.default_rng(11)
    count = 60 if method == "auto" else 6
    given = dict(zip(SIX, random.normal(size=(6, count)), strict=True))
    given |= {"phi0": random.uniform(-3, 3, count), "w0": random.normal(size=count)}
    given = {name: xr.DataArray(values, dims="i") for name, values in given.items()}
    given |= {"phi": np.linspace(-9, 9, 53), "question": "abel", "method": method}
    whole = survey.evaluate("gyrostat", **given)
    alone = survey.evaluate("gyrostat", variables=["w", "phi_turning"], **given)
    assert set(alone.data_vars) == {"w", "w_error", "phi_turning", "phi_turning_error", "status"}
    assert {OK, gyrostat_turning()} <= set(np.unique(whole.status))
    same = whole.status == alone.status
    assert same.mean() > 0.999
    for name in ("w", "phi_turning"):
        known = same & whole[name].notnull()
        assert (alone[name].notnull() == whole[name].notnull()).where(same, True).all()
        bars = whole[f"{name}_error"] + alone[f"{name}_error"]
        assert (abs(alone[name] - whole[name]) <= bars).where(known, True).all()
        assert known.sum() > count
    timed = survey.evaluate("gyrostat", variables=["w", "t"], **given)
    xr.testing.assert_equal(timed.w, whole.w)
    xr.testing.assert_equal(timed.t, whole.t)


def test_w_alone_does_not_depend_on_what_stands_where_times_would(monkeypatch):
    """Some rows are solved again, and the better answer is kept: by what is known of w."""
    random, untimed = np.random.default_rng(5), taylor.flow_abels_untimed
    given = dict(zip(SIX, random.normal(0, 10, (6, 400)), strict=True))
    given |= {"phi0": random.uniform(0, 3, 400), "w0": random.normal(0, 10, 400)}
    given = {name: xr.DataArray(values, dims="i") for name, values in given.items()}
    given |= {"phi": np.linspace(3, 9, 40), "question": "abel", "rtol": 1e-11, "variables": ["w"]}
    found, calls = [], []
    for value in (0.0, 1e300, np.nan):

        def spoiled(P, starts, targets, tolerance, limit, planes, status, value=value):
            untimed(P, starts, targets, tolerance, limit, planes, status)
            planes[rc.TIME :: 2] = value
            calls.append(tolerance)

        monkeypatch.setattr(taylor, "flow_abels_untimed", spoiled)
        found.append(survey.evaluate("gyrostat", **given))
    assert len(set(calls)) > 1  # of the first attempt and of the second
    for other in found[1:]:
        xr.testing.assert_equal(found[0], other)


def gyrostat_turning():
    """The code of the status `turning`."""
    return 16 + list(gyrostat.STATUS).index("turning")


def grid(*lengths):
    """Axes phi0, w0 and perhaps a third, each along its own dimension."""
    axes = [np.linspace(-3.0, 3.0, n) for n in lengths]
    return [
        axis.reshape([-1 if i == j else 1 for j in range(len(axes))]) for i, axis in enumerate(axes)
    ]


def test_trajectory_fills_the_block():
    phi0, w0, t = grid(3, 4, 5)
    out = solve("trajectory", phi0=phi0, w0=w0, t=t)
    assert {values.shape for values in out.values()} == {(3, 4, 5)}
    assert (out["status"] == OK).all() and (out["turnings"] >= 0).all()
    assert (
        np.isfinite(out["phi"]).all()
        and (out["phi_error"] < 1e-10 * (1 + np.abs(out["phi"]))).all()
    )


def test_turning_points_beyond_what_an_int32_holds_are_not_counted():
    ds = survey.evaluate(
        "gyrostat",
        question="trajectory",
        s3=1.0,
        phi0=1.0,
        w0=0.0,
        t=[1e3, 1e8, 1e10],
        method="closed",
    )
    assert ds.status.values.tolist() == [OK] * 3 and np.isnan(ds.turnings[2])
    assert (ds.turnings[:2] > 0).all()


@pytest.mark.parametrize(
    "start", [{"w0": 0.0, "s3": 1e-300}, {"w0": 1e-300, "s3": 1e-300}, {"w0": 1e-300, "s3": -0.4}]
)
def test_next_to_no_motion_there_is_a_bar_or_no_answer(start):
    ds = survey.evaluate(
        "gyrostat", question="abel", phi0=1.0, phi=[-4.0, 1e-300, 1.0, 4.0], **start
    )
    for name in ("w", "t", "phi_turning", "t_turning"):
        assert (ds[name].notnull() == np.isfinite(ds[f"{name}_error"])).all(), name


@pytest.mark.parametrize("method", ["auto", "taylor", "dop853"])
def test_a_bar_whose_square_underflows_is_not_zero(method):
    """g = 0: w decays towards a line of equilibria, here to 1e-236."""
    ds = survey.evaluate("gyrostat", question="trajectory", b12=-1.2275169987903272, b31=-0.25840520034837094,
                         phi0=-4548921.414959067, w0=2.2444386423875864, t=777.3128895507939, method=method,
                         rtol=1e-6)  # fmt: skip
    assert ds.status != OK or ds.w_error > 0


def test_abel_tells_what_applies():
    phi0, w0, phi = grid(3, 4, 5)
    out = solve("abel", phi0=phi0, w0=w0, phi=phi)
    reached, turned = out["status"] == OK, out["status"] == 16
    assert reached.any() and turned.any() and (reached | turned).all()
    for name in ("w", "t"):
        assert np.array_equal(np.isfinite(out[name]), reached) and np.array_equal(
            np.isfinite(out[f"{name}_error"]), reached
        )
        assert np.array_equal(np.isfinite(out[f"{'phi' if name == 'w' else 't'}_turning"]), turned)


@pytest.mark.parametrize("question", ["fate", "trajectory", "abel"])
def test_the_same_bits_in_any_block(question):
    phi0, w0, last = grid(4, 6, 3)
    extra = {"fate": {}, "trajectory": {"t": last}, "abel": {"phi": last}}[question]
    whole = solve(question, phi0=phi0, w0=w0, **extra)
    for i, j in ((slice(1, 3), slice(0, 2)), (slice(3, 4), slice(5, 6))):
        part = solve(question, phi0=phi0[i], w0=w0[:, j], **extra)
        for name, values in part.items():
            wanted = whole[name][i, j]
            assert np.array_equal(
                values.reshape(wanted.shape), wanted, equal_nan=values.dtype.kind == "f"
            ), name


@pytest.mark.parametrize("name", ["b12", "s3", "phi0", "w0"])
def test_a_point_outside_the_domain_costs_itself_alone(name):
    for question, extra in (
        ("fate", {}),
        ("trajectory", {"t": [1.0, 2.0]}),
        ("abel", {"phi": [0.1, 0.2]}),
    ):
        start = {"phi0": 0.0, "w0": 2.0} | {name: [[0.5], [np.nan]]}
        out = solve(question, **start, **extra)
        assert (out["status"][1] == INVALID_PARAMETERS).all() and (out["status"][0] == OK).all()
        for key, values in out.items():
            if values.dtype.kind == "f":
                assert np.isnan(values[1]).all(), key


def test_portraits_over_parameters():
    """The same bits in any block, places beyond the cycles are empty, a point outside its domain
    affects no other.
    """
    s2, d = np.array([[-1.0], [0.5], [np.nan], [1.2]]), np.array([[-2.0, 0.4, 1.1]])
    whole = solve("portrait", s2=s2, d=d)
    assert whole["cycle_w"].shape == (4, 3, 8) and whole["equilibrium_phi"].shape == (4, 3, 4)
    assert (whole["status"][2] == INVALID_PARAMETERS).all() and (
        np.delete(whole["status"], 2, 0) == OK
    ).all()
    part = solve("portrait", s2=s2[1:2], d=d[:, 1:])
    for name, values in part.items():
        np.testing.assert_array_equal(values, whole[name][1:2, 1:], err_msg=name)
    cycles = whole["rotations_plus"] + whole["rotations_minus"] + whole["librations"]
    for name in ("cycle_w", "cycle_multiplier", "cycle_period"):
        for values in (whole[name], whole[f"{name}_error"]):
            assert np.array_equal(np.isfinite(values).sum(axis=-1), np.maximum(cycles, 0)), name
    assert (
        np.array_equal((whole["cycle_kind"] > 0).sum(axis=-1), np.maximum(cycles, 0))
        and cycles.max() > 0
    )


def test_fates_over_a_parameter():
    out = solve("fate", b12=np.linspace(-1, 1, 5)[:, None], w0=np.array([[-2.0, 0.3, 2.0]]))
    assert out["verdict"].shape == (5, 3) and (out["verdict"] >= 0).all()
    for name in ("limit_phi", "limit_w", "multiplier"):
        assert np.array_equal(np.isfinite(out[name]), np.isfinite(out[f"{name}_error"]))


@pytest.mark.parametrize("method", [pytest.param("rk4", marks=pytest.mark.slow), "dop853"])
def test_methods_agree_on_fates(method):
    phi0, w0 = grid(3, 4)
    best, other = solve("fate", phi0=phi0, w0=w0), solve("fate", method, 1e-7, phi0=phi0, w0=w0)
    both = (best["verdict"] >= 0) & (other["verdict"] >= 0)
    assert both.mean() > 0.9 and np.array_equal(best["verdict"][both], other["verdict"][both])


PLAIN = """
import json, numpy as np
from survey.scene import Request
from survey.scenes import gyrostat
P = dict(zip(("b12", "b31", "d", "c23", "s2", "s3"), (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)))
point = {k: np.array([v]) for k, v in P.items()} | {"phi0": np.array([1.5]), "w0": np.array([0.8])}
fate = gyrostat.solve(point, Request({"question": "fate"}))
one = gyrostat.solve(point | {"t": np.array([3.0])}, Request({"question": "trajectory"}))
two = gyrostat.solve(point | {"phi": np.array([2.5])}, Request({"question": "abel"}))
del point["phi0"], point["w0"]
whole = gyrostat.solve(point, Request({"question": "portrait"}))
all_of = ("t", one), ("a", two), ("f", fate), ("p", whole)
print(json.dumps({q + k: float(np.ravel(v)[0]) for q, o in all_of for k, v in o.items()}))
"""


@pytest.mark.slow
def test_plain_python_gives_the_same_bits():
    texts = []
    for off in ("0", "1"):
        run = subprocess.run(
            [sys.executable, "-c", PLAIN],
            capture_output=True,
            text=True,
            env=os.environ | {"NUMBA_DISABLE_JIT": off},
        )
        assert run.returncode == 0, run.stderr
        texts.append(run.stdout)
    assert json.loads(texts[0]).keys() == json.loads(texts[1]).keys()
    assert texts[0] == texts[1]


@pytest.mark.parametrize("axes", [("t", "w0"), ("w0", "t")])
def test_times_are_solved_together_whatever_the_blocks(axes, monkeypatch):
    """A row that misses the accuracy at one time is refined at all: so t is never cut."""
    values = {"t": np.linspace(0.0, 40.0, 6), "w0": np.linspace(-1.0, 2.0, 5)}
    system = {
        "b12": 0.3,
        "b31": -0.2,
        "d": 1.0,
        "s3": 0.5,
        "phi0": 0.4,
        "question": "trajectory",
        "rtol": 1e-13,
    }

    def solved(**given):
        return survey.evaluate(
            "gyrostat", method="taylor", **(system | {name: values[name] for name in axes} | given)
        )

    whole = solved()
    monkeypatch.setattr(cost, "BLOCK_POINTS", 1)
    monkeypatch.setattr(cost, "IN_MEMORY", 1)
    xr.testing.assert_identical(whole.drop_attrs(), solved().drop_attrs())
    alone = solved(t=values["t"][1:2])
    for name in ("phi", "w"):
        some, bars = (
            whole.isel(t=slice(1, 2)),
            whole[f"{name}_error"].isel(t=slice(1, 2)) + alone[f"{name}_error"],
        )
        assert (abs(some[name] - alone[name]) <= bars).all()
