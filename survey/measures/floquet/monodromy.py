"""The monodromy matrix of a linear periodic system, each entry with its error bound.

The period is cut at the breaks, and each piece into steps of equal length: as many as the norm of
A, in units of the states that balance it, and the rate at which A varies ask for; points whose
bounds miss the accuracy climb a ladder of more steps, and have their errors carried sharply
(`stability`). Where a symmetry in t makes up a piece of equal parts, only the steps of the first
are computed (`halves`).
"""

from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from survey import measures, waiting
from survey.kernels.floquet import sizes, steps
from survey.kernels.math import chebyshev
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.measures.floquet import probing
from survey.measures.floquet.halves import Images

# Times at which A is looked at, as shares of a piece.
TIMES = chebyshev.shares(12)
# of entries, in a sum that stands for all: no special ones
WEIGHTS = np.cos(1.0 + 7.0 * np.arange(64)) + 1.5
TRANSFORM = chebyshev.cosines(12) / 6
RESOLVED = 1e-12  # relative to the largest Chebyshev coefficient: smaller ones do not count
DIGITS = 48  # bits of the ends of steps
GROWTH = 1.5  # steps, from rung to rung
CALL_WORK = 4_000_000  # keeps a kernel call below about a second: steps n^2
MOST_STEPS = 100_000  # of a point


@dataclass(frozen=True)
class Group:
    """Points with the same recorded operations and symmetries: their numbers among all, of each
    piece the program, the values of its numbers there, and its Images.
    """

    own: np.ndarray
    programs: list
    numbers: list
    images: list


class SystemPoints:
    """Points of a System as a method's steps need them: sizes, noise, and the units that balance A.

    `halves`: is no more integrated than symmetries of A require? `growth` (2, N): the integral of
    A's trace over the period, the logarithm of det M, and its error bound; infinite where the trace
    depends on t. If `paired`, with l also 1 / l is said to be a multiplier: points whose growth is
    certainly not 0 are not valid.
    """

    def __init__(self, system, points, halves=False, paired=False):
        self.system, self.n, self.points, self.halves = system, system.n, points, halves
        self.period, edges = system.ranges(points)
        valid = np.isfinite(points).all(axis=1) & np.isfinite(edges).all(axis=1)
        self.rough = valid.copy()
        self.edges = edges
        pieces = edges.shape[1] - 1
        self.size, self.noise, self.rate = np.zeros((3, len(points), pieces))
        self.scale = np.ones((len(points), self.n))
        self.growth = np.zeros((2, len(points)))
        self.groups = []
        if system.conserved is not None:
            valid &= np.isfinite(system.weights(points)).all(axis=1)
        where = np.flatnonzero(valid)
        for inside, programs in system.traced(points[where], edges[where]):
            if programs is None:
                self.rough[where[inside]], self.size[where[inside]] = False, np.nan
                continue
            for own, found in self._alike(where[inside], programs):
                self._measure(own, programs, found)
        self.valid = valid & np.isfinite(self.size).all(axis=1) & ~self.rough
        if paired:
            self.valid &= ~(abs(self.growth[0]) > self.growth[1])

    def _alike(self, own, programs):
        """[(those of the points `own` with the same symmetries, of each piece (values and error
        bounds of its numbers, Images, phase_bars: see `halves.Waves`))]."""
        found = [(own, [])]
        for k, program in enumerate(programs):
            before, found = found, []
            for some, pieces in before:
                numbers = program.numbers(self.points[some])
                ends = self.edges[some, k], self.edges[some, k + 1]
                kinds = (
                    program.waves.found(self.n, numbers, *ends)
                    if self.halves
                    else [(slice(None), Images(), None)]
                )
                for those, images, phase_bars in kinds:
                    here = *(values[those] for values in numbers), images, phase_bars
                    found.append(
                        (some[those], [*(_of_those(piece, those) for piece in pieces), here])
                    )
        return found

    def _measure(self, own, programs, given):
        """Norm and noise of A on each piece of the points `own`, and the units of their states."""
        self.rough[own] = False
        n, N = self.n, len(own)
        largest = np.zeros((N, n, n))
        scale = np.empty((N, n))
        sampled = []
        for k, (program, (*numbers, images, phase_bars)) in enumerate(
            zip(programs, given, strict=True)
        ):
            edges = self.edges[own[:1]] if self.system.same_ranges else self.edges[own]
            t = edges[:, k, None] + (edges[:, k + 1] - edges[:, k])[:, None] * TIMES
            A, E = np.empty((N, TIMES.size, n, n)), np.empty((N, n, n))
            self._add_trace(
                own, program.trace(numbers), self.edges[own, k + 1] - self.edges[own, k]
            )
            terms, values, errors = program.sampled(numbers, t, phase_bars)
            errors[:, :, TIMES * images.parts > 1.0] = 0.0  # only what is integrated rounds
            sizes.samples(terms, values, errors, *numbers, A, E, largest)
            sampled.append((numbers, A, E))
        sizes.balance(largest, scale)
        for k, (numbers, A, E) in enumerate(sampled):
            low, high = self.edges[own, k, None], self.edges[own, k + 1, None]
            size, rate, noise = np.empty((3, N))
            sizes.measure(A, E, scale, WEIGHTS, TRANSFORM, RESOLVED, size, rate, noise)
            length = (high - low)[:, 0]
            rate = probing.combined(rate, programs[k], numbers, low, high, scale)
            self.rate[own, k] = rate / np.where(length > 0, length, 1.0)
            self.size[own, k] = np.where(np.isnan(rate), np.nan, size)
            self.noise[own, k] = noise
        self.scale[own] = scale
        self.groups.append(
            Group(own, programs, [values for values, *_ in given], [piece[2] for piece in given])
        )

    def _add_trace(self, own, trace, length):
        value, bar = (0.0, np.inf) if trace is None else trace
        with np.errstate(all="ignore"):
            part = value * length
            self.growth[0, own] += part
            self.growth[1, own] += bar * length + 4 * ROUNDOFF_UP * (
                abs(part) + abs(self.growth[0, own])
            )

    def group_of(self, those):
        """The number (K) of the group of each of some points, -1 of those in none."""
        number = np.full(len(self.points), -1)
        for g, group in enumerate(self.groups):
            number[group.own] = g
        return number[those]

    def steps(self, reach, factor, those):
        """Numbers of steps (K, P) of some points, `factor` (K) times what norm and rate ask for."""
        length = np.diff(self.edges[those], axis=1)
        with np.errstate(invalid="ignore"):
            least = 0.5 * length / reach * (self.size[those] + probing.BY_RATE * self.rate[those])
            count = np.ceil(factor[:, None] * np.maximum(np.ceil(least), 1.0))  # more on every rung
        return np.where(
            length > 0, np.clip(np.nan_to_num(count, nan=1.0), 1, MOST_STEPS), 0
        ).astype(np.int64)


