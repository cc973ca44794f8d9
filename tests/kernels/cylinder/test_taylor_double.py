"""Flows in double-double: what float64 leaves open, within bars that mpmath confirms."""

import numpy as np
import pytest
from flow_truth import exact
from mpmath import mp, mpf

from survey.kernels.cylinder import flow_double, taylor_double
from survey.kernels.cylinder.steps import NO_CONVERGENCE, OK, SEPARATRIX, STEP_LIMIT, TURNING
from survey.measures.cylinder import auto, solution
from survey.methods import dop853, rk4, taylor

SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)
NEAR = [3.5, 1.85414457907569906]  # next to the stable branch of a saddle at 4.65095
DRAWN = np.random.default_rng(3).normal(size=(4, 8)) * [1, 1, 2, 2, 2, 2, 40, 2]


def within(found, wanted):
    return all(abs(mpf(float(found[i])) - wanted[i]) <= found[2 + i] for i in (0, 1))


def test_sine_and_cosine_have_thirty_digits():
    random = np.random.default_rng(1)
    with mp.workdps(50):
        for x in random.uniform(-3.9, 3.9, 100):
            angle = mpf(x) + mpf(1e-17 * x)
            sine, cosine = flow_double.sine_cosine((x, 1e-17 * x))
            assert abs(mpf(sine[0]) + mpf(sine[1]) - mp.sin(angle)) < 1e-31
            assert abs(mpf(cosine[0]) + mpf(cosine[1]) - mp.cos(angle)) < 1e-31


@pytest.mark.parametrize(
    "row",
    [
        *(
            pytest.param(row, marks=[pytest.mark.slow] * (i in (1, 2)))
            for i, row in enumerate(DRAWN)
        ),
        (*SIX, *NEAR),
        (0, 0, 0, 0, 0, 1.0, np.pi, 0.0),
    ],
)
def test_trajectories_lie_within_narrow_bars(row):
    """Also where float64's bar has grown by 1e13: the doubles phi and w are then as good as they can be."""
    row, times = np.array([row]), np.array([[0.5, 18.0]])
    floats, _turnings, status = solution.trajectories(taylor_double, row, times, 0.0)
    assert (status == OK).all() and (
        floats[0, :, 2:] < 3e-16 * (1 + np.abs(floats[0, :, :2]))
    ).all()
    for t, found in zip(times[0], floats[0], strict=True):
        assert within(found, exact(row[0, :6], *row[0, 6:], t, 45, float_out=False))


def test_auto_asks_it_where_float64_misses():
    row, times = np.array([[*SIX, *NEAR]]), np.array([[0.5, 14.0, 25.0]])
    plain = solution.trajectories(taylor, row, times, 1e-10)
    assert solution.missed(plain, 1e-10)[0].tolist() == [False, True, True]
    floats, _turnings, status = found = auto.trajectories(taylor, row, times, 1e-10)
    assert not solution.missed(found, 1e-10).any()
    assert np.array_equal(floats[0, 0], plain[0][0, 0])  # what was right keeps its bits
    assert within(floats[0, 2], exact(SIX, *NEAR, 25.0, 45, float_out=False))
    floats, status = solution.abel(taylor, row, np.array([[6.0]]), 1e-10)
    assert status[0, 0] in (SEPARATRIX, NO_CONVERGENCE)
    floats, status = auto.abel(taylor, row, np.array([[6.0]]), 1e-10)
    assert status[0, 0] in (OK, TURNING)
    t = floats[0, 0, 1]
    phi, w = exact(SIX, *NEAR, t, 45)
    if status[0, 0] == OK:
        assert abs(phi - 6.0) <= w * floats[0, 0, 3] + 1e-15 and abs(w - floats[0, 0, 0]) < 1e-12
    else:
        assert (
            abs(w) <= 3 * floats[0, 0, 3] and abs(phi - floats[0, 0, 0]) <= floats[0, 0, 2] + 1e-15
        )


