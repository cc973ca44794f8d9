"""The curves that [boundaries] draws on a map of periodic orbits: where a multiplier of an orbit is
on the unit circle.

    plus_one        a fold of orbits
    minus_one       period doubling
    neimark_sacker  a complex pair

Orbits are followed along ROWS lines of the map each way (`continuation`); on a line along another
parameter than that of the continuation, from the orbits that this gives at SEEDS points, or, of a line
by itself, ALONE, along which their number must be what folds explain. Where det(M
- 1), det(M + 1) or the product of all l_i l_j - 1 changes its sign there, Newton's method on the
equations of `critical` finds the orbit that has the multiplier, and the curve is followed from it
in the space of all unknowns, in which folds of orbits and cusps of their curves are nothing
special. Where curves of orbits cross, as that of an orbit that is always 0 and another, these
equations are singular: on a line by itself the parameter is bracketed there by two orbits of a
curve. Every point that is kept is shown to exist, with bounds of its parameters
(`critical_points`). Curves that none of the lines meets are not found. Curves belong to all orbits
that are followed.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures import contours
from survey.measures.floquet import bifurcations, existence, monodromy, orbit
from survey.measures.floquet.continuation import (
    SEEDS,
    ContinuedCurves,
    Range,
    distinct,
    floored,
    rough_flow,
    slopes,
)
from survey.measures.floquet.critical import Critical
from survey.measures.floquet.critical_points import RTOL, CriticalPoints
from survey.measures.floquet.critical_walk import NEAREST, Walk
from survey.measures.floquet.multipliers import MINUS_ONE, NEIMARK_SACKER, PLUS_ONE
from survey.measures.floquet.newton import CONVERGED, bordered
from survey.measures.segments import along

KINDS = (NEIMARK_SACKER, PLUS_ONE, MINUS_ONE)  # in the order in which they are followed
ROWS, FINER = 17, 4  # lines each way, and points for each of those of an orbit's curve
ALONE = 33  # points of a line by itself at which the continuation gives the orbits
SAME, ALIKE = 3e-4, 0.05  # of the map; of the orbit, relative: what lies on a curve already
OWN_IMAGE = 1e-3  # relative: what is its own mirror image
MOST_SIGNS, TRIED, ODD = 8, 24, 1e-12  # states; points at which symmetry is tried; relative
NOISE, EDGE = 1e-7, 1e-9  # of M's entries; of the map
# a crossing is closed in on from both sides, to 2^-NEARER of what is left, some times; by how much
# states may change more than along a straight curve
NEARER, CLOSER, STRAIGHT = 20, 6, 4.0


def searched(scene, square, axes, fixed):
    """[(class, parameters (m, 2), errors (m), {name: (values, errors)})] of the curves; see
    `curves.searched`; and whether some are known to lack, as along a line by itself, where they do
    not explain the numbers of orbits.
    """
    names = [p.name for p in scene.own]
    varied = [names.index(name) for name in axes if name in names]
    given = np.array([fixed.get(name, np.nan) for name in names])
    on_map = _Map(scene.equation, square, varied, given, scene.continued)
    found = []
    seeds = on_map.seeds()
    for how in on_map.kinds:
        points = on_map.points(how)
        for y, border in on_map.followed(points, seeds[how]):
            found += on_map.shown(points, y, border)
            for other in on_map.at_ends(how):
                seeds[other] += on_map.beside(points, y, other)
    found += on_map.crossings
    order = {kind: k for k, kind in enumerate((PLUS_ONE, MINUS_ONE, NEIMARK_SACKER))}
    return sorted(found, key=lambda one: order[one[0]]), on_map.lacks(found)


class Criticality(NamedTuple):
    """The way in which an orbit has a multiplier on the unit circle: see `critical.Critical`."""

    kind: int
    mirror: tuple | None = None
    branching: bool = False


class _Map:
    """A map of the parameters number `varied`, the unit square `square`; `given`: the others."""

    def __init__(self, equation, square, varied, given, continued):
        self.equation = equation
        self.square = square
        self.varied = list(varied)
        self.given = given
        self.continued = continued
        self.reach = monodromy.method_of("auto").floquet_reach(RTOL)
        self._points, self.mirror = {}, mirror_of(equation, square, self.varied, given)
        self._numbers = None  # of orbits along a line, by the continuation
        self.crossings = []  # as `shown` gives points, of a line by itself
        # has a multiplier passed 1 or -1 on a line where no orbit is found to have it?
        self._missed = False
        self.kinds = [
            Criticality(kind)
            for kind in KINDS
            if kind != NEIMARK_SACKER or equation.n - equation.free > 1
        ]
        if self.mirror is not None:
            more = ((PLUS_ONE, False), (PLUS_ONE, True), (NEIMARK_SACKER, False))
            self.kinds = [
                *(Criticality(kind, self.mirror, branching) for kind, branching in more),
                *self.kinds,
            ]
            self.kinds.sort(key=lambda how: how.kind != NEIMARK_SACKER)

    def points(self, how):
        """Points of the orbits that have a multiplier in this way."""
        if how not in self._points:
            low, high, log = (
                one[: len(self.varied)]
                for one in (self.square.low, self.square.high, self.square.log)
            )
            scale = np.where(
                log, np.log(np.where(log, high, 1.0) / np.where(log, low, 1.0)), high - low
            )
            self._points[how] = CriticalPoints(
                Critical.of(self.equation, self.varied, *how), self.given, scale, log
            )
        return self._points[how]

    def positions(self, y):
        """Positions (N, 2) of y, which ends with the varied parameters."""
        own = np.zeros((len(y), 2))
        own[:, : len(self.varied)] = y[:, -len(self.varied) :]
        return self.square.positions(own)

    def seeds(self):
        """{Criticality: [y (size)]} of orbits on the lines."""
        found = {how: [] for how in self.kinds}
        for axis in range(len(self.varied)):
            for how, y in self._of_lines(axis):
                found[how] += list(y)
        return found

    def _of_lines(self, axis):
        """(Criticality, y) where orbits along the axis have the multiplier."""
        index = self.varied[axis]
        low, high = float(self.square.low[axis]), float(self.square.high[axis])
        if self.continued is not None and self.continued.index == index:
            low, high = min(low, self.continued.low), max(high, self.continued.high)
        lines = np.zeros((ROWS if len(self.varied) > 1 else 1, 2))
        lines[:, 1 - axis] = np.linspace(0.0, 1.0, len(lines))
        rows = np.tile(self.given, (len(lines), 1))
        for k, other in enumerate(self.varied):
            rows[:, other] = self.square.parameters(lines)[:, k]
        elsewhere = self.continued is not None and self.continued.index not in self.varied
        begin = self._continued if elsewhere else None
        seeds = ALONE if elsewhere and len(rows) == 1 else SEEDS
        curves = ContinuedCurves(
            self.equation, Range(index, low, high), rows, self.reach, begin, seeds
        )
        for row, of_row in enumerate(curves.of_row):
            for curve in of_row:
                yield from self._of_curve(curves, row, curve.finer(FINER), axis)

    def _continued(self, points):
        """[(states, periods)] of the first, second, ... orbits at points (N, parameters), by the
        continuation.
        """
        curves = ContinuedCurves(self.equation, self.continued, points, self.reach)
        n = self.equation.n
        found = []
        for k, point in enumerate(points):
            _which, x, T = curves.starts(k, point[[self.continued.index]])
            own = distinct(x, T, self.equation.free)
            found.append((x[own], T[own]))
        self._numbers = np.array([len(T) for _x, T in found])
        for i in range(max(len(T) for _x, T in found)):
            some = [k for k, (_x, T) in enumerate(found) if i < len(T)]
            x, T = np.full((len(points), n), np.nan), np.full(len(points), np.nan)
            x[some], T[some] = [found[k][0][i] for k in some], [found[k][1][i] for k in some]
            yield x, T if self.equation.free else self.equation.periods(points)

    def lacks(self, found):
        """Along a line by itself: is a multiplier known to pass 1 or -1 where none is `found`, or does the
        number of orbits change by what no fold in it explains?
        """
        if len(self.varied) > 1:
            return False
        if self._numbers is None:
            return self._missed
        folds = [
            (PLUS_ONE, at)
            for kind, parameters, *_rest in found
            if kind == PLUS_ONE
            for at in self.square.positions(parameters)[:, 0]
        ]
        ticks = np.linspace(0.0, 1.0, len(self._numbers))
        explained = along(self._numbers, ticks, folds, {PLUS_ONE: 2}, optional=(PLUS_ONE,))
        return self._missed or not all(explained.values())

    def _of_curve(self, curves, row, y, axis):
        """The same of one curve of orbits."""
        n = self.equation.n
        free = self.equation.free

        def orbits(y):
            points = curves.points(np.full(len(y), row), y[:, -1])
            return points, y[:, :n], y[:, n] if free else self.equation.periods(points)

        M, f = self._matrices(*orbits(y))
        noise = NOISE * (1.0 + abs(M).max(axis=(1, 2))) ** M.shape[1]
        for kind, values in _tests(judged(M, f)).items():
            with np.errstate(all="ignore"):
                sure = abs(values) > noise
                at = np.flatnonzero((values[:-1] * values[1:] < 0.0) & sure[:-1] & sure[1:])
                share = (values[at] / (values[at] - values[at + 1]))[:, None]
            if not at.size:
                continue
            near = orbits(y[at] + share * (y[at + 1] - y[at]))
            own = self._mirrored(*near)
            # each by itself, on a line by itself: is it found?
            alone = kind != NEIMARK_SACKER and len(self.varied) < 2
            for group in np.eye(at.size, dtype=bool) if alone else np.ones((1, at.size), bool):
                found = 0
                for how in self.kinds:
                    some = group & (own if how.mirror else ~own)
                    if how.kind == kind and some.any():
                        start = self._near(how, *(one[some] for one in near))
                        located = self._located(how, start, 1 - axis)
                        found += len(located)
                        yield how, located
                if alone and not found:
                    k = at[group][0]
                    self._close_in(orbits, y[k : k + 2], kind)

    def _close_in(self, orbits, ends, kind):
        """Add to `crossings` where a multiplier passes 1 or -1 between two orbits of a line by itself, y (2,
        size) as in `_of_curve`; or note that it is not found.
        """
        method, n = monodromy.method_of("auto"), self.equation.n

        def at(y):
            """The orbits near y, the determinant, 0 where its sign is not certain, and M."""
            points, x, T = orbits(y)
            found = orbit.shown(self.equation, points, x, T, method, RTOL, relax=False)
            M = found.others.M
            value, bar = bifurcations.functions(M.shape[1], "none")[kind](M, found.others.E)
            y = y.copy()
            y[found.good, :n] = found.x[found.good]
            if self.equation.free:
                y[found.good, n] = found.T[found.good]
            return y, np.where(found.good & (abs(value) > bar), value, 0.0), M

        def places(y):
            return self.positions(orbits(y)[0][:, self.varied])[:, 0]

        begin = places(ends)
        if not ((begin > 0.0) & (begin < 1.0)).all():
            return
        first = known = at(ends)
        if not known[1][0] * known[1][1] < 0.0:
            self._missed = True
            return
        ways = 0.5 ** np.arange(1, NEARER + 1)
        for _ in range(CLOSER):
            (low, high), value, _M = known
            zero = value[0] / (value[0] - value[1])
            share = np.concatenate([zero - zero * ways, zero + (1.0 - zero) * ways[::-1]])
            inside = at(low + share[:, None] * (high - low))
            both = [np.concatenate([a[:1], b, a[1:]]) for a, b in zip(known, inside, strict=True)]
            # next to a crossing Newton's method may go over to the other curve, with the other sign
            one, two = (np.flatnonzero(np.sign(both[1]) == side) for side in np.sign(value))
            nearest = [one[one < two[0]][-1], two[two > one[-1]][0]]
            known = [a[nearest] for a in both]
        place = places(known[0])
        before, moved = (abs(np.diff(y[:, :n], axis=0)[0]) for y in (first[0], known[0]))
        with np.errstate(all="ignore"):
            share = abs(np.diff(place) / np.diff(begin))
        size = floored(abs(first[0][:, :n]).max(axis=0)[None])[0]
        if not (moved <= STRAIGHT * share * before + CONVERGED * size).all():
            self._missed = True  # not on one curve, but on two that meet at a fold
            return
        self._cross(kind, place, known[2][0])

    def _cross(self, kind, place, M):
        """Add to `crossings` what lies between these positions (2) of a line; M is that of an orbit there."""
        at, parameters = np.zeros((1, 2)), np.zeros((1, 2))
        at[0, 0] = place.mean()
        parameters[:, 0] = self.square.parameters(at)[:, 0]
        error = 0.5 * abs(np.diff(place)) * (1.0 + 1e-9) + self.square.grain
        for other, x, bar, _known in self.crossings:  # along the other curve
            apart = abs(self.square.positions(x)[0, 0] - at[0, 0])
            if other == kind and apart <= bar[0] + error[0]:
                return
        goal, angle = (1.0, 0.0) if kind == PLUS_ONE else (-1.0, np.pi)
        multipliers = np.linalg.eigvals(M)
        others = np.delete(multipliers, abs(multipliers - goal).argmin())
        outside = np.array([float((abs(others) > 1.0).sum())])
        known = {"angle": (np.array([angle]), np.zeros(1)), "outside": (outside, np.zeros(1))}
        self.crossings.append((kind, parameters, error, known))

    def _mirrored(self, points, x, T):
        """Which orbits are their own mirror images, nearly."""
        if self.mirror is None:
            return np.zeros(len(x), bool)
        half, _M, size = rough_flow(self.equation, points, x, 0.5 * T, derived=False)
        return (
            abs(half - np.array(self.mirror) * x) <= OWN_IMAGE * size.max(axis=1, keepdims=True)
        ).all(axis=1)

    def _located(self, how, start, held):
        """Orbits y with the multiplier near these, at the same parameter number `held` of the map;
        those on the map.
        """
        points = self.points(how)
        rows, goal = np.zeros((len(start), 0, start.shape[1])), np.zeros((len(start), 0))
        if len(self.varied) > 1:
            rows, goal = points.held(
                start, np.full(len(start), points.critical.parameters_at + held)
            )
        found, good = points.solved(start, rows, goal)
        with np.errstate(invalid="ignore"):
            here = self.positions(found)
            good &= ((here > -EDGE) & (here < 1.0 + EDGE)).all(axis=1)
            if how.kind == NEIMARK_SACKER:
                angle = found[:, points.critical.angle_at]
                good &= (angle > NEAREST) & (angle < np.pi - NEAREST)
        found, rows, goal = found[good], rows[good], goal[good]
        return found[points.shown(found, rows, goal).good]

    def _matrices(self, points, x, T):
        """M (N, n, n) of orbits, and f (N, n) where their periods are unknown."""
        M = rough_flow(self.equation, points, x, T)[1]
        return M, slopes(self.equation, points, x) if self.equation.free else None

    def _near(self, how, points, x, T):
        """The unknowns y (N, size) of `critical` near orbits."""
        own = self.points(how).critical
        n = self.equation.n
        M, f = self._matrices(points, x, T if how.mirror is None else 0.5 * T)
        M = own.signs[:n, None] * M
        y = np.full((len(x), own.size), np.nan)
        for k in np.flatnonzero(np.isfinite(M).all(axis=(1, 2))):
            if how.kind == NEIMARK_SACKER:
                values, vectors = np.linalg.eig(M[k])
                away = np.where(values.imag > 0.0, abs(abs(values) - 1.0), np.inf)
                best = away.argmin()
                if not np.isfinite(away[best]):
                    continue
                z = vectors[:, best]
                y[k, n : 3 * n] = np.concatenate([z.real, z.imag])
                y[k, own.angle_at] = np.angle(values[best])
            else:
                matrix = M[k] + (1.0 if how.kind == MINUS_ONE or how.branching else -1.0) * np.eye(
                    n
                )
                if own.drifts:
                    matrix = bordered(matrix[None], f[k : k + 1], f[k : k + 1])[0]
                vector = np.linalg.svd(matrix)[2][-1]
                y[k, n : own.angle_at + own.drifts] = vector / np.linalg.norm(vector[:n])
            y[k, :n], y[k, own.parameters_at :] = x[k], points[k, self.varied]
            if own.free:
                y[k, own.period_at] = T[k]
        return y

    def at_ends(self, how):
        """The Hows whose curves may pass the ends of those of `how`, complex pairs that meet."""
        return (
            [other for other in self.kinds if other.mirror == how.mirror]
            if how.kind == NEIMARK_SACKER
            else []
        )

    def beside(self, points, y, how):
        """Orbits y of the kind `how` next to the ends of a curve of complex pairs, which meet at 1
        or at -1.
        """
        if how.kind == NEIMARK_SACKER:
            return []
        own, goal = points.critical, np.pi if how.kind == MINUS_ONE or how.branching else 0.0
        ends = y[[0, -1]]
        ends = ends[
            abs(abs((ends[:, own.angle_at] - goal + np.pi) % (2 * np.pi) - np.pi)) < 1.5 * NEAREST
        ]
        if not len(ends):
            return []
        parameters = points.parameters(ends)
        n = self.equation.n
        T = ends[:, own.period_at] if own.free else self.equation.periods(parameters)
        start = self._near(how, parameters, ends[:, :n], T)
        return [one for held in (0, 1) for one in self._located(how, start, held)]

    def followed(self, points, seeds):
        """[(y (m, size), columns (m) of parameters at the map's border or -1)] of the curves through
        the seeds.
        """
        if len(self.varied) < 2:
            return [(one[None], np.full(1, -1)) for one in seeds]
        curves = []
        for seed, image in zip(seeds, self._images(points, seeds), strict=True):
            if any(self._passes(points, y, one) for y, _border in curves for one in (seed, image)):
                continue
            curves.append(Walk(points, self.square, self.positions).curve(seed))
        return curves

    def _images(self, points, seeds):
        """The orbits' mirror images, which have the same curves."""
        own = points.critical
        if self.mirror is None or own.mirror is not None or not seeds:
            return seeds
        y = np.array(seeds)
        n = own.n
        parameters = points.parameters(y)
        T = y[:, own.period_at] if own.free else self.equation.periods(parameters)
        y[:, :n] = (
            np.array(self.mirror)
            * rough_flow(self.equation, parameters, y[:, :n], 0.5 * T, derived=False)[0]
        )
        return y

    def _passes(self, points, y, seed):
        """Does the curve y pass the seed?"""
        if len(y) < 2:
            return False
        x, at = self.positions(y), self.positions(seed[None])[0]
        chord = np.diff(x, axis=0)
        share = ((at - x[:-1]) * chord).sum(axis=1) / np.maximum(
            (chord * chord).sum(axis=1), 1e-300
        )
        share = np.clip(share, 0.0, 1.0)[:, None]
        off = abs(x[:-1] + share * chord - at).max(axis=1)
        own = y[:-1] + share * np.diff(y, axis=0)
        n = points.critical.n
        if points.critical.free:  # x may lie anywhere on the orbit
            T = points.critical.period_at
            alike = abs(own[:, T] - seed[T]) <= ALIKE * seed[T]
        else:
            alike = (
                abs(own[:, :n] - seed[:n]) <= ALIKE * floored(abs(y[:, :n]).max(axis=0)[None])
            ).all(axis=1)
        return bool(((off < SAME) & alike).any())

    def shown(self, points, y, border):
        """[(class, parameters, errors, {name: (values, errors)})] of the parts of a curve that are
        shown to exist.
        """
        own = points.critical
        N = len(y)
        last = own.parameters_at
        if len(self.varied) > 1:
            # the other parameter is held: that along which the curve runs, or the one at the border
            slope = abs(np.gradient(self.positions(y), axis=0)) if N > 1 else np.array([[1.0, 0.0]])
            held = np.where(border >= 0, border, slope.argmax(axis=1))
            fixed = y[np.arange(N), last + held]
            y, good = points.solved(y, *points.held(y, last + held))
            y[np.arange(N), last + held] = fixed
            y[~good] = np.nan
            shown = points.shown(y, *points.held(y, last + held))
        else:
            held = np.ones(N, int)
            shown = points.shown(y, np.zeros((N, 0, own.size)), np.zeros((N, 0)))
        parameters = np.zeros((N, 2))
        parameters[:, : len(self.varied)] = y[:, last:]
        beside = parameters.copy()
        sides = np.arange(N), 1 - held
        beside[sides] += shown.dy[np.arange(N), np.minimum(last + 1 - held, own.size - 1)]
        with np.errstate(all="ignore"):
            error = abs(self.square.positions(beside) - self.square.positions(parameters)).max(
                axis=1
            ) * (1 + 1e-9)
        angle, bar, outside = self._passing(points, y, shown)
        shown.good &= np.isfinite(error)
        found = []
        least = 1 if len(self.varied) < 2 else 2
        for part in (
            contours.runs(shown.good)
            if least > 1
            else [np.array([k]) for k in np.flatnonzero(shown.good)]
        ):
            known = {"angle": (angle[part], bar[part]), "outside": (outside[part], 0.0 * bar[part])}
            found.append((own.kind, parameters[part], error[part] + self.square.grain, known))
        return found

    def _passing(self, points, y, shown):
        """The angle, its bound, and the number of other multipliers outside the circle."""
        own = points.critical
        M, E = shown.M, shown.dM
        if own.mirror is not None:
            signs = own.signs[: own.n, None]
            M, E = square_of(signs * M, E)
        if own.free:
            M, E = existence.deflated(M, E, shown.f, shown.df)
        M, E = (np.where(shown.good[:, None, None], one, np.eye(M.shape[1])) for one in (M, E))
        _sure, angle, bar, outside = bifurcations.passing(M, E, own.kind, "none")
        if own.kind == NEIMARK_SACKER:
            angle, bar = y[:, own.angle_at], shown.dy[:, own.angle_at]
            angle, bar = (angle, bar) if own.mirror is None else (2.0 * angle, 2.0 * bar)
            angle = abs((angle + np.pi) % (2.0 * np.pi) - np.pi)
            bar = bar + 8.0 * EPS
        return angle, bar, outside


def square_of(M, E):
    """M M and its bounds, of M known to within E."""
    with np.errstate(all="ignore"):
        size = abs(M)
        return M @ M, size @ E + E @ size + E @ E + 2 * M.shape[1] * EPS * size @ size


def mirror_of(equation, square, varied, given):
    """The signs S (n), not all 1, for which f(t + T/2, S x) = S f(t, x) as far as it is tried;
    None: there are none.
    """
    n = equation.n
    if n > MOST_SIGNS:
        return None
    spread = np.random.default_rng(1)
    points = np.tile(given, (TRIED, 1))
    points[:, varied] = square.parameters(spread.random((TRIED, 2)))[:, : len(varied)]
    x0, T = equation.begin(points)
    x = spread.standard_normal((TRIED, n)) * (1.0 + abs(x0))
    t = spread.random(TRIED) * T
    traced = equation.traced(points, x)

    def f(t, x):
        out = np.full((TRIED, n), np.nan)
        for own, programs in traced:
            out[own] = programs.slopes(programs.numbers(points[own]), t[own], x[own])[0]
        return out

    here = f(t, x)
    usable = np.isfinite(here).all(axis=1)
    if not usable.any():
        return None
    for signs in product((-1.0, 1.0), repeat=n):
        S = np.array(signs)
        if (S > 0).all():
            continue
        off = abs(f(t + 0.5 * T, S * x) - S * here)[usable]
        if (off <= ODD * (abs(here[usable]).max(axis=1, keepdims=True) + 1e-300)).all():
            return signs
    return None


def judged(M, f):
    """M without the multiplier 1 of the motion along the orbit, if there is one."""
    if f is None:
        return M
    zero = np.zeros_like(M)
    with np.errstate(all="ignore"):
        return existence.deflated(M, zero, f, np.zeros_like(f))[0]


def _tests(M):
    """{kind: function (N)} of the matrices, with a zero where the multiplier passes."""
    N, n = M.shape[:2]
    good = np.isfinite(M).all(axis=(1, 2))
    own, one = M[good], np.eye(n)
    values = {PLUS_ONE: np.linalg.det(own - one), MINUS_ONE: np.linalg.det(own + one)}
    if n > 1:
        multipliers = np.linalg.eigvals(own)
        first, second = np.triu_indices(n, 1)
        values[NEIMARK_SACKER] = (
            (multipliers[:, first] * multipliers[:, second] - 1.0).prod(axis=1).real
        )
    found = {kind: np.full(N, np.nan) for kind in values}
    for kind, own in values.items():
        found[kind][good] = own
    return found
