"""Series, Jacobian and equilibria of the flow on the cylinder, against mpmath and numpy."""

import math

import mpmath as mp
import numba
import numpy as np
import pytest

from survey.kernels.cylinder import bounds, flow, program, steps
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.jit import fresh
from survey.measures.cylinder import solution
from survey.methods import taylor

SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)


def random_systems(count, seed):
    return np.random.default_rng(seed).normal(size=(count, 6)) * [1, 1, 2, 2, 3, 3]


@fresh
def begun(p, phi, w, T):
    taylor.flow_begin(p, phi, w, 1e-16, T)
    flow.variation(p, T)


def filled(six, phi, w):
    p, T = flow.coefficients(*six), flow.table()
    begun(p, phi, w, T)
    return p, T


def test_the_series_solves_the_equation():
    """phi' = w and w' = f w + g, coefficient by coefficient, f and g expanded by mpmath."""
    b12, b31, d, c23, s2, s3 = map(mp.mpf, SIX)
    _p, T = filled(SIX, 0.3, 1.7)
    with mp.workdps(40):
        phi = [mp.mpf(float(x)) for x in T[: flow.ORDER, flow.PHI]]
        w = [mp.mpf(float(x)) for x in T[: flow.ORDER, flow.W]]

        def rate(t):
            x, v = (sum(a * t**n for n, a in enumerate(row)) for row in (phi, w))
            s, c = mp.sin(x), mp.cos(x)
            return (b12 * c - b31 * s) * v - d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s

        wanted = mp.taylor(rate, 0, 8)
        for n, value in enumerate(wanted):
            assert abs((n + 1) * w[n + 1] - value) < 1e-13 * (1 + abs(value))
            assert phi[n + 1] == pytest.approx(float(w[n]) / (n + 1), rel=1e-15)


def test_the_jacobian_is_the_derivative_of_the_flow():
    h, small = 0.05, 1e-5
    _p, T = filled(SIX, 0.3, 1.7)
    found = flow.jacobian(T, h)
    for column, (dphi, dw) in enumerate(((small, 0), (0, small))):
        ends = [taylor.flow_at(*filled(SIX, 0.3 + k * dphi, 1.7 + k * dw), h)[:2] for k in (1, -1)]
        wanted = np.subtract(*ends) / (2 * small)
        assert np.allclose([found[column], found[2 + column]], wanted, atol=1e-8)
    area = found[0] * found[3] - found[1] * found[2]
    assert area == pytest.approx(math.exp(taylor.flow_at(_p, T, h)[2]), rel=1e-9)  # Liouville


@pytest.mark.parametrize("phi", [0.0, 3.0, -3.2, 1e3, -12345.678, 1e10])
def test_reduction_keeps_the_angle(phi):
    rest, turns = flow.reduced(phi)
    assert abs(rest) <= math.pi + 1e-15
    with mp.workdps(40):
        assert abs(mp.mpf(rest) + 2 * mp.pi * int(turns) - mp.mpf(phi)) < 1e-15


def test_equilibria_are_all_roots_of_g():
    """Against the quartic in exp(i phi), whose roots on the unit circle numpy finds."""
    for six in random_systems(100, 3):
        _b12, _b31, d, c23, s2, s3 = six
        p, table = flow.coefficients(*six), np.zeros((eq.MOST, 10))
        count, _hidden = eq.equilibria(p, table)
        a, b = -c23 / 2 + 1j * d / 4, s2 / 2 + 1j * s3 / 2  # g = a z^2 + b z + conjugates
        z = np.roots([a, b, 0, b.conjugate(), a.conjugate()])
        wanted = np.sort(np.angle(z[np.abs(np.abs(z) - 1) < 1e-7]) % (2 * np.pi))
        assert np.allclose(table[:count, eq.ANGLE], wanted, atol=1e-8)
        for row in table[:count]:
            assert abs(flow.values(p, row[eq.ANGLE])[1]) <= 3 * abs(row[eq.DG]) * row[eq.BAR]


