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
    ("alpha", "beta", "sign"),
    [
        *(
            (0.15, 0.1, 1),
            (0.3, 0.2, 1),
            (-0.2, 0.1, 1),
            (0.05, -0.3, 1),
            (0.5, 0.0, 1),
            (0.0, 0.2, 1),
        ),
        *((0.2, 0.2, 1), (-0.1, 0.1, 1)),  # these pass a pole
        *((0.5, 0.5, -1), (-1.4, -1.4, -1), (0.7, -0.7, -1)),  # from an upright rotation
    ],
)
def test_a_loop_is_a_solution(alpha, beta, sign):
    drift = 0.3
    loop = separatrix.loop(alpha, beta, sign, drift)
    u0 = loop.u0
    level = (
        alpha**2 + 1
        if sign < 0
        else (alpha**2 + beta**2 - 2 * alpha * beta * u0) / (1 - u0**2) - u0**2
    )

    def slopes(t, y):
        u, v = y[:2]
        minus = (beta - alpha) / (1 - u) if beta != alpha else 0.0
        plus = (beta + alpha) / (1 + u) if beta != -alpha else 0.0
        force = -u * (level + sign * u * u) + sign * (1 - u * u) * u + alpha * beta
        return [v, force, 0.5 * (minus + plus), drift + 0.5 * (plus - minus)]

    t = np.linspace(0.0, 6.0, 13)
    found = loop.motion(t)
    known = solve_ivp(
        slopes, (0, 6), [found["u"][0], 0, 0, 0], t_eval=t, rtol=1e-11, atol=1e-12, method="DOP853"
    ).y
    for name, values in zip(("u", "psi", "phi"), (known[0], known[2], known[3]), strict=True):
        assert (abs(found[name] - values) <= found[f"{name}_error"] + 1e-8).all(), name
        assert found[f"{name}_error"].max() < 1e-6
    back = loop.motion(-t)
    np.testing.assert_allclose(back["u"], found["u"], rtol=1e-15)
    np.testing.assert_allclose(back["psi"], -found["psi"], rtol=1e-12)
    assert abs(found["u"][0] - u0) > 0.1 and abs(loop.motion(np.array([40.0]))["u"][0] - u0) < 1e-12


def test_growth_rates():
    """sqrt(-A^2 omega_n^2) of (S9), by mpmath, at random momenta; there is one where there is a
    separatrix.
    """
    random = np.random.default_rng(3)
    alpha, beta = random.uniform(-0.7, 0.7, (2, 200))
    points = {name: xr.DataArray(x, dims="point") for name, x in (("alpha", alpha), ("beta", beta))}
    ds = survey.evaluate(
        "brun", l=2.0, **points, variables=["saddle_growth", "separatrix_distance"]
    )
    assert (ds.saddle_growth.notnull() == ds.separatrix_distance.notnull()).all()
    assert 20 < int(ds.saddle_growth.notnull().sum()) < 180
    near = separatrix.saddles(alpha, beta)[0].tolist()
    for i in np.flatnonzero(ds.saddle_growth.notnull())[:40]:
        with mp.workdps(30):
            a, b = mpf(alpha[i]), mpf(beta[i])
            u = mp.findroot(
                lambda u, a=a, b=b: (a - b * u) * (b - a * u) + u * (1 - u * u) ** 2, near[i]
            )
            level = (a * a + b * b - 2 * a * b * u) / (1 - u * u) - u * u
            rate = mp.sqrt(1 - 6 * u * u - level)
            assert abs(mpf(float(ds.saddle_growth[i])) - rate) <= float(ds.saddle_growth_error[i])
    assert float(ds.saddle_growth_error.max()) < 1e-10


def test_growth_in_the_units_of_a_state():
    """Upright: u = 1 - m2 / [2 |k| + ...cosh(sqrt(m2) t / A)], m2 = 4 |k| - p^2."""
    state = {
        "A": 2.0,
        "C": 1.0,
        "epsilon": -0.6,
        "theta0": 0.3,
        "p_theta0": 0.1,
        "p_psi": 0.9,
        "p_phi": 0.9,
    }
    ds = survey.evaluate("brun", **state, variables=["saddle_growth"])
    known = np.sqrt(4 * 0.6 * 2.0 - 0.81) / 2.0
    assert abs(float(ds.saddle_growth) - known) <= float(ds.saddle_growth_error) + 1e-15


def test_the_trajectory_of_a_separatrix():
    """beta = 0, l = alpha^2: the unstable precession on the equator, whose loop this is."""
    ds = survey.evaluate("brun", l=0.25, alpha=0.5, beta=0.0).survey.trajectory()
    assert float(abs(ds.u[0])) < 1e-4 and float(abs(ds.u).max()) > 0.5
    upright = survey.evaluate("brun", sign="-1", l=1.25, alpha=0.5, beta=0.5).survey.trajectory()
    assert float(upright.u.max()) > 0.999 and float(upright.u.min()) == pytest.approx(-0.5)
    passage = survey.evaluate("brun", sign="-1", l=1.0, alpha=0.0, beta=0.0).survey.trajectory()
    np.testing.assert_allclose(passage.u, np.tanh(passage.t), atol=1e-12)
    cusp = survey.evaluate("brun", l=1.0, alpha=1.0, beta=0.0)
    with pytest.raises(BadInput, match="take a point beside it"):
        cusp.survey.trajectory()


