"""The bracketed Newton's method: zeros to rounding, from starts that the plain method would lose."""

from math import atan, cos, pi

import pytest

from survey.kernels.jit import fresh, inline
from survey.kernels.math.newton import bracketed


@inline
def steep(function, given, x):  # the plain method diverges from |x - 1| > 1.4
    value = function(x - given)
    return value, 1.0 / (1.0 + (x - given) ** 2), value < 0.0


@inline
def falling(function, given, x):
    value = function(x)
    return value, given, value > 0.0


@fresh
def arctangent(x):
    return atan(x)


@fresh
def cosine(x):
    return cos(x)


@fresh
def zero_of_steep(start, low, high):
    return bracketed(steep, arctangent, 1.0, start, (low, high), (1e-15, 0.0), 100)


@fresh
def zero_of_cosine(slope, most):
    return bracketed(falling, cosine, slope, 0.5, (0.0, 3.0), (0.0, 4e-16), most)


@pytest.mark.parametrize("start", [-90.0, 0.9, 1.0, 60.0])
def test_a_step_that_leaves_the_bracket_is_halved(start):
    before, zero = zero_of_steep(start, -100.0, 100.0)
    assert abs(zero - 1.0) <= 1e-15 and abs(before - zero) <= 1e-15


def test_without_a_slope_it_stays_in_the_bracket_and_ends():
    before, zero = zero_of_cosine(-0.9, 60)
    assert abs(zero - pi / 2) <= 1e-15 and abs(before - zero) <= 1e-15
    assert zero_of_cosine(0.0, 60) == (0.5, 0.5)  # a start that the bracket's end repeats
    before, zero = zero_of_cosine(-0.5, 3)
    assert before == zero and 0.0 <= zero <= 3.0
