"""Curves on a map on which something that moves with the parameters is exceptional: followed point
by point.

A system gives, at a position of the map and a coordinate x, two numbers (a, b) and their error bounds: b
= 0 says where the thing is (an extremum, an equilibrium), a = 0 that the position lies on the
curve. The curve is followed in the space of (x, position), where it has no cusps, by steps along
its tangent and Newton's method. Each of its points is bracketed, across the curve, by positions at
which a has certain and opposite signs where b = 0. Positions are those of `survey.measures.square`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from survey.measures import contours
from survey.measures.sampled import FLAT, LONGEST, inside

STEP = 1e-5  # of differences, in units of the map and of x
FURTHEST = 0.4  # change of x over one step
LEAST, MOST = 3e-5, 2000  # step on the map at which a curve is given up, and points of a curve
SLOW = 12  # points that have not come further than as many of the LEAST steps end a curve
SAME, APART = 3e-4, 0.05  # of the map, and of x: curves so near to one another are one
WIDEST = 1e-6  # error of a point that is kept
CUT = 24  # parts of a segment that a curve crosses
DENSER = 4  # times the nodes of a line of the lattice, where one line alone is searched
TINY = 1e-300


@dataclass(frozen=True)
class Track:
    """Points of a curve: positions (m, 2) with their errors, coordinates x with theirs; which of them
    are certain.
    """

    x: np.ndarray
    error: np.ndarray
    coordinate: np.ndarray
    coordinate_error: np.ndarray
    sure: np.ndarray

    def certain(self):
        """The runs of points that are certain."""
        return [part_of(self, part) for part in contours.runs(self.sure)]

    def passes(self, u, turn):
        """Does the curve pass u = (x, position)? x and x + turn are the same."""
        if len(self.x) < 2:
            return False
        low, chord = self.x[:-1], np.diff(self.x, axis=0)
        share = ((u[1:] - low) * chord).sum(axis=1) / np.maximum((chord * chord).sum(axis=1), TINY)
        off = abs(low + np.clip(share, 0.0, 1.0)[:, None] * chord - u[1:]).max(axis=1)
        least = np.minimum(self.coordinate[:-1], self.coordinate[1:])
        most = np.maximum(self.coordinate[:-1], self.coordinate[1:])
        return bool(
            ((off < SAME) & ((u[0] - least + APART) % turn < most - least + 2.0 * APART)).any()
        )

    def within(self, other, turn):
        """Does nearly all of this curve lie on the other?"""
        points = np.column_stack([self.coordinate, self.x])
        return np.mean([other.passes(u, turn) for u in points]) > 0.9


def part_of(track, part):
    """The points `part` of a Track."""
    return Track(*(getattr(track, name)[part] for name in Track.__dataclass_fields__))


def with_points(track, indices, others):
    """The Track with a point of each of the `others` put in before its point of the number in `indices`."""
    pairs = [
        (name, np.concatenate([getattr(other, name) for other in others]))
        for name in Track.__dataclass_fields__
    ]
    return Track(
        *(np.insert(getattr(track, name), indices, values, axis=0) for name, values in pairs)
    )


@dataclass(frozen=True)
class Follower:
    """Follows the curve a = b = 0 of the function (coordinate, position) -> (a, b, bar of a, bar of b)."""

    function: Callable
    grain: float

    def _at(self, u):
        return np.array(self.function(u[0], u[1:]), dtype=float)

    def _slopes(self, u):
        """The derivatives of a and b by x and by the position (2, 3)."""
        ends = [
            [self._at(u + side * STEP * axis)[:2] for side in (1.0, -1.0)] for axis in np.eye(3)
        ]
        return np.array([(high - low) / (2.0 * STEP) for high, low in ends]).T

    def landed(self, u):
        """The point of the curve next to u, and the slopes there; None if it is not found."""
        for _ in range(12):
            values, slopes = self._at(u), self._slopes(u)
            if not (np.isfinite(values).all() and np.isfinite(slopes).all()):
                return None
            step = -np.linalg.pinv(slopes) @ values[:2]
            size = max(abs(step[0]) / FURTHEST, np.hypot(*step[1:]) / 0.1)
            u = u + step / max(size, 1.0)
            if abs(step).max() < 1e-9:
                return u, slopes
        return None

    def _corrected(self, u, tangent):
        """As `landed`, within the plane across the tangent."""
        start, slopes = u, self._slopes(u)
        if not np.isfinite(slopes).all():
            return None
        for _ in range(8):
            values = self._at(u)
            jacobian = np.vstack([slopes, tangent])
            if not np.isfinite(values).all() or abs(np.linalg.det(jacobian)) < TINY:
                return None
            step = np.linalg.solve(jacobian, -np.array([*values[:2], tangent @ (u - start)]))
            u = u + step
            if abs(step).max() > 0.5:
                return None
            if abs(step).max() < 1e-9:
                slopes = self._slopes(u)
                return (u, slopes) if np.isfinite(slopes).all() else None
        return None

    def track(self, u):
        """The Track through the point next to u on the map, or None."""
        found = self.landed(u)
        if found is None or not inside(found[0][None, 1:])[0]:
            return None
        ahead, closed = self._half(found, 1.0)
        back = [] if closed else self._half(found, -1.0)[0]
        rows = [*back[::-1], self._row(*found, None), *ahead]
        x, error, coordinate, spread, sure = map(np.array, zip(*rows, strict=True))
        return Track(x, error, coordinate, spread, sure)

    def _half(self, found, sense):
        """The rows after the first point to one side, and whether the curve closes."""
        (u, slopes) = found
        rows = []
        step = 0.25 * LONGEST
        first, tangent = u, sense * _tangent(slopes)
        while len(rows) < MOST and step > LEAST:
            new = self._corrected(u + step * tangent, tangent)
            ahead = None if new is None else _tangent(new[1])
            if ahead is not None:
                ahead = ahead if ahead @ tangent > 0.0 else -ahead
            if ahead is None or not _near(u, tangent, new[0], ahead):
                step *= 0.5
                continue
            if not inside(new[0][None, 1:])[0]:
                end = self._border(u, new[0])
                return rows + ([end] if end else []), False
            rows.append(self._row(*new, None))
            moved = np.linalg.norm(new[0] - u)
            if (
                len(rows) > 3
                and np.linalg.norm(new[0] - first) < moved
                and abs(ahead @ _tangent(found[1])) > 0.9
            ):
                return [*rows, self._row(*found, None)], True
            u, tangent, step = new[0], ahead, 1.5 * step
            if len(rows) > SLOW and np.hypot(*(u[1:] - rows[-SLOW][0])) < SLOW * LEAST:
                break
        return rows, False

    def _border(self, u, beyond):
        """The row of the point on the map's border between u, inside, and the point beyond."""
        low, high = u[1:], beyond[1:]
        run = np.where(high == low, 1.0, high - low)
        share = np.where(high > 1.0, (1.0 - low) / run, np.where(high < 0.0, -low / run, 1.0))
        axis = int(np.argmin(share))
        return self.on_border(u + share[axis] * (beyond - u), axis, float(high[axis] > 1.0))

    def on_border(self, at, axis, end):
        """The row of the point next to `at` where the position on the axis is `end`; None if it is
        not found.
        """
        at = at.copy()
        for _ in range(8):
            at[1 + axis] = end
            values, slopes = self._at(at), self._slopes(at)
            part = slopes[:, [0, 2 - axis]]
            if (
                not (np.isfinite(values).all() and np.isfinite(part).all())
                or np.linalg.det(part) == 0.0
            ):
                return None
            step = np.linalg.solve(part, -values[:2])
            at[[0, 2 - axis]] += step
            if abs(step).max() > 0.5:
                return None
            if abs(step).max() < 1e-9:
                return self._row(at, slopes, 1 - axis) if inside(at[None, 1:])[0] else None
        return None

    def _row(self, u, slopes, axis):
        """(position, its error, coordinate, its error, is it certain?), bracketed across the curve or
        along the `axis`.
        """
        (a_x, *a_y), (b_x, *b_y) = slopes
        a_y, b_y, x = np.array(a_y), np.array(b_y), u[1:].copy()
        lost = x, np.nan, u[0], np.nan, False
        if not abs(b_x) > 0.0:
            return lost
        across = a_y - a_x * b_y / b_x
        normal = across / max(np.hypot(*across), TINY) if axis is None else np.eye(2)[axis]
        steep = abs(across @ normal)
        _a, b, bar, b_bar = self._at(u)
        if not steep > 0.0 or not self._crosses(u, b_bar / abs(b_x)):
            return lost
        width = 2.0 * (bar + abs(a_x / b_x) * b_bar) / steep + 4.0 * self.grain
        while width < WIDEST:
            sides = [self._sign(u, side * width * normal, b_y, a_x, b_x) for side in (1.0, -1.0)]
            if sides[0] * sides[1] < 0.0:
                spread = 1.5 * (abs(b) + b_bar) / abs(b_x) + abs(b_y / b_x) @ np.full(2, width)
                return x, width + self.grain, u[0], spread, True
            width *= 3.0
        return lost

    def _crosses(self, u, width):
        """Does b change its sign at u beyond its error bound?"""
        width = max(10.0 * width, 1e-9 * (1.0 + abs(u[0])))
        while width < 0.1:
            (_, low, _, low_bar), (_, high, _, high_bar) = (
                self._at(u + np.array([side * width, 0.0, 0.0])) for side in (-1.0, 1.0)
            )
            if low * high < 0.0 and abs(low) > low_bar and abs(high) > high_bar:
                return True
            width *= 10.0
        return False

    def _sign(self, u, step, b_y, a_x, b_x):
        """The sign of a where b = 0, beside u; 0 where it is open."""
        x = u[0] - b_y @ step / b_x
        for last in (False, True):
            a, b, bar, b_bar = self.function(x, u[1:] + step)
            if last:
                bar += abs(a_x / b_x) * (abs(b) + b_bar) + b * b / abs(b_x)
                return np.sign(a) if abs(a) > bar else 0.0
            x -= b / b_x
        return 0.0


