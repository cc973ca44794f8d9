"""Danby's map from series in both parameters, which are made once a process and hold for every row
and point.

See `survey.kernels.libration.panels`. The values at the nodes are double-doubles, so what a series
leaves out and the roundings of its sum are all of its bar, whatever accuracy is asked: about 1e-14 of
the factors where every step is in float64, 1e-15 where only the sum over s is.
"""

from decimal import Decimal, localcontext
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from survey import waiting
from survey.kernels.libration import danby_double as kernels
from survey.kernels.libration import panels, traces
from survey.kernels.libration.traces import INVARIANTS
from survey.kernels.libration.traces_double import NODES
from survey.kernels.math.chebyshev import TERMS as VECTOR
from survey.kernels.math.chebyshev import lebesgue, tail
from survey.kernels.math.roundoff import EPS, PAIR_ROUNDOFF, PAIR_SUM_ROUNDOFF
from survey.measures.libration.answers import Answers

DIGITS = 40
LEAST = 1e-17  # of the largest coefficient: what is less counts at no single point
PI = "3.14159265358979323846264338327950288419716939937510582097494"
# Orders in y and in 4 s - 3. A sum of T_n(x) c_n rounds its terms, T_n or Clenshaw's sum by n^2 / 2
# EPS, and x, where T_n' <= n^2.
IN_Y = np.arange(panels.TERMS)[:, None]
IN_S = np.arange(traces.NODES)
ROUNDING = EPS * (5.0 + IN_Y + 3.0 * IN_Y**2 + IN_S + 1.1 * IN_S**2)
ROUNDING_IN_S = EPS * (2.0 + IN_S + 1.1 * IN_S**2)
# In double-double n rounds |c_n| up to n + 1 times, each with a weight up to n + 1.
PAIR_ROUNDING = 4.0 * PAIR_ROUNDOFF * np.arange(1.0, NODES + 1) ** 3


class TracePanel(NamedTuple):
    """Series on one panel; bars (5) are what A to t, divided by their growth, may be off."""

    middle: np.ndarray  # see `kernels.libration.panels.position` (4)
    pairs: np.ndarray  # (5, 2, NODES, NODES)
    pairs_bars: np.ndarray
    trimmed: np.ndarray  # those that count in float64 (5, 2, TERMS, NODES of `traces`)
    trimmed_bars: np.ndarray
    series: np.ndarray  # in float64 (5, TERMS, NODES of `traces`)
    lengths: np.ndarray  # how many terms each order in y has that count at a single point (TERMS)
    bars: np.ndarray


