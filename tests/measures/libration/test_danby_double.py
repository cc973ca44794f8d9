"""Danby's map where float64 leaves it open: next to its edges, about its tip, at the ends of mu and e."""

import json
from importlib import resources

import danby_exact as exact
import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey import status
from survey.measures.libration import danby, danby_double, panels
from survey.measures.libration.answers import Answers
from survey.sweep import cost

REFERENCE = json.loads(
    resources.files("survey.reference").joinpath("libration_elliptic.json").read_text()
)
POINTS, BOUNDARY, TIP = REFERENCE["points"], REFERENCE["boundary"], REFERENCE["tip"]
NAMES = ("A", "B", "C", "D", "t")
# e, and between which mu `collision` of a stable motion in the strip changes: both arcs are as long
# there.
TIES = ((0.0, 0.0350, 0.0358), (0.2, 0.0405, 0.0412))


def results(mu, e):
    mu, e = (
        np.array(np.broadcast_to(values, np.broadcast(mu, e).shape), dtype=float)
        for values in (mu, e)
    )
    return danby_double._results(e.ravel(), mu.ravel())


def row(edge, number=401):
    """So many consecutive float64 numbers about one."""
    return edge + np.spacing(edge) * np.arange(-(number // 2), number // 2 + 1)


def points(mu, e, **more):
    mu, e = np.broadcast_arrays(mu, e)
    return survey.evaluate(
        "libration_elliptic", mu=xr.DataArray(mu, dims="p"), e=xr.DataArray(e, dims="p"), **more
    )


def test_references_lie_within_bars_of_many_digits():
    found = results([row["mu"] for row in POINTS], [row["e"] for row in POINTS])
    with mp.workdps(40):
        for i, point in enumerate(POINTS):
            for j, name in enumerate(NAMES):
                value, bar = mpf(found[i, j]) + mpf(found[i, 5 + j]), found[i, 10 + j]
                off = abs(mpf(point[name])) * mpf(10) ** -27  # what the reference may be off
                assert abs(value - mpf(point[name])) <= bar + off
                assert bar < (1e-24 if point["e"] < 0.9 else 1e-22) * (1 + abs(value))


@pytest.mark.parametrize(
    ("mu", "e"), [(0.5, 0.3), (np.nextafter(0.5, 0), 1e-300), (1e-30, 0.1), (0.02, 0.0)]
)
def test_the_ends_of_the_parameters_lie_within_the_bars(mu, e):
    found = results([mu], [e])[0]
    with mp.workdps(exact.DIGITS):
        wanted = exact.factors(mpf(mu), mpf(e), exact.STEPS, exact.ORDER)
        for j, name in enumerate(NAMES):
            assert abs(mpf(found[j]) + mpf(found[5 + j]) - wanted[name]) <= found[10 + j]


@pytest.mark.parametrize("edge", BOUNDARY, ids=lambda r: f"{r['curve']}-{r['e']}")
def test_the_verdict_changes_between_the_two_numbers_about_an_edge(edge):
    """Along 401 consecutive mu; at e = 0 A and B change their signs together, and the motion stays stable."""
    mu, e = row(float(edge["mu"])), float(edge["e"])
    ds = points(mu, e)
    assert (ds.verdict != -1).all() and (ds.collision != -1).all()
    changes = np.flatnonzero(np.diff(ds.verdict.values))
    if e == 0 and edge["curve"] != "KC":
        assert changes.size == 0 and (ds.verdict == 1).all()
        return
    assert changes.size == 1
    for i in (changes[0], changes[0] + 1):
        assert exact.decided(mu[i], e) == (ds.verdict[i], ds.collision[i])


@pytest.mark.parametrize(("e", "low", "high"), TIES)
def test_the_collision_changes_between_the_two_numbers_where_the_arcs_are_as_long(e, low, high):
    while high - low > 4 * np.spacing(low):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if int(points([middle], e).collision[0]) == 1 else (low, middle)
    mu = row(low)
    ds = points(mu, e)
    assert (ds.verdict == 1).all() and (ds.collision != -1).all()
    [change] = np.flatnonzero(np.diff(ds.collision.values))
    for i in (change, change + 1):
        assert exact.decided(mu[i], e) == (1, ds.collision[i])


def test_nothing_stays_open_about_the_tip():
    """400 points within 1e-12, and all float64 numbers next to it; verdicts of some by multiprecision."""
    random = np.random.default_rng(5)
    mu0, e0 = float(TIP["mu"]), float(TIP["e"])
    away, angle = 10 ** random.uniform(-16, -12, 400), random.uniform(0, 2 * np.pi, 400)
    steps = np.arange(-4, 5)
    mu = np.concatenate([mu0 + away * np.cos(angle), np.repeat(mu0 + np.spacing(mu0) * steps, 9)])
    e = np.concatenate([e0 + away * np.sin(angle), np.tile(e0 + np.spacing(e0) * steps, 9)])
    ds = points(mu, e)
    assert (ds.verdict != -1).all() and (ds.collision != -1).all()
    for i in (np.argmin(away), 400, 440):
        assert exact.decided(mu[i], e[i]) == (ds.verdict[i], ds.collision[i])


def test_rows_and_points_are_as_accurate_as_asked():
    mu, e = np.linspace(1e-3, 0.5, 75), np.array([0.0, 0.3, 0.97])
    dense = survey.evaluate("libration_elliptic", mu=mu, e=e, rtol=2e-16)
    alone = points(np.repeat(mu, 3), np.tile(e, 75), rtol=2e-16)
    for name in "ab":
        assert (dense[f"{name}_error"] <= 2e-16 * (1 + abs(dense[name]))).all()
        both = dense[f"{name}_error"].values.ravel().astype(float) + alone[f"{name}_error"].values
        assert (abs(dense[name].values.ravel() - alone[name].values) <= both).all()
    assert (dense.verdict.values.ravel() == alone.verdict.values).all()
    with mp.workdps(exact.DIGITS):
        wanted = exact.factors(mpf(mu[40]), mpf(e[1]), exact.STEPS, exact.ORDER)
        assert abs(mpf(float(dense.a[40, 1])) - 4 * wanted["t"] + 4) <= mpf(
            float(dense.a_error[40, 1])
        )


def test_a_row_in_double_double_has_the_same_bits_in_any_block(monkeypatch):
    given = {"mu": np.linspace(0.0, 0.05, 90), "e": np.array([0.2, 0.9]), "rtol": 1e-14}
    whole = survey.evaluate("libration_elliptic", **given)
    monkeypatch.setattr(cost, "BLOCK_POINTS", 17)
    monkeypatch.setattr(cost, "IN_MEMORY", 1)
    xr.testing.assert_identical(
        whole.drop_attrs(), survey.evaluate("libration_elliptic", **given).drop_attrs()
    )


def test_places_and_weights_of_the_series_are_exact_to_the_last_digit():
    both, matrix = panels.tables()
    with mp.workdps(40):
        for k in range(len(both)):
            angle = mp.pi * (2 * k + 1) / (2 * len(both))
            for pair, exactly in zip(
                both[k].reshape(2, 2), (7 + mp.cos(angle), 1 - mp.cos(angle)), strict=True
            ):
                assert abs(mpf(pair[0]) + mpf(pair[1]) - 3 * exactly / 8) < 1e-32 * exactly
            for n in (0, 1, 7, len(both) - 1):
                exactly = mp.cos(n * angle) * (2 if n else 1) / len(both)
                assert abs(mpf(matrix[0, n, k]) + mpf(matrix[1, n, k]) - exactly) < 1e-32


def hard_points(random, number):
    """mu at 1/2 and next to it, down to 1e-300, and between; e at 0, tiny, next to 1, and between."""
    mu = np.choose(
        random.integers(0, 5, number),
        [
            0.5 - random.integers(0, 6, number) * 2.0**-54,
            np.minimum(0.5, 0.5 - 10 ** random.uniform(-16, -1, number)),
            10 ** random.uniform(-300, -1, number),
            10 ** random.uniform(-20, -1, number),
            random.uniform(0, 0.5, number),
        ],
    )
    e = np.choose(
        random.integers(0, 5, number),
        [
            np.zeros(number),
            10 ** random.uniform(-300, -1, number),
            np.minimum(1 - 2.0**-53, 1 - 10 ** random.uniform(-16, -0.3, number)),
            10 ** random.uniform(-17, -0.5, number),
            random.uniform(0, 1, number),
        ],
    )
    return mu, e


def lies(mu, e, method, rtol):
    """Points whose error exceeds the bar, or whose verdict or collision is not that of 28 digits."""
    found = results(mu, e)
    truth = Answers(mu.size)
    danby_double.traces_double.measure(found, rtol, status.OVERFLOW, *truth.all)
    wide = [found[:, j].astype(np.longdouble) + found[:, 5 + j] for j in range(5)]
    ab, cd = wide[0] * wide[1], wide[2] * wide[3]
    b = np.where(abs(ab) < abs(cd), 6 - 8 * wide[4] + 16 * ab, 8 * wide[4] - 10 + 16 * cd)
    out = {name: values[:, 0] for name, values in danby.solve(e, mu[:, None], method, rtol).items()}
    known = (out["status"] == status.OK) & (truth.status == status.OK)
    wrong = np.zeros(mu.size, bool)
    for name, value, digits in (("a", 4 * wide[4] - 4, truth.floats[0]), ("b", b, truth.floats[2])):
        wrong |= known & (abs(out[name] - value) > out[f"{name}_error"] + 1e-18 * abs(digits))
    for name, values in (("verdict", truth.verdict), ("collision", truth.collision)):
        wrong |= known & (out[name] != values) & (out[name] != -1) & (values != -1)
    return int(wrong.sum())


@pytest.mark.parametrize(
    ("method", "rtol"), [("auto", 1e-10), ("auto", 1e-13), ("taylor16", 1e-9), ("dop853", 1e-5)]
)
def test_bars_hold_at_the_ends_of_mu_and_e(method, rtol):
    assert (
        lies(
            *hard_points(np.random.default_rng(1), 1000 if method == "auto" else 100),
            method,
            rtol,
        )
        == 0
    )


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-13])
@pytest.mark.parametrize(
    ("method", "number"), [("auto", 25_000), ("taylor16", 25_000), ("dop853", 500), ("rk4", 500)]
)
def test_bars_hold_at_very_many_ends(method, number, rtol):
    assert (
        lies(
            *hard_points(np.random.default_rng(2), number),
            method,
            max(rtol, 1e-9 if method == "rk4" else 0),
        )
        == 0
    )
