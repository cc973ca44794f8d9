"""Every way to give a satellite's point is solved again in double-double where float64 cannot tell,
against mpmath.
"""

from fractions import Fraction

import numpy as np
import pytest
from hill_problems import factors, mp_factors, solve
from mpmath import mp, mpf

import survey
from survey import status
from survey.kernels.hill.answers import STABLE, UNSTABLE
from survey.kernels.math.double import HALF_PI
from survey.scenes import mathieu, satellite

WAYS = [
    # first and second parameter, range of the second that holds an edge
    ({"amplitude": 1.1}, "rho", (1.3, 1.6), {"body": "prolate"}),
    ({"amplitude": 0.7}, "inertia_ratio", (0.8, 0.87), {}),
    ({"amplitude": 0.9}, "inertia_ratio", (1.1, 1.3), {}),
    ({"k": 1.3}, "inertia_ratio", (1.1, 1.3), {"direction": 1}),
    ({"one_minus_k": 3e-5}, "inertia_ratio", (0.8, 0.87), {}),
    ({"one_minus_k": -6e-5}, "inertia_ratio", (1.2, 1.4), {"direction": -1}),
]


def given(point):
    """k, rho, family of a point, for mpmath."""
    k = mpf(point["k"]) if "k" in point else None
    k = mp.sin(mpf(point["amplitude"])) if "amplitude" in point else k
    k = 1 - mpf(point["one_minus_k"]) if "one_minus_k" in point else k
    body, rho = point.get("body"), point.get("rho")
    if rho is None:
        alpha = mpf(point["inertia_ratio"])
        rho, body = (
            point.get("direction", 1) / mp.sqrt(3 * abs(1 - alpha)),
            "oblate" if alpha > 1 else "prolate",
        )
    return k, rho, body[0].upper() + ("L" if k < 1 else "R")


def truth(point):
    """The verdict, by Taylor series with 36 digits."""
    with mp.workdps(36):
        k, rho, family = given(point)
        y1, dy1, y2, dy2, *_ = mp_factors(family, k, rho, 36)
        assert min(abs(y1 * dy2), abs(dy1 * y2)) > mpf("1e-28")
        return UNSTABLE if dy1 * y2 > 0 or y1 * dy2 < 0 else STABLE


def doubles(x, count):
    """`count` doubles on both sides of x, and x."""
    return (np.float64(x).view(np.int64) + np.arange(-count, count + 1)).view(np.float64)


@pytest.mark.parametrize(
    ("first", "second", "between", "options"),
    [
        pytest.param(*way, marks=[pytest.mark.slow] * (i not in (0, 2)))
        for i, way in enumerate(WAYS)
    ],
)
def test_doubles_one_after_another_about_an_edge(first, second, between, options):
    """No verdict is left open, there is one switch, and mpmath finds it between the same two doubles."""

    def verdict(**values):
        return survey.evaluate(
            "satellite", **values, **options, variables=["verdict"]
        ).verdict.values

    line = np.linspace(*between, 200)
    verdicts = verdict(**first, **{second: line})
    at = np.flatnonzero(verdicts[1:] != verdicts[:-1])[0]
    low, high = line[at], line[at + 1]
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (
            (middle, high)
            if verdict(**first, **{second: [middle]})[0] == verdicts[at]
            else (low, middle)
        )
    ((name, value),) = first.items()
    for along, places, fixed in (
        (second, doubles(low, 100), first),
        (name, doubles(value, 100), {second: low}),
    ):
        got = verdict(**fixed, **{along: places})
        assert set(got) == {STABLE, UNSTABLE}
        (switch,) = np.flatnonzero(got[1:] != got[:-1])
        for place in (switch, switch + 1):
            assert truth(options | fixed | {along: places[place]}) == got[place], (
                along,
                places[place],
            )


