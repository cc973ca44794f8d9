"""The curves on a map of two parameters at which a portrait changes: closed forms, `connections`,
`cycle_folds`.

g is linear in d, c23, s2, s3, and f in b12, b31, so for each angle phi of an equilibrium the
parameters of the map are:

    fold    g = g' = 0              two linear equations for two of d, c23, s2, s3; cusps where g'' = 0
    Hopf    f = g = 0, g' < 0       likewise; super- or subcritical as K < 0 or K > 0; it ends where g' = 0
    ends    K = 0, and L = 0 where K = 0 throughout: w -> +-inf attract on one side and repel on the other

Where f = g = g' = 0 is a Bogdanov-Takens point. K = 0 on a Hopf curve implies L = 0: there the
centre is a reversible one, and Hopf's theorem has no answer at any order. Sections 4 and 5 of
`gyrostat.md`.
"""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import BOUND_G, coefficients
from survey.kernels.cylinder.program import COLUMNS
from survey.kernels.math.roundoff import ROUNDOFF
from survey.measures.cylinder import connections, cycle_folds
from survey.measures.cylinder.fate import G, remembered
from survey.measures.sampled import changes, inside, runs
from survey.measures.square import Square
from survey.methods import taylor

SYSTEM = ("b12", "b31", "d", "c23", "s2", "s3")
FORCES = ("d", "c23", "s2", "s3")
# points of a curve beside which cycles are counted; how far beside, in units of the map
COUNTED, ASIDE = 5, 1e-4
TINY = 1e-300
TURN = (0.0, 2.0 * math.pi)
# roundings, relative to the sizes of the terms, that the solution of two equations makes at most
BARS = 32.0
LATTICE = 2048  # angles at which roots are looked for


@dataclass(frozen=True)
class ParameterPlane:
    """A map of two parameters, `fixed` being the others."""

    square: Square
    axes: tuple
    fixed: dict

    def system(self, xy):
        """{name: values} at parameters xy (m, 2)."""
        return self.fixed | dict(zip(self.axes, np.asarray(xy).T, strict=True))

    @property
    def conservative(self):
        """Is b = 0 all over the map?"""
        return not any(name in self.axes or self.fixed[name] for name in ("b12", "b31"))

    def flows(self, x):
        """The rows of the flows at positions x (m, 2)."""
        system = self.system(self.square.parameters(x))
        return np.ascontiguousarray(
            coefficients(*np.broadcast_arrays(*(system[name] for name in SYSTEM), x[:, 0])[:-1])
        )

    def positions(self, xy):
        xy = np.clip(np.nan_to_num(xy, nan=1e200), -1e200, 1e200)
        return self.square.positions(np.where(self.square.log, np.maximum(xy, TINY), xy))

    def part(self, low, high):
        """The map between two positions on the first axis."""
        ends = self.square.parameters(np.array([[low, 0.0], [high, 1.0]]))
        return replace(self, square=replace(self.square, low=ends[0], high=ends[1]))

    def widths(self, xy):
        """What one unit of the map is, along each axis, at xy (m, 2)."""
        low, high = self.square.low, self.square.high
        ratios = np.log(np.divide(high, low, out=np.ones(2), where=self.square.log))
        return np.where(self.square.log, abs(xy) * ratios, high - low)


def parts(name, phi):
    """What the parameter `name` contributes to g, g', g'' at phi."""
    s, c, s2, c2 = np.sin(phi), np.cos(phi), np.sin(2.0 * phi), np.cos(2.0 * phi)
    return {
        "d": (-0.5 * s2, -c2, 2.0 * s2),
        "c23": (-c2, 2.0 * s2, 4.0 * c2),
        "s2": (c, -s, -c),
        "s3": (-s, -c, s),
    }[name]


def force(system, phi):
    """g, g', g'' at phi."""
    terms = [[system[name] * part for part in parts(name, phi)] for name in FORCES]
    return [sum(column) for column in zip(*terms, strict=True)]


def size(system):
    """The sum of the magnitudes of the terms of g."""
    return sum(abs(system[name]) for name in FORCES)


def constant(system):
    """K."""
    return system["b12"] * system["s3"] - system["b31"] * system["s2"]


def found(plane):
    """[(class, parameters (m, 2), errors (m), {name: (values, errors)})] of the curves and points
    on the map.
    """
    with np.errstate(all="ignore"):
        hopfs = (row for curve in _hopfs(plane) for row in _hopf(plane, curve))
        return [
            *_ends(plane),
            *connections.found(plane),
            *cycle_folds.found(plane),
            *_folds(plane),
            *hopfs,
        ]


