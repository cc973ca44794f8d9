"""Closed forms with error bars against 60 digits: the true error lies within the bar."""

import mpmath as mp
import numpy as np
import pytest

from survey.measures import bounded
from survey.measures.bounded import Bounded

DRAW = np.random.default_rng(4)
SIZE = 400


def inputs():
    """Floats, and others beside them that they stand for: (Bounded, exact values)."""
    value = DRAW.normal(size=SIZE) * 10.0 ** DRAW.uniform(-8, 8, SIZE)
    off = abs(value) * 10.0 ** DRAW.uniform(-16, -1, SIZE) * (DRAW.random(SIZE) < 0.7)
    exact = [mp.mpf(v) + mp.mpf(d) * (2 * mp.rand() - 1) for v, d in zip(value, off, strict=True)]
    return Bounded(value, off), exact


def worst(found, exact):
    """The largest true error over the bar."""
    bars = np.broadcast_to(found.bar, found.value.shape)
    off = [
        abs(mp.mpf(v) - e) / mp.mpf(b)
        for v, b, e in zip(found.value, bars, exact, strict=True)
        if b < np.inf
    ]
    assert len(off) > SIZE // 3
    return max(off)


@pytest.mark.parametrize("work", [
    lambda x, y: x + y, lambda x, y: x - y, lambda x, y: x * y, lambda x, y: x / y, lambda x, y: (x - y) * (x + y) / y,
    lambda x, y: 1.0 - x * 3.0 + 2.0 / y,
])  # fmt: skip
def test_errors_lie_within_their_bars(work):
    with mp.workdps(60):
        (x, a), (y, b) = inputs(), inputs()
        ratio = worst(work(x, y), [work(u, v) for u, v in zip(a, b, strict=True)])
    assert 0.1 < ratio <= 1.0


def test_roots_and_means():
    with mp.workdps(60):
        (x, a), (y, b) = inputs(), inputs()
        x, y = (Bounded(abs(n.value), n.bar) for n in (x, y))
        a, b = ([abs(v) for v in n] for n in (a, b))
        assert 0.1 < worst(x.sqrt(), [mp.sqrt(v) for v in a]) <= 1.0
        assert (
            0.1
            < worst(bounded.mean(x, y), [mp.agm(u, v) for u, v in zip(a, b, strict=True)])
            <= 1.0
        )


def test_what_may_vanish_has_no_finite_quotient_and_no_sign():
    near = Bounded(np.array([1e-3, 1e-3, -2.0]), np.array([2e-3, 1e-4, 1.0]))
    with np.errstate(all="ignore"):
        assert np.isfinite((1.0 / near).bar).tolist() == [False, True, True]
        assert near.sign().tolist() == [0.0, 1.0, -1.0]
        assert (
            near.sqrt().value[0] == 0.0
            and near.sqrt().bar[0] >= np.sqrt(3e-3)
            and np.isnan(near.sqrt().value[2])
        )


def test_arrays_and_numbers_count_as_exact():
    two = np.array([2.0]) * Bounded(np.array([1.5]), 0.25)
    assert isinstance(two, Bounded) and two.value[0] == 3.0 and 0.5 <= two.bar[0] < 0.5 + 1e-14