def _of_those(piece, those):
    """A piece of `SystemPoints._alike`, of some of its points."""
    values, errors, images, phase_bars = piece
    # what is the same for all points has one row
    phase_bars = phase_bars and {
        row_at: bars if len(bars) == 1 else bars[those] for row_at, bars in phase_bars.items()
    }
    return values[those], errors[those], images, phase_bars


def balanced(matrices):
    """Units of the states (N, n), powers of 2, in which rows and columns of |A| (N, n, n) are of
    one size (Osborne).
    """
    scale = np.empty(matrices.shape[:2])
    sizes.balance(np.array(matrices, order="C"), scale)
    return scale


@dataclass
class Matrices:
    """M of N points, bounds E of its entries and R of what multiplying leaves (N, n, n).

    `sharp` (N): where errors were carried in the coordinates of M's eigenvectors V, W = V^-1 nearly, there are also the
    complex V, W and `centre` (N, n), the eigenvalues, and `extra`, bounds of |W e V|, e the error but for R.
    """

    M: np.ndarray
    E: np.ndarray
    R: np.ndarray
    sharp: np.ndarray
    # None where no point is sharp: no memory is touched for them
    extra: np.ndarray | None = None
    V: np.ndarray | None = None
    W: np.ndarray | None = None
    centre: np.ndarray | None = None

    @classmethod
    def empty(cls, N, n):
        """Room for N points, none of them sharp."""
        return cls(*np.full((3, N, n, n), np.nan), np.zeros(N, bool))

    @classmethod
    def plain(cls, M, E):
        """The Matrices of points of which only M and E are known."""
        return cls(M, E, np.full_like(E, np.nan), np.zeros(len(M), bool))

    def make_room(self):
        """Make room for what sharp points have besides, if there is none."""
        if self.V is None:
            N, n = self.M.shape[:2]
            self.extra, self.centre = np.full((N, n, n), np.nan), np.full((N, n), np.nan, complex)
            self.V, self.W = np.full((2, N, n, n), np.nan, complex)

    def __getitem__(self, those):
        return Matrices(
            *(None if (own := getattr(self, f.name)) is None else own[those] for f in fields(self))
        )

    def __setitem__(self, those, other):
        if other.V is not None:
            self.make_room()
        for f in fields(self):
            if (given := getattr(other, f.name)) is not None:
                getattr(self, f.name)[those] = given

    @property
    def bound(self):
        """The widest bound of each point (N); those that are sharp count for half, as they serve better."""
        widest = self.E.max(axis=(1, 2))
        return np.where(np.isfinite(widest), np.where(self.sharp, 0.4, 1.0) * widest, np.inf)


