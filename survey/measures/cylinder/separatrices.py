"""The curves between fates on a map of initial states: stable branches of the saddles, and cycles.

A stable branch is the unstable one of the system that S1, (b, w, t) -> -(b, w, t), makes of it, so it is followed
forward in time there, where the flow draws neighbours to it; unstable cycles likewise, and stable ones in the system
itself. It begins at its saddle and ends as `kernels.cylinder.lines` says. Where b = 0 the branches are the level curves
H = V(saddle) (section 2), and where g = 0 the lines w - F = +-|b|, between which every motion comes to rest.
"""

import math
from copy import copy

import numpy as np

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import lines
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.kernels.cylinder.branches import unstable
from survey.kernels.cylinder.flow import BOUND_G, OF_F, OF_G
from survey.kernels.cylinder.program import COLUMNS
from survey.kernels.math.roundoff import ROUNDOFF
from survey.measures.cylinder.fate import I0, I1, G, flow_of, outline, remembered, signed
from survey.measures.sampled import changes, runs
from survey.methods import taylor

SYSTEM = ("b12", "b31", "d", "c23", "s2", "s3")
TOLERANCE = 1e-17  # truncation of one step
FURTHEST = 2e-3  # from its saddle, of the map: where a branch is begun
CLOSEST = 1e-9  # rad or rad per unit of time: as close to a saddle as a branch on a line is begun
# of the map, of a line: windings that are nearer to each other are not told apart
ON_MAP, ON_LINE = 3e-3, 1e-4
TINY = 1e-300
TWO_PI = 2.0 * math.pi


def found(square, axes, flow):
    """[(class, parameters (m, 2), errors (m), {name: (value, error)})] of the curves and the
    equilibria on the map, and whether they are known to lack one.

    `flow`: the six parameters of SYSTEM, or a program (see `equation`), of which no closed form is
    known. Where one border of the map is asked for alone, branches and cycles are followed to where
    they cross it.
    """
    window = Window(square, axes.index("phi0"))
    followed = window if square.across is None else window.border()
    s = outline(flow)
    if len(flow) > COLUMNS and (s.stratum != G or s.unknown):
        return [], True
    on_map = square.across is None
    if s.stratum == I0:
        return list(_free(window, flow) if on_map else _free_on_line(followed, flow)), False
    if s.stratum == I1:
        curves = _levels(window, s) if on_map else _levels_on_line(followed, s)
        return [*curves, *_equilibria(window, s)], False
    curves, lacking = _branches(followed, s)
    if s.folded:
        return [*curves, *_equilibria(window, s)], True
    s = remembered(taylor, flow)
    cycles, unsure = _cycles(followed, s)
    lacking |= unsure or not s.conclusive
    return [*curves, *cycles, *_equilibria(window, s)], lacking


