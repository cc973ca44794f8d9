"""Mathieu's equation against the characteristic values a_n, b_n and exact facts (DLMF chapter 28)."""

import numpy as np
import pytest
from hill_problems import REFERENCE
from mpmath import mp, mpf

import survey
from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.measures.hill import monodromy
from survey.scenes import mathieu

STANDARD = REFERENCE["standard"]
# The factor that vanishes at a_n and b_n: even n are periodic, a_n belongs to even solutions (DLMF
# 28.2(v)).
FACTOR = {("a", 0): "dy1", ("a", 1): "y1", ("b", 0): "y2", ("b", 1): "dy2"}


@pytest.mark.parametrize("method", ["auto", "rk4", "magnus6", "dop853"])
def test_discriminants_of_the_reference(method):
    for row in STANDARD["mathieu_discriminant"]:
        ds = survey.evaluate("mathieu", a=row["a"], q=row["q"], method=method)
        error = abs(float(mpf(float(ds.discriminant)) - mpf(row["Delta"])))
        assert error <= float(ds.discriminant_error)
        assert error < 1e-10 * (1 + abs(float(row["Delta"])))


@pytest.mark.parametrize(
    "row", STANDARD["mathieu"]["values"], ids=lambda r: f"{r['kind']}{r['n']}-q{r['q']}"
)
def test_the_factor_vanishes_at_a_characteristic_value_and_the_verdict_changes_there(row):
    n, edge = row["n"], float(row["value"])
    ds = survey.evaluate("mathieu", a=[edge - 1e-6, edge, edge + 1e-6], q=float(row["q"]))
    factor = ds[FACTOR[row["kind"], n % 2]]
    slope = abs(float(factor[2] - factor[0])) / 2e-6
    bar = ds[f"{factor.name}_error"].values.astype(float)
    # The edge itself is rounded to binary64.
    assert abs(float(factor[1])) <= bar[1] + slope * np.spacing(abs(edge))
    assert np.sign(float(factor[0])) == -np.sign(float(factor[2]))
    # a square root leaves the edge
    np.testing.assert_allclose(ds.rotation_number[1], n / 2, atol=1e-4)
    assert (ds.exponent >= 0).all()


def test_between_the_edges_of_a_tongue_it_is_unstable_and_outside_stable():
    b5, a5 = (
        float(r["value"]) for r in STANDARD["mathieu"]["values"] if r["n"] == 5 and r["q"] == 1
    )
    width = a5 - b5
    ds = survey.evaluate("mathieu", a=np.array([b5 - width, 0.5 * (a5 + b5), a5 + width]), q=1.0)
    assert ds.verdict.values.tolist() == [1, 0, 1] and 1e-5 < width < 2e-5
    assert float(ds.rotation_number[1]) == 2.5 and float(ds.exponent[1]) > 0


def test_without_excitation_it_is_a_free_oscillator():
    a = np.array([-2.0, -0.5, 0.0, 0.3, 1.0, 2.25, 4.0, 100.0, 123.4])
    ds = survey.evaluate("mathieu", a=a, q=0.0)
    assert ds.verdict.values.tolist() == [0, 0, 2, 1, 2, 1, 2, 2, 1]
    with mp.workdps(30):
        exact = [2 * mp.cos(mp.pi * mp.sqrt(value)) for value in map(mpf, a)]
        error = [
            abs(float(mp.re(e) - mpf(float(v))))
            for e, v in zip(exact, ds.discriminant, strict=True)
        ]
    assert (error <= ds.discriminant_error).all()
    np.testing.assert_allclose(ds.rotation_number[3:], np.sqrt(a[3:]) / 2, rtol=1e-12)


def test_the_discriminant_is_even_in_q():
    a, q = np.linspace(-5, 30, 8), np.array([0.3, 5.0, 20.0])
    one, other = (survey.evaluate("mathieu", a=a, q=sign * q) for sign in (1, -1))
    bars = one.discriminant_error.values.astype(float) + other.discriminant_error.values
    assert (abs(one.discriminant.values - other.discriminant.values) <= bars).all()
    np.testing.assert_array_equal(one.verdict, other.verdict)


def test_where_the_amplitude_leaves_binary64_the_point_says_overflow():
    ds = survey.evaluate("mathieu", a=[-1e6, 1.0], q=0.5)
    assert ds.status.attrs["flag_meanings"].split()[int(ds.status[0])] == "overflow"
    assert int(ds.status[1]) == 0 and np.isnan(ds.discriminant[0]) and int(ds.verdict[0]) == -1


@pytest.mark.parametrize("method", ["auto", "taylor16", "magnus6", "rk4", "dop853"])
def test_bars_do_not_underflow(method):
    """To first order in a and q^2, y1'(T/2) = -(a + q^2/2) pi/2 and a_0(q) = -q^2/2 (DLMF 28.6.1)."""
    tiny = [1e-80, 1e-140, 1e-150, 1e-200, 3.182584613881663e-290, -2e-283, 1e-300, 1e-308, 5e-324]
    points = [(a, q) for q in tiny for a in (0.0, q, -abs(q), 0.25 * q)] + [
        (sign * q, 0.0) for q in tiny for sign in (1, -1)
    ]
    for rtol in (1.156e-13, 6.96e-13, 1e-9):
        for a, q in points:
            out = monodromy.solve(mathieu._problem(np.array([q]), np.array([[a]])), method, rtol)
            said, dy1, bar = (
                int(out["verdict"][0, 0]),
                float(out["dy1"][0, 0]),
                float(out["dy1_error"][0, 0]),
            )
            with mp.workdps(700):
                beyond = mpf(a) + mpf(q) ** 2 / 2
                assert abs(mpf(dy1) + beyond * mp.pi / 2) <= bar, (a, q, rtol)
            assert said in (UNDECIDED, STABLE if beyond > 0 else UNSTABLE), (a, q, rtol)
            # no floor hides what is known
            decided = 1e-220 < abs(a) and abs(q) < 1e-30 and method != "dop853"
            assert not decided or (said != UNDECIDED and bar < 1e-10 * abs(a)), (a, q, rtol)


@pytest.mark.parametrize("q", [5e-324, 1e-300])
def test_the_same_rounding_in_every_step_lies_within_the_bars(q):
    """Where z hardly varies, all steps err alike, and errors of y and y' add up (a < 0: nothing turns)."""
    with mp.workdps(30):
        exact = {
            "y1": mp.cosh(mp.pi / 2),
            "dy1": mp.sinh(mp.pi / 2),
            "y2": mp.sinh(mp.pi / 2),
            "dy2": mp.cosh(mp.pi / 2),
        }
        ds = survey.evaluate("mathieu", a=-1.0, q=q, rtol=9.427827650403594e-13)
        for name, value in exact.items():
            assert abs(mpf(float(ds[name])) - value) <= float(ds[f"{name}_error"]), name
