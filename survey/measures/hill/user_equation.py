"""A user's z(u, p) as a Hill problem: every point a row of its own, and what its steps need
measured from z itself.

z is sampled at Chebyshev points on each piece between its breaks. From the coefficients c_k on a
piece of length 2 L:

    rate    max over k of (k / L) / (1 + ln(max |c| / |c_k|)): 1 / distance of the nearest singularity where c_k falls
            geometrically, the highest frequency that matters where z is entire
    noise   what does not fall: the rounding of z and of u, and what is too fine to be resolved

The noise enters the bounds: z is passed on as (z - B) + B, so that its rounding counts relative to B >= max |z|, and
B is as large as the noise asks. All depends on the point alone.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3, 7 and
8.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from math import inf, isfinite, log, sqrt
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from survey.kernels.hill import dop853, sampled_double
from survey.kernels.hill.answers import SQUARES
from survey.kernels.jit import fresh, inline, kernel
from survey.kernels.lanes import RESULTS
from survey.kernels.math import chebyshev
from survey.measures.hill import bands, monodromy, multiprecision, pointwise

SIZES = (65, 513, 4097)
# Evenly spread points of the part that is solved at which z is probed, however smooth it seems;
# those when a scene is checked; and the least number between two breaks. All but the fewest
# Chebyshev points lie closer than PROBES.
PROBES, CHECKED, LEAST_PROBES = 128, 16384, 8
# Relative to max |z|: z is resolved where its last coefficients are below the first, rough where above the second.
RESOLVED, ROUGH = 1e-14, 1e-8
# An even z may differ from its mirror image by this much, which then counts as noise.
MIRRORED = 1e-8
# What the bars of every method allow at least for the rounding of z, relative to B.
ROUNDING = 8.8e-16
# z is asked for no nearer to a break than this share of the period: rounding decides there on which
# side.
SLACK = 2.0**-50
# Steps are distributed by rate, and by frequency at this share of it.
BY_PHASE = 0.15
# DOP853 makes no step longer than this share of the distance to a singularity: it would pass a
# spike unseen.
STRIDE = 0.5
CALL_SAMPLES = 4_000_000
LARGEST = np.finfo(float).max  # for infinity
# So few points are asked one by one whether z may have spikes.
FEW = 8
# The most steps in double-double: 20 ms a hundred.
EXACT_STEPS = 2000
# z in float64 and with more digits may differ by this many times the rounding that the bounds allow
# for.
SAME_Z = 1000


@lru_cache(maxsize=32)
def kernels(z):
    """Kernels of the function z(u, p): `sample(points, u, out)`, see `at`; `probe`, z between
    samples; `walk`, DOP853 point by point.
    """
    z = inline(getattr(z, "py_func", z))

    @fresh
    def sample(points, u, out):
        for i in range(u.shape[0]):
            if len(points) == 1:
                for j in range(u.shape[1]):
                    out[0, i, j] = z(u[i, j], points[0, i])
            else:  # at one u after another: what does not depend on p is computed once
                for j in range(u.shape[1]):
                    for k in range(len(points)):
                        out[k, i, j] = z(u[i, j], points[k, i])

    @fresh
    def probe(points, ends, values, size, x, number, missed):
        """How far z (N, M) at the points x of ends (N, 2) misses z at the one of `number` points
        most unlike the rest.

        That is where the sixth differences of z at evenly spread points are largest: in the middle
        of seven. Where all are below ROUGH times the `size` of z there is none.
        """
        for i in range(len(points)):
            low, step = ends[i, 0], (ends[i, 1] - ends[i, 0]) / number[i]
            most, middle = -1.0, 0
            d0 = d1 = d2 = d3 = d4 = d5 = missed[i] = 0.0
            for j in range(number[i]):
                e0 = z(low + (j + 0.5) * step, points[i])
                missed[i] = missed[i] if isfinite(e0) else inf
                e1 = e0 - d0
                e2 = e1 - d1
                e3 = e2 - d2
                e4 = e3 - d3
                e5 = e4 - d4
                e6 = abs(e5 - d5)
                d0, d1, d2, d3, d4, d5 = e0, e1, e2, e3, e4, e5
                if j >= 6 and e6 > most:
                    most, middle = e6, j - 3
            if most <= ROUGH * size[i]:
                continue
            # where two points are unlike the rest, it may be beside both
            first = 0 if middle == 3 else middle - 1
            last = number[i] if middle == number[i] - 4 else middle + 2
            for j in range(first, last):
                u = low + (j + 0.5) * step
                off = abs(z(u, points[i]) - interpolated(values[i], x, (j + 0.5) / number[i]))
                missed[i] = max(missed[i], off)

    @inline
    def potential(u, p, point, scale):
        return z(u, point), scale

    @fresh
    def walk(points, edges, pieces, slack, longest, scale, tolerance, out, reached):
        for i in range(len(points)):
            own = edges[i, : pieces[i] + 1]
            reached[i] = dop853.hill_walk_pieces(
                potential, 0.0, points[i], scale[i], own, slack[i], longest[i], tolerance[i], out[i]
            )

    return SimpleNamespace(sample=sample, probe=probe, walk=walk)


class Raised(Exception):
    """z raised its cause, or cannot be compiled."""


def at(z, points, u):
    """z (K, N, M) at u (N, M) of the points (K, N, n); (N, M) of points (N, n)."""
    several = points if points.ndim == 3 else points[None]
    out = np.empty((len(several), *u.shape))
    try:
        kernels(z).sample(np.ascontiguousarray(several), np.ascontiguousarray(u), out)
    except Exception as error:
        raise Raised from error
    return out if points.ndim == 3 else out[0]


@dataclass(frozen=True)
class Equation:
    """Hill's equation with a user's z; equal `key`s (hashable) mean the same equation.

    `ranges(points)` gives the periods (N), edges (N, P + 1) and slack (N) of points (N, n), and
    `measured(points, ranges)` their Measured. `exact(point, edges)`, if given, gives z(u) and the
    `edges` (P + 1) of a point in more digits (`multiprecision`).
    """

    z: Callable
    key: Hashable
    even: bool
    ranges: Callable
    measured: Callable
    exact: Callable | None = None


class Steps:
    """How the steps of rows are distributed over the pieces between breaks: by `size` and `rate` of
    z (R, P).
    """

    def __init__(self, edges, slack, size, rate):
        self.edges, self.slack, self.rate, self._size = edges, slack, rate, size
        self.length, self.end = np.diff(edges, axis=1), edges[:, -1]
        self.whole = edges.shape[1] == 2  # one piece has all steps

    @cached_property
    def pieces(self):
        return np.count_nonzero(self.length > 0, axis=1)

    @cached_property
    def more(self):
        return np.where(self.pieces > 1, self.pieces, 0) / self.end

    @cached_property
    def weight(self):
        """Each piece gets steps by its weight: enough in all that each has what it needs, and one more."""
        return self.length * np.maximum(
            np.maximum(BY_PHASE * np.sqrt(self._size), self.rate), 1 / self.end[:, None]
        )

    @cached_property
    def total(self):
        return np.cumsum(self.weight, axis=1)[:, -1:]

    @cached_property
    def need(self):
        return (
            self.length
            * self.total
            / (np.where(self.weight > 0, self.weight, 1) * self.end[:, None])
        )

    def frequency(self, size):
        """What stands for the fastest phase of a whole row with this `size` of z."""
        if self.whole:
            return np.sqrt(size[:, 0])
        return (self.need * np.sqrt(size)).max(axis=1) + pointwise.LONGEST * self.more

    @property
    def rates(self):
        """What stands for the rate of a whole row."""
        if self.whole:
            return self.rate[:, 0]
        return (self.need * self.rate).max(axis=1) + 2 * self.more

    def of(self, rows, number):
        """Starts and lengths of the steps (rows, number), and the ends between which z may be asked
        for in each.
        """
        if self.whole:
            low, high, slack = self.edges[rows, :1], self.edges[rows, 1:], self.slack[rows, None]
            h = np.repeat(self.length[rows] / number, number, axis=1)
            return low + np.arange(number) * h, h, low + slack, high - slack
        i, length, weight = np.arange(rows.size)[:, None], self.length[rows], self.weight[rows]
        share = (number - self.pieces[rows, None]) * (weight / self.total[rows])
        count = np.floor(share).astype(int) + (length > 0)
        count[i[:, 0], weight.argmax(axis=1)] += number - count.sum(axis=1)
        last, k = np.cumsum(count, axis=1), np.arange(number)
        piece = (k[:, None] >= last[:, None]).sum(axis=2)
        low, high = self.edges[rows[:, None], piece], self.edges[rows[:, None], piece + 1]
        h, slack = (high - low) / count[i, piece], self.slack[rows, None]
        return low + (k - (last - count)[i, piece]) * h, h, low + slack, high - slack

    def at_nodes(self, rows, nodes, number):
        """u (rows, number, nodes) at the `nodes` (fractions) of the steps."""
        start, h, low, high = (values[:, :, None] for values in self.of(rows, number))
        return np.clip(start + h * nodes, low, high)


def problem(equation, points, ranges):
    """The Hill problem of an `Equation` at the points (N, n) with these `ranges`, and where z is
    `rough`, not smooth between its breaks.

    Points whose z is rough, not finite, or not even where it should be, have span NaN.
    """
    z = equation.z
    _, edges, slack = ranges
    size, rate, scale, rough, _ = equation.measured(points, ranges)
    steps = Steps(edges, slack, size, rate)

    def sample(rows, nodes, number):
        u = steps.at_nodes(rows, nodes, number)
        out = np.empty((rows.size, number, 2, nodes.size))
        out[:, :, 1] = scale[rows, None, None]
        out[:, :, 0] = at(z, points[rows], u.reshape(rows.size, -1)).reshape(u.shape) - out[:, :, 1]
        return out

    def walk(rows, p, tolerance):
        return walked(z, points[rows], rows, steps, scale, tolerance)

    def exactly(rows, p, low, number):
        return solved_exactly(equation, points[rows], rows, steps, scale, number)

    frequency = steps.frequency(size)
    sizes = monodromy.RowSizes(
        span=np.where(rough | np.isnan(scale), np.nan, steps.end),
        bound=np.column_stack([frequency**2, 0 * frequency, 0 * frequency]),
        rate=steps.rates,
    )
    own = monodromy.Problem(
        p=np.ones((len(points), 1)), sizes=lambda: sizes, c2=0.0,
        sample=sample, walk=walk, cut=lambda rows, number: steps.of(rows, number)[1],
        full_period=not equation.even, exact=exactly if equation.exact else None,
    )  # fmt: skip
    return own, rough


def walked(z, points, rows, steps, scale, tolerance):
    """The results of the `points`, each of one of the `rows`, by DOP853, and which of them reached
    the end.
    """
    out = np.full((rows.size, RESULTS), np.nan)
    reached = np.zeros(rows.size, np.bool_)
    stride = STRIDE / steps.rate[rows].max(axis=1)
    own = points, steps.edges[rows], steps.pieces[rows], steps.slack[rows], stride, scale[rows]
    kernels(z).walk(*own, tolerance, out, reached)
    return out, reached


def solved_exactly(equation, points, rows, steps, scale, number):
    """The results of the `points`, each of one of the `rows`, in double-double, in its `number` of steps."""
    out = np.full((rows.size, RESULTS + (0 if equation.even else SQUARES)), np.nan)
    for i in np.flatnonzero(number <= EXACT_STEPS):
        start = steps.of(rows[i : i + 1], number[i])[0][0]
        with multiprecision.LOCK:
            found = multiprecision.series(
                *equation.exact(points[i], steps.edges[rows[i]]), start, sampled_double.NODES
            )
        if found is None or not _agree(equation.z, points[i], scale[rows[i]], *found[3:]):
            continue
        terms, lengths, sizes = found[:3]
        sampled_double.solve(
            terms, sampled_double.missing(*sizes), lengths, not equation.even, out[i]
        )
    return out


def _agree(z, point, scale, u, values):
    """Is z with more digits the z of float64, to what its rounding may move?"""
    inside = at(z, point[None], u.reshape(1, -1)).reshape(u.shape)
    return bool((abs(values - inside) <= SAME_Z * ROUNDING * scale).all())


def unprobed(z, points, edges, slack, size):
    """Which points (N), whose z is of this `size` (N), are known to have no spikes between samples
    (see `bands`).
    """
    if not len(points) or edges.shape[1] != 2 or slack.any():
        return np.zeros(len(points), np.bool_)
    *most, end = _largest(np.column_stack([points, edges[:, -1]]))
    found = bands.missed(z, tuple(most), end, SIZES[0])
    known = found <= 10 * RESOLVED * size
    if isfinite(found):  # where z is small by its parameters, each for itself
        for i in np.flatnonzero(~known)[:FEW]:
            own = tuple(_largest(points[i : i + 1]))
            known[i] = bands.missed(z, own, end, SIZES[0]) <= 10 * RESOLVED * size[i]
    return known


def _largest(values):
    """The largest |value| of each column of (N, n): NaN left out, infinity as the largest number."""
    return np.fmin(np.fmax.reduce(abs(values), axis=0, initial=0.0), LARGEST).tolist()


class Measured(NamedTuple):
    """What the steps of N points need of z on their P pieces: see `measured`."""

    size: np.ndarray
    rate: np.ndarray
    scale: np.ndarray
    rough: np.ndarray
    spikeless: np.ndarray


def measured(z, points, edges, period, slack, probes=PROBES):
    """The Measured of points: for each piece `size` = max |z| and `rate` (N, P); for each point
    `scale` = B, NaN if z is not finite, whether it is `rough`, and whether it is known to be
    `spikeless` (see `unprobed`).

    `edges` (N, P + 1): 0, the breaks, and the end of the part that is solved, T/2 if z is even, else
    T; where a point has fewer, its last one repeated. With a `period` (N), z is compared with its
    mirror image, and scale is NaN where they differ. `probes` as PROBES.
    """
    shape = (len(points), edges.shape[1] - 1)
    owner = np.repeat(np.arange(len(points)), edges.shape[1] - 1)
    left, right = edges[:, :-1].reshape(-1, 1), edges[:, 1:].reshape(-1, 1)
    length, apart = right - left, slack.any()

    def nodes(pieces, number):
        u = left[pieces] + length[pieces] * chebyshev.with_ends(number)
        if apart:
            ends = slack[owner[pieces], None]
            u = np.clip(u, left[pieces] + ends, right[pieces] - ends)
        return u

    def probed(pieces):
        """The points, the ends (N, 2) and the number of probes of each piece."""
        ends = np.concatenate([left[pieces], right[pieces]], axis=1)
        own = owner[pieces]
        share = np.diff(ends, axis=1)[:, 0] / edges[own, -1]
        return (
            points[own],
            ends,
            np.maximum(np.ceil(probes * np.nan_to_num(share)), LEAST_PROBES).astype(np.int64),
        )

    def between(pieces, known, size):
        """How far z is from its interpolant at the probes: few Chebyshev points lie further apart
        than these.
        """
        own, ends, number = probed(pieces)
        out = np.empty(len(pieces))
        for count in np.unique(number):
            rows = np.flatnonzero(number == count)
            for some in _parts(rows, count):
                u = ends[some, :1] + np.diff(ends[some], axis=1) * evenly(count)
                out[some] = furthest(known[some], to_probes(int(count)), at(z, own[some], u))
        return out

    def missed(pieces, known, size):
        """How far z is from its interpolant at the probe that is most unlike the others."""
        own, ends, number = probed(pieces)
        return unlike(z, own, ends, known, size, number)

    size, rate, noise, last = np.empty((4, owner.size))
    unresolved, off = np.arange(owner.size), np.zeros(owner.size)
    spikeless = np.zeros(owner.size, np.bool_)
    for number in SIZES:
        for some in _parts(unresolved, number):
            own, u = owner[some], nodes(some, number)
            mirrored = number == SIZES[0] and period is not None
            if mirrored:
                u = np.concatenate([u, period[own, None] - u], axis=1)
            known = at(z, points[own], u)
            if mirrored:
                known, image = known[:, :number].copy(), known[:, number:]
                off[some] = abs(known - image).max(axis=1)
            size[some], rate[some], noise[some], last[some] = spectrum(known)
            smooth = np.flatnonzero((last[some] <= RESOLVED * size[some]) | (number == SIZES[-1]))
            if number == SIZES[0]:
                own, pieces = own[smooth], some[smooth]
                spikeless[pieces] = unprobed(z, points[own], edges[own], slack[own], size[pieces])
                smooth = smooth[~spikeless[pieces]]
            some = some[smooth]
            if not some.size:
                continue
            hidden = (between if number == SIZES[0] else missed)(some, known[smooth], size[some])
            hidden[~(hidden > 10 * RESOLVED * size[some] + 4 * noise[some])] = 0
            noise[some], last[some] = (
                np.maximum(noise[some], hidden),
                np.maximum(last[some], hidden),
            )
        unresolved = unresolved[last[unresolved] > RESOLVED * size[unresolved]]
        if not unresolved.size:
            break
    length = length[:, 0]
    rate = np.where(length > 0, 2 * rate / np.where(length > 0, length, 1), 0)
    size, rate, noise, last, off = (a.reshape(shape) for a in (size, rate, noise, last, off))
    scale, off = size.max(axis=1), off.max(axis=1)
    known = np.maximum(scale, np.maximum(noise.max(axis=1), off) / ROUNDING)
    return Measured(
        size=size,
        rate=rate,
        scale=np.where(off <= MIRRORED * scale, known, np.nan),
        rough=(last > ROUGH * size).any(axis=1),
        spikeless=spikeless.reshape(shape).all(axis=1),
    )


def _parts(pieces, number):
    """The pieces, as many at a time as CALL_SAMPLES allows for at this `number` of samples each."""
    count = pieces.size * number // CALL_SAMPLES + 1
    return [pieces] if count == 1 else np.array_split(pieces, count)


def unlike(z, points, ends, known, size, number):
    """See `probe` of `kernels`: `known` (N, M) are values of z at Chebyshev points between `ends` (N, 2)."""
    out = np.empty(len(points))
    try:
        kernels(z).probe(
            np.ascontiguousarray(points),
            ends,
            known,
            size,
            chebyshev.with_ends(known.shape[1]),
            number,
            out,
        )
    except Exception as error:
        raise Raised from error
    return out


@kernel
def furthest(values, transform, wanted):
    """The largest |values @ transform - wanted| of each row (N); infinite where one is not finite."""
    out, own = np.empty(len(values)), np.empty(transform.shape[1])
    for i in range(len(values)):
        own[:] = 0.0
        for k in range(len(transform)):
            for j in range(transform.shape[1]):  # no sum over j: vector code with the same bits
                own[j] += values[i, k] * transform[k, j]
        out[i] = 0.0
        for j in range(transform.shape[1]):
            off = abs(own[j] - wanted[i, j])
            out[i] = max(out[i], off) if isfinite(off) else inf
    return out


def evenly(number):
    """As many evenly spread points on [0, 1], half their distance from its ends."""
    return (np.arange(number) + 0.5) / number


@cache
def to_probes(number):
    """(SIZES[0], number): from values at Chebyshev points to the interpolant's at evenly spread ones."""
    away = evenly(number) - chebyshev.with_ends(SIZES[0])[:, None]
    weight = (-1.0) ** np.arange(SIZES[0])
    weight[[0, -1]] *= 0.5
    terms = weight[:, None] / np.where(away == 0, 1, away)
    return np.where((away == 0).any(axis=0), away == 0, terms / terms.sum(axis=0))


