"""Edges that two pairs of multipliers pass together, held against the same equation by itself."""

from math import cos, pi

import numpy as np
import pytest

import survey


def stiffness(t, p, out):
    out[0, 0] = out[1, 1] = p[0] + p[1] * cos(2 * t)


def damping(t, p, out):
    out[0, 0] = out[1, 1] = 2 * p[2]


@pytest.mark.parametrize("q", [0.3, 0.8])
def test_two_equal_damped_oscillators_have_the_edges_of_one(q):
    both = survey.floquet(
        K=stiffness, C=damping, period=pi, parameters=("a", "q", "c"), states=("x", "y")
    )
    one = survey.hill(
        lambda t, p: p[0] + p[1] * np.cos(2 * t),
        period=pi, parameters=("a", "q", "c"), even=True, damping="c",
    )  # fmt: skip
    found, known = (survey.edge(s, along="c", c=(0.01, 0.6), a=1.0, q=q) for s in (both, one))
    assert found.edge.size == known.edge.size == 1 and (found.edge_error < 1e-11).all()
    assert (abs(found.edge - known.edge) <= found.edge_error + known.edge_error).all()
    assert found.edge_class.values.tolist() == [2]  # minus_one


def test_two_equal_undamped_oscillators_have_the_edges_of_one():
    both = survey.floquet(
        K=stiffness, period=pi, parameters=("a", "q"), states=("x", "y"), structure="symplectic"
    )
    found = survey.edge(both, along="a", a=(0.2, 5.0), q=0.8)
    known = survey.edge("mathieu", along="a", a=(0.2, 5.0), q=-0.4)
    assert found.edge.size == known.edge.size == 4 and (found.edge_error < 1e-6).all()
    assert (abs(found.edge - known.edge) <= found.edge_error + known.edge_error).all()
    assert found.edge_class.values.tolist() == [2, 2, 1, 1]  # minus_one, plus_one
