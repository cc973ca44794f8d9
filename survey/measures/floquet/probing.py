"""How fast A(t) varies where a few samples cannot tell: spikes, whose tails underflow in the series
of other steps.

A step's Taylor series sees a pole from afar, but not exp(-x^2) from x = 10 on, nor cos^200 at its
zeros. So basis functions that may hide such a spike are sampled densely; products of a few sines
and cosines of lines cannot.
"""

import numpy as np

from survey.kernels.floquet import program as pg
from survey.kernels.math import chebyshev

# The width at half height, as a share of the period, from which a spike is seen; Chebyshev points
# of each piece, which lie closer than that; and those when a scene is checked.
WIDTH, NUMBER, CHECKED = 1 / 128, 256, 16384
WAVES = tuple(pg.CODES[name] + pg.OF_LINE for name in ("sin", "cos"))
# sines and cosines of lines, multiplied with each other: their series of order 16 show them
SIMPLE = 4
RESOLVED = 1e-12  # relative to the largest Chebyshev coefficient: smaller ones do not count
AT_ONCE = 64  # points that are sampled together: their arrays stay in the cache
HARMLESS = 1e-16  # what an entry of A, in balanced units, may change by over a piece
SEEN = 2.0  # a rate this many times that of fewer samples takes its place


def suspects(program):
    """The basis functions of the entries that may hide a spike."""
    degree = {}

    def visit(node):
        if node not in degree:
            code, a, b, first, last = program.operations[node]
            if code == pg.COMBINATION:
                degree[node] = max(
                    (visit(int(k)) for k in program.inside[first:last, pg.ADDED]), default=0
                )
            elif code == pg.PRODUCT:
                degree[node] = visit(int(a)) + visit(int(b))
            else:
                simple = code in (pg.ONE, pg.TIME, *WAVES)
                degree[node] = int(code != pg.ONE) if simple else np.inf
        return degree[node]

    return [int(node) for node in program.used if visit(int(node)) > SIMPLE]


def rates(program, numbers, low, high, scale, number=NUMBER):
    """As `kernels.floquet.sizes.measure`, of each suspect between `low` and `high` (N, 1):
    (suspects, N), NaN where not finite. `scale` (N, n) are the units of the states that balance A.
    """
    nodes = suspects(program)
    if not nodes:
        return np.zeros((0, len(low)))
    found = np.empty((len(nodes), len(low)))
    for first in range(0, len(low), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        own = [values[some] for values in numbers]
        found[:, some] = _rates(program, nodes, own, low[some], high[some], scale[some], number)
    return found


def _rates(program, nodes, numbers, low, high, scale, number):
    """`rates` of some points."""
    if (low == low[0]).all() and (high == high[0]).all():  # what depends on t alone is sampled once
        low, high = low[:1], high[:1]
    t = low + (high - low) * chebyshev.shares(number)
    found = np.zeros((len(nodes), len(scale)))
    for k, (values, bars) in enumerate(_values(program, numbers, t, nodes)):
        c = (
            abs(np.fft.rfft(np.concatenate([values, values[:, ::-1]], axis=1), axis=1)[:, :number])
            / number
        )
        terms = program.terms[program.terms[:, pg.BASIS] == nodes[k]]
        with np.errstate(all="ignore"):
            share = c / c.max(axis=1, keepdims=True)
            ratio = scale[:, terms[:, pg.COLUMN]] / scale[:, terms[:, pg.ROW]]
            entries = abs(numbers[0][:, terms[:, pg.NUMBER]] * ratio)
            counts = (share > RESOLVED) & (c > bars.max(axis=1, keepdims=True))
            counts &= c * entries.max(axis=1, keepdims=True) * (high - low) > HARMLESS
            rate = 2.0 * np.where(counts, np.arange(number) / (1.0 - np.log(share)), 0.0).max(
                axis=1
            )
        found[k] = np.where(np.isfinite(c).all(axis=1), rate, np.nan)
    return found


def combined(few, *given):
    """The rates (N) by a few samples, or those by many where these are much higher; `given` as `rates`."""
    many = rates(*given)
    return (
        np.where(many > SEEN * few, many, few + 0.0 * many).max(axis=0, initial=0.0)
        if len(many)
        else few
    )


def spikes(points):
    """Where far more samples show a spike than those of a run (N; NaN: nowhere), of `monodromy.SystemPoints`."""
    found = np.full(len(points.points), np.nan)
    for group in points.groups:
        own = group.own
        scale = points.scale[own]
        for piece, program in enumerate(group.programs):
            given = (
                program.numbers(points.points[own]),
                *(points.edges[own, k, None] for k in (piece, piece + 1)),
            )
            one, fine = (rates(program, *given, scale, number) for number in (NUMBER, CHECKED))
            t = given[1] + (given[2] - given[1]) * (np.arange(CHECKED) + 0.5) / CHECKED
            for k, (values, _bars) in enumerate(_values(program, given[0], t, suspects(program))):
                hidden = np.flatnonzero(fine[k] > SEEN * np.maximum(one[k], 2.0))
                found[own[hidden]] = t[
                    hidden, 3 + abs(np.diff(values[hidden], 6, axis=1)).argmax(axis=1)
                ]
    return found


def _values(program, numbers, t, nodes):
    """Yield the values (N, m) of these basis functions at the times t (N or 1, m), and their error bounds."""
    shape = len(numbers[0]), t.shape[1]
    for values, bars in program.series(numbers, t, nodes).values():
        yield np.broadcast_to(values, shape), np.broadcast_to(bars, shape)
