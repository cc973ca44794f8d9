"""Curves from numbers that are counted: of each kind on its own, where they cross, and once."""

import numpy as np

from survey.measures.floquet import narrow, row_count
from survey.measures.floquet.multipliers import NEIMARK_SACKER, PLUS_ONE

LINES = 33


def u(x):
    return x[:, 0] - 0.15 * x[:, 1] - 0.45


def v(x):
    return x[:, 0] + 0.2 * x[:, 1] - 0.63


def outside(x):
    """Two real multipliers where u > 0, two pairs where v < 0."""
    return 2 * (u(x) > 0) + 4 * (v(x) < 0)


def kinds_of(x):
    return np.where(abs(u(x)) < abs(v(x)), PLUS_ONE, NEIMARK_SACKER)


def test_curves_of_two_kinds_that_cross():
    ticks = np.linspace(0.0, 1.0, LINES)
    lattice = np.stack([one.ravel() for one in np.meshgrid(ticks, ticks, indexing="ij")], axis=1)
    counts = outside(lattice).reshape(LINES, LINES)
    found = narrow.counted(outside, kinds_of, counts, [])
    assert sorted(kind for kind, *_ in found) == [PLUS_ONE, NEIMARK_SACKER]
    for kind, x, error, _number in found:
        zero = u if kind == PLUS_ONE else v
        assert (abs(zero(x)) <= error + 1e-15).all() and np.ptp(x[:, 1]) > 0.9
    drawn = [(kind, x) for kind, x, _error, number in found for _ in range(number)]
    assert row_count.unexplained(counts, drawn)[0] == 0
