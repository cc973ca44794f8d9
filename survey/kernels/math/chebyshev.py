"""Chebyshev series: nodes, coefficients from values there, what a series may be wrong by, and its
sums.

The n nodes are those of the first kind, where nothing else is said. Bits of what is kept rest on
how each caller rounds cos(k theta_i), theta_i the angle of node i: so `to_coefficients` takes these
cosines.

Sources: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003), 1.2.1 (the recurrence of
T_k), 4.6 (discrete orthogonality); L. N. Trefethen, Approximation Theory and Approximation Practice
(2013), theorem 15.2.
"""

from functools import cache

import numpy as np

from survey.kernels.jit import HAS_FMA, kernel, splice
from survey.kernels.math.roundoff import EPS
from survey.kernels.unroll import consecutive, fma, put, unroll

# How many rows of a matrix are added at once, and in how many columns.
TERMS = WIDTH = 8
_OF_TERMS = 0.5 if HAS_FMA else 0.75  # see `next_term`


def angles(n):
    """theta_i = (i + 1/2) pi / n of the n nodes cos theta_i."""
    return np.pi * (np.arange(n) + 0.5) / n


def nodes(n):
    """The n nodes, from 1 to -1."""
    return np.cos(angles(n))


def shares(n):
    """The nodes as shares of a range, from its beginning to its end."""
    return 0.5 - 0.5 * nodes(n)


def between(n):
    """The points half way from each node to the next, by angle; the last one twice (n)."""
    return np.cos(np.pi * np.minimum(np.arange(1, n + 1), n - 1) / n)


