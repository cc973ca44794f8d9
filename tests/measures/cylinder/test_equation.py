"""A user's f and g as programs: their series and balls against mpmath, and solutions against series
in 30 digits.
"""

import math

import mpmath as mp
import numpy as np
import pytest

from survey.kernels.cylinder import bounds
from survey.kernels.cylinder import program as pg
from survey.kernels.cylinder.balls import ball
from survey.kernels.cylinder.steps import OK, TURNING
from survey.measures.cylinder import equation, solution
from survey.measures.hill.multiprecision import Unsupported
from survey.methods import dop853, taylor

RNG = np.random.default_rng(20)


def ball_of_g(row, phi):
    """What is computed for g at phi, and the bound of its rounding error."""
    out = np.zeros((int(row[pg.SLOTS]), 1, 2))
    ball(row, phi, 0.0, 1, out)
    return out[int(row[pg.G_AT]), 0]


def everything(x, p):
    """All operations and functions, within their domains for |x| < 2."""
    y = (
        math.sin(x) * p[0]
        - np.cos(2 * x) / (3 + x * x)
        + 2 ** (x / 3)
        + (2 + x**2) ** 1.3
        - 1 / (x + 4) ** 3
    )
    y += (
        math.atan(x) * math.asin(x / 3)
        + math.acos(x / 4)
        - math.tanh(x) * math.sinh(x)
        + math.cosh(x / 2)
    )
    y += (
        math.asinh(x)
        + math.acosh(3 + x * x)
        + math.atanh(x / 5)
        + math.log(3 + x) * math.exp(-x)
        + math.erf(x)
    )
    return (
        y
        + math.tan(x / 3) * math.sqrt(5 - x)
        + math.hypot(x, 2.0)
        + np.expm1(x)
        - np.log1p(x / 9)
        + (-x) ** 2
        + p[1]
    )


def plain(x, p):
    return -p[0] + 0.0 * x


def truth(x, p, order):
    """Taylor coefficients of `everything`, by mpmath."""
    p = [mp.mpf(value) for value in p]

    def f(x):
        y = (
            mp.sin(x) * p[0]
            - mp.cos(2 * x) / (3 + x * x)
            + 2 ** (x / 3)
            + (2 + x**2) ** mp.mpf(1.3)
            - 1 / (x + 4) ** 3
        )
        y += mp.atan(x) * mp.asin(x / 3) + mp.acos(x / 4) - mp.tanh(x) * mp.sinh(x) + mp.cosh(x / 2)
        y += (
            mp.asinh(x)
            + mp.acosh(3 + x * x)
            + mp.atanh(x / 5)
            + mp.log(3 + x) * mp.exp(-x)
            + mp.erf(x)
        )
        return (
            y
            + mp.tan(x / 3) * mp.sqrt(5 - x)
            + mp.hypot(x, 2)
            + mp.exp(x)
            - 1
            - mp.log(1 + x / 9)
            + x**2
            + p[1]
        )

    return mp.taylor(f, mp.mpf(x), order)


@pytest.mark.parametrize("x", [0.0, 0.3, -1.7, 1.9])
def test_series_and_balls_hold_mpmaths(x):
    p = (0.7, -1.3)
    row = equation.program(everything, everything, p, False)
    with mp.workdps(60):
        wanted = truth(x, p, 8)
        f, g = np.zeros(9), np.zeros(9)
        pg.in_angle(row, x, f, g)
        assert np.allclose(f, [float(c) for c in wanted], rtol=1e-12, atol=1e-12) and (f == g).all()
        assert pg.values(row, x)[2] == pytest.approx(float(wanted[1]), rel=1e-12)
        middle, radius = ball_of_g(row, x)
        assert abs(middle - wanted[0]) <= radius < 1e-13
        row[pg.RADIUS] = 0.1
        bounds.bound_near(row, x, 1.0)
        out, radius = row[pg.BOUND_F :], row[pg.RADIUS]
        assert 1e-3 < radius
        for y in np.linspace(x - radius, x + radius, 5):
            near = truth(y, p, 2)
            assert max(abs(near[0]), abs(near[1])) <= out[0] and abs(near[0]) <= out[1]
            assert abs(near[1]) <= out[2] and 2 * abs(near[2]) <= out[3] < 100


