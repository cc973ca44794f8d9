"""Folds of edge curves: places where F = 0 and dF/dp = 0, so that two edges of a row meet and vanish.

On a short panel of p about a curve's turn, F(q, .) is its Chebyshev series to rounding. Its stationary value g(q) there
is analytic with a simple zero at the fold, which is closed in by certain signs of g. The place in p is where the
series' derivative vanishes; its error bar is that of the derivative (Bernstein's inequality) over the second one.

Sources: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3 and 15;
P. Borwein, T. Erdelyi, Polynomials and Polynomial Inequalities (1995), section 5.1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from survey.measures.hill_curves import LONGEST
from survey.measures.hill_edges import FACTORS, close_in, of_kind

NODES = 16
LEBESGUE = 2 / np.pi * np.log(NODES + 1) + 1
X = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
TO_SERIES = 2 / NODES * np.cos(np.pi * np.outer(np.arange(NODES), np.arange(NODES) + 0.5) / NODES)
TO_SERIES[0] /= 2
ROUNDS = 12
EPS = 2.3e-16


@dataclass
class Folds:
    """`curve` of each fold, its place `x` (m, 2) in the square and the `error` (m, 2) of both coordinates."""

    curve: np.ndarray
    x: np.ndarray
    error: np.ndarray


def find(solve, square, curves):
    """The Folds of the curves (see `hill_curves.trace`), in the order in which the curves pass them."""
    whose = np.repeat(np.arange(curves.count.size), curves.count)
    slope = curves.along[:, 0]
    at = np.flatnonzero((np.diff(whose) == 0) & ((slope[1:] > 0) != (slope[:-1] > 0)))
    if not at.size:
        return Folds(at, np.zeros((0, 2)), np.zeros((0, 2)))
    share = (slope[at] / (slope[at] - slope[at + 1]))[:, None]
    guess = (1 - share) * curves.x[at] + share * curves.x[at + 1]
    radius = np.clip(np.hypot(*(curves.x[at + 1] - curves.x[at]).T), 1e-4 * LONGEST, LONGEST)
    kind, middle = curves.kind[whose[at]], np.clip(guess[:, 1], radius, 1 - radius)

    def stationary(who, q):
        """(x, value, its bar, bar of x) where F(q, .) is stationary on each panel, x from -1 to 1; q is (m, n)."""
        p = middle[who][:, None] + radius[who][:, None] * X
        places = square.places(np.stack(np.broadcast_arrays(q[..., None], p[:, None]), axis=-1))
        out = solve(places[..., 0, 0].reshape(-1, 1), places[..., 1].reshape(-1, NODES), FACTORS)
        f, bar = of_kind({name: values.reshape(*q.shape, NODES) for name, values in out.items()}, kind[who])
        return _stationary(f, bar)

    q, width, sure = close_in(
        lambda who, q: stationary(who, q)[1:3], guess[:, 0], 1e-3 * radius, np.full(at.size, square.grain)
    )
    x, _, _, off = stationary(np.arange(at.size), q[:, None] + width[:, None] * np.array([-1.0, 0.0, 1.0]))
    p = middle + radius * x[:, 1]
    error = radius * (off.max(axis=1) + np.ptp(x, axis=1)) + square.grain
    good = sure & (abs(x) < 1).all(axis=1)
    places, errors = np.stack([q, p], axis=1), np.stack([width + square.grain, error], axis=1)
    return Folds(whose[at][good], places[good], errors[good])


def _stationary(f, bar):
    """Where the series through f (..., NODES) is stationary: (x, value, bar of the value, bar of x), x in [-1, 1]."""
    series = f @ TO_SERIES.T
    bar = LEBESGUE * bar.max(axis=-1) + 2 * abs(series[..., -2:]).sum(axis=-1) + 4 * EPS * abs(series).sum(axis=-1)
    columns = np.moveaxis(series, -1, 0)
    first, second = chebyshev.chebder(columns), chebyshev.chebder(columns, 2)
    x = np.zeros(bar.shape)
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS):
            x = np.clip(x - _value(x, first) / _value(x, second), -1, 1)
        # |s'| <= (n - 1) max|s| / sqrt(1 - x^2) for the error's polynomial s
        off = NODES * bar / np.sqrt(1 - x**2) / abs(_value(x, second))
    return x, _value(x, columns), bar, off


def _value(x, columns):
    return chebyshev.chebval(x, columns, tensor=False)
