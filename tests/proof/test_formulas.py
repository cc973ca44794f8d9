"""A user's function as a formula: the same values, and what cannot be written is refused."""

import math

import numpy as np
import pytest

pytest.importorskip("flint")

from flint import arb

from survey.measures.hill.multiprecision import Unsupported
from survey.proof import checker
from survey.proof.formulas import formula, number

OMEGA = 2 * math.pi / 3


def loops(u, p):
    return sum(p[0] / (k + 1) ** 2 * np.cos(k * u) for k in range(3)) - p[1]


def quotient(u, p):
    a, b = p
    return (a - b * math.cos(u)) ** -2 + np.sqrt(1 + a * a) * math.exp(-b / 3) + abs(u + 1)


def pieces(u, p):
    return p[0] if u < 1 else p[1] * np.sin(OMEGA * u) ** 2


@pytest.mark.parametrize("z", [loops, quotient, pieces, lambda u, p: 0.1 + 1e-20 * p[0] - 3])
def test_formulas_have_the_values_of_the_function(z):
    found = checker.Formula(formula(z, ["a", "b"], (1.0, 2.0)), ["u", "a", "b"])
    for u, a, b in ((1.2, 0.3, -0.2), (1.9, -1.5, 0.7)):
        value = found(u=arb(u), a=arb(a), b=arb(b))
        assert abs(float(value.mid()) - z(u, (a, b))) < 1e-13 * (1 + abs(z(u, (a, b))))


@pytest.mark.parametrize("z, words", [
    (lambda u, p: p[0] if p[0] > 0 else p[1], "branches on a parameter"),
    (lambda u, p: p[0] if u < 1.5 else p[1], "name each position in BREAKS"),
    (lambda u, p: p[0] ** p[1], "power"),
    (lambda u, p: math.gamma(p[0]), "gamma"),
    (lambda u, p: math.floor(u), "floor"),
    (lambda u, p: "a", "not a real number"),
    (lambda u, p: math.inf, "not a real number"),
])  # fmt: skip
def test_what_is_no_formula_is_refused(z, words):
    with pytest.raises(Unsupported, match=words):
        formula(z, ["a", "b"], (1.0, 2.0))


@pytest.mark.parametrize("value, text", [
    (math.pi, "pi"), (-math.pi, "(-pi)"), (2 * math.pi, "(2*pi)"), (math.pi / 4, "(pi/4)"), (3.14159, "3.14159"),
    (0.1, "0.1"), (-2, "(-2)"), (1e-7, "1e-07"), (0, "0"),
])  # fmt: skip
def test_numbers(value, text):
    assert number(value) == text