@pytest.mark.parametrize(
    ("g", "x", "radius"),
    [
        (lambda x, p: np.arcsin(x), 0.8, 0.3),
        (lambda x, p: np.arccosh(x), 1.2, 0.3),
        (lambda x, p: np.exp(x), 700.0, 20.0),
    ],
    ids=["arcsin", "arccosh", "exp"],
)
def test_balls_beyond_the_domain_of_a_function_have_no_bound(g, x, radius):
    row = equation.program(plain, g, (1.0,), False)
    out = np.zeros((int(row[pg.SLOTS]), 1, 2))
    ball(row, x, radius, 1, out)
    assert out[int(row[pg.G_AT]), 0, 1] == np.inf


def of_the_circle(phi, p):
    """Every kind of operation, most without parameters, with the period 2 pi."""
    s, c = np.sin(phi), np.cos(phi)
    y = 2.0 / (3.0 + p[0] * c) - s * c / (2.0 - s) + (1.5 - c) * np.tanh(3 * s) - 0.7
    return y + p[1] * np.exp(p[0] * s) + np.sqrt(2.0 + c) * (c - s)


def test_samples_are_the_values_at_each_angle_for_all_parameters_at_once():
    points = [(0.3, 1.1), (0.3, 2.3), (np.nan, 1.1), (0.9, 2.3), (0.8, 2.3), (-0.4, -1.2)]
    rows = equation.flows(of_the_circle, lambda phi, p: np.sin(phi) * p[1], np.array(points), True)
    rows[4, [pg.REVERSED, pg.MIRRORED]] = -1.0, -1.0  # as the symmetries of solutions turn it
    found = np.full((len(rows), 2, 48), 99.0)
    pg.sampled(rows, found)
    for row, own in zip(rows, found, strict=True):
        if np.isnan(row[0]):
            assert (own == 99.0).all()
            continue
        values = [pg.values(row, j * (2 * math.pi / 48))[:2] for j in range(48)]
        assert np.array_equal(own.T, values)
    pg.sampled(rows[:0], found[:0])


@pytest.mark.parametrize("width", [0.3, 0.03, 0.01])
def test_bounds_over_the_circle_hold_spikes_and_poles_beside_it_tightly(width):
    def f(phi, p):
        return -np.exp(-((np.sin(phi - 0.7) / p[0]) ** 2))

    def g(phi, p):
        return 1.0 / (1.0 + p[0] ** 2 + np.cos(phi + 0.4)) + np.sin(phi)

    row = equation.program(f, g, (width,), True)
    # both at and around where they are largest, and all round
    phi = np.concatenate([np.linspace(-4, 4, 4001) * width + 0.7, np.linspace(-4, 4, 4001) * width + np.pi - 0.4,
                          np.linspace(0, 2 * np.pi, 1001)])  # fmt: skip
    values = np.array([pg.values(row, x) for x in phi])
    slopes = abs(np.diff(values, axis=0) / np.diff(phi)[:, None])[np.diff(phi) > 0]
    most = np.array([max(abs(values[:, 0]).max(), slopes[:, 0].max()), abs(values[:, 1]).max(),
                     abs(values[:, 2]).max(), slopes[:, 2].max()])  # fmt: skip
    bounds = row[pg.BOUND_F : pg.BOUND_F + 4]
    assert (bounds >= most * (1 - 1e-12)).all()
    # those of f and g are what their roundings are, in roundoffs, where that is more
    assert (bounds[2:] < 1.5 * most[2:]).all()


@pytest.mark.parametrize("width", [1e-2, 1e-4])
def test_one_limit_of_steps_all_round_the_circle_shows_spikes_and_spares_what_is_smooth(width):
    def spiky(phi, p):
        return p[0] * np.exp(-((np.sin(phi - 0.7) / width) ** 2)) - np.sin(phi)

    def smooth(phi, p):
        return p[0] / (1.5 + np.cos(phi)) + np.sin(phi) ** 7

    def simple(phi, p):
        return p[0] * np.sin(phi) * np.cos(2 * phi) - 0.3

    limits = []
    for g in (spiky, smooth, simple):
        rows = equation.flows(lambda phi, p: -0.1, g, np.array([[1e-6], [1.2]]), True)
        sampled = rows.copy()
        equation.limit(rows)
        limits.append(rows[:, pg.RADIUS])
        if g is smooth:  # what samples say holds
            equation._limit(sampled)
            assert (rows[:, pg.RADIUS] == sampled[:, pg.RADIUS]).all()
        else:
            changed = (rows != sampled).any(axis=0)
            assert changed.sum() == (g is spiky) and changed[pg.RADIUS] == (g is spiky)
    assert (width / 20 < limits[0]).all() and (limits[0] < 4 * width).all()
    assert (limits[1] > 0.1).all() and (limits[2] == pg.UNLIMITED).all()


