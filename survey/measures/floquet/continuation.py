"""Curves of periodic orbits, followed in one parameter, both ways round folds: all orbits at a
point that they meet.

The unknowns y = (x(0), l), or (x(0), T, l) where T is unknown, l the share of the parameter's
range, obey n, or n + 1, equations (see `newton`); a curve is followed by its arc length: a step
along the tangent, and Newton's method across it. Where T is unknown, x(0) stays in a plane across
the motion, which moves along with the curve.

Curves begin at the orbits that Newton's method finds at SEEDS values of l: from the start as a rule,
and where T is known also from 0 and from MORE states of a box, as several orbits may coexist that no
curve joins. They end where l leaves its range, after MOST_STEPS steps, or where these become too short. Curves
that branch off are not looked for. They depend on the other parameters and the range alone: so a
point has the same orbits, in the same order, on every grid.

Source: H. B. Keller, in Applications of Bifurcation Theory (1977) 359 (pseudo-arclength).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from survey.measures.floquet.newton import (
    ACROSS,
    ROUGH,
    ROUGH_REACH,
    applied,
    bordered,
    inverse,
    located,
)

SEEDS = 9
FIRST_STEP, LONGEST, SHORTEST = 0.01, 0.15, 1e-6  # relative to the range of l, x and T
MOST_STEPS = 400  # in each direction
MORE, AWAY = 8, 2.0  # states of a box; periods of the motion from the start that is in it
CORRECTIONS, CORRECTED, CONTRACTION = 5, 1e-3, 0.5
GROWTH, LEAST = 1.5, 1e-2  # of steps; the size of a state, relative to the largest one
NOTHING = 1e-3  # relative to the states from which it is sought: an orbit that is smaller is 0
NEAR_FOLD = 1e-4  # of l: cubics miss folds by 1e-5 at most, as measured
# of the tangent in a step, in radians: too much, and so little that steps become longer
TURN, LITTLE = 0.35, 0.12
DIFFERENCE = 1e-7  # of l, for derivatives that give directions alone
SAME, SAME_SIZE = 1e-3, 1e-2  # relative: what lies on a curve already


class Range(NamedTuple):
    """The parameter number `index` that is continued, from `low` to `high`."""

    index: int
    low: float
    high: float


@dataclass
class ContinuedCurve:
    """Points y (K, m) of a curve, its tangents, and the sizes that lengths are relative to. y ends with l."""

    y: np.ndarray
    tangent: np.ndarray
    size: np.ndarray

    def finer(self, times):
        """Points of the cubic pieces, so many for each of its own."""
        c = self._pieces()
        inner = [_cubic(c, k / times) for k in range(times)]
        return np.concatenate([np.stack(inner, axis=1).reshape(-1, self.y.shape[1]), self.y[-1:]])

    def _pieces(self):
        """Coefficients (4, K - 1, m) of the cubic pieces, powers of u in [0, 1]."""
        step, size = np.diff(self.y, axis=0), self.size[:-1]
        length = np.linalg.norm(step / size, axis=1)[:, None]
        one, two = (
            length * t / np.linalg.norm(t / size, axis=1)[:, None]
            for t in (self.tangent[:-1], self.tangent[1:])
        )
        return np.stack([self.y[:-1], one, 3 * step - 2 * one - two, one + two - 2 * step])

    def crossings(self, values):
        """Where l, on cubic pieces, takes the values (V): their numbers, and y (C, m)."""
        c = self._pieces()
        ends = _monotonic(c[:, :, -1])
        at = _cubic(c[:, :, -1, None], ends)
        below, above = np.minimum(at[:, :-1], at[:, 1:]), np.maximum(at[:, :-1], at[:, 1:])
        piece, part, which = np.nonzero(
            (below[:, :, None] <= values) & (values <= above[:, :, None])
        )
        u = _bisected(c[:, piece, -1], values[which], ends[piece, part], ends[piece, part + 1])
        return which, _cubic(c[:, piece], u[:, None])

    def beside_folds(self, values):
        """Points on both sides of the folds that l has near the values (V): their numbers, and y (C, m).

        Cubics may not reach a value next to a fold, or meet it on the wrong side; from these points
        Newton's method does, and comes nearer to either orbit by half in each step.
        """
        at, y = self._folds
        fold, which = np.nonzero(abs(at[:, None] - values) <= NEAR_FOLD)
        return np.repeat(which, 2), y[fold].reshape(-1, self.y.shape[1])

    @cached_property
    def _folds(self):
        """l at the folds (F), and points before and after them (F, 2, m), at NEAR_FOLD in l, or
        half-way to the next fold.
        """
        c = self._pieces()
        ends = _monotonic(c[:, :, -1])
        piece, part = np.nonzero(ends[:, 1:] > ends[:, :-1])
        u = np.stack([ends[piece, part], ends[piece, part + 1]], axis=1)
        at_ends = _cubic(c[:, piece, -1, None], u)
        rises = at_ends[:, 1] > at_ends[:, 0]
        turns = np.flatnonzero(rises[1:] != rises[:-1]) + 1
        bounds = np.concatenate([[0], turns, [len(u)]])  # parts between folds
        depth = np.minimum(
            NEAR_FOLD, 0.5 * abs(at_ends[bounds[1:] - 1, 1] - at_ends[bounds[:-1], 0])
        )
        y = np.empty((turns.size, 2, self.y.shape[1]))
        for k, turn in enumerate(turns):
            for side, own in ((0, np.arange(bounds[k], turn)), (1, np.arange(turn, bounds[k + 2]))):
                wanted = at_ends[turn, 0] + np.where(rises[turn], 1.0, -1.0) * depth[k + side]
                inside = (at_ends[own].min(axis=1) <= wanted) & (wanted <= at_ends[own].max(axis=1))
                i = own[inside][-1 if side == 0 else 0]
                at = _bisected(c[:, piece[i : i + 1], -1], np.array([wanted]), *u[i][:, None])
                y[k, side] = _cubic(c[:, piece[i]], at)
        return at_ends[turns, 0], y


def _monotonic(c):
    """Ends (K, 4) of the parts of [0, 1] on which cubics c (4, K) are monotonic; parts may be empty."""
    with np.errstate(all="ignore"):
        root = np.sqrt(np.maximum(c[2] ** 2 - 3 * c[1] * c[3], 0.0))
        q = -(c[2] + np.copysign(root, c[2]))
        turns = np.sort([q / (3 * c[3]), c[1] / q], axis=0)
    turns = np.clip(np.nan_to_num(turns, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    return np.stack([np.zeros(c.shape[1]), *turns, np.ones(c.shape[1])], axis=1)


def _cubic(c, u):
    return ((c[3] * u + c[2]) * u + c[1]) * u + c[0]


def _bisected(c, values, low, high):
    """Where in [low, high] cubics c (4, C), monotonic there, take the values (C)."""
    rises = _cubic(c, high) > _cubic(c, low)
    for _ in range(50):
        middle = 0.5 * (low + high)
        below = (_cubic(c, middle) < values) == rises
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


class ContinuedCurves:
    """The curves of each of R rows, sets of parameters whose continued one does not matter.

    begin(points (N, parameters)) gives [(states (N, n), periods (N))] from which Newton's method
    begins; the start if it is missing.
    """

    def __init__(self, equation, continued, rows, reach, begin=None, seeds=SEEDS):
        self.equation, self.continued, self.rows, self.reach = equation, continued, rows, reach
        self.free = equation.free
        self.of_row = [[] for _ in rows]
        self.shares = np.linspace(0.0, 1.0, seeds)
        self.met = [[[] for _ in self.shares] for _ in rows]  # orbits of the curves at the shares
        every = self.points(np.tile(np.arange(len(rows)), seeds), np.repeat(self.shares, len(rows)))
        self.least = np.zeros(len(rows))
        starts = list(begin(every) if begin else [equation.begin(every)])
        self._sought(every, starts, range(seeds))
        if begin is None and not self.free:
            others = range(0, seeds, 2)  # measured: all find 3 % more, and a map takes 5 % longer
            own = np.isin(np.arange(len(every)) // len(rows), others)
            elsewhere = self._elsewhere(every, *starts[0])
            self._sought(every[own], [(x[own], T[own]) for x, T in elsewhere], others, relax=False)

    def _elsewhere(self, points, x, T):
        """Further states from which Newton's method begins, beside the start x (N, n): 0, and points
        of a box as wide as the row's orbits and motions from the start.
        """
        n, R = self.equation.n, len(self.rows)
        away = rough_flow(self.equation, points, x, AWAY * T, derived=False)[2]
        wide = np.fmax.reduce(np.fmax(abs(x), away).reshape(-1, R, n), axis=0)
        for i, curves in enumerate(self.of_row):
            for curve in curves:
                wide[i] = np.fmax(wide[i], curve.size[:, :n].max(axis=0))
        wide = np.tile(wide, (len(self.shares), 1))
        return [(u * wide, T) for u in np.concatenate([np.zeros((1, n)), spread(MORE, n)])]

    def _sought(self, points, starts, numbers, relax=True):
        """Follow the curves of the orbits that Newton's method finds from [(states, periods)], at the
        shares of these `numbers` of every row.
        """
        R, N = len(self.rows), len(points)
        if not starts:
            return
        x, T = (np.concatenate(one) for one in zip(*starts, strict=True))
        self.least = np.fmax(
            self.least, NOTHING * np.fmax.reduce(abs(x).max(axis=1).reshape(-1, R), axis=0)
        )
        orbits, good = located(
            self.equation, np.tile(points, (len(starts), 1)), self.reach, x, T, relax
        )
        of_start, at = good // N, good % N // R
        for i, number in enumerate(numbers):
            for start in range(len(starts)):
                self._follow(number, orbits, good[(of_start == start) & (at == i)])

    def points(self, those, share):
        """The parameters of these rows, with the continued one at shares of its range."""
        index, low, high = self.continued
        points = self.rows[those].copy()
        points[:, index] = low + (high - low) * share
        return points

    def _follow(self, k, orbits, which):
        """Follow the curves through these ones of LocatedOrbits, at the share number k of the range,
        but for those that are known.
        """
        R = len(self.rows)
        which = np.array([i for i in which if not self._known(i % R, k, orbits, i)], dtype=int)
        if not which.size:
            return
        those, share = which % R, np.full((which.size, 1), self.shares[k])
        size, T = orbits.size[which], orbits.T[which, None]
        y = np.concatenate([orbits.x[which], *([T] if self.free else []), share], axis=1)
        walk = _Walk(
            self,
            np.tile(those, 2),
            np.tile(y, (2, 1)),
            np.tile(size, (2, 1)),
            np.repeat([1.0, -1.0], those.size),
        )
        walk.run()
        for k, i in enumerate(those):
            there, back = walk.done(k), walk.done(k + those.size)
            joined = [np.concatenate([b[:0:-1], a]) for a, b in zip(there, back, strict=True)]
            joined[1][: max(len(back[0]) - 1, 0)] *= -1.0
            if len(joined[0]) > 1:
                curve = ContinuedCurve(*joined)
                self.of_row[i].append(curve)
                for share, y in zip(*curve.crossings(self.shares), strict=True):
                    self.met[i][share].append(y)

    def _known(self, row, k, orbits, i):
        """Is orbit i on a curve of the row that is known?"""
        x, T, size = orbits.x[i], orbits.T[i], orbits.size[i]
        for y in self.met[row][k]:
            if self.free and self.equation.symmetry is None:
                same = abs(y[-2] - T) <= SAME * T and (abs(y[:-2] - x) <= size * 2.1).all()
            else:
                off = abs(y[: self.equation.n] - x)
                same = (off <= SAME * max(size.max(), self.least[row])).all()
            if same:
                return True
        return False

    def starts(self, row, values, folds=False):
        """The curves of a row at values of the parameter (V), and perhaps beside their folds: numbers
        of the values, states, periods (C each).
        """
        shares = (values - self.continued.low) / (self.continued.high - self.continued.low)
        n, m = self.equation.n, self.equation.n + self.free + 1
        found = [curve.crossings(shares) for curve in self.of_row[row]]
        if folds:
            found += [curve.beside_folds(shares) for curve in self.of_row[row]]
        which = np.concatenate([np.zeros(0, int), *(one for one, _y in found)])
        y = np.concatenate([np.zeros((0, m)), *(y for _one, y in found)])
        return which, y[:, :n], y[:, n] if self.free else np.full(len(y), np.nan)


def spread(count, n):
    """Points (count, n) of [-1, 1]^n, evenly spread (Roberts' sequence, an additive recurrence)."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (n + 1))
    return (
        2.0 * ((0.5 + np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, n + 1))) % 1.0)
        - 1.0
    )


