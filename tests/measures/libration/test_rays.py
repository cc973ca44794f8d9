"""Rays of L = N = 0, their discriminant and the determinants: against the printed values, and
against 60 digits.
"""

import libration_exact as exact
import numpy as np
import pytest

import survey
from survey.truth.libration import truth

NAMES = ("discriminant", "alpha", "beta", "det_N", "det_bordered")
DET_ZERO = 0.0215391147108875079  # physics digest, 5: det N'' = 0
RAY_ZERO = 0.00278347576233486111776847984938  # mu**: a20 = 0


@pytest.mark.parametrize("method", ["auto", "rational", "rational_double", "lie"])
def test_they_lie_within_their_bars(method):
    mu = exact.masses(150, seed=8)
    ds = survey.evaluate("libration", mu=mu, method=method)
    answer = {name: ds[name].values for name in ds.data_vars}
    found = truth({"mu": mu}, answer)
    for name in NAMES:
        value, low, _doubt = found[name]
        off = np.abs((answer[name] - value) - low)
        known = np.isfinite(off)
        assert known.mean() > (0.5 if method == "lie" else 0.95), name
        assert (off[known] <= answer[f"{name}_error"][known]).all(), name


def test_printed_values():
    ds = survey.evaluate("libration", mu=RAY_ZERO)
    assert float(ds.alpha.sel(ray=2)) == pytest.approx(1.41288351286687482, rel=1e-13)
    assert float(ds.beta.sel(ray=2)) == pytest.approx(-1.26111828689478070, rel=1e-13)
    beside = survey.evaluate("libration", mu=DET_ZERO * np.array([1 - 1e-9, 1 + 1e-9]))
    assert (
        np.prod(np.sign(beside.det_N.values)) == -1
        and (abs(beside.det_N) > beside.det_N_error).all()
    )


def test_the_ray_of_a_pole_is_not_given_where_it_may_be_infinite():
    ds = survey.evaluate("libration", mu=[RAY_ZERO], method="rational")
    assert (
        np.isnan(ds.alpha.sel(ray=1)) == np.isnan(ds.alpha_error.sel(ray=1))
        and int(ds.status[0]) == 0
    )


def test_the_discriminant_is_positive_and_arnolds_determinant():
    ds = survey.evaluate("libration", mu=np.linspace(1e-6, 0.0385, 2001))
    assert (ds.discriminant > ds.discriminant_error).all()
    np.testing.assert_array_equal(ds.discriminant, ds.det_bordered)


def test_the_resonance_is_that_of_its_distance_and_order():
    ds = survey.evaluate("libration", mu=np.linspace(1e-4, 0.0385, 501))
    k = ds.resonance.values
    combination = k[:, 0] * ds.omega1.values - k[:, 1] * ds.omega2.values + k[:, 2]
    np.testing.assert_allclose(abs(combination), ds.resonance_distance, atol=1e-14)
    np.testing.assert_array_equal(abs(k).sum(axis=1), ds.resonance_order)
    assert (k[:, 2] % 2 == 0).all()
    above = survey.evaluate("libration", mu=0.04)
    assert np.isnan(above.resonance).all() and np.isnan(above.alpha).all()
