"""Loops of separatrices against an integration of (S2) and (S4), and the upright rotation, which stays."""

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import survey
from survey.errors import BadInput
from survey.measures.nutation import separatrix


@pytest.mark.parametrize(
    ("alpha", "beta"), [(0.15, 0.1), (0.3, 0.2), (-0.2, 0.1), (0.05, -0.3), (0.5, 0.0), (0.0, 0.2)]
)
def test_a_loop_is_a_solution(alpha, beta):
    u0, bar = (float(x[0]) for x in separatrix.saddles(np.array([alpha]), np.array([beta])))
    drift = 0.3
    loop = separatrix.Loop(u0, bar, alpha, beta, drift)
    level = (alpha**2 + beta**2 - 2 * alpha * beta * u0) / (1 - u0**2) - u0**2

    def slopes(t, y):
        u, v = y[:2]
        minus, plus = (beta - alpha) / (1 - u), (beta + alpha) / (1 + u)
        force = -u * (level + u * u) + (1 - u * u) * u + alpha * beta
        return [v, force, 0.5 * (minus + plus), drift + 0.5 * (plus - minus)]

    t = np.linspace(0.0, 6.0, 13)
    found = loop.motion(t)
    known = solve_ivp(slopes, (0, 6), [found["u"][0], 0, 0, 0], t_eval=t, rtol=1e-11, atol=1e-12, method="DOP853").y
    for name, values in zip(("u", "psi", "phi"), (known[0], known[2], known[3]), strict=True):
        assert (abs(found[name] - values) <= found[f"{name}_error"] + 1e-8).all(), name
        assert found[f"{name}_error"].max() < 1e-6
    back = loop.motion(-t)
    np.testing.assert_allclose(back["u"], found["u"], rtol=1e-15)
    np.testing.assert_allclose(back["psi"], -found["psi"], rtol=1e-12)
    assert abs(found["u"][0]) > abs(u0) and abs(loop.motion(np.array([40.0]))["u"][0] - u0) < 1e-12


def test_growth_rates():
    """sqrt(-A^2 omega_n^2) of (S9), by mpmath, at random momenta; there is one where there is a separatrix."""
    random = np.random.default_rng(3)
    alpha, beta = random.uniform(-0.7, 0.7, (2, 200))
    points = {name: xr.DataArray(x, dims="point") for name, x in (("alpha", alpha), ("beta", beta))}
    ds = survey.evaluate("brun", l=2.0, **points, variables=["saddle_growth", "separatrix_distance"])
    assert (ds.saddle_growth.notnull() == ds.separatrix_distance.notnull()).all()
    assert 20 < int(ds.saddle_growth.notnull().sum()) < 180
    near = separatrix.saddles(alpha, beta)[0].tolist()
    for i in np.flatnonzero(ds.saddle_growth.notnull())[:40]:
        with mp.workdps(30):
            a, b = mpf(alpha[i]), mpf(beta[i])
            u = mp.findroot(lambda u, a=a, b=b: (a - b * u) * (b - a * u) + u * (1 - u * u) ** 2, near[i])
            level = (a * a + b * b - 2 * a * b * u) / (1 - u * u) - u * u
            rate = mp.sqrt(1 - 6 * u * u - level)
            assert abs(mpf(float(ds.saddle_growth[i])) - rate) <= float(ds.saddle_growth_error[i])
    assert float(ds.saddle_growth_error.max()) < 1e-10


def test_growth_in_the_units_of_a_state():
    """Upright: u = 1 - m2 / [2 |k| + ...cosh(sqrt(m2) t / A)], m2 = 4 |k| - p^2."""
    state = {"A": 2.0, "C": 1.0, "epsilon": -0.6, "theta0": 0.3, "p_theta0": 0.1, "p_psi": 0.9, "p_phi": 0.9}
    ds = survey.evaluate("brun", **state, variables=["saddle_growth"])
    known = np.sqrt(4 * 0.6 * 2.0 - 0.81) / 2.0
    assert abs(float(ds.saddle_growth) - known) <= float(ds.saddle_growth_error) + 1e-15


def test_the_trajectory_of_a_separatrix():
    """beta = 0, l = alpha^2: the unstable precession on the equator, whose loop this is."""
    ds = survey.evaluate("brun", l=0.25, alpha=0.5, beta=0.0).survey.trajectory()
    assert float(abs(ds.u[0])) < 1e-4 and float(abs(ds.u).max()) > 0.5
    upright = survey.evaluate("brun", sign="-1", l=1.25, alpha=0.5, beta=0.5)
    with pytest.raises(BadInput, match="separatrix"):
        upright.survey.trajectory()


def test_the_unstable_upright_rotation_stays():
    state = {"A": 2.0, "C": 1.0, "epsilon": -0.6, "theta0": 0.0, "p_theta0": 0.0, "p_psi": 0.9, "p_phi": 0.9}
    t = np.array([0.0, 1.0, 30.0])
    ds = survey.evaluate("brun", **state, t=t)
    assert (ds.status == 0).all() and (ds.verdict == 0).all() and (ds.u == 1.0).all() and (ds.u_error == 0.0).all()
    # about the vertical the body turns by psi + phi, at the rate p_phi / C
    off = abs(ds.psi + ds.phi - 0.9 / 1.0 * t)
    assert (off <= ds.psi_error + ds.phi_error).all()
    assert ds.period.isnull().all()