def test_steps_that_see_a_few_angles_alone_are_limited_by_weaker_spikes():
    def f(phi, p):
        return np.cos(phi) + p[0] * np.exp(-((np.sin(phi - 0.7) / 0.05) ** 2))

    rows = equation.flows(f, plain, np.array([[1e-8], [1e-2]]), True)
    few = rows.copy()
    equation.limit(rows)
    equation.limit(few, equation.FEW_PIECES)
    (weak, strong), (as_before, alike) = few[:, pg.RADIUS], rows[:, pg.RADIUS]
    assert weak < 0.12 and weak < 0.25 * as_before and strong == alike < 0.05


def test_balls_of_squares_hold_them_and_are_not_negative():
    row = equation.program(plain, lambda x, p: x * x, (1.0,), False)
    out = np.zeros((int(row[pg.SLOTS]), 1, 2))
    for x, radius in ((0.3, 1.0), (-2.0, 0.5), (0.0, 3.0)):
        ball(row, x, radius, 1, out)
        middle, wide = out[int(row[pg.G_AT]), 0]
        low = max(abs(x) - radius, 0.0) ** 2
        assert 0.0 <= low - (middle - wide) < 1e-14
        assert 0.0 <= (middle + wide) - (abs(x) + radius) ** 2 < 1e-14


@pytest.mark.parametrize("x", [-30.0, -0.2, 19.5, 24.0])
def test_series_of_tanh_hold_where_it_rounds_to_one(x):
    row = equation.program(
        lambda x, p: 1 - np.tanh(x) ** 2, lambda x, p: np.tanh(x) * p[0], (1.0,), False
    )
    f, g = np.zeros(12), np.zeros(12)
    pg.in_angle(row, x, f, g)
    with mp.workdps(60):
        for own, h in ((f, lambda x: mp.sech(x) ** 2), (g, mp.tanh)):
            wanted = [float(c) for c in mp.taylor(h, mp.mpf(x), 11)]
            assert np.allclose(own, wanted, rtol=1e-13, atol=0.0)
        assert pg.values(row, x)[2] == pytest.approx(float(mp.sech(x) ** 2), rel=1e-15)


@pytest.mark.parametrize("x", [-3.0, -0.1, 0.0, 0.4, 20.0])
@pytest.mark.parametrize("radius", [0.0, 1e-9, 0.3, 5.0])
def test_balls_of_the_slope_of_tanh_hold_its_ends_and_its_peak(x, radius):
    row = equation.program(lambda x, p: 1 - np.tanh(x) ** 2, plain, (1.0,), False)
    out = np.zeros((int(row[pg.SLOTS]), 3, 2))
    ball(row, x, radius, 3, out)
    at = int(row[pg.F_AT])
    with mp.workdps(60):
        for y in {
            x,
            mp.mpf(x) - radius,
            mp.mpf(x) + radius,
            *([mp.mpf(0)] if abs(x) <= radius else []),
        }:
            for n, wanted in enumerate(mp.taylor(lambda z: mp.sech(z) ** 2, y, 2)):
                assert abs(out[at, n, 0] - wanted) <= out[at, n, 1]
        if radius == 0.0:
            assert out[at, 0, 1] <= 2e-15 * mp.sech(x) ** 2


@pytest.mark.parametrize(("h", "exact"), [(lambda x, p: 1 - np.tanh(x) ** 2, lambda x: mp.sech(x) ** 2),
                                          (lambda x, p: np.exp(x), mp.exp)], ids=["sech2", "exp"])  # fmt: skip
def test_balls_hold_steep_ends(h, exact):
    """There the function is larger than in the middle by orders of magnitude, and so is its rounding."""
    row = equation.program(plain, h, (1.0,), False)
    out, random = np.zeros((int(row[pg.SLOTS]), 1, 2)), np.random.default_rng(4)
    x = random.uniform(0.5, 30.0, 1500)
    given = [*zip(x, x * 10 ** random.uniform(-3.0, 0.0, 1500), strict=True),
             (19.791417978502313, 2.5243551185492645), (289.9955379567339, 1.42e-13), (372.0, 0.0)]  # fmt: skip
    with mp.workdps(40):
        for x, radius in given:
            ball(row, x, radius, 1, out)
            middle, wide = out[int(row[pg.G_AT]), 0]
            for end in (mp.mpf(x) - radius, mp.mpf(x) + radius):
                assert abs(middle - exact(end)) <= wide


