"""Bounds of what Chebyshev points miss of z: never below what they miss, and none where nothing is known."""

from math import cos, cosh, exp, fabs, floor, inf, pi, sin, sqrt

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from survey.measures.hill import bands

SAMPLES, END = 65, pi / 2


def helper(x):
    return sum(x * k for k in range(3)) / 3


KNOWN = [
    lambda u, p: p[0] - 2 * p[1] * cos(2 * u),
    lambda u, p: p[0] + p[1] * np.cos(12 * u) ** 2 - p[1],
    lambda u, p: p[0] * exp(0.5 * sin(4 * u)) + helper(p[1]) * u**3,
    lambda u, p: -p[0] / 7 + cosh(p[1] * cos(u)) * 1e-3 + (u - 0.3) * sin(p[0] * u),
    lambda u, p: p[0] * cos(p[1] * 30 * u),  # too rich for so few points
    lambda u, p: (p[0] + 1e6 * cos(u)) - 1e6 * cos(u),  # rounds
    lambda u, p: exp(-1e4 * (u - 0.7) ** 2) * p[1] + p[0],  # a spike
]
UNKNOWN = [
    lambda u, p: abs(p[0]) + u,
    lambda u, p: fabs(u - 1),
    lambda u, p: p[0] / (1 + u),
    lambda u, p: sqrt(p[0]) + u,
    lambda u, p: p[0] if u < 1 else p[1],
    lambda u, p: p[0] * floor(u),
    lambda u, p: u ** p[0],
    lambda u, p: 2.0**u,
    lambda u, p: u % 1.0,
    lambda u, p: max(u, p[0]),
    lambda u, p: p[0] + p[2],  # there is no third parameter
    lambda u, p: np.tanh(u),
    lambda u, p: exp(1e3 * u) * p[0],
]


@pytest.mark.parametrize("number", range(len(KNOWN)))
def test_samples_miss_no_more_than_the_bound(number):
    z, random = KNOWN[number], np.random.default_rng(number)
    largest = (9.0, 5.0)
    bound = bands.missed(z, largest, END, SAMPLES)
    x = 0.5 * END * (1 - np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1)))
    u = np.linspace(0, END, 2001)
    for p in [largest, *(random.uniform(-1, 1, (20, 2)) * largest)]:
        values = np.array([z(float(at), p) for at in x])
        off = abs(BarycentricInterpolator(x, values)(u) - [z(float(at), p) for at in u])
        # what the interpolation itself rounds
        assert off.max() <= bound + 1e-13 * abs(values).max()
    assert (bound < 1e-10) == (number < 4)


@pytest.mark.parametrize("z", UNKNOWN)
def test_what_may_have_a_spike_is_not_known(z):
    assert bands.missed(z, (9.0, 5.0), END, SAMPLES) == inf
