"""The linear periodic systems that ship as examples, against theory and against plain integration."""

from pathlib import Path

import ground_resonance
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import survey

FOLDER = Path(__file__).parents[2] / "workflows"


def test_coupled_oscillators_resonate_at_the_sum_alone():
    scene, first, second = str(FOLDER / "coupled_mathieu.py"), 1.0, 0.62
    epsilon = 0.02
    half_width = epsilon / (2 * np.sqrt(first * second))
    for k in (0.9, 1.1):
        ds = survey.evaluate(scene, Omega=first + second + k * half_width * np.array([-1, 1]), epsilon=epsilon)
        assert (ds.verdict.values == (0 if k < 1 else 1)).all()
    beside = first - second + half_width * np.linspace(-2, 2, 41)
    assert (survey.evaluate(scene, Omega=beside, epsilon=epsilon).verdict == 1).all()


@pytest.mark.parametrize("lost", [0.0, 1.0])
def test_ground_resonance_by_plain_integration(lost):
    """M(t) is solved by numpy at every time: another code, another integrator."""
    p = np.array([27.0, 4067.5, lost])

    def slope(t, state):
        M, C, K = np.zeros((3, 6, 6))
        ground_resonance.M(t, p, M)
        ground_resonance.C(t, p, C)
        ground_resonance.K(t, p, K)
        q, v = state.reshape(2, 6, 12)
        return np.concatenate([v, -np.linalg.solve(M, C @ v + K @ q)]).ravel()

    period = ground_resonance.PERIOD(p)
    solved = solve_ivp(slope, (0, period), np.eye(12).ravel(), method="DOP853", rtol=1e-11, atol=1e-13)
    exact = np.linalg.eigvals(solved.y[:, -1].reshape(12, 12))
    names = ["multiplier_re", "spectral_radius", "exponent", "verdict", "monodromy"]
    ds = survey.evaluate(
        str(FOLDER / "ground_resonance.py"), omega=p[0], damping=p[1], lost=lost, variables=names
    )  # fmt: skip
    assert int(ds.verdict) == (0 if lost else 1)
    assert abs(float(ds.spectral_radius) - abs(exact).max()) < 1e-8
    assert abs(float(ds.exponent) - np.log(abs(exact).max()) / period) < 1e-7
    off = abs(ds.monodromy.values - solved.y[:, -1].reshape(12, 12))
    assert (off <= ds.monodromy_error.values + 1e-8 * abs(ds.monodromy.values).max()).all()