def test_what_underflows_is_not_at_rest():
    row = equation.program(
        lambda x, p: 1.0 + 0.0 * x, lambda x, p: 1 - np.tanh(400.0 * (x - 1)) ** 2, (1.0,), False
    )
    assert row[pg.AT_REST] == 0.0 and pg.values(row, 0.0)[1] == 0.0
    resting = equation.program(plain, lambda x, p: np.tanh(x), (1.0,), False)
    assert resting[pg.AT_REST] == 1.0


def test_what_cancels_is_counted_as_rounding():
    row = equation.program(plain, lambda x, p: (x + 1e8) - 1e8, (1.0,), False)
    middle, radius = ball_of_g(row, 0.1)
    assert 1e-9 < abs(middle - 0.1) <= radius < 1e-7
    bounds.bound_near(row, 0.1, 1.0)
    assert row[pg.BOUND_G] > 1e7  # the size of the terms


def test_what_depends_on_the_parameters_alone_may_branch():
    def g(x, p):
        total = 0.0
        for k in range(int(p[1])):
            total = total + math.sin((k + 1) * x) / (k + 1)
        return total if p[0] > 0 else -math.sin(x)

    one, two = (equation.program(plain, g, point, True) for point in ((1.0, 3.0), (-1.0, 3.0)))
    assert pg.values(one, 0.4)[1] == pytest.approx(
        sum(math.sin(k * 0.4) / k for k in (1, 2, 3)), rel=1e-15
    )
    assert pg.values(two, 0.4)[1] == -math.sin(0.4)
    assert one[pg.AT_REST] == 1.0  # g(0) = 0 exactly


@pytest.mark.parametrize(
    ("g", "words"),
    [
        (lambda x, p: abs(x), "abs"),
        (lambda x, p: x if x > 0 else -x, "compares"),
        (lambda x, p: x == 0, "compares"),
        (lambda x, p: math.floor(x), "floor"),
        (lambda x, p: np.interp(x, [0, 1], [0, 1]), "interp"),
        (lambda x, p: [x], "returns list"),
        (lambda x, p: max(x, 0.0), "compares"),
        (lambda x, p: x % 2.0, "%"),
    ],
)
def test_what_is_not_analytic_is_refused(g, words):
    with pytest.raises(Unsupported, match=rf"g\(phi, p\): .*{words}"):
        equation.program(plain, g, (1.0,), False)


def test_periods_are_checked():
    for g in (
        lambda x, p: math.sin(x) + 1e-12 * x,
        lambda x, p: math.sin(0.5 * x),
        lambda x, p: 1 / math.sin(x),
    ):
        assert np.isnan(equation.program(plain, g, (1.0,), True)).all()
    assert np.isnan(equation.program(plain, lambda x, p: math.log(p[0]) + x, (-1.0,), False)).all()
    assert np.isnan(equation.program(plain, lambda x, p: x / (p[0] - 1), (1.0,), False)).all()
    peak = equation.program(plain, lambda x, p: 1 / (1.001 + math.cos(x)), (1.0,), True)
    # roundoffs of 1.001 + cos, 10^6 times as large beside the peak
    assert 1e6 < peak[pg.BOUND_G] < 5e6


def lienard(x, p):
    """f = p0 + p1 x^2 + p2 cos x."""
    return p[0] + p[1] * x * x + p[2] * math.cos(x)


def force(x, p):
    """g = p3 + p4 x + p5 x^3 + p6 sin x."""
    return p[3] + p[4] * x + p[5] * x**3 + p[6] * math.sin(x)


