"""Do the curves on a map explain how an integer changes along the lines of a lattice?

Between two points of a line at which the integer is known it changes by what the curves say that
the segment meets. A segment whose curves do not add up to the change, with any signs, has lost one.
A curve that it meets next to its ends may belong to the segment beside it, and two that it meets
next to one another may be one that is drawn twice: these may count or not. Curves that end inside
the map, as between the edges of a narrow tongue, or that cancel between two points of the lattice,
do not show.
"""

from itertools import pairwise

import numpy as np

UNKNOWN = np.iinfo(np.int32).min
SHARES = (0.5, 0.31, 0.69)  # of a part: where it is cut, the first at which the integer is known
NEAR = 1e-3  # of the map: what chords of curves may be off


def segments(values, curves, weights_of, border=1, optional=()):
    """{(axis, number of the line across it, first, last point): do the curves explain the change of
    `values`?}, of integers (n, n) at the lattice's points, or UNKNOWN; each of the curves [(kind,
    positions (m, 2))] counts for 1, or for `weights_of` its kind; those of the kinds `optional` may
    count or not. The `border` is as many lines wide, which are left out.
    """
    found = {}
    for axis in (0, 1):
        # along the axis, by the position on the other one
        lines = values if axis == 1 else values.T
        ticks = np.linspace(0.0, 1.0, len(lines))
        for number in range(border, len(lines) - border):
            met = _met(curves, axis, ticks[number])
            for (first, last), good in along(
                lines[number], ticks, met, weights_of, optional
            ).items():
                found[axis, number, first, last] = good
    return found


def along(values, ticks, met, weights_of, optional=(), near=NEAR):
    """{(first, last point): do the curves explain the change of `values`?}, of integers at the
    `ticks` of a line, or UNKNOWN, which meets curves at `met` [(kind, position)], known to within
    `near`; `weights_of` and `optional` as in `segments`. What is perhaps drawn twice may count or
    not.
    """
    positions = np.array([position for _, position in met])
    found = {}
    weights = np.array([weights_of.get(kind, 1) for kind, _ in met], int)
    _, kinds = np.unique([kind for kind, _ in met], return_inverse=True)
    twice = (abs(positions[:, None] - positions) < near) & (kinds[:, None] == kinds)
    free = (twice.sum(axis=1) > 1) | np.array([kind in optional for kind, _ in met], bool)
    for first, last in pairwise(np.flatnonzero(values != UNKNOWN)):
        low, high = ticks[first], ticks[last]
        inside = (positions > low - near) & (positions < high + near)
        sure = (positions > low + near) & (positions < high - near) & ~free
        change = values[last] - values[first]
        found[first, last] = _explained(change, weights[inside & sure], weights[inside & ~sure])
    return found


def cut(integer_at, ends):
    """(positions (S) between the `ends` (S, 2) of parts, the integers there (S), UNKNOWN where none of
    SHARES tells); `integer_at(some, positions)` are the integers in the parts `some`.
    """
    between = ends @ [1.0 - SHARES[0], SHARES[0]]
    values = np.full(len(ends), UNKNOWN)
    for share in SHARES:
        some = np.flatnonzero(values == UNKNOWN)
        if not some.size:
            break
        at = ends[some] @ [1.0 - share, share]
        values[some] = integer_at(some, at)
        known = values[some] != UNKNOWN
        between[some[known]] = at[known]
    return between, values


def halves(ends, values, at, value):
    """[(ends, integers at them, indices)] of the lower and of the upper halves of parts, cut `at`
    (S) with the integer `value` (S), along which the integer changes.
    """
    found = []
    for side in (1, 0):
        own, at_ends = ends.copy(), values.copy()
        own[:, side], at_ends[:, side] = at, value
        changes = np.flatnonzero(at_ends[:, 0] != at_ends[:, 1])
        found.append((own[changes], at_ends[changes], changes))
    return found


def _met(curves, axis, tick):
    """[(kind, position)] where the line along the axis, at `tick` of the other one, meets curves."""
    met = []
    for kind, x in curves:
        off = x[:, 1 - axis] - tick
        at = np.flatnonzero((off[:-1] < 0) != (off[1:] < 0))
        share = off[at] / (off[at] - off[at + 1])
        met += [
            (kind, position) for position in x[at, axis] + share * (x[at + 1, axis] - x[at, axis])
        ]
    return met


def _explained(change, weights, optional):
    """Is the change a sum of all weights and some of the optional ones, each with either sign?"""
    sums = {0}
    for weight in weights:
        sums = {total + sign * weight for total in sums for sign in (-1, 1)}
    for weight in optional:
        sums |= {total + sign * weight for total in sums for sign in (-1, 1)}
    return int(change) in sums
