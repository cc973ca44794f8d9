"""Chebyshev series: exact coefficients, the Lebesgue constant, tails of a series that is known."""

import mpmath
import numpy as np
import pytest
from numpy.polynomial import chebyshev as known

from survey.kernels.math import chebyshev
from survey.kernels.math.roundoff import EPS, ROUNDOFF


@pytest.mark.parametrize("n", [4, 9, 16, 33])
def test_nodes_and_coefficients(n):
    assert abs(chebyshev.nodes(n) - known.chebpts1(n)[::-1]).max() < 1e-15
    symmetric = chebyshev.symmetric_nodes(n)
    assert (symmetric == -symmetric[::-1]).all() and abs(
        symmetric - chebyshev.nodes(n)
    ).max() < 1e-15
    series = np.random.default_rng(n).normal(size=n)
    values = known.chebval(chebyshev.nodes(n), series)
    assert chebyshev.to_coefficients(chebyshev.cosines(n)) @ values == pytest.approx(
        series, abs=1e-13
    )
    assert values @ chebyshev.by_columns(n) == pytest.approx(series, abs=1e-13)
    found, doubt = chebyshev.expand(values[None], chebyshev.by_columns(n), 1.0)
    assert (abs(found - series).sum() <= doubt).all()


@pytest.mark.parametrize("n", [4, 16, 64])
def test_the_lebesgue_constant_is_bounded(n):
    x = np.linspace(-1, 1, 4001)
    basis = known.chebval(x, chebyshev.to_coefficients(chebyshev.cosines(n)))
    largest = abs(basis).sum(axis=0).max()
    assert largest <= chebyshev.lebesgue(n - 1) <= 1.3 * largest


def test_the_tail_holds_what_a_series_leaves_out():
    for rate in (0.3, 0.6, 0.85):
        sizes = rate ** np.arange(200.0)
        for n in (8, 16, 32):
            assert chebyshev.tail(sizes[:n]) >= sizes[n:].sum()


@pytest.mark.parametrize("at", range(8))
def test_the_tail_of_what_is_unknown_is_unknown(at):
    sizes = np.full((3, 8), 1e-3)
    sizes[1, at] = np.nan
    assert np.isnan(chebyshev.tail(sizes)).tolist() == [False, True, False]


@pytest.mark.parametrize("terms", [5, 8, 29])
@pytest.mark.parametrize("columns", [3, 8, 21])
def test_the_bits_of_a_sum_depend_on_no_other(terms, columns):
    rng = np.random.default_rng(terms)
    values, matrix = rng.normal(size=(7, terms)), rng.normal(size=(columns, terms)).T
    found = chebyshev.combined(values, matrix)
    off, sizes = found - values @ matrix, abs(values) @ abs(matrix)
    assert (abs(off) <= 2 * terms * ROUNDOFF * sizes).all()
    np.testing.assert_array_equal(chebyshev.combined(values[3:4], matrix), found[3:4])
    np.testing.assert_array_equal(chebyshev.combined(values, matrix[:, 1:3]), found[:, 1:3])


@pytest.mark.parametrize("terms", [1, 2, 16, 44])
def test_a_surface_is_restricted_to_rows(terms):
    rng = np.random.default_rng(terms)
    series, x = rng.normal(size=(terms, 13)), np.r_[-1.0, 1.0, 0.0, rng.uniform(-1, 1, 5)]
    rows = np.empty((x.size, 13))
    chebyshev.restrict(series, x, rows)
    with mpmath.workdps(30):
        for row, at in zip(rows, x, strict=True):
            polynomials = [mpmath.chebyt(k, mpmath.mpf(float(at))) for k in range(terms)]
            for found, column in zip(row, series.T, strict=True):
                wanted = mpmath.fsum(
                    mpmath.mpf(float(c)) * t for c, t in zip(column, polynomials, strict=True)
                )
                k = np.arange(terms)
                assert abs(wanted - found) <= EPS * (abs(column) * (4 + k + 0.25 * k * k)).sum()
