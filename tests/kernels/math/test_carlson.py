"""Carlson's integrals, the mean's sums and the double-double sine against mpmath."""

import numpy as np
import pytest
from mpmath import mp, mpf

from survey.kernels.jit import kernel
from survey.kernels.math.carlson import rf, rj
from survey.kernels.math.sines import sin_cos
from survey.kernels.math.third_kind import mean, third, third_double


@kernel
def all_of(x, m, g, p, a, b, out):
    out[0], out[1] = rf(x, m, g), rj(x, m, g, p)
    out[2], out[3] = mean(a, b)
    out[4] = third(a, b, p)
    ratio, middle = third_double((a, 0.0), (b, 0.0), (p, 0.0))
    out[5], out[6], out[7], out[8] = ratio[0], ratio[1], middle[0], middle[1]


@pytest.mark.slow
def test_integrals():
    """Real and conjugate pairs; p from 1e-16 to 1e8."""
    random, out = np.random.default_rng(0), np.empty(9)
    with mp.workdps(45):
        for i in range(300):
            x = 0.0 if i % 3 == 0 else 10 ** random.uniform(-8, 4)
            m, p = 10 ** random.uniform(-4, 4), 10 ** random.uniform(-16, 8)
            g = m * 10 ** random.uniform(-9, 1.5)
            a, b = 10 ** random.uniform(-5, 5, 2)
            all_of(x, m, g, p, a, b, out)
            spread = mp.sqrt(mp.mpc(mpf(m) ** 2 - mpf(g) ** 2))
            pair = m + spread, m - spread
            middle = mp.agm(a, b)
            ratio = mp.elliprj(0, mpf(a) ** 2, mpf(b) ** 2, p) * 4 * middle * p / (3 * mp.pi)
            exact = mp.elliprf(x, *pair).real, mp.elliprj(x, *pair, p).real, middle
            for value, true in zip(out, exact, strict=False):
                assert abs(value / true - 1) < 2e-15
            assert abs(out[4] / ratio - 1) < 1e-14
            assert abs((mpf(out[5]) + mpf(out[6])) / ratio - 1) < 1e-28
            assert abs((mpf(out[7]) + mpf(out[8])) / middle - 1) < 1e-29


def test_the_third_kind_where_its_parameter_is_extreme():
    """p from 1e-80 to 1e80 times x y, as beside poles that a motion nearly aims at: a closed form
    ends the sum.
    """
    random, out = np.random.default_rng(2), np.empty(9)
    with mp.workdps(100):
        for _ in range(200):
            a, b = 10 ** random.uniform(-3, 3, 2)
            p = a * b * 10 ** random.uniform(-80, 80)
            all_of(1.0, 1.0, 1.0, p, a, b, out)
            ratio = mp.elliprj(0, mpf(a) ** 2, mpf(b) ** 2, p) * 4 * mp.agm(a, b) * p / (3 * mp.pi)
            assert abs(out[4] / ratio - 1) < 4e-15
            assert abs((mpf(out[5]) + mpf(out[6])) / ratio - 1) < 1e-30


def test_sine_and_cosine():
    random = np.random.default_rng(1)
    small, ends = 10 ** random.uniform(-20, 0, 100), np.pi - 10 ** random.uniform(-16, 0, 100)
    with mp.workdps(50):
        for x in np.concatenate([[0.0], random.uniform(0, 3.2, 300), small, ends]):
            sine, cosine = sin_cos(x)
            assert abs(mpf(sine[0]) + mpf(sine[1]) - mp.sin(x)) <= 2.0**-103 * min(x, 1.0)
            assert abs(mpf(cosine[0]) + mpf(cosine[1]) - mp.cos(x)) <= 2.0**-103
