"""Curves of periodic orbits: all orbits of a point, round folds, in the same order and bits on every grid."""

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import survey


def duffing(t, x, p, out):
    F, w = p
    out[0], out[1] = x[1], -0.2 * x[1] - x[0] - x[0] ** 3 + F * np.cos(w * t)


def scene(**more):
    given = {"continuation": ("w", 0.8, 4.0)} | more
    return survey.orbit(
        duffing, states=("x", "v"), parameters=("F", "w"), period=lambda p: 2 * math.pi / p[1], start=(0.0, 0.0),
        **given,
    )  # fmt: skip


def cycles(t, x, p, out):
    """r' = r (m + r^2 - r^4), theta' = 1.5: two cycles for -1/4 < m < 0, one for m > 0."""
    r2 = x[0] ** 2 + x[1] ** 2
    grow = p[0] + r2 - r2**2
    out[0], out[1] = grow * x[0] - 1.5 * x[1], 1.5 * x[0] + grow * x[1]


def shot(F, w, x):
    """x(T) and dx(T)/dx(0) by SciPy."""

    def rhs(t, y):
        A = np.array([[0.0, 1.0], [-1.0 - 3 * y[0] ** 2, -0.2]])
        slope = np.empty(2)
        duffing(t, y[:2], (F, w), slope)
        return np.concatenate([slope, (A @ y[2:].reshape(2, 2)).ravel()])

    y = np.concatenate([x, np.eye(2).ravel()])
    y = solve_ivp(rhs, (0.0, 2 * math.pi / w), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return y[:2], y[2:].reshape(2, 2)


@pytest.mark.slow
def test_duffings_three_orbits_against_scipy():
    """Newton's method from a lattice of starts finds no orbit that the curves do not, and the same states."""
    w = np.array([1.2, 1.9, 2.3])
    ds = survey.evaluate(scene(), F=1.0, w=w, branch=[1.0, 2.0, 3.0])
    for i, frequency in enumerate(w):
        found = []
        starts = np.array(np.meshgrid([-3, -1, 0, 1, 3], [-4, 0, 4])).reshape(2, -1).T.astype(float)
        for start in (*starts, *(ds.x0.values[i][ds.status.values[i] == 0] + 1e-2)):
            x = start
            for _ in range(12):
                X, M = shot(1.0, frequency, x)
                step = np.linalg.solve(np.eye(2) - M, X - x)
                x = x + step
                if abs(step).max() < 1e-11 or abs(x).max() > 20:
                    break
            if abs(step).max() < 1e-9 and not any(abs(x - other).max() < 1e-6 for other in found):
                found.append(x)
        ours = ds.isel(w=i)
        count = int(ours.orbits[0])
        assert count == len(found) == (1, 3, 1)[i]
        assert (ours.status == 0).values.tolist() == [k < count for k in range(3)]
        for k in range(count):
            off = [abs(x - ours.x0[k].values) for x in found]
            best = min(off, key=max)
            assert (best <= ours.x0_error[k].values + 1e-9).all()
        assert len({tuple(np.round(x, 6)) for x in ours.x0.values[:count]}) == count
    middle = ds.isel(w=1)
    assert middle.verdict.values.tolist() == [1, 0, 1]  # the orbit between the folds is the saddle


def test_cycles_round_their_fold_in_closed_form():
    system = survey.orbit(
        cycles,
        states=("x", "y"),
        parameters="m",
        period=None,
        start=(1.1, 0.0, 4.2),
        continuation=("m", -0.5, 0.4),
    )
    m = np.array([-0.4, -0.26, -0.2499, -0.2, -0.1, -0.03, 0.2])
    ds = survey.evaluate(system, m=m, branch=[1.0, 2.0])
    assert ds.orbits.isel(branch=0).values.tolist() == [0, 0, 2, 2, 2, 2, 1]
    for i, value in enumerate(m):
        root = mpmath.sqrt(1 + 4 * mpmath.mpf(value)) if value > -0.25 else None
        squares = [] if root is None else [q for q in ((1 - root) / 2, (1 + root) / 2) if q > 0]
        for k in range(2):
            at = ds.isel(m=i, branch=k)
            if k >= len(squares):
                assert int(at.status) == 16 and np.isnan(at.x0).all() and int(at.verdict) == -1
                continue
            assert int(at.status) == 0
            T = 4 * mpmath.pi / 3
            assert abs(float(at.period) - T) <= float(at.period_error) + 1e-15
            radius = math.hypot(*at.x0.values)
            assert abs(radius - float(mpmath.sqrt(squares[k]))) <= 1.5 * at.x0_error.max() + 4e-16
            exact = mpmath.exp(T * (2 * squares[k] - 4 * squares[k] ** 2))
            assert abs(float(at.multiplier_re[0]) - exact) <= float(at.multiplier_re_error[0])
            assert int(at.verdict) == (k == len(squares) - 1)


@pytest.mark.slow
def test_bits_depend_on_no_grid():
    w, F = np.linspace(0.8, 4.0, 9), np.array([0.4, 1.0, 1.3])
    whole = survey.evaluate(scene(), F=F, w=w, branch=[1.0, 2.0, 3.0])
    for i, j, k in ((0, 0, 0), (1, 3, 2), (2, 8, 0), (1, 4, 1)):
        one = survey.evaluate(scene(), F=F[i], w=w[j], branch=k + 1.0)
        for name in whole.data_vars:
            assert np.array_equal(
                whole[name].isel(F=i, w=j, branch=k).values, one[name].values, equal_nan=True
            ), name


def period_map(rhs, T, x):
    return solve_ivp(rhs, (0.0, T), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def test_coexisting_orbits_that_no_curve_from_the_start_meets():
    """A forced van der Pol oscillator has three; SciPy's DOP853 and fsolve find the same."""
    omega, F, mu = 0.88333, 0.61238, 1.50742
    ds = survey.evaluate(
        "workflows/entrainment.py", omega=omega, F=F, mu=mu, branch=[1.0, 2.0, 3.0]
    )
    assert ds.orbits.values.tolist() == [3, 3, 3] and (ds.status == 0).all()

    def rhs(t, y):
        return y[1], mu * (1 - y[0] ** 2) * y[1] - y[0] + mu * F * math.cos(omega * t)

    found = []
    for guess in ((0.17, -0.65), (0.42, -0.96), (-0.81, 1.66)):  # by size
        x = fsolve(lambda x: period_map(rhs, 2 * math.pi / omega, x) - x, guess, xtol=1e-12)
        found.append(x)
    off = abs(ds.x0.values - np.array(found))
    assert (off <= ds.x0_error.values + 1e-9).all()


def test_the_orbit_that_is_zero_from_a_start_that_is_not():
    def pendulum(t, x, p, out):
        out[0] = x[1]
        out[1] = -2 * p[1] * x[1] + (0.07439 + p[0] * np.cos(t)) * np.sin(x[0])

    system = survey.orbit(
        pendulum, states=("x", "v"), parameters=("b", "z"), period=2 * math.pi, start=(0.1, 0.0),
        continuation=("b", 0.0, 3.0),
    )  # fmt: skip
    ds = survey.evaluate(system, b=[0.21509, 1.3, 2.6], z=0.16628)
    assert (ds.status == 0).all() and (abs(ds.x0) <= ds.x0_error).all()
    twice = survey.evaluate(system, b=[0.21509, 1.3, 2.6], z=0.16628, branch=2.0)
    assert (abs(twice.x0).max("state") > 0.1).all()  # once


@pytest.mark.slow
def test_the_orbit_that_is_zero_is_counted_once():
    """Newton's method ends at 0, at 2e-69, at 9e-69: without a force the energy falls, so that there is no other."""

    def f(t, x, p, out):
        out[0] = x[1]
        out[1] = p[1] * math.cos(t) - 0.3 * x[1] - p[0] * x[0] - x[0] ** 3

    forced = survey.orbit(
        f,
        states=("x", "v"),
        period=2 * math.pi,
        parameters=("k", "F"),
        start=(0.0, 0.0),
        continuation=("F", -1.0, 1.0),
    )
    ds = survey.evaluate(forced, k=[0.3, 0.5, 0.9], F=[-0.3, 0.0, 1e-12])
    assert (ds.status == 0).all()
    assert (ds.orbits.sel(F=[0.0, 1e-12]) == 1).all()
    assert (ds.sel(k=0.3, F=-0.3).orbits == 3).item()


def test_branches_that_are_no_numbers():
    ds = survey.evaluate(scene(), F=1.0, w=1.9, branch=[1.0, 1.5, 4.0])
    assert ds.status.values.tolist() == [0, 1, 16]
    assert np.array_equal(ds.orbits, [3, np.nan, 3], equal_nan=True)


@pytest.mark.parametrize(
    "given", [("k", 0.0, 1.0), ("w", 2.0, 1.0), ("w", 0.0), "w", ("w", 0.0, math.inf), 3.0]
)
def test_bad_ranges(given):
    with pytest.raises(survey.BadInput, match="continuation") as caught:
        scene(continuation=given)
    assert "\n" not in str(caught.value)


def test_a_range_that_runs_backwards_is_told():
    words = r"continuation = \('w', 2, 1\): 2 is not below 1; give \(name, least, greatest value\)"
    with pytest.raises(survey.BadInput, match=words):
        scene(continuation=("w", 2, 1))


def test_outside_the_range():
    assert survey.evaluate(scene(), F=1.0, w=[0.5, 1.0]).status.values.tolist() == [1, 0]


def after_a_period(omega, F, zeta, x, v, step=0.12, order=26):
    """x, v and their derivatives by both, of Duffing's oscillator with a force, a period later: Taylor
    series with mpmath.
    """
    period = 2 * mpmath.pi / omega
    number = int(mpmath.ceil(period / step))
    h = period / number
    state = [[x, v], [mpmath.mpf(1), mpmath.mpf(0)], [mpmath.mpf(0), mpmath.mpf(1)]]
    for k in range(number):
        force = [F * mpmath.cos(omega * k * h + j * mpmath.pi / 2) for j in range(4)]
        rows = [([one], [two]) for one, two in state]
        square = []
        for n in range(order):
            base = rows[0][0]
            square.append(mpmath.fdot(base, base[::-1]))
            for m, (one, two) in enumerate(rows):
                cubed = (1 if m == 0 else 3) * mpmath.fdot(square, one[::-1])
                push = force[n % 4] * omega**n / mpmath.factorial(n) if m == 0 else 0
                slope = push - 2 * zeta * two[n] - one[n] - cubed
                one.append(two[n] / (n + 1))
                two.append(slope / (n + 1))
        powers = [h**j for j in range(order + 1)]
        state = [[mpmath.fdot(row, powers) for row in pair] for pair in rows]
    return state[0], mpmath.matrix([[state[1][0], state[2][0]], [state[1][1], state[2][1]]])


def orbit_near(omega, F, zeta, x, v):
    """The orbit near x, v by Newton's method, to 20 digits or so, and its multipliers."""
    with mpmath.workdps(30):
        omega, F, zeta, x, v = (mpmath.mpf(float(one)) for one in (omega, F, zeta, x, v))
        for _ in range(4):
            end, M = after_a_period(omega, F, zeta, x, v)
            step = mpmath.lu_solve(M - mpmath.eye(2), mpmath.matrix([x - end[0], v - end[1]]))
            x, v = x + step[0], v + step[1]
        assert mpmath.norm(step) < 1e-15
        half, det = (M[0, 0] + M[1, 1]) / 2, M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        root = mpmath.sqrt(half**2 - det)
        return (x, v), (half + root, half - root)


@pytest.mark.parametrize(
    ("F", "near", "inward"),
    [
        pytest.param(0.3, 1.38, -1.0, marks=pytest.mark.slow),
        (0.5, 1.42, 1.0),
        pytest.param(0.5, 1.66, -1.0, marks=pytest.mark.slow),
        pytest.param(0.7, 1.9, -1.0, marks=pytest.mark.slow),
    ],
)
def test_both_orbits_are_found_next_to_a_fold(F, near, inward):
    """Down to 1e-7 of the range, where cubics between points of the curve miss the fold by 1e-5."""
    folds = survey.edge(scene(), along="w", near=near, F=F).edge.values
    fold = float(folds[abs(folds - near).argmin()])
    assert abs(fold - near) < 0.01
    for d in (1e-5, 1e-6, 1e-7):
        ds = survey.evaluate(scene(), F=F, w=fold + 3.2 * d * inward, branch=[1, 2, 3])
        assert (ds.status == 0).all() and (ds.orbits == 3).all()
        verdicts = []
        for k in range(3):
            one = ds.isel(branch=k)
            exact, multipliers = orbit_near(one.w, F, 0.1, *one.x0.values)
            off = [abs(x - mpmath.mpf(float(y))) for x, y in zip(exact, one.x0.values, strict=True)]
            assert all(o <= bar for o, bar in zip(off, one.x0_error.values, strict=True))
            assert (one.x0_error < 1e-8).all()
            verdicts.append(int(one.verdict))
            assert verdicts[-1] in (-1, int(max(abs(m) for m in multipliers) < 1))
        assert verdicts.count(1) == 2 and verdicts.count(0) == 1  # none is undecided
        beyond = survey.evaluate(scene(), F=F, w=fold - 3.2 * d * inward, branch=1)
        assert int(beyond.orbits) == 1


def test_an_angle_is_taken_modulo_2_pi():
    """The forced, damped pendulum: orbits are counted once, not with their copies 2 pi further on."""

    def f(t, x, p, out):
        out[0] = x[1]
        out[1] = -0.5 * x[1] - math.sin(x[0]) + p[0] * math.cos(2 * t / 3)

    T = 3 * math.pi
    system = survey.orbit(
        f, states=("angle", "v"), period=T, parameters=("F",), start=(0.0, 0.0),
        continuation=("F", 0.01, 1.2),
    )  # fmt: skip
    F = [0.3, 0.55, 1.05]
    ds = survey.evaluate(system, F=F, branch=[1.0, 2.0, 3.0, 4.0])
    assert ds.orbits.isel(branch=0).values.tolist() == [1, 1, 3]
    for i, force in enumerate(F):
        here = ds.x0.isel(F=i).dropna("branch").values
        assert len(here) == int(ds.orbits[i, 0])
        for x in here:

            def slope(t, y, force=force):
                return [y[1], -0.5 * y[1] - math.sin(y[0]) + force * math.cos(2 * t / 3)]

            assert abs(period_map(slope, T, x) - x).max() < 1e-8
        apart = here[:, None, 0] - here[None, :, 0]
        apart = np.hypot(np.angle(np.exp(1j * apart)), here[:, None, 1] - here[None, :, 1])
        assert (apart + 10 * np.eye(len(here)) > 0.01).all()