class Window:
    """A map of phi0 and w0; `at` (0 or 1) is the axis of phi0.

    A line of constant phi0 or w0 where `flat`, an axis of the two, is not None.
    """

    flat, nearest = None, ON_MAP

    def __init__(self, square, at):
        self.square, self.at = square, at
        self.low, self.high = (np.roll(end, -at) for end in (square.low, square.high))
        self.log = np.roll(square.log, -at)
        low, high = (
            np.where(self.log, np.log(np.where(self.log, end, 1.0)), end)
            for end in (self.low, self.high)
        )
        self.size = high - low

    def border(self):
        """The border of the map that alone is asked for."""
        line = copy(self)
        line.flat, line.nearest = 1 - self.at, ON_LINE
        value = self.square.parameters(np.array([0.0, self.square.across]))[1]
        line.low, line.high, line.log, line.size = (
            each.copy() for each in (self.low, self.high, self.log, self.size)
        )
        line.low[line.flat] = line.high[line.flat] = value
        line.log[line.flat] = False
        line.size[line.flat] = TWO_PI if line.flat == 0 else 1.0 + abs(value)
        return line

    def reach(self, saddles):
        """How far from the saddles their branches are begun (rad): so that chords to there are
        short, and on a line before they cross it.
        """
        slopes = [0.5 * (abs(row[eq.F]) + _spread(row)) for row in saddles]
        far = FURTHEST * np.array([self.size[0], self.size[1] / max(slopes)])
        if self.flat == 0:
            far = 0.5 * np.abs(
                [math.remainder(self.low[0] - x, TWO_PI) for x in saddles[:, eq.ANGLE]]
            )
        elif self.flat == 1:
            far = 0.5 * abs(self.low[1]) / np.array(slopes)
        return min(0.1, *np.maximum(far, CLOSEST))

    def end_at(self, saddle):
        """The point (1, POINT) at which a branch ends at its saddle; on a line that is closer to
        the saddle than CLOSEST, its crossing.
        """
        angle, bar, border = saddle[eq.ANGLE], saddle[eq.BAR], lines.INSIDE
        error = math.hypot(*(bar / self.size))
        slope = 0.5 * (_spread(saddle) - saddle[eq.F])
        off = math.remainder(self.low[0] - angle, TWO_PI)
        if self.flat == 0 and abs(off) <= CLOSEST:
            angle, border = angle + off, lines.AT_PHI_LOW
            error = 2.0 * slope * (abs(off) + bar) / self.size[1]
        elif self.flat == 1 and abs(self.low[1]) <= CLOSEST:
            border, error = lines.AT_W_LOW, (bar + 2.0 * abs(self.low[1]) / slope) / self.size[0]
        return np.array([[angle - TWO_PI * (angle > math.pi), 0.0, 0.0, border, error]])

    def for_lines(self, side):
        """As `kernels.cylinder.lines` takes it, for w of the sign `side` times that of the map."""
        w = sorted((side * self.low[1], side * self.high[1]))
        return np.array([self.low[0], self.high[0], *w, *self.size, *self.log, self.nearest])

    def parameters(self, phi, w):
        return np.roll(np.column_stack(np.broadcast_arrays(phi, w)), self.at, axis=1)

    def positions(self, phi, w):
        pair = self.parameters(phi, w)
        return self.square.positions(np.where(self.square.log, np.maximum(pair, TINY), pair))

    def error(self, phi, w, by_phi, by_w, across):
        """Position errors of points whose gradient (by_phi, by_w) times the distance from the curve
        is `across`.
        """
        a, c = (
            np.where(log, abs(x), 1.0) * size
            for x, log, size in zip((phi, w), self.log, self.size, strict=True)
        )
        return across / np.maximum(np.hypot(by_phi * a, by_w * c), TINY)

    def copies(self, low, high):
        """The numbers of turns that bring something from low to high into the map."""
        return range(
            math.ceil((self.low[0] - high) / TWO_PI), math.floor((self.high[0] - low) / TWO_PI) + 1
        )


def _flipped(p):
    """S1."""
    return flow_of(signed(p, (-1.0, -1.0, 1.0, 1.0, 1.0, 1.0)))


