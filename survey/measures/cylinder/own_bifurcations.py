"""The curves on a map of two parameters at which the portrait of a user's flow changes, f and g of
period 2 pi.

    ends    the first of mean(f), mean(g), K, L (see `ends`) that does not vanish all over the map is 0
    fold    g = g' = 0; cusps where g'' = 0
    Hopf    f = g = 0, g' < 0; with f, g in powers of the angle super- or subcritical as f2 - f1 g2 / g1 < 0 or > 0,
            generalised where that is 0; the curve ends in f = g = g' = 0, a Bogdanov-Takens point

and saddle connections (`connections`) and folds of cycles (`cycle_folds`). Values of f and g are
those of balls that hold every rounding. Points of codimension two lie on the curves that are
followed (`survey.measures.tracks`).

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapters 3 and 8.
"""

from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import program as pg
from survey.kernels.cylinder.balls import ball
from survey.kernels.cylinder.flow import TWO_PI
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.measures import contours, tracks
from survey.measures.cylinder import bifurcations, connections, cycle_folds, ends
from survey.measures.cylinder.fate import MOST_OF_PROGRAM

LINES, ANGLES = 33, 256  # of the lattice, and at which extrema of g are looked for
NUMBERS = ("mean_f", "mean_g", "K", "L")  # of `ends`, one after another
F0, F1, F2, G0, G1, G2, G3 = range(7)


@dataclass(frozen=True)
class ScenePlane(bifurcations.ParameterPlane):
    """A map of two parameters of the `scene`, an AbelScene."""

    scene: object

    def flows(self, x):
        """The rows of the flows at positions x (m, 2); NaN where there is none."""
        system = self.system(self.square.parameters(x))
        names = [p.name for p in self.scene.own]
        return self.scene.flows(
            np.column_stack(np.broadcast_arrays(*(system[name] for name in names), x[:, 0]))[:, :-1]
        )

    @property
    def conservative(self):
        return False

    def flow(self, position):
        """The row of the flow at one position (2), or None; the last ones are kept."""
        return _flow(self.flows, position.tobytes())


@lru_cache(maxsize=64)
def _flow(flows, position):
    row = flows(np.frombuffer(position)[None])[0]
    return row if np.isfinite(row).all() else None


def series(row, phi):
    """f and g in powers of the angle about phi (7, 2): F0 to G3, each a middle and a radius."""
    balls = np.zeros((int(row[pg.SLOTS]), 4, 2))
    ball(row, float(phi), 0.0, 4, balls)
    f, g = balls[int(row[pg.F_AT])], balls[int(row[pg.G_AT])]
    return np.concatenate([f[:3], g])


def found(plane):
    """[(class, parameters (m, 2), errors (m), {name: (values, errors)})] of the curves and points
    on the map.
    """
    yield from _ends(plane)
    yield from connections.found(plane)
    yield from cycle_folds.found(plane)
    for things, function, drawn in ((_extrema, _fold, _folds), (_rests, _hopf, _hopfs)):
        at = partial(_at, plane, function)
        for _label, track in tracks.from_lattice(
            LINES, partial(things, plane), lambda _, at=at: (at, TWO_PI), plane.square
        ):
            for part in track.certain():
                yield from drawn(plane, part)


def _at(plane, function, coordinate, position):
    row = plane.flow(position)
    return np.full(4, np.nan) if row is None else function(series(row, coordinate))


def _fold(s):
    """g, g' and their bars."""
    return s[G0, 0], s[G1, 0], s[G0, 1], s[G1, 1]


def _hopf(s):
    """f, g and their bars."""
    return s[F0, 0], s[G0, 0], s[F0, 1], s[G0, 1]


def _extrema(plane, position):
    """The extrema of g: [(label, is it a minimum?, angle, g)]."""
    row = plane.flow(position)
    if row is None:
        return []
    angles = np.linspace(0.0, TWO_PI, ANGLES + 1)
    slopes = np.array([pg.values(row, phi)[2] for phi in angles])
    found = []
    slopes[-1] = slopes[0]  # of which one alone may be 0
    for i in np.flatnonzero((slopes[1:] > 0.0) != (slopes[:-1] > 0.0)):
        phi = angles[i] + (angles[i + 1] - angles[i]) * slopes[i] / (slopes[i] - slopes[i + 1])
        found.append(("fold", bool(slopes[i + 1] > 0.0), phi, pg.values(row, phi)[1]))
    return found


def _rests(plane, position):
    """The equilibria that are not saddles: [(label, None, angle, f)]."""
    row = plane.flow(position)
    if row is None:
        return []
    table = np.zeros((MOST_OF_PROGRAM, eq.EQUILIBRIUM_SIZE))
    rows = table[: max(eq.bisected(row, table), 0)]
    return [("hopf", None, one[eq.ANGLE], one[eq.F]) for one in rows if one[eq.DG] < 0.0]


def _curve(plane, kind, part):
    angle = part.coordinate % TWO_PI
    return (
        kind,
        plane.square.parameters(part.x),
        part.error,
        {"equilibrium_phi": (angle, part.coordinate_error)},
    )


