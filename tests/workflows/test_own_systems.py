"""The linear periodic systems that ship as examples, against theory and against plain integration."""

from pathlib import Path

import ground_resonance
import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import survey

FOLDER = Path(__file__).parents[2] / "workflows"


def test_coupled_oscillators_resonate_at_the_sum_alone():
    scene, first, second = str(FOLDER / "coupled_mathieu.py"), 1.0, 0.62
    epsilon = 0.02
    half_width = epsilon / (2 * np.sqrt(first * second))
    for k in (0.9, 1.1):
        ds = survey.evaluate(
            scene, Omega=first + second + k * half_width * np.array([-1, 1]), epsilon=epsilon
        )
        assert (ds.verdict.values == (0 if k < 1 else 1)).all()
    beside = first - second + half_width * np.linspace(-2, 2, 41)
    assert (survey.evaluate(scene, Omega=beside, epsilon=epsilon).verdict == 1).all()


@pytest.mark.parametrize("frequency, product", [(2.0, 1.0), (1.24, 0.62**2), (1.62, 0.62)])
def test_damping_suppresses_resonances_from_a_strength_on(frequency, product):
    """To first order epsilon = 4 c sqrt(omega_i omega_j): of the next order is c^2."""
    scene, c = str(FOLDER / "damped_oscillators.py"), 0.004
    limit = 4 * c * np.sqrt(product)
    Omega = frequency + 0.5 * limit * np.linspace(-1, 1, 41)
    below, above = (
        survey.evaluate(scene, Omega=Omega, epsilon=k * limit, c=c).verdict.values
        for k in (0.98, 1.02)
    )
    assert (below == 1).all() and (above == 0).any()


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
    solved = solve_ivp(
        slope, (0, period), np.eye(12).ravel(), method="DOP853", rtol=1e-11, atol=1e-13
    )
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


def test_a_quadrupoles_damping_in_closed_form():
    """y = exp(-k t) v: Mathieu's equation at a - k^2, by a scene that shares nothing with the system's."""
    scene, period = str(FOLDER / "ion_trap.py"), np.pi
    q, a, k = np.linspace(0.1, 1.4, 7), np.linspace(-0.5, 0.6, 6), [0.02, 0.3]
    ds = survey.evaluate(scene, q=q, a=a, k=k)
    for i, damping in enumerate(k):
        growth, bars = [], []
        for sign in (1, -1):
            one = survey.evaluate("mathieu", a=sign * a - damping**2, q=q).transpose("q", "a", ...)
            growth.append(np.maximum(one.exponent.values, 0.0) / period - damping)
            bars.append(one.exponent_error.values / period)
        exact, bar = np.max(growth, axis=0), np.max(bars, axis=0)
        ours = ds.isel(k=i).transpose("q", "a", ...)
        assert (abs(ours.exponent.values - exact) <= ours.exponent_error.values + bar + 1e-15).all()
        assert (ours.verdict.values == (exact < 0)).all()


