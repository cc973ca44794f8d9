"""Fates and portraits of flows of one's own against SciPy, eigenvalues, asymptotics and the gyrostat."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import survey
from survey.measures.cylinder import ends, equation

RNG = np.random.default_rng(4)
JUNCTION = survey.abel(
    lambda phi, p: -p[0],
    lambda phi, p: p[1] - math.sin(phi),
    parameters=("a", "I"),
    period=2 * math.pi,
)


def gyrostat_f(phi, p):
    return p[0] * math.cos(phi) - p[1] * math.sin(phi)


def gyrostat_g(phi, p):
    s, c = math.sin(phi), math.cos(phi)
    return -p[2] * c * s - p[3] * math.cos(2 * phi) + p[4] * c - p[5] * s


NAMES = ("b12", "b31", "d", "c23", "s2", "s3")
TWIN = survey.abel(gyrostat_f, gyrostat_g, parameters=NAMES, period=2 * math.pi)


def harmonics(phi, p):
    """p[0] + p[1] cos + p[2] sin + p[3] cos 2phi + p[4] sin 2phi + ..."""
    total = p[0]
    for k in range(1, (len(p) + 1) // 2):
        total = total + p[2 * k - 1] * math.cos(k * phi) + p[2 * k] * math.sin(k * phi)
    return total


def turn(f, g, w):
    """By how much |w| grows over one turn in the direction of w, by SciPy."""
    side = math.copysign(1.0, w)
    run = solve_ivp(
        lambda x, y: [f(x) + g(x) / y[0]],
        (0, side * 2 * math.pi),
        [w],
        "DOP853",
        rtol=3e-14,
        atol=1e-14,
    )
    return side * (run.y[0, -1] - w)


def first(phi, p):
    return harmonics(phi, p[:5])


def second(phi, p):
    return harmonics(phi, p[5:])


@pytest.mark.parametrize("order", range(4))
def test_ends_grow_as_the_expansion_says(order):
    for _ in range(4):
        p, q = RNG.normal(size=5), RNG.normal(size=5)
        p[0] *= order == 0
        q[0] *= order < 2
        if order == 3:  # K = 0: g is orthogonal to F
            F = np.array([-p[2], p[1], -p[4] / 2, p[3] / 2])  # of cos, sin, cos 2phi, sin 2phi
            q[1:] -= F * (q[1:] @ F) / (F @ F)
        found = ends.of(equation.program(first, second, (*p.tolist(), *q.tolist()), True))
        leading = [found.mean_f, found.mean_g, found.K, found.L]
        assert all(value == 0.0 for value in leading[:order]) and leading[order] != 0.0
        size = (300.0, 3000.0, 100.0, 100.0)[order]
        for i, w in enumerate((size, -size)):
            growth = turn(lambda x, p=p: harmonics(x, p), lambda x, q=q: harmonics(x, q), w)
            expansion = (
                2 * leading[0],
                2 * leading[1] / w,
                leading[2] / w**2,
                leading[3] / w**3 / math.pi,
            )
            assert growth == pytest.approx(math.pi * expansion[order], rel=0.3)
            assert np.sign(growth) == found.attract[i]


def test_the_gyrostat_as_an_equation_of_ones_own_is_the_gyrostat():
    """Ends, equilibria, cycles and fates are the same from six parameters, and from two functions."""
    for _ in range(6):
        six = dict(zip(NAMES, RNG.normal(size=6).round(3).tolist(), strict=True))
        own, known = (
            survey.evaluate(scene, question="portrait", **six) for scene in (TWIN, "gyrostat")
        )
        for name in ("K", "L", "mean_f"):
            wanted = 0.0 if name == "mean_f" else known[name]
            assert abs(own[name] - wanted) <= own[f"{name}_error"] + 1e-15
        for name in ("end_plus", "end_minus", "equilibria", "saddles", "rotations_plus", "rotations_minus",
                     "librations", "cycle_kind"):  # fmt: skip
            assert (own[name] == known[name]).all(), (six, name)
        for name in ("equilibrium_phi", "cycle_w", "cycle_multiplier", "cycle_period"):
            size = min(own[name].size, known[name].size)
            one, two = own[name].values[:size], known[name].values[:size]
            bars = own[f"{name}_error"].values[:size] + known[f"{name}_error"].values[:size]
            assert (np.isnan(one) == np.isnan(two)).all() and not (abs(one - two) > bars).any(), (
                six,
                name,
            )
        starts = {"phi0": RNG.uniform(-3, 3, 8), "w0": RNG.uniform(-3, 3, 5)}
        one, two = (
            survey.evaluate(scene, question="fate", **six, **starts) for scene in (TWIN, "gyrostat")
        )
        both = (one.verdict >= 0) & (two.verdict >= 0)
        assert (one.verdict == two.verdict).where(both, True).all() and both.mean() > 0.95
        assert (one.turnings == two.turnings).where(both, True).all()


def test_a_mean_that_is_0_for_all_parameters_does_not_make_portraits_degenerate():
    six = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
    own, known = (
        survey.evaluate(scene, question="portrait", **six) for scene in (TWIN, "gyrostat")
    )
    assert int(own.verdict) == int(known.verdict) == 1
    why = own.survey.point().why
    assert "K = 0.06" in why and "mean_f" not in why
    biased = survey.abel(
        lambda phi, p: p[0] + math.cos(phi),
        lambda phi, p: p[1] - math.sin(2 * phi) + 0.3 * math.cos(phi),
        parameters=("a", "b"),
        period=2 * math.pi,
    )  # its mean changes with a, through 0
    ds = survey.evaluate(biased, a=[-0.1, 0.0, 0.1], b=0.2, question="portrait")
    assert ds.verdict.values.tolist() == [1, 0, 1]
    assert "mean_f = 0" in ds.isel(a=1).survey.point().why
    pushed = survey.abel(
        lambda phi, p: p[0] * math.cos(phi),
        lambda phi, p: p[1] - math.sin(phi),
        parameters=("a", "b"),
        period=2 * math.pi,
    )  # g decides, but where b = 0
    ds = survey.evaluate(pushed, a=0.3, b=[-0.4, 0.0, 0.4], question="portrait")
    assert ds.verdict.values[[0, 2]].tolist() == [1, 1] and int(ds.verdict[1]) != 1


def homoclinic(a):
    """I at which the saddle's branch w > 0 returns to it, by shooting from both sides to phi = pi."""

    def gap(current):
        saddle = math.pi - math.asin(current)
        root = math.sqrt(a * a - 4 * math.cos(saddle))
        speeds = []
        for rate, start, side in (
            (0.5 * (root - a), saddle - 2 * math.pi, 1),
            (0.5 * (-root - a), saddle, -1),
        ):
            x = start + side * 1e-5

            def middle(_t, y):
                return y[0] - 0.5 * (saddle + saddle - 2 * math.pi)

            middle.terminal = True
            second = 0.5 * math.sin(start) / (3 * rate + a)  # w = rate x + second x^2
            run = solve_ivp(
                lambda t, y: [y[1], -a * y[1] + current - math.sin(y[0])],
                (0, side * 100), [x, rate * (x - start) + second * (x - start) ** 2], "DOP853",
                events=middle, rtol=1e-12, atol=1e-13,
            )  # fmt: skip
            speeds.append(run.y_events[0][0][1])
        return speeds[0] - speeds[1]

    return brentq(gap, 0.5 * a, min(1.4 * a, 0.999), xtol=1e-11)


