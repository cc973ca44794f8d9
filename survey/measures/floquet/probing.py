"""How fast A(t) varies where a few samples cannot tell: spikes, whose tails underflow in the series
of other steps.

A step's Taylor series sees a pole from afar, but not exp(-x^2) from x = 10 on, nor cos^200 at its
zeros. So basis functions that may hide such a spike are sampled densely; products of a few sines
and cosines of lines, and of states, cannot. Chebyshev coefficients tell how fast a function varies,
but of a spike at an end of the interval too little, as the square root of their number resolves it
there: next to the ends differences tell.
"""

import math
from functools import lru_cache

import numpy as np

from survey.kernels.floquet import program as pg
from survey.kernels.math import chebyshev

# The width at half height, as a share of the period, from which a spike is seen; Chebyshev points
# of each piece, which lie closer than that; and those when a scene is checked.
WIDTH, NUMBER, CHECKED = 1 / 128, 256, 16384
WAVES_OF_ANY = tuple(pg.CODES[name] for name in ("sin", "cos"))
WAVES = tuple(code + pg.OF_LINE for code in WAVES_OF_ANY)
# sines and cosines of lines, multiplied with each other: their series of order 16 show them
SIMPLE = 4
RESOLVED = 1e-12  # relative to the largest Chebyshev coefficient: smaller ones do not count
AT_ONCE = 64  # points that are sampled together: their arrays stay in the cache
HARMLESS = 1e-16  # what an entry of A, in balanced units, may change by over a piece
ENDS = 1 / 8  # of the interval: so far from its ends differences count
ORDER = 4  # of differences
# (max |f''''| / 24 max |f|)^(1/4) times this is the rate: half of what a Gaussian's coefficients show
OF_DIFFERENCES = 0.6
BY_RATE = 0.6  # what a step may span of 1 / rate, relative to the reach
SEEN = 2.0  # a rate this many times that of fewer samples takes its place


def suspects(program):
    """The basis functions of the entries that may hide a spike."""
    known = _degrees(program)
    return [int(node) for node in program.used if known[int(node)][0] > SIMPLE]


@lru_cache(maxsize=64)
def _degrees(program):
    """{node: (of how many waves or states it is a product, does it depend on a state?)} of the basis
    functions of the entries and of those that they are made of.
    """
    known = {}
    for node in program.needed(program.used):
        code, a, b, first, last = program.operations[node]
        if code == pg.COMBINATION:
            inside = [known[int(k)] for k in program.inside[first:last, pg.ADDED]]
            degree = max((one for one, _ in inside), default=0)
        elif code == pg.PRODUCT:
            inside = [known[int(a)], known[int(b)]]
            degree = sum(one for one, _ in inside)
        elif code in (pg.ONE, pg.TIME, pg.STATE, *WAVES):
            inside, degree = [], int(code != pg.ONE)
        else:
            inside = [known[int(k)] for k in ((a, b) if code == pg.QUOTIENT else (a,))]
            wave = code in WAVES_OF_ANY and inside[0][0] <= 1
            degree = 1 if wave else np.inf
        known[node] = degree, code == pg.STATE or any(of_state for _, of_state in inside)
    return known


def longest_steps(program, numbers, span, reach):
    """The longest steps (N) that see every spike, between 0 and `span` (N), of what depends on t
    alone in the f of x' = f(t, x); infinite where nothing may hide one.
    """
    known, found = _degrees(program), np.full(len(span), np.inf)
    nodes = [k for k, (degree, of_state) in known.items() if degree > SIMPLE and not of_state]
    if not nodes:
        return found
    for first in range(0, len(span), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        own, end = [values[some] for values in numbers], span[some, None]
        t, spacing = _times(0.0 * end, end, NUMBER)
        all_of_it = np.full(len(end), np.inf)
        rates = [
            _rate(values, NUMBER, spacing, bars.max(axis=1), all_of_it)
            for values, bars in _values(program, own, t, nodes)
        ]
        fastest = np.nan_to_num(np.max(rates, axis=0), nan=0.0)
        with np.errstate(divide="ignore"):
            found[some] = reach * span[some] / (BY_RATE * fastest)
    return found


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
    t, spacing = _times(low, high, number)
    found = np.zeros((len(nodes), len(scale)))
    for k, (values, bars) in enumerate(_values(program, numbers, t, nodes)):
        terms = program.terms[program.terms[:, pg.BASIS] == nodes[k]]
        with np.errstate(all="ignore"):
            ratio = scale[:, terms[:, pg.COLUMN]] / scale[:, terms[:, pg.ROW]]
            entries = abs(numbers[0][:, terms[:, pg.NUMBER]] * ratio)
        change = entries.max(axis=1) * (high - low)[:, 0]
        found[k] = _rate(values, number, spacing, bars.max(axis=1), change)
    return found


def _times(low, high, number):
    """Times (N, m) between `low` and `high` (N, 1): `number` Chebyshev points, then evenly spaced ones
    next to each end, not at an end itself, where A may be infinite; and their spacing as a share.
    """
    spacing = 4 * ENDS / number  # closer than the Chebyshev points in the middle
    beside = (np.arange(number // 4) + 0.5) * spacing
    shares = np.concatenate([chebyshev.shares(number), beside, 1.0 - beside])
    return low + (high - low) * shares, spacing


def _rate(values, number, spacing, bar, change):
    """The rate (N) of functions from their values at `_times`, which have an error bound and `change`
    A over the interval by so much times themselves (N).
    """
    with np.errstate(all="ignore"):
        return np.maximum(
            _rate_by_coefficients(values[:, :number], bar, change),
            _rate_by_differences(values, number, spacing, bar, change),
        )


def _rate_by_coefficients(values, bar, change):
    """The rate (N), from the values at Chebyshev points."""
    number = values.shape[1]
    mirrored = np.concatenate([values, values[:, ::-1]], axis=1)
    c = abs(np.fft.rfft(mirrored, axis=1)[:, :number]) / number
    share = c / c.max(axis=1, keepdims=True)
    counts = _counts(c, share, bar[:, None], change[:, None])
    rate = 2.0 * chebyshev.fastest(share, counts)
    return np.where(np.isfinite(c).all(axis=1), rate, np.nan)


def _rate_by_differences(values, number, spacing, bar, change):
    """The rate (N) next to both ends, from the values there, behind the first `number`."""
    beside = values[:, number:].reshape(len(values), 2, -1)
    steep = abs(np.diff(beside, ORDER)).max(axis=(1, 2)) / 2**ORDER  # at most the largest value
    share = steep / abs(values).max(axis=1)
    rate = OF_DIFFERENCES / spacing * (share * (2**ORDER / math.factorial(ORDER))) ** (1 / ORDER)
    rate = np.where(_counts(steep, share, bar, change), rate, 0.0)
    return np.where(np.isfinite(steep), rate, np.nan)


def _counts(size, share, bar, change):
    """Which parts of a function, by their size and their share of the largest, are no rounding and
    matter.
    """
    return (share > RESOLVED) & (size > bar) & (size * change > HARMLESS)


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
