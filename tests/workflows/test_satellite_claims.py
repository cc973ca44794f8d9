"""The pieces that test the source's printed formulas, at small size."""

import numpy as np
import pytest
import satellite_claims as claims

import survey


@pytest.mark.parametrize("case", [claims.CASES[i] for i in (0, 3, 6, 7)])
def test_the_rigid_body_agrees_with_survey_and_not_with_the_printed_z(case):
    body, k, rho = case
    known = float(survey.evaluate("satellite", k=k, rho=rho, body=body).discriminant)
    assert abs(claims.body_trace(*case) - known) < 1e-6
    assert abs(claims.hill_trace(k, -rho, k * k) - known) > 0.1


@pytest.mark.parametrize("body", claims.BODIES)
def test_lyapunov(body):
    assert not claims.librations(body, 40).certified.any()
    ds = claims.rotations(body, 40)
    assert ds.certified.any() and not np.any(ds.certified & ds.unstable)