def test_the_homoclinic_curve_of_the_junction():
    """Bisection on the number of rotation cycles meets the curve of SciPy, and I = 4 a / pi + O(a^3)."""
    for a in (0.05, 0.2, 0.5):
        low, high, exact = 0.9 * a, 1.4 * a, homoclinic(a)
        for _ in range(18):
            middle = 0.5 * (low + high)
            cycles = int(
                survey.evaluate(JUNCTION, question="portrait", a=a, I=middle).rotations_plus
            )
            low, high = (low, middle) if cycles else (middle, high)
        assert low - 1e-6 < exact < high + 1e-6
        assert abs(exact - 4 * a / math.pi) < 0.5 * a**3


def test_portraits_of_the_junction():
    ds = survey.evaluate(JUNCTION, question="portrait", a=[0.3, 1.5], I=[0.2, 0.6, 1.3])
    assert (
        ds.rotations_plus.values.tolist() == [[0, 1, 1], [0, 0, 1]]
        and (ds.rotations_minus == 0).all()
    )
    assert ds.equilibria.values.tolist() == [[2, 2, 0]] * 2 and (ds.verdict == 1).all()
    assert (ds.end_plus == 0).all() and (ds.end_minus == 0).all() and (ds.librations == 0).all()
    assert (
        abs(ds.equilibrium_phi.values[0, 1, :2] - [math.asin(0.6), math.pi - math.asin(0.6)]).max()
        < 1e-14
    )
    one = ds.isel(a=0, I=1, cycle=0)
    period, w, multiplier = (float(one[f"cycle_{name}"]) for name in ("period", "w", "multiplier"))
    assert multiplier == pytest.approx(
        math.exp(-0.3 * period), abs=float(one.cycle_multiplier_error) + 1e-15
    )
    saddle = math.pi - math.asin(0.6)
    run = solve_ivp(lambda t, y: [y[1], -0.3 * y[1] + 0.6 - math.sin(y[0])], (0, period), [saddle, w], "DOP853",
                    rtol=1e-12, atol=1e-12)  # fmt: skip
    assert abs(run.y[0, -1] - saddle - 2 * math.pi) < 1e-9 and abs(run.y[1, -1] - w) < 1e-9
    fold = survey.evaluate(JUNCTION, question="portrait", a=0.3, I=1.0)
    assert int(fold.status) == 21 and int(fold.verdict) == 0
    lossless = survey.evaluate(JUNCTION, question="portrait", a=0.0, I=0.3)
    assert int(lossless.status) == 22 and int(lossless.equilibria) == 2
    assert (
        int(survey.evaluate(JUNCTION, question="fate", a=0.0, I=0.3, phi0=1.0, w0=1.0).status) == 22
    )