def _tangent(slopes):
    """The direction of the curve in (x, position)."""
    along = np.cross(*slopes)
    return along / max(np.linalg.norm(along), TINY)


def _near(u, tangent, new, ahead):
    """Is the chord from u to the new point short and flat enough?"""
    chord = np.hypot(*(new - u)[1:])
    one, two = tangent[1:], ahead[1:]
    bend = abs(one[0] * two[1] - one[1] * two[0]) / max(np.hypot(*one) * np.hypot(*two), TINY)
    turned = one @ two < 0.0  # a cusp of the curve on the map
    flat = chord * bend <= 8.0 * FLAT or chord <= FLAT
    return chord <= 2.0 * LONGEST and abs(new[0] - u[0]) <= FURTHEST and ahead @ tangent > 0.9 and flat and (
        not turned or chord <= 1e-3)  # fmt: skip


def from_lattice(number, things, function_of, square):
    """[(label, Track)] of all curves that part the nodes of a lattice of so many lines each way.

    Where only a border of the `square` is asked for: of their points there, Tracks of one point.

    things(position) -> [(label, side, coordinate, a)] where b = 0; function_of(label): what a Follower
    takes, and by how much coordinates differ that are the same (an infinite number if none are). A curve
    is begun where, from one node to the next, a changes its sign on things of one label and side
    that are near.
    """
    if square.across is not None:
        x = contours.lattice((number - 1) * DENSER + 1, square.across)
        return list(_on_line(x, things, function_of, square))
    ticks = np.linspace(0.0, 1.0, number)
    known = [[things(np.array([one, two])) for two in ticks] for one in ticks]
    found = []
    for i in range(number):
        for j in range(number):
            for k, m in ((i + 1, j), (i, j + 1)):
                if k < number and m < number:
                    here, there = np.array([ticks[i], ticks[j]]), np.array([ticks[k], ticks[m]])
                    for label, start in _changes(known[i][j], known[k][m], here, there):
                        _add(found, label, *function_of(label), square.grain, start)
    return _alone(found, function_of)