@cache
def symmetric_nodes(n):
    """As `nodes`, symmetric to the last bit."""
    x = np.sin(np.pi * (n - 1 - 2 * np.arange(n)) / (2 * n))
    return np.concatenate([x[: n // 2], [0.0] * (n % 2), -x[: n // 2][::-1]])


def fastest(share, counts):
    """The largest k / (1 + ln(1 / share)) (N) of coefficients c_k that count (N, m; both), their share of
    the largest: what stands for 1 / distance of a singularity, or a frequency, by angle. Of Fourier's alike.
    """
    number = np.where(counts, np.arange(share.shape[1]) / (1.0 - np.log(share)), 0.0)
    return number.max(axis=1)


def cosines(n):
    """cos(k theta_i) (n, n; [k, i]) of the nodes."""
    return np.cos(np.pi * np.outer(np.arange(n), np.arange(n) + 0.5) / n)


def to_coefficients(cosines):
    """The matrix (n, n; [k, i]) from values at n nodes to coefficients of T_k, from cos(k theta_i)."""
    matrix = 2 / len(cosines) * cosines
    matrix[0] /= 2
    return matrix


@cache
def by_columns(n):
    """As `to_coefficients`, transposed: from value i, the first index, to coefficient k."""
    return to_coefficients(
        np.cos(np.pi * np.arange(n)[:, None] * (2 * np.arange(n) + 1) / (2 * n))
    ).T


@cache
def odd_columns(half):
    """As `by_columns` of odd functions, from values at the first `half` nodes to the coefficients
    of T_{2k+1}.
    """
    theta, k = np.pi * (2 * np.arange(half) + 1) / (4 * half), 2 * np.arange(half) + 1
    return 2 / half * np.cos(theta[:, None] * k)


@cache
def with_ends(n):
    """The n points of the second kind as shares of a range, both ends among them."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(n) / (n - 1))


@cache
def by_columns_with_ends(n):
    """As `by_columns`, from values at points of the second kind; the first coefficient and the last
    are twice as large.
    """
    i, k = np.arange(n)[:, None], np.arange(n)
    weight = np.where((i == 0) | (i == n - 1), 1.0, 2.0)
    return weight * np.cos(np.pi * ((i * k) % (2 * n - 2)) / (n - 1)) / (n - 1)


def lebesgue(degree):
    """Bound of the Lebesgue constant of interpolation of this degree, or a lower one (Trefethen,
    theorem 15.2).
    """
    return 2 / np.pi * np.log(degree + 1) + 1


def lagrange(x, n):
    """Magnitudes (n, R) of the Lagrange polynomials of the n nodes at x (R), rounded up.

    That of node i is sin(theta_i) T_n(x) / (n (x - x_i)), at most sqrt 2 (Fejer). T_n is known to
    within 4 n EPS.
    """
    theta, clipped = angles(n)[:, None], np.clip(x, -1.0, 1.0)
    with np.errstate(divide="ignore"):
        sizes = abs(np.cos(n * np.arccos(clipped))) * (np.sin(theta) / n) + 6 * EPS
        sizes /= abs(clipped - np.cos(theta))
    return np.minimum(sizes, np.sqrt(2.0), out=sizes)


@cache
def largest_lagrange(n, parts):
    """Bounds (parts n, n) of the magnitudes of the Lagrange polynomials of n nodes on parts of [-1,
    1].

    Node i is in the middle of the parts from parts i on; in the angle all parts are equal. Between
    samples of the angle a polynomial exceeds them by d^2 / 8 times its second derivative, at most
    n^2 sqrt 2 (Bernstein; Fejer).
    """
    samples = 16
    angles = np.linspace(0.0, np.pi, n * parts * samples + 1)
    sizes = abs(np.cos(angles[:, None] * np.arange(n)) @ by_columns(n).T)
    within = [sizes[k : k - samples or None : samples] for k in range(samples + 1)]
    beyond = (np.pi / (parts * samples)) ** 2 / 8 * np.sqrt(2.0)
    return np.max([part[: n * parts] for part in within], axis=0) + beyond + 1e-12


def combined(values, matrix):
    """values (R, n) times `matrix` (n, m; [from, to]), summed so that a row's bits do not depend on
    the others.
    """
    out = np.zeros((len(values), matrix.shape[1]))
    _combine(np.ascontiguousarray(values), np.ascontiguousarray(matrix), out)
    return out


@kernel
def _combine(values, matrix, out):
    for r in range(len(values)):
        add(values[r], matrix, out[r])


@splice
def add(c, rows, sums):
    """Add sum_k c[k] rows[k] to `sums`, the last term first, TERMS of them at once; none of `sums`
    depends on the others.
    """
    whole = len(sums) - len(sums) % WIDTH
    add_turns(c, rows, sums, whole)
    for k in range(len(c) - 1, -1, -1):
        for i in range(0 if k < len(c) % TERMS else whole, len(sums)):
            sums[i] = _one_more(c[k], rows[k, i], sums[i])


@splice
def add_turns(c, rows, sums, count):
    """Add the terms from c[len(c) % TERMS] on, in the first `count` sums, and in those up to a multiple of WIDTH."""
    for k in range(len(c) - TERMS, -1, -TERMS):
        own = (c[k], c[k + 1], c[k + 2], c[k + 3], c[k + 4], c[k + 5], c[k + 6], c[k + 7])
        for i in range(0, count, WIDTH):
            _add_several(own, rows, k, sums, i)


@splice
def sum_turns(c, rows, sums, count):
    """sum_k c[k] rows[k] in the first `count` of `sums`, and in those up to a multiple of WIDTH; c has a
    multiple of TERMS terms.
    """
    for i in range(len(sums)):
        sums[i] = 0.0
    add_turns(c, rows, sums, count)


@unroll
def _add_several(c, rows, first, sums, i):
    """Add TERMS numbers c times as many rows, from the `first` on, to WIDTH `sums` from i on; the
    last one first.
    """
    total = consecutive(sums, (i,), WIDTH)
    for k in reversed(range(TERMS)):
        total = fma(c[k], consecutive(rows, (first + k, i), WIDTH), total)
    put(sums, (i,), total)


@unroll
def _one_more(c, x, total):
    return fma(c, x, total)


def expand(values, matrix, ulps):
    """The series of each row of `values` (R, n) at nodes, by `matrix` (n, n; [from, to]), and its
    `_doubt` (R).
    """
    series = combined(values, matrix)
    return series, _doubt(np.abs(series), ulps)


def transform(rows, matrix, ulps):
    """Coefficients (n, m) along the first axis of `rows`, values at nodes, by `matrix` (n, n;
    [from, to]), and the `_doubt` (a number) of their sums over the columns.
    """
    series = combined(matrix.T, rows)
    return series, float(_doubt(np.abs(series).sum(axis=1)[None], ulps)[0])


def tail(sizes):
    """What series with coefficients of these sizes (..., n) leave out and fold back, from the rate
    of their decay.
    """
    return _left_out(sizes.reshape(-1, sizes.shape[-1]), 0.0)[0].reshape(sizes.shape[:-1])


def _doubt(sizes, ulps):
    """`tail` and rounding of such series (R, n), whose argument on [-1, 1] is known to within
    `ulps` ulp.

    Rounding is that of the transform, of T_k (see `next_term`) and the sum, and of the argument, where
    T_k' <= k^2.
    """
    tails, rounding = _left_out(sizes, ulps)
    return tails + EPS * rounding


def _left_out(sizes, ulps):
    out = np.empty((2, len(sizes)))
    _doubts(np.ascontiguousarray(sizes), ulps, out)
    return out


@kernel
def _doubts(sizes, ulps, out):
    """`tail` of each row, and in ulps the rounding that `_doubt` adds."""
    n = sizes.shape[1]
    for r in range(len(sizes)):
        last = before = rounding = 0.0
        for k in range(max(n - 8, 0), n):
            size = sizes[r, k]
            if k < n - 4:
                before = before if size <= before or before != before else size  # NaN stays
            else:
                last = last if size <= last or last != last else size
        for k in range(n):
            rounding += sizes[r, k] * (4.0 + k + (_OF_TERMS + ulps) * k * k)
        rate = min(max(last / (before + 1e-300), 0.1), 0.9)
        out[0, r] = 4.0 * last / (1.0 - rate)
        out[1, r] = rounding


@kernel
def restrict(series, x, out):
    """out[r] = sum_k series[k] T_k(x[r]): the rows' own coefficients."""
    t = np.empty(len(series))
    for r in range(len(x)):
        for k in range(len(t)):
            t[k] = next_term(2.0 * x[r], t[k - 1], t[k - 2]) if k > 1 else x[r] if k == 1 else 1.0
        for i in range(out.shape[1]):
            out[r, i] = 0.0
        add(t, series, out[r])


@unroll
def next_term(twice, last, before):
    """T_k from the two before; with those within k^2 EPS / 4, or 3/4 where a b + c is rounded twice."""
    return fma(twice, last, -before)
