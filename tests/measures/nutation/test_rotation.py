"""p_theta, p, q, r and gamma at t by the Euler-Poisson equations; alpha1 to beta3 by (11), corrected."""

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import survey
from survey.errors import BadInput
from survey.measures.nutation import rotation

AT_T = tuple(rotation.AT_T)
PARAMETERS = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")


def slopes(_t, y, inertia, epsilon):
    """M' = M x w + epsilon gamma x I gamma, gamma' = gamma x w."""
    momentum, gamma = y[:3], y[3:]
    rate = momentum / inertia
    torque = np.cross(momentum, rate) + epsilon * np.cross(gamma, inertia * gamma)
    return np.concatenate([torque, np.cross(gamma, rate)])


def integrated(point, t):
    """p, q, r, gamma (6, m), with psi = phi = 0 at t = 0; at theta0 = 0 the momentum across is
    p_theta0 alone.
    """
    size_a, size_c, epsilon, theta, p_theta, b, a = point
    across = (b - a * np.cos(theta)) / np.sin(theta) if theta else 0.0
    start = [p_theta, across, a, 0.0, np.sin(theta), np.cos(theta)]
    inertia = np.array([size_a, size_a, size_c])
    done = solve_ivp(
        slopes,
        (0.0, t[-1]),
        start,
        "DOP853",
        t_eval=t,
        args=(inertia, epsilon),
        rtol=1e-12,
        atol=1e-13,
        max_step=0.05,
    )
    return np.concatenate([done.y[:3] / inertia[:, None], done.y[3:]])


RANDOM = np.random.default_rng(21)
STATES = [
    (*size, RANDOM.uniform(-2, 2), RANDOM.uniform(0.5, 2.6), *RANDOM.normal(size=3))
    for size in zip(RANDOM.uniform(0.5, 2.0, 6), RANDOM.uniform(0.2, 0.9, 6), strict=True)
]
# upwards, downwards, at first away from the pole; both poles; from the pole itself, both ways
PASSING = [
    (2.0, 1.0, 0.6, 0.9, -0.8, 0.7, 0.7),
    (2.0, 1.0, 0.6, 2.0, 0.9, -0.7, 0.7),
    (1.0, 1.5, 0.6, 0.9, 0.8, 0.5, 0.5),
    (2.0, 1.0, 0.6, 0.9, 1.9, 0.0, 0.0),
    (2.0, 1.0, 0.6, 0.0, 1.1, 0.7, 0.7),
    (2.0, 1.0, 0.6, 0.0, -1.1, 0.7, 0.7),
]


@pytest.mark.parametrize("point", STATES + PASSING)
def test_the_rotation_at_t(point):
    t = np.linspace(0.0, 12.0, 61)
    ds = survey.evaluate(
        "brun", **dict(zip(PARAMETERS, point, strict=True)), t=t, variables=[*AT_T, "psi", "phi"]
    )
    known = integrated(point, t)
    for name, values in zip(
        ("omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3"), known, strict=True
    ):
        bar = ds[f"{name}_error"].values
        assert (abs(ds[name].values - values) <= bar + 2e-11).all(), (
            name,
            abs(ds[name].values - values).max(),
        )
        assert bar.max() < 1e-9, name
    across = point[0] * (ds.omega1 * np.cos(ds.phi) - ds.omega2 * np.sin(ds.phi))
    assert float(abs(ds.p_theta - across).max()) < 1e-12


def test_bars_of_the_rotation():
    """At half the times' step, to 30 digits, beside a turning point: the bar is a rounding or two."""
    point = (2.0, 1.0, 0.6, 1.1, 0.5, 1.3, 0.9)
    given = dict(zip(PARAMETERS, point, strict=True))
    ds = survey.evaluate("brun", **given, t=[0.0], variables=[*AT_T])
    with mp.workdps(30):
        theta, across = mpf(1.1), (mpf(1.3) - mpf(0.9) * mp.cos(mpf(1.1))) / mp.sin(mpf(1.1))
        known = (mpf(0.5), mpf(0.5) / 2, across / 2, mpf(0.9), mpf(0), mp.sin(theta), mp.cos(theta))
        for name, value in zip(AT_T, known, strict=True):
            got, bar = float(ds[name][0]), float(ds[f"{name}_error"][0])
            assert abs(mpf(got) - value) <= bar < 1e-13, name