def exactly(p, phi, w, t, digits=24):
    """phi and w of the Lienard equation at t, in many digits."""
    with mp.workdps(digits + 8):
        p, phi, w, left = [mp.mpf(value) for value in p], mp.mpf(phi), mp.mpf(w), mp.mpf(t)
        while left:
            x, v, s, c, square = [phi], [w], [mp.sin(phi)], [mp.cos(phi)], [phi * phi]
            for n in range(digits):
                f = [p[1] * q + p[2] * y for q, y in zip(square, c, strict=True)]
                f[0] += p[0]
                cube = mp.fdot(square, x[::-1])
                g = p[4] * x[n] + p[5] * cube + p[6] * s[n] + (p[3] if n == 0 else 0)
                sine, cosine = mp.fdot(c, v[::-1]) / (n + 1), -mp.fdot(s, v[::-1]) / (n + 1)
                x.append(v[n] / (n + 1))
                v.append((mp.fdot(f, v[::-1]) + g) / (n + 1))
                s.append(sine)
                c.append(cosine)
                square.append(mp.fdot(x, x[::-1]))
            largest = max(
                abs(row[k]) ** (mp.mpf(1) / k) for row in (x, v) for k in (digits - 1, digits)
            )
            step = mp.sign(left) * min(abs(left), 1 / (12 * largest))
            phi, w = (mp.fdot(row, [step**n for n in range(digits + 1)]) for row in (x, v))
            left -= step
        return phi, w


def hard_point(i):
    """Parameters, start and time: van der Pol, Lienard, Duffing, the pendulum with torque; stiff
    ones among them.
    """
    p = [*RNG.normal(size=3), *RNG.normal(size=4)]
    if i % 4 == 0:
        mu = 10.0 ** RNG.uniform(-1, 1.3)
        p = [mu, -mu, 0.0, 0.0, -1.0, 0.0, 0.0]
    elif i % 4 == 1:
        p[1], p[5] = -abs(p[1]), -abs(p[5])
    elif i % 4 == 2:
        p[:3], p[5] = [0.3 * p[0], 0.0, 0.0], -1.0
    else:
        p[1] = p[2] = p[4] = p[5] = 0.0
    return p, RNG.normal() * 2, RNG.normal() * 2 * (i % 5 > 0), RNG.uniform(0.2, 8.0)


@pytest.mark.parametrize("points", [8, pytest.param(24, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "method", [taylor, pytest.param(dop853, marks=pytest.mark.slow)], ids=["taylor", "dop853"]
)
def test_trajectories_lie_within_their_bars(method, points):
    wide = answered = 0
    for i in range(points):
        p, phi, w, t = hard_point(i)
        rows = solution.rows(equation.program(lienard, force, tuple(p), False)[None], [phi], [w])
        floats, _turnings, status = solution.trajectories(
            method, rows, np.array([[0.5 * t, t, -0.1 * t]]), 1e-10
        )
        for row, code, at in zip(floats[0], status[0], (0.5 * t, t, -0.1 * t), strict=True):
            if code != OK:
                continue
            answered += 1
            wanted = exactly(p, phi, w, at)
            errors = [abs(float(row[k] - wanted[k])) for k in (0, 1)]
            assert errors[0] <= row[2] and errors[1] <= row[3], (p, phi, w, at)
            wide += row[2] > 1e-9 * (1 + abs(row[0]))
    assert answered >= 2.2 * points and wide <= 0.15 * answered


@pytest.mark.parametrize("points", [16, pytest.param(40, marks=pytest.mark.slow)])
def test_angles_agree_with_times_also_near_turning_points(points):
    checked = 0
    for i in range(points):
        p, phi, w, t = hard_point(i)
        phi2, w2 = map(float, exactly(p, phi, w, 0.3 * t))
        rows = solution.rows(equation.program(lienard, force, tuple(p), False)[None], [phi], [w])
        floats, status = solution.abel(taylor, rows, np.array([[phi2]]), 1e-10)
        value, time, value_bar, time_bar = floats[0, 0]
        if status[0, 0] == OK and abs(time - 0.3 * t) < 1e-3:  # not at a passage before
            back = exactly(p, phi, w, time)
            slope = abs(lienard(phi2, p) + force(phi2, p) / w2) if w2 else np.inf
            doubt = 1e-15 * (1 + abs(phi2)) * slope
            assert abs(value - w2) <= value_bar + doubt and abs(
                time - 0.3 * t
            ) <= time_bar + 2e-16 * abs(phi2 / w2)
            assert abs(float(back[0]) - phi2) <= time_bar * (abs(w2) + value_bar) * 1.1 + 1e-15 * (
                1 + abs(phi2)
            )
            checked += 1
        elif status[0, 0] == TURNING:
            turned = exactly(p, phi, w, time)
            assert abs(turned[0] - value) <= value_bar + 1e-15 and abs(turned[1]) < 1e-7
            checked += 1
    assert checked >= 0.4 * points