def _branches(window, s):
    """Both stable branches of every saddle, and whether one was cut short."""
    p, found, cut = _flipped(s.p), [], False
    starts = np.zeros((2 * max(len(s.equilibria), 1), rc.START))
    saddles = s.equilibria[s.equilibria[:, eq.KIND] == eq.SADDLE]
    if not len(saddles):
        return found, cut
    size = unstable(p, s.equilibria, len(s.equilibria), starts, window.reach(saddles), eq.SADDLE)
    for i, start in enumerate(starts[:size]):
        saddle = saddles[i // 2]
        known = {"equilibrium_phi": (saddle[eq.ANGLE], saddle[eq.BAR])}
        points, ended = _followed(window, -1.0, p, start, s, lines.BRANCH)
        cut |= not ended
        first = window.end_at(saddle)
        off = start[rc.START_PHI] - saddle[eq.ANGLE]
        shift = round((start[rc.START_PHI] - first[0, lines.ANGLE_AT] - off) / TWO_PI)
        first[0, lines.TURNS] = shift
        found += _copied(window, np.vstack([first, points]), "stable_manifold", known)
    return found, cut


def _spread(saddle):
    """The difference between the two slopes of a saddle's branches."""
    return math.sqrt(saddle[eq.F] ** 2 + 4.0 * saddle[eq.DG])


def _cycles(window, s):
    """One period of every cycle that is certain, and whether one is not, or was cut short."""
    found, unsure = [], False
    for side, table in ((1.0, s.plus), (-1.0, s.minus), (0.0, s.librations)):
        for row in table:
            if row[rt.CYCLE_CLASS] < 0.0:
                unsure = True
                continue
            stable = row[rt.MULTIPLIER] < 1.0
            start = np.array([row[rt.CYCLE_X], 0.0, row[rt.CYCLE_BAR], 0.0])
            if side:
                start = np.array([s.section, side * row[rt.CYCLE_X], 0.0, row[rt.CYCLE_BAR]])
            sign = 1.0 if stable else -1.0
            start[rc.START_W] *= sign
            kind = lines.ROTATION if side else lines.LIBRATION
            flow = s.p if stable else _flipped(s.p)
            points, ended = _followed(window, sign, flow, start, s, kind)
            unsure |= not ended
            known = {"multiplier": (row[rt.MULTIPLIER], row[rt.MULTIPLIER_BAR])}
            found += _copied(window, points, "stable_cycle" if stable else "unstable_cycle", known)
    return found, unsure


def _followed(window, side, p, start, s, kind):
    """Points (m, POINT) of a line in the system itself, and whether it was followed to its end.

    `side`: the sign of its w in the system p.
    """
    out = np.zeros((lines.MOST_POINTS, lines.POINT))
    given = window.for_lines(side), s.equilibria, len(s.equilibria), s.section, kind
    size, ended = taylor.flow_line(p, start, *given, TOLERANCE, out)
    out = out[:size]
    out[:, lines.VELOCITY] *= side
    if side < 0.0:
        flipped = np.array(
            [lines.INSIDE, lines.AT_PHI_LOW, lines.AT_PHI_HIGH, lines.AT_W_HIGH, lines.AT_W_LOW]
        )
        known = np.isfinite(out[:, lines.BORDER])
        out[known, lines.BORDER] = flipped[out[known, lines.BORDER].astype(int)]
    return out, ended


def _copied(window, points, kind, known):
    """The runs of a line on the map, in every copy of it: phi is an angle."""
    phi, w, turns, border, error = points.T
    if not np.isfinite(phi).any():
        return
    unwrapped = phi + TWO_PI * turns
    loose = 1e-9 * (1.0 + abs(phi))  # points on a border are so within rounding
    for k in window.copies(np.nanmin(unwrapped - loose), np.nanmax(unwrapped + loose)):
        x, v = phi + TWO_PI * (turns + k), w.copy()
        for mark, axis, end in (
            (lines.AT_PHI_LOW, 0, window.low[0]),
            (lines.AT_PHI_HIGH, 0, window.high[0]),
            (lines.AT_W_LOW, 1, window.low[1]),
            (lines.AT_W_HIGH, 1, window.high[1]),
        ):
            own = (border == mark) & ((abs(x - end) < loose) if axis == 0 else True)
            (x, v)[axis][own] = end
        good = (
            (x >= window.low[0])
            & (x <= window.high[0])
            & (v >= window.low[1])
            & (v <= window.high[1])
        )
        for part in np.split(np.arange(x.size), 1 + np.flatnonzero(np.diff(good))):
            if (part.size > 1 or window.flat is not None) and good[part[0]]:
                shift = ROUNDOFF * (abs(x[part]) + TWO_PI) / window.size[0]
                yield kind, window.parameters(x[part], v[part]), error[part] + shift, known


def _equilibria(window, s):
    """The equilibria, as points."""
    for row in s.equilibria:
        if row[eq.KIND] == eq.DEGENERATE:
            continue
        kind = (
            "saddle"
            if row[eq.KIND] == eq.SADDLE
            else ("sink", "centre", "source")[1 + int(row[eq.STABLE])]
        )
        known = {"equilibrium_phi": (row[eq.ANGLE], row[eq.BAR])}
        for k in window.copies(row[eq.ANGLE], row[eq.ANGLE]):
            phi = np.array([row[eq.ANGLE] + TWO_PI * k])
            if window.low[1] <= 0.0 <= window.high[1]:
                error = (row[eq.BAR] + ROUNDOFF * abs(phi)) / window.size[0]
                yield kind, window.parameters(phi, 0.0), error, known


def _free(window, six):
    """g = 0: w = F + |b| and w = F - |b|."""
    b12, b31 = six[OF_F]
    b = math.hypot(b12, b31)
    for side in (1.0, -1.0) if b else ():

        def w(phi, side=side):
            return b12 * np.sin(phi) + b31 * np.cos(phi) + side * b

        for phi in runs(lambda t, w=w: window.positions(t, w(t)), window.low[0], window.high[0]):
            slope = b12 * np.cos(phi) - b31 * np.sin(phi)
            across = 4.0 * ROUNDOFF * b * (2.0 + abs(phi))
            yield (
                "stable_manifold",
                window.parameters(phi, w(phi)),
                window.error(phi, w(phi), slope, 1.0, across),
                {},
            )


def _free_on_line(line, six):
    """As `_free`, where w = F +- |b| crosses the line."""
    b12, b31 = six[OF_F]
    b = math.hypot(b12, b31)
    extreme = math.atan2(b12, b31) + math.pi * np.arange(3)
    for side in (1.0, -1.0) if b else ():

        def w(phi, side=side):
            return b12 * np.sin(phi) + b31 * np.cos(phi) + side * b

        for phi in _crossings(line, w, extreme):
            slope, bend = b12 * np.cos(phi) - b31 * np.sin(phi), w(phi) - side * b
            across = 4.0 * ROUNDOFF * b * (2.0 + abs(phi))
            yield _crossing(line, phi, w(phi), (slope, bend), (1.0, 0.0), across, {})


def _levels_of(s):
    """(saddle, its Level, far, turns) of the level curves from all saddles; the last two as in
    `far_end`.
    """
    for row in s.equilibria:
        if row[eq.KIND] != eq.SADDLE:
            continue
        level = Level(s.p, row)
        for side in (1.0, -1.0):
            far, turns = far_end(level, s, side)
            if turns or side > 0.0 or abs(far) < TWO_PI:  # else the same as to the other side
                yield row, level, far, turns


def _levels(window, s):
    """b = 0: H = V(saddle) from each saddle to both sides, up to where it turns or to another saddle."""
    for row, level, far, turns in _levels_of(s):
        known = {"equilibrium_phi": (row[eq.ANGLE], row[eq.BAR])}
        for branch in (0.0,) if turns else (1.0, -1.0):

            def point(t, far=far, branch=branch, level=level):
                x = 0.5 * far * (1.0 - np.cos(math.pi * t))
                return x, (branch or np.sign(1.0 - t)) * level.velocity(x)

            for k in window.copies(level.angle + min(far, 0.0), level.angle + max(far, 0.0)):

                def position(t, point=point, k=k, level=level):
                    x, w = point(t)
                    return window.positions(level.angle + x + TWO_PI * k, w)

                for t in runs(position, 0.0, 1.0 if branch else 2.0):
                    x, w = point(t)
                    phi = level.angle + x + TWO_PI * k
                    across = (
                        level.error(x)
                        + 4.0 * ROUNDOFF * w * w
                        + abs(level.slope(x)) * ROUNDOFF * abs(phi)
                    )
                    error = window.error(phi, w, level.slope(x), w, across)
                    error[x == 0.0] = row[eq.BAR] / window.size[0] + ROUNDOFF
                    if not turns:  # a saddle of the same level, within rounding
                        error[x == far] = math.hypot(
                            *(np.sqrt(level.error(far) * level.reach()) / window.size)
                        )
                    yield "stable_manifold", window.parameters(phi, w), error, known


def _levels_on_line(line, s):
    """As `_levels`, where H = V(saddle) crosses the line."""
    for row, level, far, _turns in _levels_of(s):
        known = {"equilibrium_phi": (row[eq.ANGLE], row[eq.BAR])}
        side = math.copysign(1.0, far)
        # V is extreme at the equilibria
        between = [side * ((side * (y - level.angle)) % TWO_PI) for y in s.equilibria[:, eq.ANGLE]]
        nodes = level.angle + np.unique([0.0, far, *(y for y in between if abs(y) < abs(far))])
        for sign in (1.0, -1.0):

            def w(phi, level=level, sign=sign):
                return sign * level.velocity(phi - level.angle)

            for phi in _crossings(line, w, nodes):
                x, v = phi - level.angle, w(phi)
                across = level.error(x) + 4.0 * ROUNDOFF * v * v
                across += abs(level.slope(x)) * ROUNDOFF * abs(phi)
                if x == 0.0:
                    across = abs(row[eq.DG]) * (row[eq.BAR] + ROUNDOFF) ** 2
                by_phi = level.slope(x), level.bend(x)
                yield _crossing(line, phi, v, by_phi, (v, 1.0), across, known)


def _crossings(line, w, nodes):
    """The angles between the first and the last of the nodes, in any copy on the line, where
    w(phi), monotone between nodes, crosses it.
    """
    low, high = nodes[0], nodes[-1]
    if line.flat == 0:
        angles = line.low[0] - TWO_PI * np.arange(
            math.ceil((line.low[0] - high) / TWO_PI), math.floor((line.low[0] - low) / TWO_PI) + 1
        )
        return [phi for phi in angles if line.low[1] <= w(phi) <= line.high[1]]
    value = line.low[1]
    met = nodes[w(nodes) == value]
    return np.unique([*met, *changes(lambda phi: w(phi) > value, nodes)])


def _crossing(line, phi, w, by_phi, by_w, across, known):
    """A row of `found`: the point of a curve on the line, of that slope and bend along either axis;
    see `Window.error`.
    """
    if line.flat == 0:
        xs, w, error = line.low[:1], np.array([w]), _farthest(across, *by_w) / line.size[1]
    else:
        xs = phi + TWO_PI * np.array(line.copies(phi, phi))
        w, error = line.low[1], _farthest(across, *by_phi) / line.size[0]
    return "stable_manifold", line.parameters(xs, w), np.full(len(xs), error), known


def _farthest(across, slope, bend):
    """How far slope x + bend x^2 / 2 = +-across is from 0, next to it; where no x is, how far the
    extremum may be.
    """
    least = math.sqrt(2.0 * across * abs(bend))
    steep = max(abs(slope), least)
    return 2.0 * across / max(steep + math.sqrt(max(steep * steep - least * least, 0.0)), TINY)


class Level:
    """V(saddle) - V(saddle + x), as a product that does not cancel next to the saddle."""

    def __init__(self, p, row):
        self.p, self.angle, self.bar, self.steep = p, row[eq.ANGLE], row[eq.BAR], row[eq.DG]
        self.size = p[BOUND_G]

    def depth(self, x):
        """Twice the integral of g: sin(x/2) times what vanishes at x = 0."""
        d, c23, s2, s3 = self.p[OF_G]
        middle, half = self.angle + 0.5 * x, 0.5 * x
        mean_slope = (
            2.0 * np.cos(half) * (0.5 * d * np.sin(2.0 * middle) + c23 * np.cos(2.0 * middle))
        )
        return (
            -2.0
            * np.sin(half)
            * (mean_slope - 2.0 * s2 * np.cos(middle) + 2.0 * s3 * np.sin(middle))
        )

    def velocity(self, x):
        return np.sqrt(np.maximum(self.depth(x), 0.0))

    def slope(self, x):
        """V' there."""
        phi = self.angle + np.asarray(x, float)
        d, c23, s2, s3 = self.p[OF_G]
        return (
            0.5 * d * np.sin(2.0 * phi)
            + c23 * np.cos(2.0 * phi)
            - s2 * np.cos(phi)
            + s3 * np.sin(phi)
        )

    def bend(self, x):
        """V'' there."""
        phi = self.angle + x
        d, c23, s2, s3 = self.p[OF_G]
        return (
            d * np.cos(2.0 * phi)
            - 2.0 * c23 * np.sin(2.0 * phi)
            + s2 * np.sin(phi)
            + s3 * np.cos(phi)
        )

    def reach(self):
        """Squares of how far from a saddle H = V(saddle) + 1 is, along phi and along w, with a
        margin of 2.
        """
        return np.array([8.0 / self.steep, 8.0])

    def error(self, x):
        """Error bound of half the depth: rounding, and that of the saddle's angle."""
        return abs(np.sin(0.5 * x)) * (
            16.0 * ROUNDOFF * self.size * (1.0 + abs(self.angle)) + 4.0 * self.size * self.bar
        )


def far_end(level, s, side):
    """(x, does it turn there?): where the level curve from a saddle ends on this side."""
    others = [side * ((side * (row[eq.ANGLE] - level.angle)) % TWO_PI) for row in s.equilibria]
    for x in sorted((x for x in others if abs(x) > 1e-12), key=abs):
        reach = level.depth(x)
        if abs(reach) <= 4.0 * level.error(x) + ROUNDOFF * level.size:
            return x, False
        if reach < 0.0:
            before = max(
                (y for y in [0.5 * x, *others] if abs(y) < abs(x) and level.depth(y) > 0.0), key=abs
            )
            return _zero(level, before, x), True
    return side * TWO_PI, False


def _zero(level, inner, outer):
    while True:
        middle = 0.5 * (inner + outer)
        if middle in (inner, outer):
            return inner
        inner, outer = (middle, outer) if level.depth(middle) > 0.0 else (inner, middle)
