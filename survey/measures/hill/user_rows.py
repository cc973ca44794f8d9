"""A user's z(u, p) as rows of a Hill problem: z = c0(u) + p_k c1(u) along the axis of a parameter
on which it depends linearly (`dependence`), and series across the axis of another one on which it
depends analytically.

c0 and c1 follow from z at both ends of the axis of p_k, between which z is a mean of the two: so
are bounds of its size and of its noise. Where z is linear across the rows too, it is a mean of the
four corners of the map, and what steps need is measured there. All depends on the row and on the
axes, never on the block.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from survey.measures.hill import monodromy, user_equation
from survey.measures.hill.user_equation import Steps, at


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


def problem(equation, axes, points, lanes, ranges, known=None):
    """The Hill problem of an `Equation` in rows of `points` (R, n) with these `ranges` by `lanes` (R, L),
    where a row is `rough` (R), and where its span is NaN, as z is rough or not finite (R).

    `known`: what `_from_corners` gave for their map.
    """
    z = equation.z
    _, edges, slack = ranges
    known = known or _from_corners(equation, axes, points)
    sizes, rate, scale, rough = (
        known(points) if known else _measured(equation, axes, points, ranges)
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
        u = steps().at_nodes(rows, nodes, number)
        both = np.stack([_with(points[rows], axes.lane, end) for end in axes.line[1:]])
        low, high = at(z, both, u.reshape(rows.size, -1)).reshape(2, *u.shape)
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
        return user_equation.solved_exactly(equation, own, rows, steps(), scale, number)

    row_axis = None if axes.across is None else _row_axis(equation, axes, points, known)
    own = monodromy.Problem(
        p=lanes, sizes=sizes_of_rows, c2=0.0,
        sample=sample, walk=walk, cut=lambda rows, number: steps().of(rows, number)[1],
        full_period=not equation.even, exact=exactly if equation.exact else None,
        line=axes.line, row_axis=row_axis, positions=None if row_axis is None else points[:, axes.across],
    )  # fmt: skip
    return own, rough, bad


def _measured(equation, axes, points, ranges):
    """What steps need of z in rows of `points` (R, n): its size (2, R, P) at both ends of the rows, its
    rate (R, P) and scale (R), and where it is `rough` (R); see `user_equation.measured`.
    """
    ends = np.repeat(points, 2, axis=0)
    ends[::2, axes.lane], ends[1::2, axes.lane] = axes.line[1:]
    known = equation.measured(ends, [np.repeat(values, 2, axis=0) for values in ranges])
    size, rate, scale, rough = (
        values.reshape(len(points), 2, *values.shape[1:]) for values in known[:4]
    )
    return size.swapaxes(0, 1), rate.max(axis=1), scale.max(axis=1), rough.any(axis=1)


def _from_corners(equation, axes, points):
    """The function of points (R, n) that gives what `_measured` does, bounds from the corners of their
    map; None where z has to be measured row by row.
    """
    if not axes.linear:
        return None
    low, high = axes.row_line[1:]
    ends = _with(np.repeat(points[:1], 2, axis=0), axes.across, [low, high])
    size, rate, scale, rough = _measured(equation, axes, ends, equation.ranges(ends))
    if rough.any() or np.isnan(scale).any():
        return None
    rates = rate.max(axis=0)[None]

    def at_rows(points):
        x = np.minimum(np.maximum(points[:, axes.across], low), high)
        before, after = (high - x) / (high - low), (x - low) / (high - low)
        known = np.isfinite(points).all(axis=1)
        return (
            size[:, :1] * before[:, None] + size[:, 1:] * after[:, None],
            rates[np.zeros(len(points), int)],
            np.where(known, scale[0] * before + scale[1] * after, np.nan),
            np.zeros(len(points), bool),
        )

    return at_rows


def _row_axis(equation, axes, points, known):
    """The axis across the rows; all other parameters are the same in these `points`."""
    same = points[:1]
    others = tuple(np.delete(same[0], [axes.lane, axes.across]).tolist())
    nodes = replace(equation, exact=None)  # nodes are solved in float64

    def rows_at(positions):
        own = _with(np.repeat(same, positions.size, axis=0), axes.across, positions)
        lanes = np.zeros((positions.size, 0))
        one_axis = Axes(axes.lane, axes.line)
        return problem(nodes, one_axis, own, lanes, equation.ranges(own), known)[0]

    return monodromy.RowAxis((equation.key, axes, others), *axes.row_line, at=rows_at)


def box(equation, axes, point):
    """The box of points on their own between the ends of both axes; all other parameters are those
    of a `point`.
    """
    point = _with(_with(point[None], axes.lane, axes.line[1]), axes.across, axes.row_line[1])
    row_axis = _row_axis(equation, axes, point, _from_corners(equation, axes, point))
    return monodromy.Box(row_axis, axes.line, full_period=not equation.even)


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