@lru_cache(maxsize=64)
def panel(number):
    """The TracePanel of this number."""
    if waiting.other_compiler:  # it compiles the chain, the longest
        _compile_others()
        waiting.wait("chain")
    shapes, weights, middle = nodes(number)
    rates, matrix = tables()
    results = np.empty((NODES**2, kernels.RESULTS))
    kernels.chain(np.repeat(shapes, NODES, axis=0), np.tile(rates, (NODES, 1)), results)
    series, (sizes, bars) = np.empty((INVARIANTS, 2, NODES, NODES)), np.empty((2, INVARIANTS))
    panels.fit(results, matrix, weights, series, sizes, bars)
    magnitudes = abs(series[:, 0])
    in_y, in_s = magnitudes.sum(axis=2), magnitudes.sum(axis=1)
    bars = lebesgue(NODES - 1) ** 2 * (bars + PAIR_SUM_ROUNDOFF * NODES * sizes)
    bars += (PAIR_ROUNDING * (in_y + in_s)).sum(axis=1) + tail(in_y) + tail(in_s)
    trimmed = np.ascontiguousarray(series[:, :, : panels.TERMS, : traces.NODES])
    beyond = magnitudes.copy()
    beyond[:, : panels.TERMS, : traces.NODES] = 0.0
    trimmed_bars = bars + beyond.sum(axis=(1, 2))
    short = np.ascontiguousarray(trimmed[:, 0])
    counts = (abs(short) > LEAST * abs(short).max(axis=(1, 2), keepdims=True)).any(axis=0)
    lengths = -(-np.where(counts, IN_S + 1, 0).max(axis=1) // VECTOR) * VECTOR
    lengths[0] = lengths.max()
    left_out = magnitudes.copy()
    left_out[:, : panels.TERMS, : traces.NODES][:, IN_S < lengths[:, None]] = 0.0
    short_bars = bars + left_out.sum(axis=(1, 2)) + (ROUNDING * abs(short)).sum(axis=(1, 2))
    return TracePanel(middle, series, bars, trimmed, trimmed_bars, short, lengths, short_bars)


def _compile_others():
    """Compile, by calls on nothing, what makes series of values at nodes, and what rows and points call."""
    series, short = (
        np.empty((INVARIANTS, 2, 0, 0)),
        np.empty((INVARIANTS, panels.TERMS, traces.NODES)),
    )
    bars, middle, lengths = np.zeros(INVARIANTS), np.zeros(4), np.zeros(panels.TERMS, np.int64)
    results, answers = np.empty((0, traces.RESULTS)), Answers(0)
    panels.fit(
        np.empty((0, kernels.RESULTS)),
        series[0],
        np.empty((0, 2)),
        series,
        *np.zeros((2, INVARIANTS)),
    )
    none = np.empty(0)
    panels.rows(none, True, middle, series, bars, series[None, :0], np.empty((0, INVARIANTS)))
    panels.points(none, none, True, middle, short, lengths, bars, results)
    answers.assess(results, 0.0)


def rows(e):
    """The series (R, 5, NODES of `traces`) in 4 s - 3 of rows e (R), and bounds of their errors (R, 5).

    They are sums of pairs, rounded: only the sum at each point is left to round.
    """
    sums, bars = _rows(e, "trimmed", traces.NODES)
    series = np.ascontiguousarray(sums[:, :, 0])
    return series, bars + (ROUNDING_IN_S * np.abs(series)).sum(axis=2)


def pairs(e):
    """As `rows`, with all digits: series (R, 5, 2, NODES)."""
    return _rows(e, "pairs", NODES)


def _rows(e, which, size):
    number = np.empty(e.size, dtype=np.int64)
    panels.panels(e, number)
    series, bars = np.empty((e.size, INVARIANTS, 2, size)), np.empty((e.size, INVARIANTS))
    for one in np.unique(number):
        mine, own = np.flatnonzero(number == one), panel(int(one))
        found, found_bars = (np.empty((mine.size, *whole.shape[1:])) for whole in (series, bars))
        given = getattr(own, which), getattr(own, which + "_bars")
        panels.rows(e[mine], one == 0, own.middle, *given, found, found_bars)
        series[mine], bars[mine] = found, found_bars
    return series, bars


def points(e, mu):
    """Results (N, RESULTS of `traces`) of points."""
    number, results = np.empty(e.size, dtype=np.int64), np.empty((e.size, traces.RESULTS))
    panels.panels(e, number)
    for one in np.unique(number):
        mine = np.flatnonzero(number == one)
        found = np.empty((mine.size, traces.RESULTS))
        own = panel(int(one))
        panels.points(
            e[mine], mu[mine], one == 0, own.middle, own.series, own.lengths, own.bars, found
        )
        results[mine] = found
    return results


def nodes(number):
    """1 + e, 1 - e (NODES, 4) and 1 / growth (NODES, 2) at the nodes of a panel, and the same e and
    1 - e (4) in its middle: pairs.
    """
    with localcontext() as context:
        context.prec = DIGITS
        found = []
        for k in range(NODES):
            square = (2 * number + 1 + cosine(2 * k + 1)).exp()  # exp(2 y)
            less = 2 / (1 + square)
            found.append(
                (
                    *pair(square * less),
                    *pair(less),
                    *pair(1 / (square * square if number else square)),
                )
            )
        less = 2 / (1 + Decimal(2 * number + 1).exp())
        middle = np.array([*pair(1 - less), *pair(less)])
    shapes, weights = np.split(np.array(found), [4], axis=1)
    return np.ascontiguousarray(shapes), np.ascontiguousarray(weights), middle


@lru_cache
def tables():
    """The rates at the nodes (NODES, 4), and the matrix that makes coefficients of values (2,
    NODES, NODES).
    """
    with localcontext() as context:
        context.prec = DIGITS
        cosines = [cosine(k) for k in range(4 * NODES)]  # of k pi / (2 NODES)
        at = range(1, 2 * NODES, 2)
        one = Decimal(1)
        # d1, d2 = (3 / 2)(1 +- s), s = (3 + cos) / 4, and 1 - cos without cancellation
        both = [
            (
                *pair((7 + cosines[k]) * 3 / 8),
                *pair((1 - cosines[k]) * 3 / 8 if cosines[k] < one / 2 else _less(k)),
            )
            for k in at
        ]
        matrix = [
            [pair(cosines[k * n % (4 * NODES)] * (2 if n else 1) / NODES) for k in at]
            for n in range(NODES)
        ]
    return np.array(both), np.ascontiguousarray(np.moveaxis(np.array(matrix), 2, 0))


def cosine(k):
    """cos(k pi / (2 NODES)) in decimals, by its series at an angle below pi / 4."""
    k %= 4 * NODES
    if k > 2 * NODES:
        return cosine(4 * NODES - k)
    if k > NODES:
        return -cosine(2 * NODES - k)
    return _sum(k, 0) if 2 * k <= NODES else _sum(NODES - k, 1)


def _less(k):
    """(3 / 8)(1 - cos(k pi / (2 NODES))) = (3 / 4) sin^2 of half the angle."""
    return Decimal("0.75") * _sum(Decimal(k) / 2, 1) ** 2


def _sum(k, first):
    """cos (first 0) or sin (first 1) of k pi / (2 NODES)."""
    x = k * Decimal(PI) / (2 * NODES)
    term = total = x if first else Decimal(1)
    for n in range(first + 2, 60, 2):
        term = -term * x * x / (n * (n - 1))
        total += term
    return total


def pair(number):
    """A number of decimals as a double-double."""
    high = float(number)
    return high, float(number - Decimal(high))
