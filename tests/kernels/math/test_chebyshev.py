"""Chebyshev series: exact coefficients, the Lebesgue constant, tails of a series that is known."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev as known

from survey.kernels.math import chebyshev


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


@pytest.mark.parametrize("rows", [1, 7])
def test_sums_of_rows_are_in_the_order_of_their_terms(rows):
    """The bits of a row depend on no other row, nor on how many there are."""
    rng = np.random.default_rng(5)
    values, matrix = rng.normal(size=(rows, 13)), rng.normal(size=(13, 10)).T.copy().T
    wanted = np.zeros((rows, 10))
    for i in range(13):
        wanted += values[:, i, None] * matrix[i]
    np.testing.assert_array_equal(chebyshev.combined(values, matrix), wanted)
    np.testing.assert_array_equal(chebyshev.combined(values[:1], matrix), wanted[:1])
