"""Families of symmetric orbits (see `symmetry`) on a map of two parameters, or a line: their
multipliers anywhere.

On a lattice orbits are found from `start`, or, on every fourth line, by following them along the
parameter of the continuation. In between, splines of x(0) and T are where Newton's method begins,
and the orbit it finds is shown to exist (`shooting`).
"""

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline

from survey.measures import contours
from survey.measures.floquet import monodromy, orbit
from survey.measures.floquet.continuation import floored
from survey.measures.floquet.newton import located

NOISE = 1e-9  # relative: a guess of the errors on the lattice, where orbits are not shown to exist
# rtol of the series by which orbits are found, and of those that are told apart
REACHED, ENOUGH = 1e-13, 1e-9
FOLLOWED = 4  # lines from one that is followed to the next; a power of two
SAME = 1e-4  # relative: periods of one orbit, from cubic pieces of its curve
WIDE = 1e-7  # relative: bounds of M above which orbits are shown again with finer steps
HOLE = 1e-9  # the weight of what is unknown, but for rounding
ALIKE = 0.05  # relative: how near its guess an orbit between these lines must be


class Family:
    """The orbits of an OrbitScene on the map of `axes`, the unit square `square`; `fixed`: the
    other parameters.

    They are looked for on `lines` lines each way. Where orbits are continued, they are those number
    `fixed["branch"]`.
    """

    def __init__(self, scene, square, axes, fixed, lines):
        self.equation, self.square, self.continued = scene.equation, square, scene.continued
        self.method = monodromy.method_of("auto")
        self.reach = self.method.floquet_reach(REACHED)
        names = [p.name for p in scene.own]
        self.given = np.array([fixed.get(name, np.nan) for name in names])
        self.varied = [names.index(name) for name in axes if name in names]
        self.branch = int(fixed.get("branch", 1))
        self.x = contours.lattice(lines, square.across)
        self.points, n = self._parameters(self.x), self.equation.n
        self.states, self.T = np.full((len(self.x), n), np.nan), np.full(len(self.x), np.nan)
        self._find(np.arange(len(self.x)).reshape(lines, -1))

    def _parameters(self, x):
        """All parameters (N, parameters) at positions (N, 2)."""
        points = np.tile(self.given, (len(x), 1))
        points[:, self.varied] = self.square.parameters(x)[:, : len(self.varied)]
        return points

    def _find(self, lattice):
        """Find the orbits of the `lattice`, an array (lines, lines), or (lines, 1), of their numbers."""
        if self.continued is None:
            self._locate(lattice.ravel(), *self.equation.begin(self.points))
        else:
            along = self.continued.index
            # the axis with a line for each position
            across = 1 - self.varied.index(along) if along in self.varied else 0
            each = np.arange(lattice.shape[across])
            step = FOLLOWED if each.size > 1 else 1
            followed = lattice.take(each[::step], across).ravel()
            self._locate(followed, *self._followed(followed))
            while step > 1:
                self._interpolate(lattice.take(each[::step], across))
                step //= 2
                between = lattice.take(each[step :: 2 * step], across).ravel()
                _points, x, T = self._near(self.x[between])
                self._locate(between, x, T, ALIKE)
            self._extend(lattice)
        self._interpolate(lattice)

    def _extend(self, lattice):
        """Find orbits of the `lattice` next to known ones, from where two of these in a row
        lead, until no more are found: beside the end of the family lines are too far apart.
        """
        ways = [np.moveaxis(lattice, axis, 0)[::side] for axis in (0, 1) for side in (1, -1)]
        tried = np.zeros((len(ways), self.T.size), dtype=bool)
        progress = True
        while progress:
            progress = False
            for way, before in zip(ways, tried, strict=True):
                first, second, next_ = (way[k : len(way) - 2 + k].ravel() for k in range(3))
                known = np.isfinite(self.T)
                own = known[first] & known[second] & ~known[next_] & ~before[next_]
                first, second, next_ = first[own], second[own], next_[own]
                before[next_] = True
                x, T = (2.0 * values[second] - values[first] for values in (self.states, self.T))
                self._locate(next_, self.equation.pinned(self.points[next_], x), T, ALIKE)
                progress |= bool(np.isfinite(self.T[next_]).any())

    def _locate(self, those, x, T, alike=np.inf):
        """Find orbits number `those` from x and T, from which they differ by less than `alike`."""
        orbits, good = located(self.equation, self.points[those], self.reach, x, T)
        off = (abs(orbits.x - x) / floored(orbits.size)).max(axis=1)
        good = good[(off[good] <= alike) & (abs(orbits.T - T)[good] <= alike * orbits.T[good])]
        self.states[those[good]], self.T[those[good]] = orbits.x[good], orbits.T[good]

    def _followed(self, those):
        """States and periods where Newton's method begins, of orbits that are followed along the
        continuation.
        """
        points = self.points[those]
        found = zip(*orbit.followed(self.equation, self.continued, points, self.reach), strict=True)
        which, states, periods = map(np.concatenate, found)
        x, T = np.full((len(points), self.equation.n), np.nan), np.full(len(points), np.nan)
        for k in np.unique(which):
            own = self._chosen(points[k], states[which == k], periods[which == k])
            if own is not None:
                x[k], T[k] = states[which == k][own], periods[which == k][own]
        return x, T

    def _chosen(self, point, x, T):
        """Which of the orbits near x (K, n) and T at a point is number `branch`; None if there are
        not so many.
        """
        if (abs(T - T[0]) <= SAME * T).all():  # one orbit, perhaps found twice
            return 0 if abs(self.branch) == 1 else None
        points = np.tile(point, (len(x), 1))
        found = orbit.shown(self.equation, points, x, T, self.method, ENOUGH, relax=False)
        shown = [orbit.KnownOrbit.of(found, i, i) for i in np.flatnonzero(found.good)]
        order = orbit.numbered(shown, free=False)
        return order[self.branch - (self.branch > 0)] if abs(self.branch) <= len(order) else None

    def _interpolate(self, lattice):
        """Make splines of the states that are unknown and of T from those on a lattice, an array of
        their numbers.
        """
        ticks = self.x[lattice[:, 0], 0], self.x[lattice[0], 1]
        columns = [*self.states.T[self.equation.symmetry.unknown], self.T]
        self._splines = [_spline(ticks, values[lattice]) for values in columns]

    def on_lattice(self):
        """(M, E) on the lattice, as `rough` gives them."""
        return self._rough(self.points, self.states, self.T)

    def rough(self, x):
        """As `matrices`, several times as fast, but no orbit is shown to exist: E is a guess."""
        points, start, T = self._near(x)
        orbits, good = located(self.equation, points, self.reach, start, T)
        known = np.isin(np.arange(len(x)), good)
        return self._rough(
            points, np.where(known[:, None], orbits.x, np.nan), np.where(known, orbits.T, np.nan)
        )

    def matrices(self, x, rtol, wide=np.inf):
        """(M, E) (N, m, m) at positions (N, 2), of the multipliers that are judged: (0 1; -1 2 K),
        see `symmetry`; `wide`: see `orbit.shown`.
        """
        points, start, T = self._near(x)
        M, E = np.full((2, len(x), self.equation.judged, self.equation.judged), np.nan)
        for i in range(0, len(x), orbit.CHUNK):
            own = slice(i, i + orbit.CHUNK)
            given = self.equation, points[own], start[own], T[own], self.method, rtol
            found = orbit.shown(*given, relax=False, wide=wide)
            M[own], E[own] = found.others.M, found.others.E
        return M, E

    def close(self, x):
        """As `matrices`, with the narrowest bounds."""
        return self.matrices(x, REACHED, WIDE)

    def _near(self, x):
        """The parameters at positions (N, 2), and where Newton's method begins there."""
        points, symmetry = self._parameters(x), self.equation.symmetry
        columns = np.stack([spline(x) for spline in self._splines], axis=1)
        columns[((x < 0.0) | (x > 1.0)).any(axis=1)] = np.nan
        start = np.zeros((len(x), self.equation.n))
        start[:, symmetry.unknown] = columns[:, :-1]
        return points, self.equation.pinned(points, start), columns[:, -1]

    def _rough(self, points, x, T):
        """(M, E) of orbits from x (N, n), of the periods T; NaN where x is."""
        n = self.equation.n
        symmetry = self.equation.symmetry
        X, f = np.full((len(x), n, n), np.nan), np.full((len(x), n), np.nan)
        good = np.flatnonzero(np.isfinite(x).all(axis=1))
        for inside, programs in self.equation.traced(points[good], x[good]):
            own = good[inside]
            numbers = programs.numbers(points[own])
            X[own] = programs.flow(numbers, x[own], self.equation.share * T[own], self.reach)[1]
            f[own] = programs.slopes(numbers, np.zeros(own.size), x[own])[0]
        own = symmetry.block(X)
        found = symmetry.matrices(X, _noise(X), f, _noise(f), own, _noise(own))[2]
        return found.M, found.E


def _noise(A):
    """Guesses of the errors of arrays (N, ...)."""
    return np.broadcast_to(NOISE * abs(A).max(axis=tuple(range(1, A.ndim)), keepdims=True), A.shape)


def _spline(ticks, values):
    """The function of positions (N, 2) that has these values; NaN beside points where they are unknown."""
    hole, values = np.where(np.isfinite(values), 0.0, 1.0), contours.filled(values)
    if len(ticks[1]) == 1:
        along = CubicSpline(ticks[0], values[:, 0])
        return lambda x: np.where(
            np.interp(x[:, 0], ticks[0], hole[:, 0]) > 0.0, np.nan, along(x[:, 0])
        )
    both = RectBivariateSpline(*ticks, values)
    outside = RectBivariateSpline(*ticks, hole, kx=1, ky=1)
    return lambda x: np.where(outside.ev(*x.T) > HOLE, np.nan, both.ev(*x.T))