def test_too_many_steps_are_given_up_at_once():
    floats, turnings, status = solution.trajectories(
        taylor_double, np.array([[*SIX, *NEAR]]), np.array([[1e9]]), 0.0
    )
    assert status[0, 0] == STEP_LIMIT and np.isnan(floats).all() and turnings[0, 0] == -2


@pytest.mark.parametrize("method", [taylor, dop853])
@pytest.mark.parametrize("fast", [0.0, 4.0])
def test_one_short_step_keeps_within_its_rounding(method, fast):
    """A bar of one step is little more than an ulp: sums of stages must not be rounded at the size
    of phi and w.
    """
    random = np.random.default_rng(4)
    rows = random.normal(size=(1500, 8)) * [1, 1, 1, 1, 1, 1, 2, 10.0**fast]
    rows[::2, :2] = 0.0
    times = random.uniform(0.0, 0.02, (1500, 1)) / 10.0**fast
    truth, _turnings, _status = solution.trajectories(taylor_double, rows, times, 0.0)
    found, _turnings, status = solution.trajectories(method, rows, times, 1e-11)
    assert (status == OK).all()
    error, bars = np.abs(found - truth)[..., :2], found[..., 2:] + 1.2e-16 * np.abs(truth[..., :2])
    assert (error <= bars).all()


@pytest.mark.parametrize("method", [dop853, taylor, rk4])
def test_beside_saddles_a_short_step_counts_the_rounding_of_every_stage(method):
    """There w and its change are so small that nothing hides what the stages round: phi, and terms
    that cancel.
    """
    random = np.random.default_rng(1)
    rows = random.normal(size=(3000, 8))
    rows[::3, :4] = random.integers(-2, 3, (1000, 4))
    rows[1::3, :2] *= 10.0 ** random.uniform(0.0, 1.6, (1000, 1))
    saddle = random.uniform(-np.pi, np.pi, 3000)
    s, c, double = np.sin(saddle), np.cos(saddle), np.cos(2 * saddle)
    across = rows[:, 2] * c * s + rows[:, 3] * double  # g(saddle) = 0
    # g'(saddle) >= 0
    along = -rows[:, 2] * double + 4 * rows[:, 3] * s * c - 2 * np.abs(rows[:, 4])
    rows[:, 4], rows[:, 5] = across * c + along * s, along * c - across * s
    rows[:, 6] = saddle + random.choice([-1, 1], 3000) * 10.0 ** random.uniform(-6, -1, 3000)
    rows[:, 7] = random.choice([-1, 1], 3000) * 10.0 ** random.uniform(-6, -1, 3000)
    size = 1 + np.abs(rows[:, :6]).max(axis=1, keepdims=True)
    times = random.choice([-1, 1], (3000, 1)) * 10.0 ** random.uniform(-4, -1.3, (3000, 1)) / size
    truth, _turnings, fine = solution.trajectories(taylor_double, rows, times, 0.0)
    found, _turnings, status = solution.trajectories(method, rows, times, 1e-11)
    assert (status == OK).all() and (fine == OK).all()
    error, bars = np.abs(found - truth)[..., :2], found[..., 2:] + 1.2e-16 * np.abs(truth[..., :2])
    assert (error <= bars).all()


@pytest.mark.parametrize(
    "six, phi, w, t",
    [
        ((-2.0, -2.0, -2.0, -1.0, -2.0, 0.0), 2.2290410185099954, -0.0011125970712905814, 0.0072402503017094675),
        ((-1.389808512226827, 2.5547491227577033, -0.7916020016796301, 0.47434415625972387, -0.9560388961783558,
          1.3535366736515712), 2.9041607647499617, -0.004547703132447713, 0.004917358940409421),
        ((-26.968987047629245, -31.405995826332965, 0.15154881327396186, -0.3469366525293508, -0.8647679873868779,
          0.154479070638798), 2.0557384284098403, -0.003321777991317204, -0.0016229513955336081),
    ],
)  # fmt: skip
def test_dop853_beside_saddles_as_mpmath_has_it(six, phi, w, t):
    found, _turnings, _status = solution.trajectories(
        dop853, np.array([[*six, phi, w]]), np.array([[t]]), 1.5e-11
    )
    assert within(found[0, 0], exact(six, phi, w, t, float_out=False))


