"""A user's z(u, p) as rows of a Hill problem: z = c0(u) + p_k c1(u) along the axis of a parameter
on which it depends linearly (`dependence`), and series across the axis of another one on which it
depends analytically.

c0 and c1 follow from z at both ends of the axis of p_k, between which z is a mean of the two: so
are bounds of its size and of its noise. Where z is linear across the rows too, it is a mean of the
four corners of the map, and what steps need is measured there. All depends on the row and on the
axes, never on the block.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from survey.measures.hill import monodromy, user_equation
from survey.measures.hill.user_equation import Steps, at, measured

# What the rounding of z is relative to, as a multiple of max |z|, where z is a mean: five roundings more.
MEAN = 1.7


@dataclass(frozen=True)
class Axes:
    """The parameter `lane` (its index) along the rows, and its axis `line`; `across` is the one, if
    any, across them, `row_line` its axis, and `linear`: is z a linear function of it?
    """

    lane: int
    line: tuple[int, float, float]
    across: int | None = None
    row_line: tuple[int, float, float] | None = None
    linear: bool = False


def problem(z, key, axes, points, lanes, ranges, even, exact=None, corners=None):
    """The Hill problem of z in rows of `points` (R, n) by `lanes` (R, L), where a row is `rough` (R),
    and where its span is NaN, as z is rough or not finite (R).

    `ranges(points)` gives periods, edges and slack as `user_equation` takes them; what it gives,
    and z, is named by the hashable `key`. `corners` are those of their map, if known.
    """
    _, edges, slack = ranges(points)
    corners = corners or _corners(z, axes, points, ranges, even)
    sizes, rate, scale, rough = (
        corners.measured(points) if corners else _measured(z, axes, points, ranges, even)
    )
    bad = rough | np.isnan(scale)

    @cache
    def steps():
        return Steps(edges, slack, sizes.max(axis=0), rate)

    def sizes_of_rows():
        own = steps()
        low, high = (own.frequency(size) ** 2 for size in sizes)
        bound = _bound(low, high, *axes.line[1:])
        return monodromy.RowSizes(np.where(bad, np.nan, own.end), bound, own.rates)

    def sample(rows, nodes, number):
        # one piece, whose ends depend on neither axis: all rows have the same steps
        if corners and edges.shape[1] == 2:
            u = steps().at_nodes(rows[:1], nodes, number)
            low, high = corners.sampled(points[rows], u)
        else:
            u = steps().at_nodes(rows, nodes, number)
            low, high = (
                at(z, _with(points[rows], axes.lane, end), u.reshape(rows.size, -1))
                for end in axes.line[1:]
            )
        low, high = (values.reshape(-1, *u.shape[1:]) for values in (low, high))
        out = np.zeros((rows.size, number, 2, nodes.size + 1))
        out[:, :, 1, :-1] = (high - low) / (axes.line[2] - axes.line[1])
        out[:, :, 0, :-1] = low - axes.line[1] * out[:, :, 1, :-1]
        out[:, :, 0, -1] = scale[rows, None]  # what the rounding of z is relative to
        return out

    def walk(rows, p, tolerance):
        return user_equation.walked(
            z, _with(points[rows], axes.lane, p), rows, steps(), scale, tolerance
        )

    def exactly(rows, p, low, number):
        own = _with(points[rows], axes.lane, p)
        return user_equation.solved_exactly(z, own, rows, steps(), scale, even, exact, number)

    own = monodromy.Problem(
        p=lanes, sizes=sizes_of_rows, c2=0.0,
        sample=sample, walk=walk, cut=lambda rows, number: steps().of(rows, number)[1], full_period=not even,
        exact=exactly if exact else None, line=axes.line,
        row_axis=_row_axis(z, key, axes, points, ranges, even, corners) if axes.across is not None else None,
        positions=points[:, axes.across] if axes.across is not None else None,
    )  # fmt: skip
    return own, rough, bad


def _measured(z, axes, points, ranges, even):
    """What steps need of z in rows of `points` (R, n): its size (2, R, P) at both ends of the rows, its
    rate (R, P) and scale (R), and where it is `rough` (R); see `user_equation.measured`.
    """
    period, edges, slack = ranges(points)
    ends = np.concatenate([_with(points, axes.lane, end) for end in axes.line[1:]])
    edges, slack = np.tile(edges, (2, 1)), np.tile(slack, 2)
    known = measured(z, ends, edges, np.tile(period, 2) if even else None, slack)
    size, rate, scale, rough = (
        values.reshape(2, len(points), *values.shape[1:]) for values in known
    )
    return size, rate.max(axis=0), scale.max(axis=0), rough.any(axis=0)


@dataclass(frozen=True)
class _Corners:
    """A map on whose two axes z depends linearly: z in a row, and what its steps need of it, is a
    mean of what it is at the two `ends` (2, n) of the axis across the rows.
    """

    z: Callable
    axes: Axes
    ends: np.ndarray
    size: np.ndarray
    rate: np.ndarray
    scale: np.ndarray

    def _between(self, points):
        """The weights (2, R) of both ends across the rows."""
        low, high = self.ends[:, self.axes.across]
        x = np.clip(points[:, self.axes.across], low, high)
        # no 1 - share: next to an end where z is small by far its rounding would count
        return np.stack([high - x, x - low]) / (high - low)

    def measured(self, points):
        """What `_measured` says of rows of `points` (R, n)."""
        between = self._between(points)
        known = np.isfinite(points).all(axis=1)
        return (
            np.einsum("ekp,kr->erp", self.size, between),
            np.repeat(self.rate.max(axis=0)[None], len(points), axis=0),
            np.where(known, MEAN * (self.scale @ between), np.nan),
            np.zeros(len(points), bool),
        )

    def sampled(self, points, u):
        """z (R, M) at both ends of the rows of `points` (R, n), at M positions u."""
        first, last = self._between(points)[:, :, None]
        for end in self.axes.line[1:]:
            known = at(
                self.z, _with(self.ends, self.axes.lane, end), np.tile(u.reshape(-1), (2, 1))
            )
            yield first * known[0] + last * known[1]


def _corners(z, axes, points, ranges, even):
    """The _Corners of the map of `points` (R, n); None where z has to be measured row by row."""
    if not axes.linear:
        return None
    ends = _with(np.repeat(points[:1], 2, axis=0), axes.across, axes.row_line[1:])
    size, rate, scale, rough = _measured(z, axes, ends, ranges, even)
    if rough.any() or np.isnan(scale).any():
        return None
    return _Corners(z, axes, ends, size, rate, scale)


def _row_axis(z, key, axes, points, ranges, even, corners):
    """The axis across the rows; all other parameters are the same in these `points`."""
    same = points[:1]
    others = tuple(np.delete(same[0], [axes.lane, axes.across]).tolist())

    def rows_at(positions):
        own = _with(np.repeat(same, positions.size, axis=0), axes.across, positions)
        lanes = np.zeros((positions.size, 0))
        along = Axes(axes.lane, axes.line)
        own, _rough, _bad = problem(z, key, along, own, lanes, ranges, even, None, corners)
        return own

    return monodromy.RowAxis((key, axes, others), *axes.row_line, at=rows_at)


def box(z, key, axes, point, ranges, even):
    """The box of points on their own between the ends of both axes; all other parameters are those
    of a `point`.
    """
    point = _with(_with(point[None], axes.lane, axes.line[1]), axes.across, axes.row_line[1])
    corners = _corners(z, axes, point, ranges, even)
    row_axis = _row_axis(z, key, axes, point, ranges, even, corners)
    return monodromy.Box(row_axis, axes.line, full_period=not even)


def _bound(low_square, high_square, low, high):
    """Bounds (R, 3) of z by |p|, of what is at most these squares of frequencies at both ends, and
    a mean between.
    """
    slope = (high_square - low_square) / (high - low)
    if low >= 0 or high <= 0:
        slope = slope if low >= 0 else -slope
        first = low_square - abs(low) * slope
    else:
        first = low_square - low * slope
        slope = np.maximum((high_square - first) / high, (low_square - first) / -low)
    return np.column_stack([first, slope, 0 * slope])


def _with(points, index, values):
    """The points with other values of one parameter."""
    out = points.copy()
    out[:, index] = values
    return out
