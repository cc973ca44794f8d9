"""Elliptic functions against mpmath, from k = 0 to one ulp-like distances from 1."""

import numpy as np
import pytest
from mpmath import mp, mpf

from survey.kernels.hill.satellite import complete_integrals
from survey.kernels.jit import kernel
from survey.kernels.math.elliptic import MEANS, jacobi, means


@kernel
def all_at(u, kc, out):
    pairs = np.empty((2, MEANS))
    last = means(kc, pairs)
    for i in range(len(u)):
        out[i, 0], out[i, 1], out[i, 2] = jacobi(u[i], pairs, last)


def exact(one_minus_k):
    """k and k' of the exact binary number 1 - k."""
    k = 1 - mpf(one_minus_k)
    return k, mp.sqrt((1 - k) * (1 + k))


SHORT = [1.0, 0.9, 0.5, 0.1, 1e-3, 1e-6, 1e-8, 1e-11, 1e-14]


@pytest.mark.parametrize("short", SHORT)
def test_sn_cn_dn(short):
    with mp.workdps(40):
        k, kc = exact(short)
        u = np.linspace(0.0, float(mp.ellipk(k**2)) * (1 - 1e-15), 41)
        got = np.empty((u.size, 3))
        all_at(u, float(kc), got)
        for i, value in enumerate(u):
            wanted = [mp.ellipfun(name, mpf(float(value)), m=k**2) for name in ("sn", "cn", "dn")]
            # The argument itself moves by half an ulp, which the derivative (at most 1) carries
            # over.
            bound = 6e-16 + 2.3e-16 * value * float(abs(wanted[1] * wanted[2]) + abs(wanted[0]))
            assert max(abs(float(w - g)) for w, g in zip(wanted, got[i], strict=True)) < bound


@pytest.mark.parametrize("short", SHORT)
def test_complete_integrals(short):
    with mp.workdps(40):
        k, kc = exact(short)
        first, second = complete_integrals(np.array([float(k)]), np.array([float(kc)]))
        big = mp.ellipk(k**2)
        assert abs(first[0] / big - 1) < 1e-15
        assert abs(second[0] - mp.ellipe(k**2)) < 1e-15 * big


def test_odd_and_even():
    u = np.array([-0.7, 0.0, 0.7])
    got = np.empty((3, 3))
    all_at(u, 0.6, got)
    np.testing.assert_array_equal(got[0] * [-1, 1, 1], got[2])
    np.testing.assert_array_equal(got[1], [0.0, 1.0, 1.0])
