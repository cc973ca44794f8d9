"""The page of the gyrostat's errata: every corrected formula holds, and no printed one that is
called wrong.
"""

import gyrostat_elliptic
import gyrostat_errata
import pytest
from errata import erratum, residual
from mpmath import mp, mpf


@pytest.mark.parametrize("row", gyrostat_errata.ERRATA, ids=lambda row: row[0])
def test_the_corrected_formula_holds_and_the_printed_one_does_not(row):
    printed, corrected = erratum(row[-1])
    assert printed > 1e-4 and corrected < 1e-30


@pytest.mark.parametrize(
    "row", [*gyrostat_errata.RIGHT, *gyrostat_errata.GAPS], ids=lambda row: row[0]
)
def test_what_is_right_and_what_is_missing(row):
    assert residual(row[-1]) < 1e-30


def test_a_wrong_formula_would_be_seen(monkeypatch):
    """The residuals of what is right are not zero by construction."""
    whole = gyrostat_errata.Body.moment
    monkeypatch.setattr(
        gyrostat_errata.Body,
        "moment",
        lambda self, w, nu: whole(self, w, nu) + gyrostat_errata.matrix([1e-9, 1e-9, 1e-9]),
    )
    for name in (
        "full_equations",
        "integrals",
        "rotation",
        "second_equation",
        "conditions",
        "set_a",
        "set_b",
    ):
        assert residual(getattr(gyrostat_errata, name)) > 1e-12, name


def test_weierstrass_against_the_differential_equation_and_the_lemniscate():
    with mp.workdps(40):
        g2, g3 = mpf("3.7"), mpf("-0.9")
        p, slope = gyrostat_elliptic.weierstrass(mpf("0.8"), g2, g3)
        assert abs(slope**2 - 4 * p**3 + g2 * p + g3) < 1e-36
        half = mp.gamma(mpf(1) / 4) ** 2 / (4 * mp.sqrt(mp.pi))  # DLMF 23.5, g2 = 1, g3 = 0
        assert abs(gyrostat_elliptic.weierstrass(half, mpf(1), mpf(0))[0] - mpf("0.5")) < 1e-35
