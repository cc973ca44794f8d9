"""Double-double arithmetic against mpmath, on numbers drawn to cancel and to differ in size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from survey.kernels.hill import satellite
from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import PAIR_ROUNDOFF


@kernel
def all_of(x, y, out):
    """Every operation on the pairs x and y, in the order of `exact`."""
    a, b = (x[0], x[1]), (y[0], y[1])
    out[0, 0], out[0, 1] = dd.two_sum(x[0], y[0])
    out[1, 0], out[1, 1] = dd.two_prod(x[0], y[0])
    out[2, 0], out[2, 1] = dd.add(a, b)
    out[3, 0], out[3, 1] = dd.sub(a, b)
    out[4, 0], out[4, 1] = dd.mul(a, b)
    out[5, 0], out[5, 1] = dd.times(a, y[0])
    out[6, 0], out[6, 1] = dd.over(a, y[0])
    out[7, 0], out[7, 1] = dd.div(a, b)
    positive = a if x[0] > 0.0 else dd.neg(a)
    out[8, 0], out[8, 1] = dd.sqrt(positive)
    out[9, 0], out[9, 1] = dd.mean(positive, b if y[0] > 0.0 else dd.neg(b))
    out[10, 0], out[10, 1] = dd.shifted(a, y[0])
    out[11, 0], out[11, 1] = dd.square(a)
    out[12, 0], out[12, 1] = dd.ratio(a, b)
    out[13, 0], out[13, 1] = dd.positive_root(positive)
    out[14, 0], out[14, 1] = dd.loose(a, b)


split = inline(dd.split_error)


@kernel
def both_errors(x, y, out):
    for i in range(len(x)):
        out[0, i], out[1, i] = (
            dd.fused_error(x[i], y[i], x[i] * y[i]),
            split(x[i], y[i], x[i] * y[i]),
        )


def exact(x, y):
    a, b = mpf(x[0]) + mpf(x[1]), mpf(y[0]) + mpf(y[1])
    first, second = mpf(x[0]), mpf(y[0])
    return [first + second, first * second, a + b, a - b, a * b, a * second, a / second, a / b, mp.sqrt(abs(a)),
            mp.agm(abs(a), abs(b)), a + second, a * a, a / b, mp.sqrt(abs(a)), a + b]  # fmt: skip


def value(pair):
    return mpf(float(pair[0])) + mpf(float(pair[1]))


def check(x, y):
    out = np.empty((15, 2))
    all_of(np.array(x), np.array(y), out)
    with mp.workdps(80):
        wanted = exact(x, y)
        assert value(out[0]) == wanted[0] and value(out[1]) == wanted[1]
        for i, (pair, number) in enumerate(zip(out[2:], wanted[2:], strict=True)):
            # the last one may cancel
            size = abs(number) if i < 12 else abs(value(x)) + abs(value(y))
            assert abs(value(pair) - number) <= (8 if i == 7 else 4) * PAIR_ROUNDOFF * size, i
            assert pair[0] == pair[0] + pair[1], i


HIGH = st.floats(1e-12, 1e12) | st.sampled_from(
    [1.0, 3.0, 1 + 2.0**-52, 2.0 - 2.0**-52, 134217729.0, 0.1]
)
LOW = st.floats(-1.0, 1.0).map(lambda part: round(part, 9))  # the reference has 80 digits
SIGN = st.sampled_from([-1.0, 1.0])


def pair(high, part):
    """A normalised pair with a given fraction of half an ulp below."""
    low = 0.499 * part * np.spacing(high)
    return high, (low if high == high + low else 0.0)


@settings(max_examples=300, deadline=None)
@given(HIGH, LOW, SIGN, HIGH, LOW, SIGN)
def test_operations(a, p, s, b, q, t):
    check(pair(s * a, p), pair(t * b, q))


@settings(max_examples=100, deadline=None)
@given(HIGH, LOW, LOW, st.integers(-3, 3))
def test_operations_that_cancel(a, p, q, ulps):
    check(pair(a, p), pair(a + ulps * np.spacing(a), q))


def test_special_pairs():
    with mp.workdps(50):
        assert abs(value(dd.PI) - mp.pi) < 1e-32
        assert abs(value(dd.HALF_PI) - mp.pi / 2) < 1e-32
    assert dd.sqrt((0.0, 0.0)) == (0.0, 0.0)


@kernel
def products(a, b, out):
    for n in range(a.shape[1]):
        out[n] = dd.convolved(a, b, n)
    out[a.shape[1]] = dd.total(a)
    out[a.shape[1] + 1] = dd.slope(a)


def test_series():
    random = np.random.default_rng(5)
    orders = 30
    high = random.normal(size=(2, orders)) * 10.0 ** random.uniform(-8, 8, (2, orders))
    series = np.stack([high, 0.4 * np.spacing(high) * random.uniform(-1, 1, (2, orders))], axis=1)
    out = np.empty((orders + 2, 2))
    products(series[0], series[1], out)
    with mp.workdps(60):
        a, b = ([value(s[:, n]) for n in range(orders)] for s in series)
        for n in range(orders):
            terms = [a[i] * b[n - i] for i in range(n + 1)]
            assert abs(value(out[n]) - mp.fsum(terms)) <= 2 * PAIR_ROUNDOFF * mp.fsum(
                map(abs, terms)
            )
        for got, terms in ((out[-2], a), (out[-1], [n * v for n, v in enumerate(a)])):
            assert abs(value(got) - mp.fsum(terms)) <= 8 * PAIR_ROUNDOFF * mp.fsum(map(abs, terms))


@kernel
def half_of(row, exact):
    satellite.exactly(row, exact)
    return satellite.half_period(exact)


@pytest.mark.parametrize(
    "short", [1.0 - 1e-9, 0.5, 1e-3, 1e-8, 1e-14, 1e-20, -1e-20, -1e-8, -0.3, -7.0, -1e9]
)
def test_half_period_from_one_minus_k(short):
    """2 K(k), K(1/k) / k to 30 digits: 1 - k is an exact number, however small."""
    row = np.array([0.0, 0.0, 0.0, 0.0, short, satellite.ONE_MINUS_K])
    with mp.workdps(60):
        k = 1 - mpf(short)
        wanted = 2 * mp.ellipk(k**2) if k < 1 else mp.ellipk(1 / k**2) / k
        assert (
            abs(value(half_of(row, np.empty(satellite.EXACTLY))) / wanted - 1) < 16 * PAIR_ROUNDOFF
        )


@pytest.mark.parametrize(
    "amplitude", [0.0, 1e-9, 0.03, 0.8, 1.5, 1.5707963, np.nextafter(np.pi / 2, 0)]
)
def test_half_period_from_the_amplitude(amplitude):
    """2 K(sin amplitude) to 30 digits, also where cos amplitude is 6e-17."""
    row = np.array([0.0, 0.0, 0.0, 0.0, amplitude, satellite.AMPLITUDE])
    with mp.workdps(60):
        wanted = mp.pi / mp.agm(1, mp.cos(mpf(amplitude)))
        assert (
            abs(value(half_of(row, np.empty(satellite.EXACTLY))) / wanted - 1) < 16 * PAIR_ROUNDOFF
        )


def test_both_ways_to_the_error_of_a_product_give_the_same_bits():
    rng, out = np.random.default_rng(3), np.empty((2, 3000))
    x, y = rng.standard_normal((2, 3000)) * 10.0 ** rng.integers(-120, 120, (2, 3000))
    both_errors(x, y, out)
    assert out[0].tobytes() == out[1].tobytes() and (out[0] != 0.0).sum() > 2900
