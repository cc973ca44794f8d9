"""A user's z(u, p) as rows of a Hill problem: z = c0(u) + p_k c1(u) along the axis of a parameter
on which it depends linearly (`dependence`), and series across the axis of another one on which it
depends analytically.

c0 and c1 follow from z at both ends of the axis of p_k, between which z is a mean of the two: so
are bounds of its size and of its noise. Where z is linear across the rows too, it is a mean of the
four corners of the map, and what steps need is measured there. All depends on the row and on the
axes, never on the block.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from survey.measures.hill import monodromy, user_equation
from survey.measures.hill.user_equation import Steps, at, measured


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


def problem(z, key, axes, points, lanes, ranges, even, exact=None, known=None):
    """The Hill problem of z in rows of `points` (R, n) by `lanes` (R, L), where a row is `rough` (R),
    and where its span is NaN, as z is rough or not finite (R).

    `ranges(points)` gives periods, edges and slack as `user_equation` takes them; what it gives,
    and z, is named by the hashable `key`. `known`: what `_from_corners` gave for their map.
    """
    _, edges, slack = ranges(points)
    ends = [_with(points, axes.lane, end) for end in axes.line[1:]]
    known = known or _from_corners(z, axes, points, ranges, even)
    sizes, rate, scale, rough = known(points) if known else _measured(z, axes, points, ranges, even)
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
        u = steps().at_nodes(rows, nodes, number)
        low, high = (at(z, end[rows], u.reshape(rows.size, -1)).reshape(u.shape) for end in ends)
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
        row_axis=_row_axis(z, key, axes, points, ranges, even, known) if axes.across is not None else None,
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


def _from_corners(z, axes, points, ranges, even):
    """The function of points (R, n) that gives what `_measured` does, bounds from the corners of their
    map; None where z has to be measured row by row.
    """
    if not axes.linear:
        return None
    low, high = axes.row_line[1:]
    ends = np.concatenate([_with(points[:1], axes.across, end) for end in (low, high)])
    size, rate, scale, rough = _measured(z, axes, ends, ranges, even)
    if rough.any() or np.isnan(scale).any():
        return None

    def at_rows(points):
        x = np.clip(points[:, axes.across], low, high)
        between = np.stack([high - x, x - low]) / (high - low)
        known = np.isfinite(points).all(axis=1)
        return (
            np.einsum("ekp,kr->erp", size, between),
            np.repeat(rate.max(axis=0)[None], len(points), axis=0),
            np.where(known, scale[0] * between[0] + scale[1] * between[1], np.nan),
            np.zeros(len(points), bool),
        )

    return at_rows


def _row_axis(z, key, axes, points, ranges, even, known):
    """The axis across the rows; all other parameters are the same in these `points`."""
    same = points[:1]
    others = tuple(np.delete(same[0], [axes.lane, axes.across]).tolist())

    def rows_at(positions):
        own = _with(np.repeat(same, positions.size, axis=0), axes.across, positions)
        lanes = np.zeros((positions.size, 0))
        return problem(z, key, Axes(axes.lane, axes.line), own, lanes, ranges, even, None, known)[0]

    return monodromy.RowAxis((key, axes, others), *axes.row_line, at=rows_at)


def box(z, key, axes, point, ranges, even):
    """The box of points on their own between the ends of both axes; all other parameters are those
    of a `point`.
    """
    point = _with(_with(point[None], axes.lane, axes.line[1]), axes.across, axes.row_line[1])
    known = _from_corners(z, axes, point, ranges, even)
    row_axis = _row_axis(z, key, axes, point, ranges, even, known)
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
