"""The libration points as users ask for them: labels, files, counts, and what is said of the proofs."""

import subprocess
import sys
from math import isqrt
from pathlib import Path

import libration_exact as exact
import numpy as np
import pytest

import survey
from survey.scenes import libration

WORKFLOW = {
    "scene": "libration",
    "axes": {"mu": {"start": 1e-4, "stop": 0.045, "num": 40}},
    "output": {"figures": ["verdict", "c"]},
}


def test_coefficients_are_named_by_their_monomials():
    row = exact.REFERENCE["table"][2]
    ds = survey.evaluate("libration", mu=float(row["mu"]))
    assert ds.c.dims == ("monomial",) and list(ds.monomial.values) == list(row["c"])
    for label, value in row["c"].items():
        # the table's mu is a decimal, that of the survey the float64 next to it
        assert float(ds.c.sel(monomial=label)) == pytest.approx(float(value), rel=1e-12)
    assert float(ds.M_ray) == pytest.approx(float(row["derived"]["M_on_ray2"]), rel=1e-12)


def test_the_share_that_order_6_decides():
    mu = np.linspace(0, 0.0385208965045513970, 50_001)[1:-1]
    ds = survey.evaluate("libration", mu=mu, variables="verdict")
    assert float((ds.verdict == 2).mean()) == pytest.approx(0.14182, abs=4e-5)
    assert int((ds.verdict == 2).sum() + (ds.verdict == 1).sum()) == mu.size


def test_a_run_keeps_the_labels(tmp_path):
    path = tmp_path / "small.nc"
    ds = survey.run(WORKFLOW, output=path)
    again = survey.evaluate("libration", mu=ds.mu.values)
    np.testing.assert_array_equal(ds.c.sel(monomial="012"), again.c.sel(monomial="012"))
    assert ds.c.dims == ("mu", "monomial") and (tmp_path / "small.png").exists()
    checker = [
        Path(sys.executable).with_name("compliance-checker"),
        "--test=cf:1.11",
        "--criteria=strict",
        path,
    ]
    assert subprocess.run(checker, capture_output=True).returncode == 0


def test_lazy_input():
    import xarray as xr

    mu = xr.DataArray(np.linspace(0.001, 0.03, 12).reshape(3, 4), dims=("one", "two"))
    lazy = survey.evaluate("libration", mu=mu.chunk(one=1))
    assert lazy.c.dims == ("one", "two", "monomial")
    np.testing.assert_array_equal(lazy.c.values, survey.evaluate("libration", mu=mu).c.values)


def test_no_binary_fraction_is_a_resonance_of_rank_2():
    """omega1 omega2 = sqrt(27 m (2^k - m)) / 2^(k+1) at mu = m / 2^k is irrational below mu_R; at
    1/4 it is not.
    """
    for k in range(2, 15):
        for m in range(1, int(0.0386 * 2**k) + 1):
            square = 27 * m * (2**k - m)
            assert isqrt(square) ** 2 != square
    assert isqrt(27 * 3) ** 2 == 27 * 3


def test_what_is_not_proved_is_said():
    for text in (
        libration.__doc__,
        next(o for o in libration.OUTPUTS if o.name == "verdict").applies,
    ):
        assert "rational" in text and "rank-2" in text and "Lyapunov" in text


@pytest.mark.parametrize("mu", [0.0, -0.01, 0.51])
def test_a_mass_outside_the_domain_is_refused(mu):
    with pytest.raises(survey.BadInput, match="allowed: 1e-100 <= mu <= "):
        survey.evaluate("libration", mu=mu)