def solve(points, method, rtol, factor, those, sharp):
    """The Matrices of some of the SystemPoints, in `factor` (K) times the steps asked for; `sharp`: see
    Matrices.

    A function `sharp` takes, for some of `those` (their indices there), the Matrices in the balanced
    units of the states, these units (N, n), and the steps: F, their error bounds, `doubt` and
    `first` of `steps.products`.
    """
    n = points.n
    count = points.steps(method.floquet_reach(rtol), factor, those)
    found = Matrices.empty(len(those), n)
    number = points.group_of(those)
    for g, group in enumerate(points.groups):
        mine = np.flatnonzero(number == g)
        row_at = np.empty(len(points.points), dtype=np.int64)
        row_at[group.own] = np.arange(len(group.own))
        work = np.cumsum(count[mine].sum(axis=1)) * n * n
        cuts = np.searchsorted(work, np.arange(CALL_WORK, work[-1], CALL_WORK)) if work.size else []
        for some in np.split(mine, cuts):
            if some.size:
                given = (
                    group,
                    count[some],
                    sharp if isinstance(sharp, bool) else partial(sharp, some),
                )
                found[some] = _call(points, method, those[some], row_at[those[some]], *given)
    return found


def _call(points, method, those, row_at, group, count, sharp):
    n = points.n
    parts = np.array([images.parts for images in group.images])
    count = -(-count // parts)  # of the first parts
    first = np.concatenate([[0], np.cumsum((count * parts).sum(axis=1))])
    F, error, doubt = np.empty((first[-1], n, n)), np.empty(first[-1]), np.empty(first[-1])
    offset = first[:-1].copy()
    scale = np.ascontiguousarray(points.scale[those])
    for k, (program, values, images) in enumerate(
        zip(group.programs, group.numbers, group.images, strict=True)
    ):
        steps_of = count[:, k]
        point = np.repeat(np.arange(len(those)), steps_of)
        if not point.size:
            continue
        index = np.arange(point.size) - np.repeat(np.cumsum(steps_of) - steps_of, steps_of)
        low, high = points.edges[those, k], points.edges[those, k + 1]
        phase_bars = points.edges[those, -1]
        if parts[k] > 1:
            phase_bars = high = low + (high - low) / parts[k]
        start, end = (_ends(low, high, steps_of, point, index + shift) for shift in (0, 1))
        middle, half = 0.5 * (start + end), 0.5 * (end - start)
        # all is exact but the first and the last step of the piece, which meet others within their
        # rounding
        share = phase_bars / np.where(high > low, high - low, 1.0)
        noise = points.noise[those, k] + 4 * ROUNDOFF_UP * points.size[those, k] * share
        ways = 1 if images.reversal is None else 2
        found = (
            np.empty((ways * point.size, n, n)),
            np.empty(ways * point.size),
            np.empty(ways * point.size),
        )
        method.floquet_factors(
            program.operations, program.signs, program.inside, program.order, program.used, program.terms,
            np.ascontiguousarray(values[row_at]), scale, noise, n, point, middle, half, *found,
        )  # fmt: skip
        where = np.repeat(offset, steps_of) + index
        where = (
            where if ways == 1 else np.concatenate([where, where + np.repeat(steps_of, steps_of)])
        )
        F[where], error[where], doubt[where] = found
        images.complete(F, error, doubt, offset, steps_of)
        offset += steps_of * parts[k]
    found = Matrices.empty(len(those), n)
    steps.products(F, error, doubt, first, n, found.M, found.E, found.R)
    if callable(sharp):
        sharp(found, scale, F, error, doubt, first)
    elif sharp:
        found.make_room()
        which = np.flatnonzero(
            np.isfinite(found.M).all(axis=(1, 2)) & np.isfinite(found.E).all(axis=(1, 2))
        )
        found.centre[which], found.V[which] = np.linalg.eig(found.M[which])
        found.W[which] = inverse(found.V[which])
        waiting.wait("carried")
        steps.carried(F, error, doubt, first, which, n, found.V, found.W, found.extra)
        found.sharp[:] = np.isfinite(found.extra).all(axis=(1, 2))
    back = scale[:, :, None] / scale[:, None, :]
    with np.errstate(over="ignore", invalid="ignore"):
        for matrix in (found.M, found.E, found.R):
            matrix *= back
    if found.V is not None:
        found.V *= scale[:, :, None]
        found.W /= scale[:, None, :]
    return found


def inverse(V):
    """The inverses (N, n, n); NaN where there is none."""
    try:
        return np.linalg.inv(V)
    except np.linalg.LinAlgError:
        out = np.full_like(V, np.nan)
        for i, one in enumerate(V):
            try:
                out[i] = np.linalg.inv(one)
            except np.linalg.LinAlgError:
                continue
        return out


def _ends(low, high, steps, point, index):
    """Ends of steps, but for those of the piece with so few digits that their sums and differences
    are exact.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = np.exp2(np.ceil(np.log2(np.maximum(abs(low), abs(high)))) - DIGITS)[point]
        t = np.rint((low[point] + (high - low)[point] * (index / steps[point])) / unit) * unit
    return np.where(index == 0, low[point], np.where(index == steps[point], high[point], t))


def method_of(name):
    """The method of this name; "auto" is Taylor series about the middles of steps."""
    return measures.method("taylor16" if name == "auto" else name)
