"""The page of the errata of Brun's problem: corrected formulas hold, and no printed one that is
called wrong.
"""

import brun_errata
import errata
import pytest


@pytest.fixture(autouse=True)
def _fewer_trials(monkeypatch):
    monkeypatch.setattr(errata, "TRIALS", 2)


@pytest.mark.parametrize("row", brun_errata.ERRATA, ids=lambda row: row[-1].__name__)
def test_the_corrected_formula_holds_and_the_printed_one_does_not(row):
    printed, corrected = errata.erratum(row[-1])
    assert printed > 1e-3 and corrected < 1e-30


@pytest.mark.parametrize(
    "row", [*brun_errata.RIGHT, *brun_errata.GAPS], ids=lambda row: row[-1].__name__
)
def test_what_is_right_and_what_is_missing(row):
    assert errata.residual(row[-1]) < 1e-30


def test_a_wrong_field_would_be_seen(monkeypatch):
    """The residuals of what is right are not zero by construction."""
    whole = brun_errata.Motion.energy
    monkeypatch.setattr(brun_errata.Motion, "energy", lambda self: whole(self) + 1e-9)
    assert all(
        errata.residual(getattr(brun_errata, name)) > 1e-11
        for name in ("hamilton_jacobi", "dependent", "any_ratio")
    )
