"""Tongues between two points of the lattice, of functions whose zeros are known."""

import numpy as np
import pytest

from survey.measures import contours
from survey.measures.floquet import dips

LINES = 97
TIP = 0.31


def middle(y):
    return 0.4037 + 0.11 * y - 0.07 * y * y


def tongue(half_width, sign=1.0):
    """sign ((x - middle)^2 - half_width^2), as long as half_width > 0, with bounds of its rounding."""

    def function(x):
        off, w = x[:, 0] - middle(x[:, 1]), half_width(x[:, 1])
        return sign * (off * off - np.sign(w) * w * w), np.full(len(x), 1e-18)

    return function


def found(function, turned):
    def on_map(x):
        return function(x[:, ::-1] if turned else x)

    values = on_map(contours.lattice(LINES))[0].reshape(LINES, LINES)
    pieces = dips.curves(on_map, [], 1e-16, values)
    return [(x[:, ::-1] if turned else x, error) for x, error in pieces]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("slope", [1e-3, 1e-6])
def test_both_edges_are_followed_from_the_tip_to_the_border(slope, sign, turned):
    def half_width(y):
        return slope * (y - TIP)

    pieces = found(tongue(half_width, sign), turned)
    sides = []
    for x, error in pieces:
        off = x[:, 0] - middle(x[:, 1])
        assert (abs(abs(off) - half_width(x[:, 1])) <= error).all() and error.max() < 1e-9
        sides += list(np.unique(np.sign(off[half_width(x[:, 1]) > 1e-9])))
        assert x[:, 1].max() == 1.0 and np.hypot(*np.diff(x, axis=0).T).max() < 0.03
        assert x[:, 1].min() < TIP + 0.02
    assert sorted(sides) == [-1.0, 1.0]


def test_a_valley_above_zero_has_no_curve():
    assert (
        found(lambda x: (tongue(lambda y: 0.0 * y)(x)[0] + 1e-10, np.full(len(x), 1e-18)), False)
        == []
    )


def test_what_is_drawn_already_is_not_found_again():
    function = tongue(lambda y: 1e-3 + 0.0 * y)
    values = function(contours.lattice(LINES))[0].reshape(LINES, LINES)
    once = dips.curves(function, [], 1e-16, values)
    assert len(once) == 2
    assert dips.curves(function, [x for x, _error in once], 1e-16, values) == []