@pytest.mark.parametrize(
    "delta, epsilon, zeta, verdict",
    [
        (1.0, 0.42, 0.1, 0),
        pytest.param(1.0, 0.38, 0.1, 1, marks=pytest.mark.slow),
        pytest.param(-0.5, 1.0, 0.3, 0, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_damped_multipliers_in_closed_form(delta, epsilon, zeta, verdict):
    """exp(-pi zeta) times those of Mathieu's equation at delta - zeta^2, which mpmath integrates to 30 digits."""
    with mp.workdps(30):
        d, e, damping = (mp.mpf(value) for value in (delta, epsilon, zeta))
        rest = d - damping**2

        def slope(t, y):
            return [y[1], -(rest + e * mp.cos(2 * t)) * y[0]]

        columns = [mp.odefun(slope, 0, start)(mp.pi) for start in ([1, 0], [0, 1])]
        half = (columns[0][0] + columns[1][1]) / 2
        root = mp.sqrt(mp.mpc(half**2 - 1))
        exact = [mp.exp(-mp.pi * damping) * (half + sign * root) for sign in (1, -1)]
        ds = survey.evaluate(
            str(FOLDER / "damped_mathieu.py"), delta=delta, epsilon=epsilon, zeta=zeta
        )
        ours = ds.multiplier_re.values + 1j * ds.multiplier_im.values
        for value in exact:
            k = int(abs(ours - complex(value)).argmin())
            for name, part in (("multiplier_re", value.real), ("multiplier_im", value.imag)):
                off = abs(mp.mpf(float(ds[name][k])) - part)
                assert off <= float(ds[f"{name}_error"][k]) < 1e-10
        assert int(ds.verdict) == verdict == (max(map(abs, exact)) < 1)


def test_damped_tongues_in_closed_form():
    """On a map: the exponents of the scene `mathieu` less zeta, and the sign of the difference."""
    delta, epsilon, zeta = np.linspace(-1.0, 7.0, 33), np.linspace(0.0, 6.0, 25), [0.03, 0.1, 0.4]
    ds = survey.evaluate(str(FOLDER / "damped_mathieu.py"), delta=delta, epsilon=epsilon, zeta=zeta)
    for i, damping in enumerate(zeta):
        one = survey.evaluate("mathieu", a=delta - damping**2, q=epsilon / 2)
        one = one.transpose("a", "q", ...)
        exact = np.maximum(one.exponent.values, 0.0) / np.pi - damping
        bar = one.exponent_error.values / np.pi
        ours = ds.isel(zeta=i).transpose("delta", "epsilon", ...)
        # at delta = epsilon = 0 nothing depends on the position, and the velocity decays
        marginal = (delta[:, None] == 0.0) & (epsilon == 0.0)
        assert (ours.verdict.values == np.where(marginal, 2, exact < 0)).all()
        off = abs(ours.exponent.values - exact)
        assert (off <= ours.exponent_error.values + bar + 1e-15).all()


def test_the_quadrupoles_first_region():
    """Its corner and its tip, 0.908046 at a = 0 without damping; here with next to none."""
    scene = str(FOLDER / "ion_trap.py")
    edge = survey.evaluate(scene, q=[0.908046 - 1e-5, 0.908046 + 1e-5], a=0.0, k=1e-7)
    assert edge.verdict.values.tolist() == [1, 0]
    corner = survey.evaluate(scene, q=0.705996, a=[0.236994 - 1e-4, 0.236994 + 1e-4], k=1e-7)
    assert corner.verdict.values.tolist() == [1, 0]


def test_kapitzas_limit():
    """beta^2 > 2 kappa, as both go to 0: the ratio at the edge is 2 (1 + O(kappa))."""
    for kappa in (1e-3, 1e-4):
        beta = np.sqrt(2 * kappa * (1 + 8 * kappa * np.array([-1.0, 1.0])))
        ds = survey.evaluate(str(FOLDER / "kapitza.py"), kappa=kappa, beta=beta, zeta=1e-9)
        assert ds.verdict.values.tolist() == [0, 1]


def test_duffings_folds_against_scipy():
    """x(T) = x(0), det(M - 1) = 0 solved with SciPy's integrator: there the number of orbits changes."""
    F, zeta = 0.3, 0.05

    def shot(y):
        x, v, omega = y

        def rhs(t, y):
            force = F * np.cos(omega * t) - 2 * zeta * y[1] - y[0] - y[0] ** 3
            rest = -(1 + 3 * y[0] ** 2)
            return [
                y[1],
                force,
                y[4],
                y[5],
                rest * y[2] - 2 * zeta * y[4],
                rest * y[3] - 2 * zeta * y[5],
            ]

        y = solve_ivp(
            rhs, (0, 2 * np.pi / omega), [x, v, 1, 0, 0, 1], "DOP853", rtol=1e-11, atol=1e-12
        ).y[:, -1]
        return [y[0] - x, y[1] - v, (y[2] - 1) * (y[5] - 1) - y[3] * y[4]]

    scene, omega = str(FOLDER / "duffing.py"), np.linspace(1.1, 2.6, 76)
    ds = survey.evaluate(scene, omega=omega, F=F, zeta=zeta, branch=2.0)
    inside = np.flatnonzero(ds.orbits.values == 3)
    assert (np.diff(inside) == 1).all() and 0 < inside[0] and inside[-1] < 75
    for k, side in ((inside[0], -1), (inside[-1], 1)):
        fold = fsolve(shot, [*ds.x0.values[k], omega[k]], xtol=1e-9)[2]
        assert 0 < side * (fold - omega[k]) < 0.0201
        beside = survey.evaluate(scene, omega=fold + 1e-4 * np.array([-1, 1]), F=F, zeta=zeta)
        assert beside.orbits.values.tolist() == [1, 3][::-side]


def test_entrainment_by_averaging():
    """rho ((1 - rho)^2 + sigma^2) = F^2 / 4; stable where rho > 1/2 and (1 - rho)(1 - 3 rho) +
    sigma^2 > 0.
    """
    mu = 0.02
    for sigma, low, high in ((0.2, 0.1, 1.5), (0.9, 0.5, 2.0)):
        rho = np.linspace(1e-3, 2.0, 400001)
        force = 2 * np.sqrt(rho * ((1 - rho) ** 2 + sigma**2))
        stable = (rho > 0.5) & ((1 - rho) * (1 - 3 * rho) + sigma**2 > 0)
        edge = force[stable].min()
        assert low < edge < high
        omega = (-mu * sigma + np.sqrt((mu * sigma) ** 2 + 4)) / 2
        ds = survey.evaluate(
            str(FOLDER / "entrainment.py"), omega=omega, F=edge * np.array([0.97, 1.03]), mu=mu, branch=-1.0
        )  # fmt: skip
        assert ds.verdict.values.tolist() == [0, 1]