@pytest.mark.parametrize(
    ("gap", "kinds"), [(0.0, {eq.DEGENERATE}), (1e-9, {eq.SADDLE, eq.NODE}), (-1e-9, set())]
)
def test_a_double_root_is_degenerate_and_a_near_one_is_two(gap, kinds):
    """g = -cos 2phi - (1 - gap) cos phi = (3/2) x^2 - gap + ... at phi = pi + x."""
    p, table = flow.coefficients(0.1, 0.2, 0.0, 1.0, -1.0 + gap, 0.0), np.zeros((eq.MOST, 10))
    near = [
        row for row in table[: eq.equilibria(p, table)[0]] if abs(row[eq.ANGLE] - math.pi) < 1e-3
    ]
    assert {int(row[eq.KIND]) for row in near} == kinds
    assert len(near) == len(kinds)
    for row in near:
        assert abs(abs(row[eq.ANGLE] - math.pi) - math.sqrt(gap / 1.5)) < row[eq.BAR] + 1e-9


@pytest.mark.slow
def test_regions_of_attraction_hold():
    """States on the edge of the region V < LEVEL end at the equilibrium."""
    tried, random = 0, np.random.default_rng(5)
    for six in random_systems(60, 4):
        p, table = flow.coefficients(*six), np.zeros((eq.MOST, 10))
        for row in table[: eq.equilibria(p, table)[0]]:
            if row[eq.LEVEL] == 0.0 or row[eq.F] > -0.3 or row[eq.DG] > -0.1:
                continue
            V = np.array([[row[eq.VAA], row[eq.VAB]], [row[eq.VAB], row[eq.VBB]]])
            angles = random.uniform(0, 2 * np.pi, 8)
            x = np.linalg.solve(
                np.linalg.cholesky(V).T, [np.cos(angles), np.sin(angles)]
            ) * math.sqrt(row[eq.LEVEL])
            starts = np.ascontiguousarray(x.T + np.array([row[eq.ANGLE], 0.0]))
            planes, n, s = np.zeros((4, 8, 1)), np.zeros((8, 1), dtype=int), np.zeros(8, dtype=int)
            taylor.flow_trajectories(
                np.tile(p, (8, 1)), starts, np.full((8, 1), 300.0), 1e-14, 99999, planes, n, s
            )
            assert np.abs(planes[0, :, 0] - row[eq.ANGLE]).max() < 1e-6
            tried += 1
    assert tried > 10


@pytest.mark.parametrize("n", [1, 2, 10])
def test_errors_of_the_start_and_the_target_lie_within_the_bar_of_a_crossing(n):
    """2 n local errors, and those of the initial phi, the target and the time, which all add up in w."""
    floats, size = np.empty((1, 4)), 1e-10
    steps.fill_crossing(floats, 0, n, 1.0, 0.0, (n + 3) * size**2, 0.0, n * size**2, -1.0, 0.0)
    assert (2 * n + 3) * size <= floats[0, 2] < 1.1 * (2 * n + 4) * size


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_kernels_of_the_gyrostat_compile_no_program():
    """Its rows are read-only arrays; a row that may be written to is taken for a program."""
    P, _starts = solution.split(np.ones((1, 8)))
    own = np.zeros(program.OPERATIONS + 2 * program.WIDTH)
    for p in (flow.coefficients(*SIX), P[0], own):
        every(p, flow.table())
    for kernel in (
        program.values,
        program.in_time,
        program.along,
        bounds.bound_near,
        bounds.longest_step,
    ):
        assert {signature[0].mutable for signature in kernel.signatures} == {True}


@fresh
def every(p, T):
    flow.series(p, 0.1, 0.2, T, flow.LOW)
    flow.rates(p, T)
    return flow.values(p, 0.1), flow.longest_step(p, 0.2), flow.on_circle(p)
