"""Series of Danby's factors in both parameters, against the same point by point and against
multiprecision.
"""

import danby_exact as exact
import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.kernels.math.chebyshev import cosines
from survey.measures.libration import danby_double, panels
from survey.sweep import cost

NAMES = ("A", "B", "C", "D", "t")
MU = np.array([1e-12, 1e-4, 0.0123, 0.04699, 0.2, 0.5])


def at(series, mu):
    """The sums (..., MU) of series (..., n) in 4 s - 3, s in long double."""
    mu = mu.astype(np.longdouble)
    x = 4 * np.sqrt(1 - 3 * mu * (1 - mu)) - 3
    weights = np.cos(np.arange(series.shape[-1])[:, None] * np.arccos(np.clip(x, -1, 1)))
    return series.astype(np.longdouble) @ weights


@pytest.mark.parametrize(
    ("low", "high"), [(1e-300, 1e-3), (0.0, 0.76), (0.7615, 0.97), (0.964, 0.9999), (0.9999, 1.0)]
)
def test_rows_lie_within_narrow_bars_of_their_points(low, high):
    random = np.random.default_rng(7)
    e = np.concatenate([random.uniform(low, high, 6), np.tanh(1.0) + 2.0**-53 * np.arange(-3, 4)])
    series, bars = panels.rows(e)
    truth = danby_double._results(np.repeat(e, MU.size), np.tile(MU, e.size)).reshape(
        e.size, MU.size, 15
    )
    values = truth[..., :5].astype(np.longdouble) + truth[..., 5:10]
    off = abs(at(series, MU) - np.swapaxes(values, 1, 2))
    assert (off <= bars[..., None]).all() and off.max() > 0
    sizes = abs(series @ cosines(24)).max(axis=2)
    assert (bars < 2e-13 * sizes).all() and np.median(bars / sizes) < 3e-14


@pytest.mark.parametrize("e", [1e-9, 0.31, 0.7615941559557649, 0.95, 1 - 1e-7])
def test_rows_of_many_digits_lie_within_their_bars(e):
    (series,), (bars,) = panels.pairs(np.array([e]))
    truth = danby_double._results(np.full(MU.size, e), MU)
    with mp.workdps(45):
        for i, mu in enumerate(MU):
            x = 4 * mp.sqrt(1 - 3 * mpf(float(mu)) * (1 - mpf(float(mu)))) - 3
            for j in range(5):
                terms = [mpf(float(high)) + mpf(float(low)) for high, low in series[j].T]
                total = sum(term * mp.chebyt(n, x) for n, term in enumerate(terms))
                value = mpf(float(truth[i, j])) + mpf(float(truth[i, 5 + j]))
                assert abs(total - value) <= bars[j] + truth[i, 10 + j]
                assert bars[j] < (1e-21 if e < 0.99 else 1e-20) * max(abs(terms[0]), abs(terms[1]))


def test_a_series_is_that_of_multiprecision():
    e, mu = 0.61, 0.0123
    series, bars = panels.rows(np.array([e]))
    with mp.workdps(exact.DIGITS):
        wanted = exact.factors(mpf(mu), mpf(e), exact.STEPS, exact.ORDER)
        for j, name in enumerate(NAMES):
            assert (
                abs(mpf(float(at(series[0, j], np.array([mu]))[0])) - wanted[name])
                <= bars[0, j]
                < 1e-12
            )


def test_points_lie_within_their_bars():
    random = np.random.default_rng(3)
    e = np.concatenate(
        [random.uniform(0, 1, 300), 1 - 10 ** random.uniform(-15, -1, 200), [1e-300, 0.5]]
    )
    mu = np.concatenate([random.uniform(0, 0.5, 400), 10 ** random.uniform(-20, -1, 102)])
    found, truth = panels.points(e, mu), danby_double._results(e, mu)
    off = abs((found[:, :5] - truth[:, :5]) - truth[:, 5:10])
    assert (off <= found[:, 5:] + truth[:, 10:]).all() and off.max() > 0
    sizes = abs(panels.rows(e)[0] @ cosines(24)).max(axis=2)
    assert np.median(found[:, 5:] / sizes) < 3e-14


def test_points_agree_with_steps_and_keep_their_bits_in_any_block(monkeypatch):
    random = np.random.default_rng(4)
    points = {
        "mu": xr.DataArray(random.uniform(0, 0.05, 400), dims="p"),
        "e": xr.DataArray(np.linspace(0, 0.9, 400), dims="p"),
    }
    many = survey.evaluate("libration_elliptic", **points)
    for method in ("taylor16", "dop853"):
        other = survey.evaluate("libration_elliptic", method=method, **points)
        for name in "ab":
            bars = other[f"{name}_error"].astype(float) + many[f"{name}_error"]
            assert (abs(other[name] - many[name]) <= bars).all()
            assert (many[f"{name}_error"] < other[f"{name}_error"]).all()
        for name in ("verdict", "collision"):
            known = other[name] != -1
            assert (other[name] == many[name])[known].all() and known.mean() > 0.95
    monkeypatch.setattr(cost, "BLOCK_POINTS", 17)
    monkeypatch.setattr(cost, "IN_MEMORY", 1)
    xr.testing.assert_identical(
        many.drop_attrs(), survey.evaluate("libration_elliptic", **points).drop_attrs()
    )