def distinct(x, T, free):
    """Which of the orbits of one point, states x (K, n) and periods T (K), are none of those before
    them.
    """
    size = abs(x).max(axis=0, initial=0.0).max(initial=0.0)
    off = abs(T[:, None] - T) > SAME * T if free else abs(x[:, None] - x).max(axis=2) > SAME * size
    return [k for k in range(len(x)) if off[k, :k].all()]


class _Walk:
    """Steps along the curves of K tasks, from y (K, m) and the largest moduli of the states (K, n),
    in the direction in which l changes by `sign` at first.

    Lengths are relative to the orbit and the period at the last point, so that large orbits have as
    few steps as small.
    """

    def __init__(self, curves, rows, y, moduli, sign):
        self.curves, self.rows, self.y = curves, rows, y.copy()
        self.n, self.free, self.equation = curves.equation.n, curves.free, curves.equation
        K, m = y.shape
        self.step = np.full(K, FIRST_STEP)
        self.kept = [([], [], []) for _ in range(K)]
        self.size, self.tangent, self.plane = (
            np.ones((K, m)),
            np.zeros((K, m)),
            np.full((2, K, self.n), np.nan),
        )
        self.size[:, : self.n] = floored(moduli, curves.least[rows])
        self.tangent[:, -1] = sign
        everyone = np.arange(K)
        if self.free:
            self.plane[:] = (
                slopes(self.equation, curves.points(rows, y[:, -1]), y[:, : self.n]),
                y[:, : self.n],
            )
        self.live = everyone[self._moved(everyone, y, np.pi)]

    def run(self):
        """Follow the curves to their ends."""
        for _ in range(MOST_STEPS):
            if not self.live.size:
                break
            live = self.live
            good = self._moved(
                live, self.y[live] + self.step[live, None] * self.tangent[live], TURN
            )
            took, failed = live[good], live[~good]
            self.step[failed] *= 0.5
            closed = np.array([self._closed(k) for k in took], bool)
            ended = closed | (self.y[took, -1] < 0.0) | (self.y[took, -1] > 1.0)
            self.live = np.setdiff1d(
                live, np.concatenate([failed[self.step[failed] < SHORTEST], took[ended]])
            )

    def done(self, k):
        """Points, tangents and sizes of a task's curve."""
        return tuple(np.array(one).reshape(-1, self.y.shape[1]) for one in self.kept[k])

    def _closed(self, k):
        y, tangent, size = self.kept[k]
        near = len(y) > 4 and np.linalg.norm((y[-1] - y[0]) / size[0]) < self.step[k]
        return bool(near and (tangent[-1] / size[0]) @ (tangent[0] / size[0]) > 0.0)

    def _real(self, those, y):
        """Parameters, states and periods at y (K, m) of some tasks."""
        points = self.curves.points(self.rows[those], y[:, -1])
        return points, y[:, : self.n], y[:, self.n] if self.free else self.equation.periods(points)

    def _moved(self, those, y, most):
        """Move these tasks to the curve near y, across their tangents, if these turn by less than
        `most`; where.
        """
        done = np.zeros(len(y), bool)
        lost = np.zeros(len(y), bool)
        last = self.step[those]
        tangent, size = np.empty_like(y), np.empty_like(y)
        for _ in range(CORRECTIONS):
            busy = np.flatnonzero(~done & ~lost)
            if not busy.size:
                break
            mine = those[busy]
            value, slope, size[busy] = self._equations(mine, y[busy])
            across = self.tangent[mine] / self.size[mine] ** 2
            with np.errstate(all="ignore"):
                matrix = inverse(np.concatenate([slope, across[:, None]], axis=1))
                step = -applied(matrix[:, :, :-1], value)
                length = np.linalg.norm(step / self.size[mine], axis=1)
                bad = ~(length < last[busy])
                new = np.ascontiguousarray(matrix[:, :, -1])
                tangent[busy] = new / np.linalg.norm(new / size[busy], axis=1, keepdims=True)
                turn = _turn(self.tangent[mine] / self.size[mine], new / self.size[mine])
                done[busy] = ~bad & (length < CORRECTED)
                bad |= done[busy] & ~(turn < most)
            y[busy[~bad]] += step[~bad]
            lost[busy[bad]], last[busy] = True, CONTRACTION * length
            straight = done[busy] & (turn < LITTLE)
            self.step[mine[straight]] = np.minimum(GROWTH * self.step[mine[straight]], LONGEST)
        done &= ~lost
        took = those[done]
        self.y[took], self.tangent[took], self.size[took] = y[done], tangent[done], size[done]
        if self.free and took.size:
            x = self.y[took, : self.n]
            self.plane[:, took] = (
                slopes(self.equation, self.curves.points(self.rows[took], self.y[took, -1]), x),
                x,
            )
        for k in took:
            for kept, one in zip(
                self.kept[k], (self.y[k], self.tangent[k], self.size[k]), strict=True
            ):
                kept.append(one.copy())
        return done

    def _equations(self, those, y):
        """The equations' left sides at y (K, m), their derivatives (K, m - 1, m), and what lengths
        are relative to.
        """
        n = self.n
        points, x, T = self._real(those, y)
        X, M, moduli = rough_flow(self.equation, points, x, self.equation.share * T)
        value, slope = self._closing(those, points, x, X, M)
        inward = np.where(y[:, -1] < 0.99, DIFFERENCE, -DIFFERENCE)
        shifted = y.copy()
        shifted[:, -1] += inward
        others, _x, other_T = self._real(those, shifted)
        moved = ~_flow_alike(self.equation, points, others, x) | (T != other_T)
        if moved.any():
            span = self.equation.share * other_T[moved]
            X = X.copy()
            X[moved] = rough_flow(self.equation, others[moved], x[moved], span, derived=False)[0]
        by_l = (self._closing(those, others, x, X, M)[0] - value) / inward[:, None]
        size = np.ones_like(y)
        size[:, :n] = floored(moduli, self.curves.least[self.rows[those]])
        if self.free:
            c = self.plane[0, those]
            size[:, n] = T
            across = (c * slopes(self.equation, points, x)).sum(axis=1)
            slope[~(across >= ACROSS * (c * c).sum(axis=1))] = np.nan
        return value, np.concatenate([slope, by_l[:, :, None]], axis=2), size

    def _closing(self, those, points, x, X, M):
        """What must vanish for orbits to close, and its derivatives by (x(0), T), of X = x(T) and M
        = dX/dx(0).
        """
        n = self.n
        symmetry = self.equation.symmetry
        if symmetry is not None:
            guess = self.equation.begin(points)[0]
            return symmetry.linearised(X, M, slopes(self.equation, points, X), x, guess)
        value, slope = X - x, M - np.eye(n)
        if self.free:
            c, at = self.plane[:, those]
            value = np.concatenate([value, (c * (x - at)).sum(axis=1)[:, None]], axis=1)
            slope = bordered(slope, slopes(self.equation, points, X), c)
        return value, slope