def quadratures(point):
    """alpha1 to beta3 at the initial state, by (8) and (11), corrected, as they stand: A = 2 C, t =
    phi = psi = 0.
    """
    size_a, c, epsilon, theta, p_theta, b, a = (mpf(x) for x in point)
    u0, sine = mp.cos(theta), mp.sin(theta)
    across = (b - a * u0) / sine
    energy = (p_theta**2 + across**2) / (2 * size_a) + a * a / (2 * c)
    energy += epsilon / 2 * (size_a * sine**2 + c * u0**2)
    # (7)
    second = p_theta**2 + across**2 + a * a - epsilon * (size_a * c * sine**2 + size_a**2 * u0**2)
    k = epsilon * size_a * (size_a - c)
    level = p_theta**2 + across**2 - k * u0**2 + a * a
    coefficients = [-k, mpf(0), k - level, 2 * a * b, level - a * a - b * b]
    roots = [
        z.real
        for z in mp.polyroots(coefficients, maxsteps=500, extraprec=200)
        if abs(z.imag) < mpf(10) ** -20
    ]
    low = max(z for z in roots if z <= u0)
    side = -1 if p_theta > 0 else 1  # u decreases where p_theta > 0, the sign of (11)

    def integral(f):
        def integrand(x):  # u = low + x^2
            u = low + x * x
            rest = mp.polyval(coefficients, u)
            return 2 * x * f(u) / ((1 - u * u) * mp.sqrt(rest))

        return -side * mp.quad(integrand, [mpf(10) ** -30, mp.sqrt(u0 - low)])

    return {
        "alpha1": 2 * energy,
        "alpha2": second,
        "alpha3": b,
        "beta1": -2 * c * integral(lambda u: b * u / a - 1),
        "beta2": -integral(lambda u: 2 - u * u - b * u / a) / 2,
        "beta3": integral(lambda u: b - a * u),
    }


@pytest.mark.parametrize(
    "point",
    [
        (2.0, 1.0, 0.6, 1.1, 0.5, 1.3, 0.9),
        (2.0, 1.0, 0.6, 1.1, -0.5, 1.3, 0.9),
        (1.0, 0.5, -0.8, 1.9, 0.7, -0.6, 0.4),
        (1.0, 0.5, 2.0, 1.4, -0.3, 0.2, -1.1),
    ],
)
def test_the_constants_of_the_paper(point):
    names = (*rotation.ENERGIES, *rotation.PHASES)
    ds = survey.evaluate("brun", **dict(zip(PARAMETERS, point, strict=True)), variables=[*names])
    with mp.workdps(40):
        for name, known in quadratures(point).items():
            value, bar = float(ds[name]), float(ds[f"{name}_error"])
            assert abs(mpf(value) - known) <= bar + mpf(10) ** -20, (name, value, known, bar)
            assert bar < 1e-12, name


def test_the_constants_stay_along_a_motion():
    """From a later state, with phi and psi there: beta1 less t, beta2 and beta3, of any A = B."""
    start = dict(zip(PARAMETERS, (1.7, 0.6, 0.9, 1.2, -0.4, 0.8, 0.5), strict=True))
    names = (*rotation.ENERGIES, *rotation.PHASES)
    t = np.array([0.3, 0.9, 1.4])
    moved = survey.evaluate(
        "brun", **start, t=t, variables=["u", "phi", "psi", "p_theta", "period"]
    )
    assert float(t[-1]) < float(moved.period[0]) / 4
    later = {name: np.full(3, value) for name, value in start.items()}
    later |= {"theta0": np.arccos(moved.u.values), "p_theta0": moved.p_theta.values}
    later = {name: xr.DataArray(values, dims="t") for name, values in later.items()}
    first, then = (survey.evaluate("brun", **given, variables=[*names]) for given in (start, later))
    share = start["C"] / (2 * start["p_phi"] * (start["A"] - start["C"]))
    phi, psi = moved.phi.values, moved.psi.values
    # (10): beta1 = 2 phi da/dalpha1 - t + ..., beta2 = -phi C/(2 a (A - C)) + ..., beta3 = psi +
    # ...
    expected = {
        "beta1": then.beta1.values + 2 * start["A"] * share * phi - t,
        "beta2": then.beta2.values - share * phi,
        "beta3": then.beta3.values + psi,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(values, float(first[name]), atol=2e-13)
    for name in rotation.ENERGIES:
        np.testing.assert_allclose(then[name], float(first[name]), atol=2e-14)


def test_what_does_not_apply_is_nan():
    state = dict(zip(PARAMETERS, (2.0, 1.0, 0.6, 1.1, 0.5, 1.3, 0.0), strict=True))
    ds = survey.evaluate("brun", **state, variables=["beta1", "beta2", "beta3", "alpha1"])
    assert (
        np.isnan(ds.beta1)
        and np.isnan(ds.beta2)
        and np.isfinite(ds.beta3)
        and np.isfinite(ds.alpha1)
    )
    with pytest.raises(BadInput, match="gamma1"):
        survey.evaluate("brun", **state, variables=["gamma1"])  # no t
