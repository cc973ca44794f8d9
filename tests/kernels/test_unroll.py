"""Straight code from loops: compiled and plain Python give the same bits, whatever goes in."""

from math import inf, nan

import numpy as np
import pytest

from survey.kernels import unroll as module
from survey.kernels.jit import HAS_FMA, fresh, kernel
from survey.kernels.unroll import (
    both,
    changes_sign,
    consecutive,
    counted,
    first_of,
    fma,
    largest,
    put,
    root,
    selected,
    smallest,
    spread,
    transposed,
    unroll,
)


@unroll
def inner(x, y):
    return largest(abs(x), 0.25) / y


@unroll
def some(table, i, pair, scale, out):
    """Every operation, in both orders, with numbers, loops, lists, tuples, places and another such
    function.
    """
    u, v = pair
    series = [table[0, i], u]
    for n in range(5):
        series.append(sum((series[n - j] * series[j] for j in range(n + 1)), -v) * (1 / (n + 2)))
    out[0, i] = series[-1] - 3.0
    out[1, i] = 2.0 - series[-2] + out[0, i]
    out[2, i] = changes_sign(u, v) + 1
    last = series[3] / (1.0 / scale + 2)
    return last, largest(last, inner(u, v)), 0.5


@kernel
def many(table, us, vs, scale, out):
    for i in range(len(us)):
        out[3, i], out[4, i], out[5, i] = some(table[::2], i, (us[i], vs[i]), scale, out)


def test_compiled_as_plain():
    rng = np.random.default_rng(7)
    special = np.array([0.0, -0.0, 1.0, -1e-310, inf, -inf, nan])
    us, vs = (
        values.ravel() for values in np.meshgrid(special, np.append(special, rng.normal(size=9)))
    )
    table = rng.normal(size=(4, us.size))
    compiled, plain = np.zeros((6, us.size)), np.zeros((6, us.size))
    many(table, us, vs, 0.3, compiled)
    with np.errstate(all="ignore"):
        for i in range(us.size):
            plain[3:, i] = some(table[::2], i, (us[i], vs[i]), np.float64(0.3), plain)
    np.testing.assert_array_equal(compiled, plain)
    zero = compiled == 0
    np.testing.assert_array_equal(np.signbit(compiled[zero]), np.signbit(plain[zero]))
    assert np.isnan(compiled).any() and np.isfinite(compiled).any()


@unroll
def eight(table, row, first, limit, scale, out):
    """Every operation on eight numbers at once, with one number before and behind it."""
    x = consecutive(table, (row, first), 8)
    few = both(x <= limit, -limit <= x)
    y = 2.0 - (abs(x) * scale + largest(x - scale, 0.25)) / (scale + x) - -smallest(x, scale)
    y += root(x)
    y = fma(-x, y, fma(scale, y, x))
    put(out, (row, first), y)
    put(out, (row + 1, first + 1), selected(few, y * scale), few)
    put(out, (0, first), spread(scale * scale, x))
    return counted(few)


@kernel
def of_rows(table, first, limit, scale, out):
    return eight(table, 1, first, limit, scale, out)


@pytest.mark.parametrize("first", [0, 3])
@pytest.mark.parametrize("limit", [-inf, 0.0, 0.3, inf, nan])
def test_several_numbers_compiled_as_plain(first, limit):
    table = np.random.default_rng(3).normal(size=(2, 12))
    table[1, 4:8] = 0.0, -0.0, inf, nan
    compiled, plain = np.zeros((3, 12)), np.zeros((3, 12))
    number = of_rows(table, first, limit, 0.3, compiled)
    with np.errstate(all="ignore"):
        assert number == eight(table, 1, first, limit, 0.3, plain)
    np.testing.assert_array_equal(compiled, plain)
    assert (
        number == (abs(table[1, first : first + 8]) <= limit).sum() == np.count_nonzero(compiled[2])
    )
    assert (
        compiled[1, first : first + 8].any() and (compiled[0, first : first + 8] == 0.3 * 0.3).all()
    )
    assert not np.delete(compiled[:2], np.s_[first : first + 8], axis=1).any()


@pytest.mark.parametrize("fused", [True, False])
def test_multiply_adds_compiled_as_plain(fused, monkeypatch):
    if fused and not HAS_FMA:
        pytest.skip("this processor has no fused multiply-adds")
    monkeypatch.setattr(module, "HAS_FMA", fused)

    @unroll
    def one(a, b, c):
        return fma(a, b, c)

    @fresh
    def all_of(a, b, c, out):
        for i in range(len(a)):
            out[i] = one(a[i], b[i], c[i])

    special = [0.0, -0.0, 1.0, -1e-310, 1e-200, -1e200, 1.7e308, inf, -inf, nan, 1 / 3, -1 / 9]
    a, b, c = (values.ravel() for values in np.meshgrid(special, special, special))
    with np.errstate(all="ignore"):
        left = -(a * b)  # to which once rounded sums add what the product's rounding has lost
    a, b, c = np.tile(a, 2), np.tile(b, 2), np.append(c, left)
    compiled = np.zeros(a.size)
    all_of(a, b, c, compiled)
    with np.errstate(all="ignore"):
        plain = np.array([one(*numbers) for numbers in zip(a, b, c, strict=True)])
    np.testing.assert_array_equal(compiled, plain)
    zero = compiled == 0
    np.testing.assert_array_equal(np.signbit(compiled[zero]), np.signbit(plain[zero]))
    assert np.any(compiled[left.size :][np.isfinite(left)] != 0) == fused


@pytest.mark.parametrize("a", [-1.0, -0.0, 0.0, 2.0])
@pytest.mark.parametrize("b", [-1.0, -0.0, 0.0, 2.0])
def test_words(a, b):
    assert largest(a, b) == max(a, b) and smallest(a, b) == min(a, b)
    assert root(b * b) == abs(b)
    assert changes_sign(a, b) == ((a < 0) != (b < 0))


@unroll
def turned(table, columns, number, out):
    rows = [consecutive(table, (i, columns[i]), 8, first_of(8, number)) for i in range(8)]
    for i, row in enumerate(transposed(rows)):
        put(out, (i, 0), row)
        put(out, (8 + i, columns[i]), row, first_of(8, number))
        put(out, (16 + i, 0), selected(row <= 0.5, row, -1.0))


@fresh
def turned_in_a_kernel(table, columns, number, out):
    turned(table, columns, number, out)


@pytest.mark.parametrize("number", [0.0, 1.0, 3.0, 8.0, 12.0, nan, -1.0])
@pytest.mark.parametrize("columns", [np.arange(8) % 5, np.zeros(8, int)], ids=str)
def test_rows_that_a_mask_reads_and_writes_are_turned(number, columns):
    table = np.random.default_rng(1).normal(size=(8, 12))
    table[2, 5], table[3, 4] = nan, -0.0
    mine, plain = np.zeros((24, 16)), np.zeros((24, 16))
    turned_in_a_kernel(table, columns, number, mine)
    turned(table, columns, number, plain)
    np.testing.assert_array_equal(mine, plain)
    assert (np.signbit(mine) == np.signbit(plain)).all()
    read = np.arange(8) < number
    wanted = np.where(read, [table[i, c : c + 8] for i, c in enumerate(columns)], 0.0).T
    np.testing.assert_array_equal(mine[:8, :8], wanted)
