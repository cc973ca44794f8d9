"""Roots and logarithms by bits, against libm."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from survey.kernels.math import roots

positive = st.floats(1e-307, 1e307)


@given(positive)
def test_the_16th_root_is_known_to_1_percent(x):
    assert abs(roots.sixteenth_root(x) / x**0.0625 - 1.0) < 0.01


@given(positive)
def test_the_logarithm_is_known_to_3_digits(x):
    assert abs(roots.log2(x) - np.log2(x)) < 0.0009


@given(st.floats(-999.0, 999.0))
def test_the_power_is_known_to_4_digits(y):
    assert abs(roots.exp2(y) / np.exp2(y) - 1.0) < 1.1e-4
