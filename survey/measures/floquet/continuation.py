"""Curves of periodic orbits, followed in one parameter, both ways round folds: all orbits at a point that they meet.

The unknowns y = (x(0), l), or (x(0), T, l) where T is unknown, l the parameter, obey n, or n + 1, equations (see
`newton`); a curve is followed by its arc length: a step along the tangent, and corrections across it by the derivative
at the step's beginning. Where T is unknown, x(0) stays in a plane across the motion, which moves along with the curve.

Curves begin at the orbits that Newton's method finds from the start at SEEDS values of l, and end where l leaves its
range, after MOST_STEPS steps, or where these become too short. They depend on the other parameters and the range
alone: so a point has the same orbits, in the same order, on every grid.

Source: H. B. Keller, in Applications of Bifurcation Theory (1977) 359 (pseudo-arclength).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from survey.measures.floquet.newton import applied, bordered, inverse, located

SEEDS = 9
FIRST_STEP, LONGEST, SHORTEST = 0.01, 0.06, 1e-6  # relative to the range of l, and the sizes of x and T
MOST_STEPS = 400  # in each direction
CORRECTIONS, CORRECTED = 6, 1e-6
TURN, LITTLE = 0.35, 0.12  # of the tangent in a step, in radians: too much, and so little that steps become longer
DIFFERENCE = 1e-6  # of l, for derivatives that give directions alone
SAME, SAME_SIZE = 1e-3, 1e-2  # relative: what lies on a curve already


class Range(NamedTuple):
    """The parameter number `index` that is continued, from `low` to `high`."""

    index: int
    low: float
    high: float


@dataclass
class Curve:
    """Points y (K, m) of a curve in units of `scale` (m), and unit tangents; l, from 0 to 1, is the last component."""

    y: np.ndarray
    tangent: np.ndarray
    scale: np.ndarray

    def crossings(self, values):
        """Where l, on cubic pieces, takes the values (V): their numbers, and y (C, m), with its units."""
        step = np.diff(self.y, axis=0)
        length = np.linalg.norm(step, axis=1)[:, None]
        one, two = length * self.tangent[:-1], length * self.tangent[1:]
        c = np.stack([self.y[:-1], one, 3 * step - 2 * one - two, one + two - 2 * step])  # powers of u in [0, 1]
        found, where = [], []
        for k in range(len(step)):
            turns = np.roots([3 * c[3, k, -1], 2 * c[2, k, -1], c[1, k, -1]]) if c[2:, k, -1].any() else np.zeros(0)
            turns = np.sort(turns[np.isreal(turns)].real)
            ends = [0.0, *turns[(turns > 0) & (turns < 1)], 1.0]
            for a, b in pairwise(ends):
                at = [_cubic(c[:, k, -1], u) for u in (a, b)]
                inside = np.flatnonzero((values - at[0]) * (values - at[1]) <= 0)
                if inside.size:
                    found.append(inside)
                    where.append(_cubic(c[:, k, :, None], _bisected(c[:, k, -1], values[inside], a, b)).T)
        if not found:
            return np.zeros(0, int), np.zeros((0, len(self.scale)))
        return np.concatenate(found), np.concatenate(where) * self.scale


def _cubic(c, u):
    return ((c[3] * u + c[2]) * u + c[1]) * u + c[0]


def _bisected(c, values, a, b):
    """u in [a, b] at which the cubic, monotonic there, takes the values."""
    low, high = np.full(values.size, a), np.full(values.size, b)
    rises = _cubic(c, b) > _cubic(c, a)
    for _ in range(50):
        middle = 0.5 * (low + high)
        below = (_cubic(c, middle) < values) == rises
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


class Curves:
    """The curves of each of R rows, sets of parameters whose continued one does not matter."""

    def __init__(self, equation, continued, rows, reach):
        self.equation, self.continued, self.rows, self.reach = equation, continued, rows, reach
        self.free = equation.free
        self.of_row = [[] for _ in rows]
        for share in np.linspace(0.0, 1.0, SEEDS):
            self._follow(share)

    def points(self, those, share):
        """The parameters of these rows, with the continued one at shares of its range."""
        index, low, high = self.continued
        points = self.rows[those].copy()
        points[:, index] = low + (high - low) * share
        return points

    def _follow(self, share):
        """Follow the curves through the orbits at this share of the range, but for those that are known."""
        everyone = np.arange(len(self.rows))
        points = self.points(everyone, share)
        orbits, good = located(self.equation, points, self.reach, *self.equation.begin(points))
        those = np.array([i for i in good if not self._known(i, share, orbits, i)], dtype=int)
        if not those.size:
            return
        size = np.maximum(orbits.size[those], 1e-2 * orbits.size[those].max(axis=1, keepdims=True))
        one = np.ones((those.size, 1))
        y = np.concatenate([orbits.x[those], *([orbits.T[those, None]] if self.free else []), share * one], axis=1)
        scale = np.concatenate([size, *([orbits.T[those, None]] if self.free else []), one], axis=1)
        task = np.tile(np.arange(those.size), 2)
        sign = np.repeat([1.0, -1.0], those.size)
        walk = _Walk(self, those[task], y[task] / scale[task], scale[task], sign)
        walk.run()
        for k, i in enumerate(those):
            there, back = walk.done(k), walk.done(k + those.size)
            y = np.concatenate([back[0][:0:-1], there[0]])
            tangent = np.concatenate([-back[1][:0:-1], there[1]])
            if len(y) > 1:
                self.of_row[i].append(Curve(y, tangent, scale[k]))

    def _known(self, i, share, orbits, k):
        for curve in self.of_row[i]:
            for y in curve.crossings(np.array([share]))[1]:
                if self.free:
                    same = abs(y[-2] - orbits.T[k]) <= SAME * orbits.T[k]
                    same &= (abs(y[:-2] - orbits.x[k]) <= orbits.size[k] * 2.1).all()
                else:
                    same = (abs(y[:-1] - orbits.x[k]) <= SAME * orbits.size[k].max()).all()
                if same:
                    return True
        return False

    def starts(self, row, values):
        """The curves of a row at values of the parameter (V): numbers of the values, states, periods (C each)."""
        shares = (values - self.continued.low) / (self.continued.high - self.continued.low)
        n, m = self.equation.n, self.equation.n + self.free + 1
        found = [curve.crossings(shares) for curve in self.of_row[row]]
        which = np.concatenate([np.zeros(0, int), *(one for one, _y in found)])
        y = np.concatenate([np.zeros((0, m)), *(y for _one, y in found)])
        return which, y[:, :n], y[:, n] if self.free else np.full(len(y), np.nan)


class _Walk:
    """Steps along the curves of K tasks from y (K, m), in the direction in which `sign` l changes at first."""

    def __init__(self, curves, rows, y, scale, sign):
        self.curves, self.rows, self.y, self.scale = curves, rows, y.copy(), scale
        self.n, self.free, self.equation = curves.equation.n, curves.free, curves.equation
        K, m = y.shape
        self.step, self.live = np.full(K, FIRST_STEP), np.arange(K)
        self.kept = [([], []) for _ in range(K)]
        self.tangent, self.matrix = np.zeros((K, m)), np.full((K, m, m), np.nan)
        self.plane = np.full((2, K, self.n), np.nan)
        self.tangent[:, -1] = sign
        good = self._turned(self.live, self.y, first=True)
        # beside a fold l hardly changes: either way is one of the two
        self.live = self.live[good]

    def run(self):
        """Follow the curves to their ends."""
        for _ in range(MOST_STEPS):
            if not self.live.size:
                break
            live = self.live
            y, good = self._corrected(live, self.y[live] + self.step[live, None] * self.tangent[live])
            took = live[good]
            before = self.tangent[took].copy()
            moved = self._turned(took, y[good])
            turn = np.arccos(np.clip((before[moved] * self.tangent[took[moved]]).sum(axis=1), -1, 1))
            took = took[moved]
            self.step[took] = np.where(turn < LITTLE, np.minimum(1.5 * self.step[took], LONGEST), self.step[took])
            failed = np.setdiff1d(live, took)
            self.step[failed] *= 0.5
            inside = (self.y[:, -1] >= 0.0) & (self.y[:, -1] <= 1.0) | (len(self.kept) == 0)
            gone = np.union1d(failed[self.step[failed] < SHORTEST], took[~inside[took]])
            gone = np.union1d(gone, [k for k in took if self._closed(k)]).astype(int)
            self.live = np.setdiff1d(live, gone)

    def done(self, k):
        """Points and tangents of a task's curve."""
        y, tangent = self.kept[k]
        return np.array(y).reshape(-1, self.y.shape[1]), np.array(tangent).reshape(-1, self.y.shape[1])

    def _closed(self, k):
        y, tangent = self.kept[k]
        near = len(y) > 4 and np.linalg.norm(y[-1] - y[0]) < self.step[k] and tangent[-1] @ tangent[0] > 0.5
        return bool(near)

    def _value(self, those, y):
        """X(T), and the equations' left sides in the units of the scale, at y (K, m) of some tasks."""
        n, real = self.n, y * self.scale[those]
        points = self.curves.points(self.rows[those], y[:, -1])
        T = real[:, n] if self.free else self.equation.periods(points)
        return points, real[:, :n], T

    def _equations(self, those, x, X):
        value = (X - x) / self.scale[those, : self.n]
        if self.free:
            c, at = self.plane[:, those]
            planar = (c * (x - at)).sum(axis=1) / np.sqrt((c * c).sum(axis=1) * (x * x).sum(axis=1))
            value = np.concatenate([value, planar[:, None]], axis=1)
        return value

    def _corrected(self, those, y):
        """y moved onto the curve, across the tangent, and where that succeeds."""
        done, lost, last = np.zeros(len(y), bool), np.zeros(len(y), bool), np.full(len(y), np.inf)
        for _ in range(CORRECTIONS):
            busy = np.flatnonzero(~done & ~lost)
            if not busy.size:
                break
            mine = those[busy]
            points, x, T = self._value(mine, y[busy])
            X = self._flow(points, x, T, derived=False)[0]
            value = self._equations(mine, x, X)
            with np.errstate(all="ignore"):
                step = -applied(self.matrix[mine], np.concatenate([value, np.zeros((busy.size, 1))], axis=1))
                size = np.linalg.norm(step, axis=1)
                bad = ~(size < np.minimum(0.5 * last[busy], self.step[mine]))
            y[busy[~bad]] += step[~bad]
            lost[busy[bad]] = True
            done[busy] = ~bad & (size < CORRECTED)
            last[busy] = size
        return y, done

    def _flow(self, points, x, T, derived=True):
        N, n = x.shape
        X, M = np.full((N, n), np.nan), np.full((N * derived, n, n), np.nan)
        usable = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(x).all(axis=1) & (T > 0))
        for inside, programs in self.equation.traced(points[usable], x[usable]):
            own = usable[inside]
            out = programs.flow(programs.numbers(points[own]), x[own], T[own], self.curves.reach, derived)
            X[own] = out[0]
            if derived:
                M[own] = out[1]
        return X, M

    def _slopes(self, points, x):
        f = np.full(x.shape, np.nan)
        for inside, programs in self.equation.traced(points, x):
            f[inside] = programs.slopes(programs.numbers(points[inside]), np.zeros(inside.size), x[inside])[0]
        return f

    def _turned(self, those, y, first=False):
        """Take y as the next points of these tasks, where the tangent has not turned too far; returns where."""
        n = self.n
        points, x, T = self._value(those, y)
        X, M = self._flow(points, x, T)
        inward = np.where(y[:, -1] < 0.5, DIFFERENCE, -DIFFERENCE)
        shifted = y.copy()
        shifted[:, -1] += inward
        after, _x, T_after = self._value(those, shifted)
        by_l = (self._flow(after, x, T_after, derived=False)[0] - X) / inward[:, None]
        scale = self.scale[those]
        slope = (M - np.eye(n)) * scale[:, None, :n] / scale[:, :n, None]
        if self.free:
            c = self._slopes(points, x)
            late = self._slopes(points, X) * scale[:, n, None] / scale[:, :n]
            unit = np.sqrt((c * c).sum(axis=1) * (x * x).sum(axis=1))[:, None]
            slope = bordered(slope, late, c * scale[:, :n] / unit)
            by_l = np.concatenate([by_l / scale[:, :n], np.zeros((len(y), 1))], axis=1)
        else:
            by_l = by_l / scale[:, :n]
        B = np.concatenate([np.concatenate([slope, by_l[:, :, None]], axis=2), self.tangent[those, None]], axis=1)
        last = np.zeros((len(y), y.shape[1]))
        last[:, -1] = 1.0
        with np.errstate(all="ignore"):
            new = applied(inverse(B), last)
            new /= np.linalg.norm(new, axis=1, keepdims=True)
            turn = np.arccos(np.clip((new * self.tangent[those]).sum(axis=1), -1, 1))
            B[:, -1] = new
            matrix = inverse(B)
            good = np.isfinite(matrix).all(axis=(1, 2)) & (first | (turn < TURN))
        took = those[good]
        self.y[took], self.tangent[took], self.matrix[took] = y[good], new[good], matrix[good]
        if self.free:
            self.plane[0, took], self.plane[1, took] = c[good], x[good]
        for k in took:
            self.kept[k][0].append(self.y[k].copy())
            self.kept[k][1].append(self.tangent[k].copy())
        return good
