"""Saddle connections on a map of two parameters: where an unstable branch of a saddle is a stable
branch of a saddle.

Four kinds are looked for: those on which w keeps its sign, over at most a turn; those with one
turning point (a loop, or a way back to another saddle); loops with two, one to either side of
the saddle, which surround both equilibria beside it; and ways from one saddle to the other with 2
to `TURNINGS` turning points. There are no other loops: a closed curve that is not wound round the
cylinder has two turning points, and does not meet its copies a turn away. For the same reason a
branch that passes the copy of its saddle does not turn any more. So on a way with more turning
points than one the branch of one saddle winds inward, between the saddle and its copy, round the
other saddle and the equilibria beside it; in reversed time, if it is the stable one. Ways with more
than `TURNINGS` are not looked for. They are many where damping is weak; no cycle is born in them.

For each, a function of the parameters says by how much both branches miss each other: the
difference of w where they pass the same equilibrium, or of their turning points. It is continuous,
and beyond the angle that a branch does not reach it is continued by how far from it the branch
turns; not where a branch winds, there it ends at the curve with one turning point less. Its zeros
are found as those of `survey.measures.contours`, and followed on from where the lattice loses them,
as where folds and points of codimension two are near (`survey.measures.tips`).

Saddles are told apart by their V, for loops, and by which one lies next to the right of an angle at
which no saddle is on the map, if there is one, for ways from one to the other: with weak damping
these lie where both have the same V. Where the labels change a jump is not a zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from survey.kernels.cylinder import connections as cn
from survey.kernels.cylinder.flow import TWO_PI
from survey.measures import contours, tips
from survey.methods import taylor

LINES, HALVINGS = 97, 12
TOLERANCE = 1e-17  # truncation of one step
BESIDE = 1e-5  # of the map: a jump is as high there as next to the point
# of the map, from a fold to where its equilibria are told apart; and their distance (rad) there
STEPS, CLOSE = 1e-12 * 4.0 ** np.arange(12), 0.05
HIGH, LOW = range(2)  # saddles, by V, or the first and the second from an angle on
# (unstable, stable): the systems in which both branches leave to the right
UPPER, LOWER = (cn.ITSELF, cn.BOTH), (cn.MIRRORED, cn.REVERSED)
RIGHT, LEFT = (cn.ITSELF, cn.REVERSED), (cn.MIRRORED, cn.BOTH)


@dataclass(frozen=True)
class Connection:
    """The branches (system, saddle) of a connection, miss(rows of both) -> (value, error bound), and
    behind how many turning points that needs each of them; the `cut` from which saddles are counted.
    """

    branches: tuple
    miss: Callable
    turnings: tuple = (1, 1)
    cut: float = np.nan

    @property
    def kind(self):
        return "homoclinic" if self.branches[0][1] == self.branches[1][1] else "heteroclinic"


def _every():
    """All Connections."""
    for sides, one, two in product((UPPER, LOWER), (HIGH, LOW), (HIGH, LOW)):
        yield Connection(((sides[0], one), (sides[1], two)), partial(_passing, one == two))
    for sides, one, two, wall in product((RIGHT, LEFT), (HIGH, LOW), (HIGH, LOW), (HIGH, LOW)):
        yield Connection(
            ((sides[0], one), (sides[1], two)), partial(_turning, one == wall, two == wall)
        )
    for sides, saddle in product((UPPER, LOWER), (HIGH, LOW)):
        yield Connection(((sides[0], saddle), (sides[1], saddle)), _returning)
    for turnings in range(2, cn.TURNINGS + 1):
        pairs = (RIGHT, LEFT) if turnings % 2 else (UPPER, LOWER)
        for sides, one, winding in product(pairs, (HIGH, LOW), (0, 1)):
            yield Connection(
                ((sides[0], one), (sides[1], 1 - one)),
                partial(_winding, turnings, winding),
                tuple(turnings if k == winding else 1 for k in (0, 1)),
            )


def found(plane):
    """[(class, parameters (m, 2), errors (m), {name: (value, error)})] of the connections on the map."""
    for connection, x, error in curves(plane):
        row = _traced(plane, x, np.zeros((4, 2)), connection.cut)[
            :, cn.ITSELF, connection.branches[0][1]
        ]
        known = {"equilibrium_phi": (row[:, cn.FROM], row[:, cn.FROM_BAR])}
        yield connection.kind, plane.square.parameters(x), error, known


def curves(plane):
    """[(Connection, positions (m, 2), errors (m))] of the curves."""
    if plane.conservative:
        return  # every branch is part of a connection, see `separatrices`
    everything = _traced(
        plane, contours.lattice(LINES, plane.square.across), np.full((4, 2), float(cn.TURNINGS))
    )
    cut = _far_from_saddles(everything)
    rows = {"homoclinic": everything, "heteroclinic": _counted_from(cut, everything)}
    for connection in _every():
        if connection.kind == "heteroclinic":
            connection = replace(connection, cut=cut)
        own = rows[connection.kind]
        values = connection.miss(*(own[:, *branch] for branch in connection.branches))[0]
        # on a line a sign may change beyond the last node before a fold
        alone = plane.square.across is not None
        if alone or np.nanmin(values, initial=0.0) < 0.0 < np.nanmax(values, initial=0.0):
            function = partial(missed, plane, connection)
            halvings = contours.HALVINGS if alone else HALVINGS
            pieces = contours.lines(function, plane.square, LINES, values, halvings)
            pieces = _continuous(function, pieces)
            if not alone:
                longer = tips.followed(function, pieces, plane.square.grain)
                pieces = _continuous(function, longer, pieces)
            for x, error in pieces:
                yield connection, x, error


def _far_from_saddles(rows):
    """The angle farthest from all saddles of flows that have two, or NaN."""
    angles = rows[:, cn.ITSELF, :, cn.FROM]
    angles = np.sort(angles[np.isfinite(angles).all(axis=1)].ravel())
    if not angles.size:
        return np.nan
    gaps = np.diff(angles, append=angles[0] + TWO_PI)
    widest = np.argmax(gaps)
    return angles[widest] + 0.5 * gaps[widest]


def _counted_from(cut, rows):
    """The rows (m, 4, 2, ROW) with saddles in the order of their angles from the cut on, rather than of V."""
    first, second = ((rows[:, cn.ITSELF, :, cn.FROM] - cut) % TWO_PI).T
    return np.where((second < first)[:, None, None, None], rows[:, :, ::-1], rows)


def _continuous(function, pieces, known=()):
    """The pieces [(positions (m, 2), errors (m))] of curves without points where the function jumps
    rather than vanishes; it vanishes at those of the pieces that are `known`.
    """
    zeros = {point.tobytes() for x, _error in known for point in x}
    found = []
    for x, error in pieces:
        good = np.array([point.tobytes() in zeros for point in x])
        good[~good] = _smooth(function, x[~good], error[~good])
        found += [(x[part], error[part]) for part in contours.runs(good)]
    return found


def _traced(plane, x, wanted, cut=np.nan):
    """The branches (m, 4, 2, ROW) of the systems at positions x (m, 2), saddles by V, or from the `cut` on."""
    out, P = np.full((len(x), 4, 2, cn.ROW), np.nan), plane.flows(x)
    good = np.flatnonzero(np.isfinite(P).all(axis=1))
    for some in np.array_split(good, 1 + len(good) // 1000):
        found = np.empty((len(some), 4, 2, cn.ROW))
        taylor.flow_connections(np.ascontiguousarray(P[some]), wanted, TOLERANCE, cut, found)
        out[some] = found
    return out


def missed(plane, connection, x):
    """By how much both branches of a connection miss each other at positions x (m, 2), and its
    error bound.
    """
    wanted = np.zeros((4, 2))
    for branch, turnings in zip(connection.branches, connection.turnings, strict=True):
        wanted[branch] = turnings
    out = _traced(plane, x, wanted, connection.cut)
    return connection.miss(*(out[:, *branch] for branch in connection.branches))


def passes(plane, position, error):
    """On which sides, {1 (w > 0), -1}, does a branch that comes round pass both equilibria next to a
    fold of theirs at this position of the line? Then no rotation of that side lies on the fold.
    """
    for step in np.maximum(STEPS, 4.0 * error):
        x = np.array([[position + side * step, plane.square.across] for side in (1.0, -1.0)])
        found = [
            (side, row[2 * before])
            for out in _traced(plane, x, np.ones((4, 2)))
            for side, systems in ((1, UPPER), (-1, LOWER))
            for row in out[list(systems)].reshape(-1, cn.ROW)
            if np.isfinite(row[cn.COLUMNS])
            for before in [int(row[cn.COLUMNS]) - 2]
            if row[cn.OFFSETS + before + 1] - row[cn.OFFSETS + before] < CLOSE
        ]
        if found:
            return {side for side, w in found if np.isfinite(w)}
    return set()


def _smooth(function, x, error):
    """Is the change of sign at positions x a zero rather than a jump?"""
    good = np.ones(len(x), bool)
    for axis in np.eye(2):
        near, beside = (
            abs(
                np.subtract(
                    *(
                        function(np.clip(x + side * step * axis, 0.0, 1.0))[0]
                        for side in (1.0, -1.0)
                    )
                )
            )
            for step in (2.0 * error[:, None], BESIDE)
        )
        good &= ~(near > 0.5 * beside) | (error > 0.1 * BESIDE)
    return good


def _passing(same, one, two):
    """For two branches on which w keeps its sign: w at the centre between their saddles, or at the
    saddle between.
    """
    pair = (one[:, cn.COLUMNS] == 4.0) & (two[:, cn.COLUMNS] == 4.0)
    single = (one[:, cn.COLUMNS] == 2.0) & (two[:, cn.COLUMNS] == 2.0)
    at = 1 if same else 0
    value, bar = np.full(len(one), np.nan), np.full(len(one), np.nan)
    for here, column in ((pair, at), (single, 0)):
        if here.any() and (same or here is pair):
            (v, v_bar), (w, w_bar) = (_level(row[here], column) for row in (one, two))
            value[here], bar[here] = np.where((v < 0.0) & (w < 0.0), np.nan, v - w), v_bar + w_bar
    return value, bar


def _level(row, column):
    """w where a branch passes an equilibrium; if it turns before, minus the distance by which it does."""
    w, short = row[:, 2 * column], row[:, cn.TURN] - row[:, cn.OFFSETS + column]
    passed = np.isfinite(w)
    return np.where(passed, w, np.where(short < 0.0, short, np.nan)), np.where(
        passed, row[:, 2 * column + 1], row[:, cn.TURN_BAR]
    )


def _returning(one, two):
    """For two branches of a saddle that turn, one to either side of it: w where they pass it on
    their ways back.
    """
    v, w = one[:, cn.BACK], two[:, cn.BACK]
    value = np.where((v < 0.0) & (w < 0.0), np.nan, v - w)
    return value, one[:, cn.BACK_BAR] + two[:, cn.BACK_BAR]


def _winding(turnings, which, *rows):
    """For two branches of which this one winds round the saddle of the other: |w| where it passes,
    behind so many turning points, the equilibrium next to that saddle.
    """
    column, other = cn.WINDING + 2 * (turnings - 2), rows[1 - which]
    return rows[which][:, column] - other[:, 0], rows[which][:, column + 1] + other[:, 1]


def _turning(first_own, second_own, one, two):
    """For two branches that turn before the same saddle (their own, a turn further, if so): their
    turning points.
    """
    count = one[:, cn.COLUMNS]
    (x, x_bar, x_in), (y, y_bar, y_in) = (
        _beside(row, own) for row, own in ((one, first_own), (two, second_own))
    )
    good = (
        (count == two[:, cn.COLUMNS]) & ((count == 4.0) | (first_own & second_own)) & (x_in | y_in)
    )
    return np.where(good, x - y, np.nan), x_bar + y_bar


def _beside(row, own):
    """The turning point of a branch less the saddle behind it, or beyond that w there; its bar;
    does it turn before?
    """
    column = np.where(own, row[:, cn.COLUMNS] - 1.0, 1.0)
    column = np.where(np.isfinite(column), column, 0.0).astype(int)
    rows = np.arange(len(row))
    wall, w, bar = (
        row[rows, first + step * column] for first, step in ((cn.OFFSETS, 1), (0, 2), (1, 2))
    )
    turned = row[:, cn.PASSED] == column
    x = np.where(turned, row[:, cn.TURN] - wall, w)
    return x, np.where(turned, row[:, cn.TURN_BAR], bar), turned