def test_the_unstable_upright_rotation_stays():
    state = {
        "A": 2.0,
        "C": 1.0,
        "epsilon": -0.6,
        "theta0": 0.0,
        "p_theta0": 0.0,
        "p_psi": 0.9,
        "p_phi": 0.9,
    }
    t = np.array([0.0, 1.0, 30.0])
    ds = survey.evaluate("brun", **state, t=t)
    assert (
        (ds.status == 0).all()
        and (ds.verdict == 0).all()
        and (ds.u == 1.0).all()
        and (ds.u_error == 0.0).all()
    )
    # about the vertical the body turns by psi + phi, at the rate p_phi / C
    off = abs(ds.psi + ds.phi - 0.9 / 1.0 * t)
    assert (off <= ds.psi_error + ds.phi_error).all()
    assert ds.period.isnull().all()


AT_T = ("p_theta", "omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3")


@pytest.mark.parametrize(
    ("state", "last"),
    [
        ((2.0, 1.0, -0.6, 0.0, 0.0, 0.9, 0.9), 1e3),  # upright: exactly, for ever
        ((1.0, 1.5, 1.0, np.pi, 0.0, -0.3, 0.3), 15.0),  # upside down: as far as pi is a float
        ((1.0, 0.5, 1.0, np.pi / 2, 0.0, 0.0, 0.1), 20.0),  # across the vertical
        pytest.param((3.0, 1.0, 0.4, np.pi / 2, 0.0, 0.0, -0.2), 20.0, marks=pytest.mark.slow),
    ],
)
def test_states_at_rest_on_an_unstable_precession(state, last):
    """The rotation goes on steadily; what float64 leaves open of the state grows in the bars, to no
    answer at last.
    """
    names = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
    t = np.linspace(-last, last, 41)
    variables = ["u", "psi", "phi", "verdict", *AT_T]
    ds = survey.evaluate("brun", **dict(zip(names, state, strict=True)), t=t, variables=variables)
    assert (ds.status == 0).all() and (ds.verdict == 0).all()
    inertia = np.array([state[0], state[0], state[1]])
    with mp.workdps(60):  # pi and the float next to it
        theta = mpf(state[3])
        across = (
            (mpf(state[5]) - mpf(state[6]) * mp.cos(theta)) / mp.sin(theta) if theta else mpf(0)
        )
        start = [mpf(0), across, mpf(state[6]), mpf(0), mp.sin(theta), mp.cos(theta)]
    with mp.workdps(25):

        def slopes(_t, y):
            m, g = y[:3], y[3:6]
            w = [x / mpf(i) for x, i in zip(m, inertia, strict=True)]
            h = [x * mpf(i) * mpf(state[2]) for x, i in zip(g, inertia, strict=True)]
            one, two, three = ((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
                               for a, b in ((m, w), (g, h), (g, w)))  # fmt: skip
            return [*(x + y for x, y in zip(one, two, strict=True)), *three]

        solution = mp.odefun(slopes, 0, start, tol=mpf(10) ** -21)
        for time in (2.0, 5.0):
            known = solution(mpf(time))
            here = survey.evaluate(
                "brun", **dict(zip(names, state, strict=True)), t=[time], variables=variables
            )
            for i in range(3):
                for name, value in (
                    (f"omega{i + 1}", known[i] / inertia[i]),
                    (f"gamma{i + 1}", known[3 + i]),
                ):
                    off, bar = (
                        abs(mpf(float(here[name][0])) - value),
                        float(here[f"{name}_error"][0]),
                    )
                    assert off <= bar + 1e-20 and bar < 1e-8, (name, time, off, bar)
            turned = mp.atan2(known[3], known[4]) - mpf(float(here.phi[0]))
            # phi from gamma1, gamma2: at a pole only the sum of the angles shows
            if state[3] not in (0.0, np.pi):
                turned -= 2 * mp.pi * mp.nint(turned / (2 * mp.pi))
                assert abs(turned) <= float(here.phi_error[0])
    assert float(here.u[0]) == pytest.approx(np.cos(state[3]), abs=1e-15)
    assert (ds.u_error.max() < 1e-2) and np.isfinite(ds.psi + ds.phi).all()
    if state[3]:
        lost = survey.evaluate(
            "brun", **dict(zip(names, state, strict=True)), t=[1e4], variables=variables
        )
        assert np.isnan(lost.u[0]) and np.isnan(lost.omega1[0]) and int(lost.verdict[0]) == 0
