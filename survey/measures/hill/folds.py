"""Folds of edge curves: points where F = 0 and dF/dp = 0, so that two edges of a row meet and
vanish.

On a short panel of p about a curve's turn, F(q, .) is its Chebyshev series to rounding. Its
stationary value g(q) there is analytic with a simple zero at the fold, which is bracketed by
certain signs of g. Its p is where the derivative of the series vanishes; its error bound is that of
the derivative (Bernstein's inequality) over the second derivative.

Sources: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3 and 15;
P. Borwein, T. Erdelyi, Polynomials and Polynomial Inequalities (1995), section 5.1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from survey.kernels.math.chebyshev import cosines, lebesgue, nodes, to_coefficients
from survey.kernels.math.roundoff import EPS
from survey.measures.hill.curves import LONGEST
from survey.measures.hill.edges import FACTORS, close_in, of_kind

NODES = 16
LEBESGUE = lebesgue(NODES)
X = nodes(NODES)
TO_SERIES = to_coefficients(cosines(NODES))
ROUNDS = 12
WIDER = (1, 4, 16)  # panels: times the step at the turn


@dataclass
class Folds:
    """`curve` of each fold, its position `x` (m, 2) in the square and the `error` (m, 2) of both
    coordinates.
    """

    curve: np.ndarray
    x: np.ndarray
    error: np.ndarray


def find(solve, square, curves):
    """The Folds of the curves (see `curves.trace`), in the order in which the curves pass them."""
    whose = np.repeat(np.arange(curves.count.size), curves.count)
    slope = curves.along[:, 0]
    at = np.flatnonzero((np.diff(whose) == 0) & ((slope[1:] > 0) != (slope[:-1] > 0)))
    if not at.size:
        return Folds(at, np.zeros((0, 2)), np.zeros((0, 2)))
    share = (slope[at] / (slope[at] - slope[at + 1]))[:, None]
    guess = (1 - share) * curves.x[at] + share * curves.x[at + 1]
    radius = np.clip(np.hypot(*(curves.x[at + 1] - curves.x[at]).T), 1e-4 * LONGEST, LONGEST)
    kind = curves.kind[whose[at]]

    def stationary(which, q, start, wider=1):
        """(p, value, its bound, bound of p) where F(q, .) is stationary near p = start (m), on each
        panel; q (m, n).
        """
        half = np.minimum(wider * radius[which], 0.5)
        middle = np.clip(start, half, 1 - half)
        p = (middle[:, None] + half[:, None] * X)[:, None]
        here = square.parameters(np.stack(np.broadcast_arrays(q[..., None], p), axis=-1))
        out = solve(here[..., 0, 0].reshape(-1, 1), here[..., 1].reshape(-1, NODES), FACTORS)
        f, bar = of_kind(
            {name: values.reshape(*q.shape, NODES) for name, values in out.items()}, kind[which]
        )
        x, value, bar, off = _stationary(f, bar, ((start - middle) / half)[:, None])
        return (
            middle[:, None] + half[:, None] * x,
            value,
            bar,
            np.where(abs(x) < 1, half[:, None] * off, np.inf),
        )

    q, width, sure = close_in(
        lambda which, q: stationary(which, q, guess[which, 1])[1:3],
        guess[:, 0],
        1e-3 * radius,
        np.full(at.size, square.grain),
    )
    sides = q[:, None] + width[:, None] * np.array([-1.0, 0.0, 1.0])
    p, error = guess[:, 1], np.full(at.size, np.inf)
    # the series' derivative is sharper on a longer panel, as long as the series converges
    for wider in WIDER:
        new, _, _, off = stationary(np.arange(at.size), sides, p, wider)
        off = off.max(axis=1) + np.ptp(new, axis=1) + square.grain
        better = (off < error) & (abs(new[:, 1] - p) <= error + off)  # not another stationary point
        p, error = np.where(better, new[:, 1], p), np.where(better, off, error)
    good = sure & np.isfinite(error)
    x, errors = np.stack([q, p], axis=1), np.stack([width + square.grain, error], axis=1)
    return Folds(whose[at][good], x[good], errors[good])


def _stationary(f, bar, x):
    """Where the series through f (..., NODES) is stationary near x: (x, value, its bound, bound of
    x), x in [-1, 1].
    """
    series = f @ TO_SERIES.T
    bar = (
        LEBESGUE * bar.max(axis=-1)
        + 2 * abs(series[..., -2:]).sum(axis=-1)
        + 4 * EPS * abs(series).sum(axis=-1)
    )
    columns = np.moveaxis(series, -1, 0)
    first, second = chebyshev.chebder(columns), chebyshev.chebder(columns, 2)
    x = x + np.zeros(bar.shape)
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS):
            x = np.clip(x - _value(x, first) / _value(x, second), -1, 1)
        # |s'| <= (n - 1) max|s| / sqrt(1 - x^2) for the error's polynomial s
        off = NODES * bar / np.sqrt(1 - x**2) / abs(_value(x, second))
    return x, _value(x, columns), bar, off


def _value(x, columns):
    return chebyshev.chebval(x, columns, tensor=False)