@pytest.mark.slow
def test_fates_of_the_junction_agree_with_long_integration():
    for a, current in ((0.3, 0.6), (0.9, 0.7), (0.4, 1.2)):
        phi0, w0 = RNG.uniform(-3, 3, 5), RNG.uniform(-3, 4, 5)
        ds = survey.evaluate(JUNCTION, question="fate", a=a, I=current, phi0=phi0, w0=w0)
        assert (ds.verdict >= 0).mean() > 0.95
        for i, phi in enumerate(phi0):
            for j, w in enumerate(w0):
                run = solve_ivp(lambda t, y: [y[1], -a * y[1] + current - math.sin(y[0])], (0, 150), [phi, w],  # noqa: B023
                                "DOP853", rtol=1e-10, atol=1e-10)  # fmt: skip
                rests = abs(run.y[1, -1]) < 1e-2
                assert int(ds.verdict[i, j]) in (-1, 0 if rests else 2)
                if rests and int(ds.verdict[i, j]) == 0:
                    assert math.cos(run.y[0, -1] - float(ds.limit_phi[i, j])) > 0.999


def test_no_equilibrium_is_missed():
    """Roots of random trigonometric polynomials of degree 5, as eigenvalues of a companion matrix."""
    five = survey.abel(
        lambda phi, p: -0.5 + math.cos(phi),
        harmonics,
        parameters=[f"q{k}" for k in range(11)],
        period=2 * math.pi,
    )
    for _ in range(8):
        q = RNG.normal(size=11)
        half = np.array([(q[2 * k - 1] - 1j * q[2 * k]) / 2 for k in range(1, 6)])
        roots = np.roots(np.concatenate([half[::-1], [q[0]], half.conj()]))
        angles = np.sort(np.angle(roots[abs(abs(roots) - 1) < 1e-9]) % (2 * math.pi))
        ds = survey.evaluate(five, question="portrait", **{f"q{k}": q[k] for k in range(11)})
        assert int(ds.equilibria) == len(angles)
        assert np.allclose(ds.equilibrium_phi.values[: len(angles)], angles, rtol=0, atol=1e-9)