def _folds(plane, part):
    """A fold, and its cusps."""
    yield _curve(plane, "fold", part)
    for _index, mark in _marks(plane, part, _fold, lambda s: (s[G2, 0], s[G2, 1])):
        yield _curve(plane, "cusp", mark)


def bend(s):
    """f2 g1 - f1 g2, which is > 0 at a supercritical Hopf point, and its bar."""
    pairs = (F2, G1), (F1, G2)
    one, two = (s[i, 0] * s[j, 0] for i, j in pairs)
    bars = [abs(s[i, 0]) * s[j, 1] + abs(s[j, 0]) * s[i, 1] + s[i, 1] * s[j, 1] for i, j in pairs]
    return one - two, sum(bars) + 4.0 * ROUNDOFF_UP * (abs(one) + abs(two))


def _hopfs(plane, part):
    """The parts of a curve f = g = 0 where g' < 0, with the points at their ends."""
    slopes, bends = (
        list(_marks(plane, part, _hopf, third)) for third in (lambda s: (s[G1, 0], s[G1, 1]), bend)
    )
    for _index, mark in slopes:
        yield _curve(plane, "bogdanov_takens", mark)
    bends = [(index, mark) for index, mark in bends if _series(plane, mark, 0)[G1, 0] < 0.0]
    for _index, mark in bends:
        yield _curve(plane, "generalised_hopf", mark)
    marks = sorted(slopes + bends, key=lambda one: one[0])
    indices = [index for index, _ in marks]
    refined = tracks.with_points(part, indices, [mark for _, mark in marks]) if marks else part
    cuts = [0, *(index + i for i, index in enumerate(indices)), len(refined.x) - 1]
    alone = len(refined.x) == 1  # of a line
    for low, high in pairwise(cuts):
        if high > low or alone:
            inner = low + (low in cuts[1:] and not alone)
            s = _series(plane, refined, (low + high + 1) // 2 if high > low + 1 else inner)
            if s[G1, 0] < 0.0:
                kind = "supercritical_hopf" if bend(s)[0] > 0.0 else "subcritical_hopf"
                yield _curve(plane, kind, tracks.part_of(refined, slice(low, high + 1)))


def _series(plane, track, i):
    """The `series` at a point of a Track."""
    return series(plane.flow(track.x[i]), track.coordinate[i])


def _marks(plane, part, function, third):
    """(number of the point after it, Track of it) where third(series) -> (value, bar) passes 0 on a
    curve.

    The errors are those that the bars of its three equations leave.
    """

    def equations(u):
        row = plane.flow(u[1:])
        if row is None:
            return np.full((3, 2), np.nan)
        s = series(row, u[0])
        a, b, bar, b_bar = function(s)
        return np.array([(a, bar), (b, b_bar), third(s)])

    points = np.column_stack([part.coordinate, part.x])
    values = np.array([equations(u)[2, 0] for u in points])
    for i in np.flatnonzero((values[1:] > 0.0) != (values[:-1] > 0.0)):
        u = points[i] + (points[i + 1] - points[i]) * values[i] / (values[i] - values[i + 1])
        step = now = slopes = np.full((3, 3), np.nan)
        for _ in range(20):
            ends_of = [
                [equations(u + side * tracks.STEP * axis)[:, 0] for side in (1.0, -1.0)]
                for axis in np.eye(3)
            ]
            slopes = np.array([(high - low) / (2.0 * tracks.STEP) for high, low in ends_of]).T
            now = equations(u)
            if not np.isfinite(slopes).all() or abs(np.linalg.det(slopes)) < bifurcations.TINY:
                break
            step = -np.linalg.solve(slopes, now[:, 0])
            u = u + step
            if abs(step).max() < 1e-13:
                break
        near = abs(u - points[i]).max() < 2.0 * abs(points[i + 1] - points[i]).max()
        if near and abs(step).max() < 1e-9 and tracks.inside(u[None, 1:])[0]:
            bars = (
                2.0 * abs(np.linalg.inv(slopes)) @ (abs(now[:, 0]) + now[:, 1])
                + 4.0 * plane.square.grain
            )
            error = np.array([np.hypot(*bars[1:])])
            yield i + 1, tracks.Track(u[None, 1:], error, u[:1], bars[:1], np.array([True]))


def _ends(plane):
    """Where the number that decides the ends changes its sign."""

    def known(x, number):
        rows = [ends.of(row) if np.isfinite(row).all() else None for row in plane.flows(x)]
        values = [
            (getattr(row, number), row.bars[NUMBERS.index(number)]) if row else (np.nan, np.nan)
            for row in rows
        ]
        return tuple(np.array(values).T)

    for number in NUMBERS:
        values, bars = known(contours.lattice(LINES, plane.square.across), number)
        if (abs(values) > bars).any():
            for x, error in contours.lines(
                partial(known, number=number), plane.square, LINES, values
            ):
                yield "ends", plane.square.parameters(x), error, {}
            return
