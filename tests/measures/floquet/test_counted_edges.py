"""Edges that two pairs of multipliers pass together, held against the same equation by itself."""

from math import cos, pi
from pathlib import Path

import numpy as np
import pytest

import survey

ROOT = Path(__file__).parents[3]


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


def test_both_edges_of_a_tongue_between_two_points_of_the_lattice_are_found():
    system, given = str(ROOT / "workflows/coupled_mathieu.py"), {"epsilon": 0.3}
    found = survey.edge(system, along="Omega", Omega=(0.2, 5.0), **given)
    first, second = found.edge.values[:2]
    assert (found.edge_error[:2] < 1e-8).all() and second - first < 4e-6
    inside, outside = (
        survey.evaluate(system, Omega=Omega, **given).verdict.values.tolist()
        for Omega in ([0.5 * (first + second)], [first - 1e-5, second + 1e-5])
    )
    assert inside == [0] and outside == [1, 1]