def counted(plane, kind, xy, error, known):
    """A row of `found` with the numbers of cycles to the left and to the right of some points of
    the curve.
    """
    sides = np.full((2, len(xy)), np.nan)
    x = plane.positions(xy)
    for i in _spread(x) if len(xy) > 2 and plane.square.across is None else ():
        along = x[i + 1] - x[i - 1]
        across = np.array([-along[1], along[0]]) / max(np.hypot(*along), TINY)
        for side, sign in zip(sides, (1.0, -1.0), strict=True):
            row = plane.flows(x[i][None] + sign * ASIDE * across)[0]
            if not np.isfinite(row).all():
                continue
            s = remembered(taylor, row if len(row) > COLUMNS else row[: rc.SIX])
            if s.stratum == G and s.conclusive and not s.folded and not s.unknown:
                side[i] = len(s.plus) + len(s.minus) + len(s.librations)
    names = ("cycles_left", "cycles_right")
    return (
        kind,
        xy,
        error,
        known | {name: (side, 0.0 * side) for name, side in zip(names, sides, strict=True)},
    )


def _spread(x):
    """Numbers of COUNTED inner points that divide a curve, positions x (m, 2), evenly."""
    along = np.cumsum(np.hypot(*np.diff(x, axis=0).T))
    return np.unique(
        np.clip(np.searchsorted(along, np.linspace(0.0, along[-1], COUNTED)), 1, len(x) - 2)
    )


@dataclass(frozen=True)
class EquilibriumCurve:
    """Parameters xy(t) (m, 2), low <= t <= high, their error bounds bar(t), and the angle phi(t) of
    the equilibrium.
    """

    xy: object
    bar: object
    phi: object
    low: float = TURN[0]
    high: float = TURN[1]


def _straight(plane, a, b, c, noise, phi=None):
    """The EquilibriumCurve a x + b y + c = 0; noise(xy): error bound of the left side."""
    low, high = plane.square.low, plane.square.high
    steep = abs(a) * (high[0] - low[0]) >= abs(b) * (high[1] - low[1])
    along, (own, other) = (1, (a, b)) if steep else (0, (b, a))

    def of(t, value):
        return np.stack(np.broadcast_arrays(*((value, t) if steep else (t, value))), axis=-1)

    def xy(t):
        return of(t, -(c + other * t) / own)

    def bar(t):
        return of(0.0 * t, (noise(xy(t)) + 4.0 * ROUNDOFF * (abs(c) + abs(other * t))) / abs(own))

    angle = None if phi is None else (lambda t: np.full(np.shape(t), phi))
    return EquilibriumCurve(xy, bar, angle, low[along], high[along])