@pytest.mark.slow
@pytest.mark.parametrize("still", [True, False])
def test_thousands_beside_separatrices_rests_and_double_roots(still):
    """Bars of closed forms and of Taylor series hold, and turnings agree wherever they are known."""
    random = np.random.default_rng(7)
    rows, n = random.normal(size=(6000, 8)), 6000
    rows[:, :2] *= 0.0 if still else 1.0
    rest = random.uniform(-np.pi, np.pi, n)
    s, c, double = np.sin(rest), np.cos(rest), np.cos(2 * rest)
    across = rows[:, 2] * c * s + rows[:, 3] * double  # g(rest) = 0
    along = random.normal(size=n) * 10.0 ** random.uniform(-9, 1, n)
    third = np.arange(n) % 3 == 0
    # g'(rest) = 0, but for roundings
    along[third] = (-rows[:, 2] * double + 4 * rows[:, 3] * s * c)[third]
    rows[:, 4], rows[:, 5] = across * c + along * s, along * c - across * s
    rows[:, 6] = random.uniform(-np.pi, np.pi, n)

    def potential(x):
        sine, cosine = np.sin(x), np.cos(x)
        return (
            rows[:, 2] * sine**2 / 2
            + rows[:, 3] * sine * cosine
            - rows[:, 4] * sine
            - rows[:, 5] * cosine
        )

    kinetic = 2 * (potential(rest) - potential(rows[:, 6]))
    level = (
        random.choice([-1, 1], n)
        * np.sqrt(np.abs(kinetic))
        * (1 + 10.0 ** random.uniform(-17, -1, n))
    )
    rows[:, 7] = np.where(
        np.arange(n) % 2 == 0, level, rows[:, 7] * 10.0 ** random.uniform(-17, 0, n)
    )
    beside = np.arange(n) % 5 == 0
    rows[beside, 6] = (rest + random.choice([-1, 0, 1], n) * 10.0 ** random.uniform(-17, 0, n))[
        beside
    ]
    times = random.uniform(0, 20, (n, 1))
    truth, counted, fine = solution.trajectories(taylor_double, rows, times, 0.0)
    for measure in (solution, auto):
        found, turns, status = measure.trajectories(taylor, rows, times, 1e-10)
        both = (status == OK) & (fine == OK)
        assert both.mean() > 0.95
        error, bars = np.abs(found - truth)[both][:, :2], (found + truth)[both][:, 2:]
        assert (error <= bars).all()
        sure = both & (turns >= 0) & (counted >= 0)
        assert np.array_equal(turns[sure], counted[sure])


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-9])
@pytest.mark.parametrize(("six", "phi0", "w0"), [((0, 0, 1.1, 0.3, 0.5, -0.2), 1.5, 0.5145879417558026),
                                                 pytest.param((0, 0, 0, 0, 0, 4.0), 0.25, 3.968790668917316,
                                                              marks=pytest.mark.slow)])  # fmt: skip
def test_bars_stay_narrow_from_one_passage_of_a_saddle_to_the_next(six, phi0, w0, off):
    """What errs along the flow must not come across it: at each saddle it would grow by as much as
    solutions part.
    """
    row, times = np.array([[*six, phi0, w0 * (1.0 + off)]]), np.array([[40.0, 90.0]])
    floats, turnings, status = solution.trajectories(taylor_double, row, times, 0.0)
    assert (status == OK).all() and (turnings >= 0).all()
    assert (floats[0, :, 2:] <= (1e-8 if off == 0.0 else 1e-12)).all()
    wanted = exact(six, phi0, row[0, 7], 40.0, 50, float_out=False)
    assert within(floats[0, 0], wanted)
