"""Hill's measure on Mathieu's equation: characteristic values, discriminants, certainty, exact rules."""

import numpy as np
import pytest
from hill_problems import REFERENCE, mathieu
from mpmath import mp, mpf

from survey import status
from survey.measures.hill import monodromy
from survey.measures.hill.answers import Answers, Asked
from survey.methods import taylor16

# Per method, the relative bar of discriminants below which no rtol leads, the rounding of all
# steps; within a factor 2.
FLOORS = {"taylor16": 3e-13, "magnus6": 3e-12, "rk4": 6e-11}
METHODS = list(FLOORS)
STANDARD = REFERENCE["standard"]["mathieu"]["values"]
DISCRIMINANTS = REFERENCE["standard"]["mathieu_discriminant"]


def solve(a, q, rtol=1e-10, method="taylor16"):
    return monodromy.solve(mathieu(a, q), method, rtol)


@pytest.mark.parametrize("row", STANDARD, ids=lambda row: f"{row['kind']}{row['n']}-q{row['q']}")
def test_characteristic_values_separate_stable_from_unstable(row):
    """a_n and b_n to 30 digits: on the value the verdict may not be sure and wrong; beside it, it
    is right.
    """
    a = float(row["value"])
    step = 1e-9 * (1 + abs(a))
    out = solve([[a, a - step, a + step]], [row["q"]], rtol=1e-13)
    assert abs(abs(out["discriminant"][0, 0]) - 2) < out["discriminant_error"][0, 0] + 1e-12
    assert (
        abs(out["rotation_number"][0, 0] - row["n"] / 2)
        <= out["rotation_number_error"][0, 0] + 1e-6
    )
    # The unstable interval lies below a_n and above b_n; that of n = 10 at q <= 5 is narrower than
    # the step.
    narrow = row["n"] >= 10 and row["q"] < 25
    assert list(out["verdict"][0, 1:]) == (
        [1, 1] if narrow else [0, 1] if row["kind"] == "a" else [1, 0]
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-9, 1e-13])
def test_discriminants_lie_within_the_bars(method, rtol):
    ratios = []
    for row in DISCRIMINANTS:
        out = solve([[row["a"]]], [row["q"]], rtol, method)
        bar = out["discriminant_error"][0, 0]
        ratios.append(float(abs(mpf(out["discriminant"][0, 0]) - mpf(row["Delta"]))) / bar)
        assert ratios[-1] <= 1
        assert bar < max(rtol, FLOORS[method]) * (1 + abs(float(row["Delta"])))
    assert max(ratios) > 1e-3, "bars a thousand times the errors"


FAST = [row for row in STANDARD if row["q"] >= 25]


@pytest.mark.parametrize("row", FAST, ids=lambda row: f"{row['kind']}{row['n']}-q{row['q']}")
def test_factors_alone_are_not_solved_again_for_a_verdict(row):
    """On an edge no accuracy decides: factors keep the bars that were asked for, which hold the zero."""
    name = {"a": ("dy1", "y1"), "b": ("y2", "dy2")}[row["kind"]][row["n"] % 2]
    problem, rtol = mathieu([[float(row["value"])]], [row["q"]]), 1e-6
    alone = monodromy.solve(problem, "taylor16", rtol, {name})
    decided = monodromy.solve(problem, "taylor16", rtol, {name, "verdict"})
    bar = alone[f"{name}_error"].item()
    assert abs(alone[name].item()) <= bar <= rtol
    assert decided[f"{name}_error"].item() < bar


def test_no_modulation_is_marginal_at_squares_only():
    out = solve([[1.0, 4.0, 2.0, 9.000001]], [0.0])
    assert list(out["verdict"][0]) == [
        monodromy.MARGINAL,
        monodromy.MARGINAL,
        monodromy.STABLE,
        monodromy.STABLE,
    ]
    np.testing.assert_allclose(
        out["rotation_number"][0], np.sqrt([1, 4, 2, 9.000001]) / 2, rtol=1e-13
    )


def test_exponent_and_rotation_number_agree_with_the_discriminant():
    a = np.linspace(-1, 12, 400)
    out = solve([a], [1.7])
    discriminant, exponent = out["discriminant"], out["exponent"]
    unstable = out["verdict"] == monodromy.UNSTABLE
    np.testing.assert_allclose(
        np.cosh(exponent[unstable]), abs(discriminant[unstable]) / 2, rtol=1e-9
    )
    np.testing.assert_allclose(
        2 * np.cos(2 * np.pi * out["rotation_number"][~unstable]),
        discriminant[~unstable],
        atol=1e-9,
    )
    assert np.all(np.diff(out["rotation_number"][0]) > -1e-12)
    assert np.all(
        2 * out["rotation_number"][unstable] == np.rint(2 * out["rotation_number"][unstable])
    )


def test_verdict_is_undecided_where_the_bar_holds_both_answers():
    results = np.array(
        [[1e-9, 1.0, 1e-9, 1.0, *[1e-8] * 4, 0, 0], [0.1, -9.9, 0.1, 0.1, *[1e-8] * 4, 1, 0]]
    )
    answers = Answers(2, Asked(1e-10, np.ones(7, bool)))
    answers.assess(results, None)
    assert list(answers.verdict) == [monodromy.UNDECIDED, monodromy.STABLE] and answers.missed.all()


def test_rotation_numbers_beside_a_closed_gap():
    """q = 0: the rotation number is sqrt(a) / 2; where a = n^2, y1' and y2 vanish together, so that
    the bar of the larger product, cos^2, must not be divided by the small sine.
    """
    off = 10.0 ** -np.arange(3, 9)
    a = (5 + np.concatenate([-off, off])) ** 2
    out = solve([a], [0.0], rtol=1e-13)
    with mp.workdps(30):
        error = [
            float(abs(mpf(float(x)) - mp.sqrt(mpf(float(b))) / 2))
            for x, b in zip(out["rotation_number"][0], a, strict=True)
        ]
    assert list(out["verdict"][0]) == [monodromy.STABLE] * a.size
    assert (error <= out["rotation_number_error"][0]).all()
    assert out["rotation_number_error"].max() < 1e-13


def test_failures_are_values():
    out = solve([[2.0, np.nan, -1e7, 1e13]], [1.0])
    assert list(out["status"][0]) == [
        status.OK,
        status.INVALID_PARAMETERS,
        status.OVERFLOW,
        status.STEP_LIMIT,
    ]
    assert np.isnan(out["discriminant"][0, 1:]).all()
    assert list(out["verdict"][0, 1:]) == [-1, -1, -1]


def test_huge_growth_has_a_relative_bar():
    """a = -400, q = 0: D = 2 cosh(20 pi) = 1e27; det M = 1 would be off by 1e11 and must not matter."""
    out = solve([[-400.0]], [0.0])
    with mp.workdps(40):
        wanted = 2 * mp.cosh(20 * mp.pi)
    assert (
        abs(out["discriminant"][0, 0] - wanted) <= out["discriminant_error"][0, 0] < 1e-10 * wanted
    )
    assert out["verdict"][0, 0] == monodromy.UNSTABLE
    assert abs(out["exponent"][0, 0] - float(20 * mp.pi)) <= out["exponent_error"][0, 0] < 1e-10


def test_one_compiled_version_of_each_kernel():
    solve([[2.0, 3.0]], [1.0])
    solve(np.ones((3, 5)), [1.0, 2.0, 3.0], rtol=1e-6)
    assert len(getattr(taylor16.hill_chain, "signatures", [0])) == 1