@pytest.mark.parametrize("amplitude", [1e-5, 0.7, 1.5707])
@pytest.mark.parametrize("inertia_ratio", [pytest.param(1e-20, marks=pytest.mark.slow), 0.3, 1.6])
def test_factors_by_amplitude_and_inertia_ratio(amplitude, inertia_ratio):
    """The double-double kernel: all four within half an ulp."""
    rho, low = satellite.rates(np.array(inertia_ratio), "1")
    out = factors(
        "oblate" if inertia_ratio > 1 else "prolate", float(rho), float(low), amplitude=amplitude
    )
    with mp.workdps(40):
        k, rho, family = given({"amplitude": amplitude, "inertia_ratio": inertia_ratio})
        for got, bar, exact in zip(
            out[:4], out[4:8], mp_factors(family, k, rho, 40)[:4], strict=True
        ):
            assert abs(mpf(got) - exact) <= bar
            assert bar < 1.3e-16 * abs(got) + 1e-24


def test_the_last_amplitude_below_a_right_angle():
    """1 - k = 1.9e-33: no digit of pi/2 - amplitude is lost."""
    amplitude = np.nextafter(np.pi / 2, 0)
    with mp.workdps(60):
        one_minus_k = float(1 - mp.sin(mpf(amplitude)))
    for body in ("prolate", "oblate"):
        one, other = (
            factors(body, 1.7, **point)
            for point in ({"amplitude": amplitude}, {"one_minus_k": one_minus_k})
        )
        np.testing.assert_allclose(one[:4], other[:4], rtol=1e-14)


def test_at_the_separatrix_there_is_no_period(recwarn):
    for point in ({"k": 1.0}, {"one_minus_k": 0.0}, {"k": np.inf}):
        out = solve(rho=1.5, **point)
        assert out["status"][0] == status.INVALID_PARAMETERS and np.isnan(out["period"][0])
    assert not recwarn.list


def test_rho_of_an_inertia_ratio_to_thirty_digits():
    alpha = np.concatenate(
        [[0.0, 1e-300, 1e-17, np.nextafter(1, 0), np.nextafter(1, 2), 2.0], np.linspace(0, 2, 40)]
    )
    for direction in ("1", "-1"):
        rho, low = satellite.rates(alpha, direction)
        for i in range(alpha.size):
            with mp.workdps(50):
                true = int(direction) / mp.sqrt(3 * abs(1 - mpf(alpha[i])))
                assert abs(mpf(rho[i]) + mpf(low[i]) - true) < mpf("1e-31") * abs(true), alpha[i]
            assert abs(low[i]) <= 0.5 * np.spacing(abs(rho[i])), alpha[i]


def test_steps_fill_the_half_period_on_any_machine():
    """Mathieu's is pi / 2, known to 32 digits: steps an ulp longer or shorter add up to it to half
    an ulp of one.
    """
    problem = mathieu._problem(np.array([1.0, 5.0]), np.zeros((2, 1)))
    for steps in (6, 10, 28, 448, 28672):
        lengths = problem.lengths(np.array([1]), steps)[0]
        total = sum(map(Fraction, lengths.tolist()))
        assert (
            abs(total - (Fraction(HALF_PI[0]) + Fraction(HALF_PI[1])))
            <= Fraction(np.spacing(lengths.min())) / 2
        )
        assert np.ptp(lengths) <= np.spacing(lengths.max())


@pytest.mark.skipif(
    np.finfo(np.longdouble).eps > 1e-18, reason="this machine has no longer floats than float64"
)
def test_steps_fill_the_half_period_to_19_digits():
    """Half an ulp of each step alone would be 1e-11 of D at rho = 1000 beside the separatrix."""
    for one_minus_k in (1e-12, 0.4, -1e-9, -3.0):
        motion = satellite.Motion(
            *(np.array([v]) for v in satellite.moduli({"one_minus_k": one_minus_k})), False
        )
        problem = satellite._problem(motion, np.array([[1.0]]))
        total = sum(map(Fraction, problem.lengths(np.array([0]), 28672)[0].tolist()))
        with mp.workdps(40):
            kc = mpf(motion.kc[0])  # as rounded: its rounding is another matter
            half = mp.pi / mp.agm(1, kc) / (2 * motion.k[0] if motion.k[0] > 1 else 1)
            assert abs(mpf(total.numerator) / total.denominator / half - 1) < 3e-19
