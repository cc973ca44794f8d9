"""Inverse functions of many numbers against mpmath, next to where their formulas change, too."""

import numpy as np
import pytest
from mpmath import mp

from survey.kernels.jit import kernel
from survey.kernels.math import inverses
from survey.kernels.math.roundoff import EPS


@kernel
def arcsinh_roots(x, work):
    inverses.arcsinh_roots(x, work)


@kernel
def arctan_roots(x, y, out):
    for i in range(len(out)):
        out[i] = inverses.arctan_root(x[i], y[i])


def sizes(seed):
    """Numbers of all sizes, and neighbours of those where 1 + u passes a power of 2, or its root."""
    rng = np.random.default_rng(seed)
    turns = np.sinh(np.log(2.0) * 0.5 * np.arange(-2, 60)) ** 2
    near = (turns[:, None] * (1 + EPS * np.arange(-3, 4))).ravel()
    return np.concatenate(
        [10 ** rng.uniform(-320, 307, 2000), 10 ** rng.uniform(-4, 4, 2000), near]
    )


def test_arcsinh_of_roots():
    x = sizes(1)
    found = x.copy()
    arcsinh_roots(found, np.empty(x.size))
    with mp.workdps(40):
        wrong = [
            abs(float(mp.mpf(float(a)) / mp.asinh(mp.sqrt(mp.mpf(float(b)))) - 1))
            for a, b in zip(found, x, strict=True)
            if b > 0
        ]
    assert len(wrong) > 4000
    assert max(wrong) < 2 * EPS


def test_arcsinh_of_roots_at_its_ends():
    x = np.array([0.0, -1.0, -np.inf, 5e-324, np.nan])
    arcsinh_roots(x, np.empty(x.size))
    assert x[:4].tolist() == [0.0, 0.0, 0.0, np.sqrt(5e-324)]
    assert np.isnan(x[4])


def test_arctan_of_roots():
    rng = np.random.default_rng(2)
    x = rng.uniform(0, 1, 3000)
    y = 1 - x
    small = 10 ** rng.uniform(-300, 0, 1000)
    turns = np.tan(np.pi / 16 * np.arange(1, 8)) ** 2
    near = (turns[:, None] * (1 + EPS * np.arange(-3, 4))).ravel()
    x, y = (
        np.concatenate([x, small, np.ones(1000), near]),
        np.concatenate([y, np.ones(1000), small, np.ones(near.size)]),
    )
    found = np.empty(x.size)
    arctan_roots(x, y, found)
    with mp.workdps(40):
        right = [
            mp.atan(mp.sqrt(mp.mpf(float(a)) / mp.mpf(float(b)))) for a, b in zip(x, y, strict=True)
        ]
        wrong = [abs(float(mp.mpf(float(a)) - b)) for a, b in zip(found, right, strict=True)]
        small = [float(w / b) for w, b in zip(wrong, right, strict=True)]
    assert max(wrong) < 2 * EPS
    assert max(small) < 4 * EPS  # relative


@pytest.mark.parametrize(
    ("x", "y", "right"),
    [(0.0, 1.0, 0.0), (1.0, 0.0, np.pi / 2), (-1.0, 2.0, 0.0), (1.0, 1.0, np.pi / 4)],
)
def test_arctan_of_roots_at_its_ends(x, y, right):
    found = np.empty(1)
    arctan_roots(np.array([x]), np.array([y]), found)
    assert abs(found[0] - right) <= EPS if x == y else found[0] == right