@inline
def interpolated(values, x, u):
    """The polynomial through `values` at the Chebyshev points x (M) on [0, 1], at `u` there (barycentric)."""
    above = below = 0.0
    for j in range(len(x)):
        if x[j] == u:
            return values[j]
        weight = (1.0 - 2.0 * (j % 2)) * (0.5 if j == 0 or j == len(x) - 1 else 1.0) / (u - x[j])
        above += weight * values[j]
        below += weight
    return above / below


def spectrum(values):
    """max |z|, rate (on [-1, 1]), noise and the largest of the last coefficients, from z at
    Chebyshev points (n, M).
    """
    size, rate, noise, last = np.empty((4, len(values)))
    if values.shape[1] == SIZES[0]:
        series = np.empty((0, SIZES[0]))
    else:
        series = abs(np.fft.rfft(np.concatenate([values, values[:, -2:0:-1]], axis=1), axis=1).real)
        series /= values.shape[1] - 1
    fall(values, series, chebyshev.by_columns_with_ends(SIZES[0]), size, rate, noise, last)
    return size, rate, noise, last


@kernel
def fall(values, series, transform, size, rate, noise, last):
    """See `spectrum`: from the sizes of the coefficients, `series`, or, if that is empty, by
    `transform` (M, M).
    """
    count = values.shape[1]
    own, n = np.empty(count), count - 1
    for i in range(len(values)):
        top = 0.0
        if len(series) == 0:
            own[:] = 0.0
            for j in range(count):
                for k in range(count):  # no sum over k: vector code with the same bits
                    own[k] += values[i, j] * transform[j, k]
        for k in range(count):
            own[k] = abs(own[k]) if len(series) == 0 else series[i, k]
            top = max(top, own[k])
        size[i] = last[i] = total = 0.0
        for k in range(count):
            size[i] = max(size[i], abs(values[i, k]))
        for k in range(count - n // 4, count):
            last[i] = max(last[i], own[k])
            total += own[k] * own[k]
        noise[i] = 3.0 * sqrt(0.5 * n * total / (n // 4))
        least = max(RESOLVED * size[i], 2.0 * last[i])
        rate[i] = 0.0
        for k in range(count):
            if own[k] > least:
                rate[i] = max(rate[i], k / (1.0 + log(top / max(own[k], 1e-300))))
        if not isfinite(size[i] + total):
            size[i] = rate[i] = noise[i] = last[i] = np.nan