def from_segments(segments, things, function_of, square):
    """As `from_lattice`, of the curves that cross `segments` [positions (2, 2) of their ends], each cut
    into CUT parts; where nothing changes its sign, from where something is there last.
    """
    found = []
    for low, high in segments:
        x = low + np.linspace(0.0, 1.0, CUT + 1)[:, None] * (high - low)
        pairs = list(pairwise([(position, things(position)) for position in x]))
        starts = [
            start
            for (here, some), (there, others) in pairs
            for start in _changes(some, others, here, there)
        ]
        starts = starts or [
            start
            for (here, some), (there, others) in pairs
            for start in (*_lost(some, others, here), *_lost(others, some, there))
        ]
        for label, start in starts:
            _add(found, label, *function_of(label), square.grain, start)
    return _alone(found, function_of)


def _alone(found, function_of):
    """Those [(label, Track)] that do not lie on longer ones."""
    found.sort(key=lambda one: -len(one[1].x))
    alone = []
    for label, track in found:
        if not any(
            own == label and track.within(longer, function_of(label)[1]) for own, longer in alone
        ):
            alone.append((label, track))
    return alone


def _on_line(x, things, function_of, square):
    """(label, Track of one point) of the curves that part the positions x (m, 2) on a border."""
    nodes = [(position, things(position)) for position in x]
    for (here, some), (there, others) in pairwise(nodes):
        for label, start in _changes(some, others, here, there):
            row = Follower(function_of(label)[0], square.grain).on_border(start, 1, square.across)
            if row is not None:
                yield label, Track(*(np.array([value]) for value in row))


def _add(found, label, function, turn, grain, start):
    """Add the curve through a point next to `start`, unless it is known."""

    def known(u):
        return any(own == label and track.passes(u, turn) for own, track in found)

    follower = Follower(function, grain)
    landed = None if known(start) else follower.landed(start)
    if landed is None or known(landed[0]):
        return
    track = follower.track(landed[0])
    if track is not None and len(track.x) > 1:
        found.append((label, track))


def _changes(some, others, here, there):
    """(label, (coordinate, position)) where a of a thing changes its sign between two positions."""
    for label, side, x, a in some:
        same = [(abs(y - x), y, c) for *other, y, c in others if other == [label, side]]
        if same:
            off, y, c = min(same)
            # one of them may be 0 exactly
            if (a > 0.0) != (c > 0.0) and np.isfinite(a - c) and off < 1.0:
                share = a / (a - c)
                yield label, np.array([x + share * (y - x), *(here + share * (there - here))])


def _lost(some, others, here):
    """(label, (coordinate, position)) of things at a position `here` that are not at the next one."""
    there = {(label, side) for label, side, *_ in others}
    for label, side, x, _a in some:
        if (label, side) not in there:
            yield label, np.array([x, *here])
