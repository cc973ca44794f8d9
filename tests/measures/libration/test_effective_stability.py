"""The radius of effective stability: the bound against the full equations and plain brackets, times
by quadrature.
"""

from math import factorial, log, pi, sqrt

import libration_exact as exact
import lie_twin
import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import quad

from survey.measures.libration import effective_stability as effective
from survey.methods import lie

MU_1, MU_2, MU_R = map(float, exact.CRITICAL)


def test_the_first_remainder_bounds_the_full_equations():
    """r = 2: along the exact force at random places on the polydisk, no action changes faster than
    the bound.
    """
    random, mu, rho = np.random.default_rng(2), 0.02, 1e-3
    norms = lie.remainders(np.array([mu]), 8)
    known = np.array([[norms[2, d][0].max() for d in range(3, 10)]])
    bound = effective.bound(2, known, np.array([[rho]]))[0, 0]
    with mp.workdps(30):
        _omega, columns = lie_twin.modes(mpf(mu))
    columns = np.array([[complex(c) for c in column] for column in columns[:3]])
    z = rho * np.exp(2j * pi * random.random((4000, 3)))
    place = np.array([0.5 - mu, sqrt(0.75), 0.0])
    x, y, zeta = (2.0 * (z @ columns[:, :3]).real + place).T
    force = np.zeros((3, len(z)))
    for mass, place in ((1.0 - mu, -mu), (mu, 1.0 - mu)):
        distance = np.sqrt((x - place) ** 2 + y**2 + zeta**2)
        force -= mass * np.array([x - place, y, zeta]) / distance**3
    s, e, k = x - (0.5 - mu), y - sqrt(0.75), 0.75 * sqrt(3.0) * (1.0 - 2.0 * mu)
    # what the force is beyond that of H2 and the constant: -d(H3 + H4 + ...)/dq
    force -= [-(0.5 - mu) - 0.25 * s + k * e, -sqrt(0.75) + k * s + 1.25 * e, -zeta]
    # dz_j/dt = {z_j, R}, z_j = -i {q, zbar_j}-component: dr_j/dt = 2 Re(i zbar_j * conj(column) .
    # dR/dq)
    rates = 2.0 * (1j * z.conj() * (columns[:, :3].conj() @ -force).T).real
    fastest = abs(rates).max()
    assert 0.2 * bound < fastest < bound


def test_norms_against_plain_brackets():
    """After two transforms: sums of |k_j| |coefficient| of degrees 5 to 7, by dictionaries and in
    30 digits.
    """
    mu, top = 0.012, 7
    norms = lie.remainders(np.array([mu]), 6)
    with mp.workdps(30):
        omega, F = lie_twin.hamiltonian(mpf(mu), top)
        for stage in (3, 4):
            F = transformed(F, stage, omega, top)
        for degree in range(5, top + 1):
            for j in range(3):
                known = float(sum(abs(e[3 + j] - e[j]) * abs(c) for e, c in F[degree].items()))
                value, bar = norms[4, degree][:, j, 0]
                assert abs(value - known) <= bar <= 1e-8 * known


def transformed(F, stage, omega, top):
    """exp(ad chi) of all terms, chi removing those of degree `stage` that are not diagonal."""
    off = {e: c for e, c in F[stage].items() if e[:3] != e[3:]}
    chi = {
        e: -c / (1j * sum(omega[j] * (e[3 + j] - e[j]) for j in range(3))) for e, c in off.items()
    }
    out = dict(F)
    for degree, f in F.items():
        n, term = 1, f
        while degree + n * (stage - 2) <= top:
            term, at = lie_twin.bracket(term, chi), degree + n * (stage - 2)
            out[at] = lie_twin.combine((1, out[at]), (mpf(1) / factorial(n), term))
            n += 1
    return out


def test_the_time_of_a_geometric_remainder():
    """A_d = a q^d: the tail is exact, B = a (q rho)^(r + 1) / (1 - q rho)."""
    r, a, q, start = 4, 3.0, 20.0, 0.01
    norms = a * q ** np.arange(r + 1, r + 5)[None]
    known = quad(
        lambda rho: 2 * rho * (1 - q * rho) / (a * (q * rho) ** (r + 1)), start, sqrt(2) * start
    )[0]
    assert effective.escape_time(r, norms, np.array([start]))[0] == pytest.approx(known, rel=1e-12)
    assert effective.escape_time(r, norms, np.array([0.036]))[0] == 0.0  # the tail diverges at 1/20


def test_the_radius_keeps_the_time_that_is_asked():
    mu = np.array([0.001, 0.01, 0.03])
    norms = lie.remainders(mu, 8)
    before = None
    for time in (1e4, 1e7, 1e10):
        radius, bar, r = effective.radius(norms, time)
        assert (bar > 0).all() and (bar < 1e-4 * radius).all() and ((r >= 2) & (r <= 7)).all()
        for n in range(mu.size):
            known = np.array([[norms[r[n], d][0][:, n].max() for d in range(r[n] + 1, 10)]])
            inside, outside = (
                effective.escape_time(r[n], known, radius[n : n + 1] * (1 + e))[0]
                for e in (-1e-9, 1e-9)
            )
            assert inside > time > outside
            assert time < 1e6 or inside == pytest.approx(time, rel=1e-6)
        assert before is None or (radius < before).all()
        before = radius


def test_orders_end_before_a_resonance():
    """Where a divisor is nothing the order is the resonance's less 1, and the radius that of this
    order alone.
    """
    fourth = 0.008270372663897213  # (1, 4, 0)
    mu = np.array([MU_1, MU_2, fourth, MU_R * 1.01, -1.0])
    radius, bar, r = effective.radius(lie.remainders(mu, 8), 2 * pi * 1e9)
    assert r.tolist() == [2, 3, 4, -1, -1]
    assert np.isfinite(radius[:3]).all() and np.isnan(radius[3:]).all() and np.isnan(bar[3:]).all()
    # r = 2 at mu_1, the first term of the remainder alone: T = (1 - 1/sqrt 2) 2 / (A rho)
    first = lie.remainders(mu[:1], 4)[2, 3][0].max()
    assert radius[0] == pytest.approx((2 - sqrt(2)) / (first * 2 * pi * 1e9), rel=1e-6)


def test_higher_orders_reach_farther():
    mu = np.linspace(0.002, 0.022, 7)
    radii = [effective.radius(lie.remainders(mu, order), 2 * pi * 1e9)[0] for order in (4, 6, 8)]
    assert (radii[0] < radii[1]).all() and (radii[1] < radii[2]).all()
    assert log(radii[2].max()) < -5.0