def _flow_alike(equation, points, others, x):
    """Where motions from x (N, n) are the same at both points, as of a parameter that only chooses
    an orbit.
    """
    alike = np.zeros(len(x), bool)
    usable = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(others).all(axis=1))
    for inside, programs in equation.traced(points[usable], x[usable]):
        own = usable[inside]
        one, two = (programs.numbers(both[own])[0][:, programs.A.read] for both in (points, others))
        alike[own] = (one == two).all(axis=1) & programs.holds(others[own])
    return alike


def rough_flow(equation, points, x, T, derived=True):
    """x(T) from x (N, n), its derivatives, and the largest moduli of the states, not quite to
    rounding; or NaN.
    """
    N, n = x.shape
    X = np.full((N, n), np.nan)
    M = np.full((N * derived, n, n), np.nan)
    size = np.full((N, n), np.nan)
    usable = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(x).all(axis=1) & (T > 0))
    for inside, programs in equation.traced(points[usable], x[usable]):
        own = usable[inside]
        X[own], found, size[own], _steps = programs.flow(
            programs.numbers(points[own]), x[own], T[own], ROUGH_REACH, derived, tolerance=ROUGH
        )
        if derived:
            M[own] = found
    return X, M, size


def slopes(equation, points, x):
    """f (N, n) at t = 0."""
    f = np.full(x.shape, np.nan)
    for inside, programs in equation.traced(points, x):
        f[inside] = programs.slopes(
            programs.numbers(points[inside]), np.zeros(inside.size), x[inside]
        )[0]
    return f


def floored(moduli, least=0.0):
    """Sizes of states, from their largest moduli (K, n): one that is 0 all the time has one too, and
    so have all of an orbit that is smaller than `least` (K).
    """
    largest = np.maximum(moduli.max(axis=1), least)[:, None]
    return np.maximum(moduli, np.where(largest == 0.0, 1.0, LEAST * largest))


def _turn(a, b):
    """The angles between vectors (K, m)."""
    with np.errstate(all="ignore"):
        cosine = (a * b).sum(axis=1) / np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1))
        return np.arccos(np.clip(cosine, -1, 1))