def _run(plane, curve, kind, tests=()):
    """The curve on the map, parted where one of the `tests` changes; kind(t of its middle) is its
    class, or None.
    """
    for t in runs(lambda t: plane.positions(curve.xy(t)), curve.low, curve.high, tests):
        own = kind(t[[t.size // 2]] if t.size > 2 else np.array([0.5 * (t[0] + t[-1])]))
        if own:
            yield _drawn(plane, curve, own, t)


def _drawn(plane, curve, kind, t):
    """One row of `found`."""
    xy = curve.xy(t)
    bar = curve.bar(t)
    known = {}
    # a point on the border to within its rounding, or that of t, is on it
    loose = bar + 2.0 * abs(curve.xy(t + np.spacing(abs(t) + TINY)) - xy)
    for border in (plane.square.low, plane.square.high):
        near = abs(xy - border) <= loose
        xy, bar = np.where(near, border, xy), np.where(near.any(axis=1)[:, None], loose, bar)
    error = np.hypot(*(bar / np.maximum(plane.widths(xy), TINY)).T) + 4.0 * plane.square.grain
    if curve.phi is not None:
        phi = curve.phi(t) % TURN[1]
        known["equilibrium_phi"] = (phi, np.full(phi.shape, 8.0 * ROUNDOFF * TURN[1]))
    return kind, np.clip(xy, plane.square.low, plane.square.high), error, known


def _marks(plane, curve, kind, function):
    """The points of a curve on the map at which function(t) -> (value, error bound) changes sign."""
    lattice = np.linspace(curve.low, curve.high, LATTICE + 1)
    for at in changes(lambda t: function(t)[0] > 0.0, lattice):
        t, step = np.array([at]), 1e-7 * (curve.high - curve.low)
        value, bar = function(t)
        slope = abs(function(t + step)[0] - function(t - step)[0]) / (2.0 * step)
        if _special(plane, curve.xy(t)) and abs(value[0]) <= 1e-6 * slope[0] + bar[0]:
            name, xy, error, known = _drawn(plane, curve, kind, t)
            delay = 1.1 * (bar / np.maximum(slope, TINY) + 2.0 * np.spacing(abs(t) + 1.0))
            speed = (
                (curve.xy(t + delay + step) - curve.xy(t - delay - step))
                / (2.0 * (delay + step))
                / plane.widths(xy)
            )
            turned = abs(curve.phi(t + step) - curve.phi(t - step)) / (2.0 * step)
            angle, rough = known["equilibrium_phi"]
            yield (
                name,
                xy,
                error + delay * np.hypot(*speed.T),
                {"equilibrium_phi": (angle, rough + delay * turned)},
            )


def _special(plane, xy):
    """Is a point on the map, with neither f nor g identically 0 there?"""
    system = plane.system(xy)
    least = 1e-9 * min(plane.square.high - plane.square.low)
    return (
        inside(plane.positions(xy))[0]
        and min(size(system), abs(system["b12"]) + abs(system["b31"])) > least
    )


def _rest(plane):
    """The system with 0 for the parameters of the map: what does not depend on them."""
    return plane.fixed | dict.fromkeys(plane.axes, 0.0)


# ---- folds of equilibria


def _folds(plane):
    """g = g' = 0."""
    mine = [name for name in plane.axes if name in FORCES]
    if len(mine) == 2 and size(_rest(plane)) > 0.0:
        curve = EquilibriumCurve(partial(_fold_at, plane), partial(_fold_bar, plane), np.asarray)
        yield from _run(plane, curve, lambda t: "fold")
        yield from _marks(plane, curve, "cusp", partial(_bend, plane, curve))
    curves = [_all_at(plane, 0.5 * math.pi * k) for k in range(4)] if len(mine) == 2 else []
    curves += list(_folds_of_one(plane, mine[0])) if len(mine) == 1 else []
    for curve in filter(None, curves):
        yield from _run(plane, curve, lambda t: "fold")


def _pair(plane, phi):
    """(g0, g0', determinant, (a, a', b, b')) of the equations g0 + a x + b y = 0 and g0' + a' x +
    b' y = 0.
    """
    g, dg, _ = force(_rest(plane), phi)
    (a, da, _), (b, db, _) = (parts(name, phi) for name in plane.axes)
    return g, dg, a * db - b * da, (a, da, b, db)


def _fold_at(plane, phi):
    g, dg, determinant, (a, da, b, db) = _pair(plane, phi)
    return np.stack([(b * dg - g * db) / determinant, (da * g - a * dg) / determinant], axis=-1)


def _fold_bar(plane, phi):
    bar = BARS * ROUNDOFF * size(plane.system(_fold_at(plane, phi))) / abs(_pair(plane, phi)[2])
    return np.stack([bar, bar], axis=-1)


def _bend(plane, curve, phi):
    """g'', which is 0 where the curve turns back, and its error bound."""
    system = plane.system(curve.xy(phi))
    return force(system, phi)[2], BARS * ROUNDOFF * size(system) + 8.0 * curve.bar(phi)[..., 0]


def _all_at(plane, phi):
    """Where at an angle one equation is 0 = 0, as by symmetry, and the other is not: its solutions,
    a straight line.
    """
    g, dg, _, (a, da, b, db) = _pair(plane, phi)
    noise, own = 8.0 * ROUNDOFF, size(_rest(plane))
    first, second = max(abs(a), abs(b)) > noise, max(abs(da), abs(db)) > noise
    if first == second or abs(dg if first else g) > noise * own:
        return None
    line = (a, b, g) if first else (da, db, dg)
    return _straight(plane, *line, lambda xy: noise * (own + abs(xy).sum(axis=-1)), phi)


def _folds_of_one(plane, name):
    """Straight lines, where g does not depend on the other axis."""
    at, rest = plane.axes.index(name), _rest(plane)

    def mixed(phi):
        (g, dg, _), (a, da, _) = force(rest, phi), parts(name, phi)
        return g * da - dg * a

    for phi in changes(lambda t: mixed(t) > 0.0, np.linspace(*TURN, LATTICE + 1) + 0.1234):
        (g, dg, _), (a, da, _) = force(rest, phi), parts(name, phi)
        value = -(g * a + dg * da) / (a * a + da * da)
        sizes = size(rest | {name: value})
        slope = abs(mixed(phi + 1e-6) - mixed(phi - 1e-6)) / 2e-6
        # error of the angle; g'' moves the value with it
        delay = BARS * ROUNDOFF * sizes / max(slope, TINY)
        bend = abs(force(rest | {name: value}, phi)[2]) + 4.0 * sizes * delay
        bar = (BARS * ROUNDOFF * sizes + delay * bend) / math.hypot(a, da)
        yield _straight(plane, 1.0 - at, 1.0 * at, -value, lambda xy, bar=bar: bar, phi)


# ---- Hopf


def _hopfs(plane):
    """f = g = 0, for g' of either sign."""
    rest = _rest(plane)
    mine = [name for name in plane.axes if name in ("b12", "b31")]
    b12, b31 = rest["b12"], rest["b31"]
    if len(mine) == 2:
        yield from _hopfs_at_rest(plane)
        return
    for side in (0.0, math.pi):
        if mine and (b12 or b31):
            yield _hopf_of_both(plane, mine[0], side)
            continue
        phi = math.atan2(b12, b31) + side if not mine else side + 0.5 * math.pi * (mine[0] == "b12")
        a, b = (parts(name, phi)[0] if name in FORCES else 0.0 for name in plane.axes)
        if max(abs(a), abs(b)) > 8.0 * ROUNDOFF and (mine or b12 or b31):
            own = size(rest)
            noise = lambda xy, own=own: BARS * ROUNDOFF * (own + abs(xy).sum(axis=-1))  # noqa: E731
            yield _straight(plane, a, b, force(rest, phi)[0], noise, phi)


def _hopf_of_both(plane, name, side):
    """One axis in f, whose other coefficient is not 0, and one in g."""
    at, rest = plane.axes.index(name), _rest(plane)
    other = plane.axes[1 - at]

    def phi(t):
        return (
            np.arctan2(*((t, rest["b31"]) if name == "b12" else (rest["b12"] + 0.0 * t, t))) + side
        )

    def pair(t, value):
        return np.stack(np.broadcast_arrays(*((t, value) if at == 0 else (value, t))), axis=-1)

    def xy(t):
        return pair(t, -force(rest, phi(t))[0] / parts(other, phi(t))[0])

    def bar(t):
        return pair(
            0.0 * t, BARS * ROUNDOFF * size(plane.system(xy(t))) / abs(parts(other, phi(t))[0])
        )

    return EquilibriumCurve(xy, bar, phi, plane.square.low[at], plane.square.high[at])


def _hopfs_at_rest(plane):
    """Both axes in f: at each equilibrium a straight line through b = 0."""
    table = np.zeros((eq.MOST, eq.EQUILIBRIUM_SIZE))
    p = np.ascontiguousarray(
        coefficients(*(_rest(plane)[name] for name in ("b12", "b31", *FORCES)))
    )
    for row in table[: eq.equilibria(p, table)[0]] if p[BOUND_G] > 0.0 else ():
        line = {"b12": math.cos(row[eq.ANGLE]), "b31": -math.sin(row[eq.ANGLE])}
        bar = row[eq.BAR] + 4.0 * ROUNDOFF
        noise = lambda xy, bar=bar: bar * abs(xy).sum(axis=-1)  # noqa: E731
        yield _straight(plane, *(line[name] for name in plane.axes), 0.0, noise, row[eq.ANGLE])


def _hopf(plane, curve):
    """A curve f = g = 0 where g' < 0, and its marks."""

    def slope(t):
        system = plane.system(curve.xy(t))
        return force(system, curve.phi(t))[1] + 0.0 * t, BARS * ROUNDOFF * size(
            system
        ) + 4.0 * curve.bar(t).sum(axis=-1)

    def ends(t):
        system = plane.system(curve.xy(t))
        terms = abs(system["b12"]) + abs(system["b31"]) + abs(system["s2"]) + abs(system["s3"])
        return constant(system) + 0.0 * t, terms * (
            8.0 * ROUNDOFF * terms + curve.bar(t).sum(axis=-1)
        )

    def kind(t):
        (steep, _), (value, bar) = slope(t), ends(t)
        if not (steep[0] < 0.0 and abs(value[0]) > bar[0]):
            return None
        return "supercritical_hopf" if value[0] < 0.0 else "subcritical_hopf"

    yield from _run(plane, curve, kind, (lambda t: slope(t)[0] < 0.0, lambda t: ends(t)[0] < 0.0))
    yield from _marks(plane, curve, "bogdanov_takens", slope)
    for mark in _marks(plane, curve, "generalised_hopf", ends):
        _kind, xy, _error, known = mark
        if force(plane.system(xy), known["equilibrium_phi"][0])[1][0] < 0.0:
            yield mark


# ---- ends


def _ends(plane):
    """K = 0; where K is identically 0, L = 0."""
    rest = _rest(plane)
    slopes = {"b12": rest["s3"], "b31": -rest["s2"], "s3": rest["b12"], "s2": -rest["b31"]}
    a, b = (slopes.get(name, 0.0) for name in plane.axes)
    both = {("b12", "s3"): 1.0, ("b31", "s2"): -1.0}.get(tuple(sorted(plane.axes)), 0.0)
    c = constant(rest)
    if both:
        curves = _hyperbola(plane, both, c)
    elif a or b:
        noise = lambda xy: 8.0 * ROUNDOFF * (abs(c) + abs(a * xy[..., 0]) + abs(b * xy[..., 1]))  # noqa: E731
        curves = [_straight(plane, a, b, c, noise)]
    else:
        curves = _next_ends(plane, rest) if c == 0.0 else []
    for curve in curves:
        yield from _run(plane, curve, lambda t: "ends")


def _nothing(xy):
    return 0.0 * xy[..., 0]


def _hyperbola(plane, both, c):
    """both x y + c = 0."""
    if c == 0.0:
        return [
            _straight(plane, 1.0, 0.0, 0.0, _nothing),
            _straight(plane, 0.0, 1.0, 0.0, _nothing),
        ]
    ratio = -c / both
    found = []

    def curve(side, low, high):
        def xy(t):
            x = side * np.exp(t)
            return np.stack([x, ratio / x], axis=-1)

        return EquilibriumCurve(xy, lambda t: 8.0 * ROUNDOFF * abs(xy(t)), None, low, high)

    for side in (1.0, -1.0):
        # log |x| where x has this sign, and where y has the sign that it has then, on the plane
        (x_low, x_high), (y_low, y_high) = _parts(plane, (side, math.copysign(side, side * ratio)))
        low = max(x_low, math.log(abs(ratio)) - y_high)
        high = min(x_high, math.log(abs(ratio)) - y_low)
        if low < high:
            beyond = 0.5 * (high - low)  # so that the borders are crossed
            found.append(curve(side, low - beyond, high + beyond))
    return found


def _parts(plane, signs):
    """The logarithms (low, high) of the magnitudes of either coordinate where it has this sign on
    the plane; the lower above the higher one where it never has.
    """
    parts = []
    for low, high, sign in zip(plane.square.low, plane.square.high, signs, strict=True):
        first, last = (low, high) if sign > 0 else (-high, -low)
        parts.append((math.log(max(first, TINY)), math.log(last)) if last > 0.0 else (1.0, 0.0))
    return parts


def _next_ends(plane, rest):
    """c23 (b12^2 - b31^2) - d b12 b31 = 0."""
    axes = plane.axes
    mine = [name for name in plane.axes if name in ("b12", "b31")]
    b12, b31, d, c23 = (rest[name] for name in ("b12", "b31", "d", "c23"))
    if not mine:
        slopes = {"d": -b12 * b31, "c23": (b12 - b31) * (b12 + b31)}
        a, b = (slopes.get(name, 0.0) for name in axes)
        c = slopes["c23"] * c23 + slopes["d"] * d
        noise = lambda xy: 8.0 * ROUNDOFF * (abs(c) + abs(a * xy[..., 0]) + abs(b * xy[..., 1]))  # noqa: E731
        return [_straight(plane, a, b, c, noise)] if a or b else []
    if len(mine) == 2:
        # (b12, b31) = b (cos, sin) of it, or across
        half = 0.5 * math.atan2(2.0 * c23, d) if c23 or d else None
        if half is None:
            return []
        pairs = [{"b12": math.cos(x), "b31": math.sin(x)} for x in (half, half + 0.5 * math.pi)]
        noise = lambda xy: 8.0 * ROUNDOFF * abs(xy).sum(axis=-1)  # noqa: E731
        return [_straight(plane, *(line[name] for name in axes), 0.0, noise) for line in pairs]
    at = axes.index(mine[0])
    if axes[1 - at] not in ("d", "c23"):
        return []

    def xy(t):
        one, two = (t, b31) if mine[0] == "b12" else (b12, t)
        square, product = (one - two) * (one + two), one * two
        value = c23 * square / product if axes[1 - at] == "d" else d * product / square
        return np.stack(np.broadcast_arrays(*((t, value) if at == 0 else (value, t))), axis=-1)

    bar = lambda t: 16.0 * ROUNDOFF * abs(xy(t))  # noqa: E731
    return [EquilibriumCurve(xy, bar, None, plane.square.low[at], plane.square.high[at])]
