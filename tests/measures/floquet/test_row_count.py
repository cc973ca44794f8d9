"""Do curves explain how many multipliers are outside the circle? All do, and none without one of them."""

import math
from pathlib import Path

import numpy as np
import pytest

import survey
from survey.measures.floquet import row_count
from survey.measures.floquet.multipliers import COLLISION, MINUS_ONE, PLUS_ONE
from survey.request.workflow import check
from survey.sweep import boundaries

COUPLED = str(Path(__file__).parents[3] / "workflows/coupled_mathieu.py")


def stiffness(t, p, out):
    out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)


def damping(t, p, out):
    out[0, 0] = 0.2


@pytest.mark.slow
@pytest.mark.parametrize(
    "make, ends",
    [
        (
            lambda: survey.floquet(
                K=stiffness, C=damping, period=math.pi, parameters=("a", "q"), states="x"
            ),
            {"a": (0.0, 6.0), "q": (0.0, 4.0)},
        ),
        (lambda: COUPLED, {"Omega": (0.55, 2.6), "epsilon": (0.0, 0.6)}),
    ],
    ids=["damped", "symplectic"],
)
def test_curves_that_are_left_out_are_missed(make, ends, monkeypatch):
    known, own = [], row_count.unexplained

    def kept(counts, curves, passed):
        known.append((counts, curves))
        return own(counts, curves, passed)

    monkeypatch.setattr(row_count, "unexplained", kept)
    table = {name: {"start": low, "stop": high, "num": 3} for name, (low, high) in ends.items()}
    workflow = check({"scene": make(), "axes": table, "boundaries": {}})
    assert "curves_unexplained" not in boundaries.find(workflow).attrs
    (counts, curves) = known[0]
    assert (counts >= 0).mean() > 0.99 and len(np.unique(counts[counts >= 0])) > 1
    for k, (_kind, x) in enumerate(curves):
        if len(x) > 20:
            assert own(counts, curves[:k] + curves[k + 1 :])[0] > 3


def test_segments_by_hand():
    n = 11
    counts = np.zeros((n, n), int)
    counts[6:] = 1  # outside from x = 0.55 on
    line = np.array([[0.55, 0.0], [0.55, 1.0]])
    assert row_count.unexplained(counts, [(PLUS_ONE, line)]) == (0, 2 * 9 * 10)
    assert row_count.unexplained(counts, [])[0] == 9
    assert row_count.unexplained(counts, [(COLLISION, line)])[0] == 9  # it takes 2 outside
    assert (
        row_count.unexplained(
            counts, [(PLUS_ONE, line), (MINUS_ONE, line + np.array([0.02, 0.0]))]
        )[0]
        == 9
    )
    counts[5:7] = -1  # what is not known is bridged
    assert row_count.unexplained(counts, [(PLUS_ONE, line)])[0] == 0
    assert row_count.unexplained(counts, [])[0] == 9


def test_the_number_outside_is_certain_or_left_open():
    M = np.array(
        [
            np.diag([2.0, 0.5]),
            np.diag([0.9, 0.5]),
            np.diag([1.0 + 1e-12, 0.5]),
            [[0.6, -0.8], [0.8, 0.6]],
        ]
    )
    E = np.full_like(M, 1e-10)
    assert row_count.outside(M, E, "none").tolist() == [1, 0, -1, -1]
    assert row_count.outside(M, E, "symplectic").tolist()[0::3] == [1, 0]
